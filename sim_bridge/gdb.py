"""A debugger at the emulated ATmega328P: avr-gdb over TCP, in its remote serial protocol (GDB manual, appendix E).

The board calls in from within its run, where the program stops: no time passes in the world until gdb lets it go on, so
that a run under gdb is the run without it. Only this computer reaches the port, one client at a time; one that vanishes
leaves the program to itself. Who does not begin as gdb does, such as a browser, is sent away.
"""

from __future__ import annotations

import contextlib
import re
import select
import socket
import sys
import time

from boebot.errors import BoardError
from boebot.running import interrupts
from sim_bridge.boards.avr import AvrBoard
from sim_bridge.served_ports import listening

LOOK_S = 0.1  # between two looks for Ctrl-C while nothing comes
SEND_S = 5.0  # a client that takes nothing for that long has gone
PACKET_MAXIMUM = 0x1000  # bytes
DATA, DATA_END = 0x800000, 0x800900  # where gdb has the data space
FLASH_END = 0x8000
SREG, SPL, SPH = DATA + 0x5F, DATA + 0x5D, DATA + 0x5E
REGISTERS = [*range(DATA, DATA + 32), SREG, SPL, SPH]  # in gdb's order; then the program counter
PC_BYTES = 4
RESETS, OTHER_COMMANDS = ("reset", "reset halt", "reset init"), ("init", "halt")  # of `monitor`


class Gdb:
    """A port for avr-gdb at a board; `close` gives it back.

    Attributes:
        port: of TCP, on loopback.
    """

    def __init__(self, board: AvrBoard, port: int, *, waits: bool) -> None:
        """`waits`: the program stands still until a client has come.

        Raises:
            BoardError: the port is taken.
        """
        self._board, self._waits = board, waits
        self._listener = listening(port)
        self._client: socket.socket | None = None
        self._received = b""
        self._points: set[tuple[int, int, int]] = set()  # gdb's kind, address, length
        self._stop = b"S05"  # why it stands still
        self._is_awaited = False  # gdb waits for it to stop
        self._goes_on = True
        self._is_closed = False
        self._debug = board.debug(self._called)
        self.port = int(self._listener.getsockname()[1])
        what = "the program waits for a debugger" if waits else "a debugger may come"
        print(
            f"boebot: {what}: avr-gdb{f' {board.elf}' if board.elf else ''} -ex 'target remote :{self.port}'",
            file=sys.stderr,
            flush=True,
        )

    # ---- what the board calls ----

    def _called(self, why: int) -> int:
        """In the midst of the board's run: an error ends that, and is raised by who lets the board run."""
        if self._is_closed:
            return 0
        begun = time.perf_counter()
        try:
            if why == self._board.lib.AVR_LOOKS:
                self._look()
            elif self._client is not None:
                is_watch = why == self._board.lib.AVR_WATCHED
                self._halt(b"T05watch:%x;" % (DATA + self._debug.accessed) if is_watch else b"S%02X" % why)
        except OSError:
            self._leave()
        except BaseException as error:
            self._board.ended = error
            self.close()
            return 1
        finally:
            self._board.stood_still_s += time.perf_counter() - begun
        return 0

    def _look(self) -> None:
        while self._client is None and self._waits:
            self._receive(LOOK_S)
        self._waits = False
        data = self._receive(0.0)
        self._received += data
        if b"\3" in data:
            self._debug.interrupted = True

    def _halt(self, stop: bytes) -> None:
        self._stop = stop
        if self._is_awaited:
            self._send(stop)
        self._goes_on = self._is_awaited = False
        while not self._goes_on:
            packet = self._packet()
            try:
                reply = self._reply(packet[:1], packet[1:])
            except ValueError:
                reply = b"E01"
            if reply is not None:
                self._send(reply)

    # ---- the line ----

    def _receive(self, seconds: float) -> bytes:
        """What comes within that time.

        Raises:
            OSError: the client has gone, or another thread has closed the port.
            KeyboardInterrupt: Ctrl-C.
        """
        client = self._client
        try:
            ready = select.select([self._listener, *([client] if client else [])], [], [], seconds)[0]
        except ValueError:
            raise ConnectionAbortedError from None  # they have no number any more
        if interrupts.first is not None:
            raise KeyboardInterrupt
        if self._listener in ready:
            newcomer, _ = self._listener.accept()
            if client is None:
                newcomer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                newcomer.settimeout(SEND_S)
                self._client, self._received, self._debug.interrupted = newcomer, b"", True
            else:
                newcomer.close()
        if client is None or client not in ready:
            return b""
        if not (data := client.recv(PACKET_MAXIMUM)):
            raise ConnectionResetError
        return data

    def _packet(self) -> str:
        """The next whole one, acknowledged."""
        while True:
            if self._received[:1] not in (b"", b"+", b"-", b"$", b"\3") or len(self._received) > 4 * PACKET_MAXIMUM:
                raise ConnectionResetError("this is not gdb")
            self._received = self._received.lstrip(b"+-\3")
            if found := re.match(rb"\$([^#]*)#([0-9a-fA-F]{2})", self._received):
                self._received = self._received[found.end() :]
                is_whole = sum(found[1]) % 256 == int(found[2], 16)
                self._transmit(b"+" if is_whole else b"-")
                if is_whole:
                    return found[1].decode("latin-1")
            else:
                self._received += self._receive(LOOK_S)

    def _transmit(self, data: bytes) -> None:
        if self._client is None:
            raise ConnectionAbortedError
        self._client.sendall(data)

    def _send(self, text: bytes) -> None:
        self._transmit(b"$%s#%02x" % (text, sum(text) % 256))

    def _leave(self) -> None:
        """The client has gone."""
        if self._client is not None:
            self._client.close()
        self._client = None
        self._let_go()

    def _let_go(self) -> None:
        """The program goes on, past all that was set."""
        self._goes_on, self._is_awaited = True, False
        self._points.clear()
        self._set_points()
        self._debug.stepping = self._debug.interrupted = False

    def close(self) -> None:
        """Says that the program has ended, and closes the port. May be called twice."""
        if self._is_closed:
            return
        self._is_closed = True
        with contextlib.suppress(OSError):
            if self._is_awaited:
                self._send(b"W00")
        self._leave()
        self._listener.close()

    # ---- packets ----

    def _reply(self, kind: str, rest: str) -> bytes | None:
        """The answer to a packet. None: there is none, or it is sent. ValueError: it is wrong."""
        if kind == "?":
            return self._stop
        if kind == "g":
            registers = bytes(self._cell(address) for address in REGISTERS)
            return (registers + int(self._debug.pc).to_bytes(PC_BYTES, "little")).hex().encode()
        if kind == "G":
            values = bytes.fromhex(rest)
            for address, value in zip(REGISTERS, values[:-PC_BYTES], strict=True):
                self._put(address, value)
            self._debug.pc = int.from_bytes(values[len(REGISTERS) :], "little") % FLASH_END
            return b"OK"
        if kind in ("m", "M"):
            return self._memory(kind, rest)
        if kind in ("Z", "z"):
            return self._point(kind, rest)
        if kind in ("c", "s", "C", "S"):
            where = rest if kind.islower() else rest.partition(";")[2]
            self._debug.pc = int(where, 16) if where else self._debug.pc
            self._debug.stepping = kind in ("s", "S")
            self._goes_on = self._is_awaited = True
            return None
        if kind == "D":
            self._let_go()
            return b"OK"
        if kind == "k":
            raise BoardError("the debugger has ended the run")
        if kind == "q":
            return self._query(rest)
        return b"OK" if kind in ("H", "T", "!") else b""

    def _query(self, what: str) -> bytes | None:
        if what.startswith("Supported"):
            return b"PacketSize=%x" % PACKET_MAXIMUM
        if what == "Attached":
            return b"1"  # gdb detaches where it ends
        if not what.startswith("Rcmd,"):
            return b""
        command = " ".join(bytes.fromhex(what[5:]).decode("latin-1").split())
        if command in RESETS:
            self._board.lib.avr_debug_reset(self._board.handle)
        elif command not in OTHER_COMMANDS:
            sentence = f"no command {command!r}; expected one of: {', '.join((*OTHER_COMMANDS, *RESETS))}\n"
            self._send(b"O" + sentence.encode().hex().encode())
        return b"OK"

    def _cell(self, address: int) -> int:
        """Raises ValueError where none is."""
        if (value := int(self._board.lib.avr_debug_read(self._board.handle, address))) < 0:
            raise ValueError(f"no memory at 0x{address:X}")
        return value

    def _put(self, address: int, value: int) -> None:
        """Raises ValueError where no cell is."""
        if not self._board.lib.avr_debug_write(self._board.handle, address, value):
            raise ValueError(f"no memory at 0x{address:X}")

    def _memory(self, kind: str, rest: str) -> bytes:
        where, _, data = rest.partition(":")
        address, count = (int(number, 16) for number in where.split(","))
        if kind == "m":
            return bytes(self._cell(address + i) for i in range(min(count, PACKET_MAXIMUM // 2))).hex().encode()
        for cell, value in zip(range(address, address + count), bytes.fromhex(data), strict=True):
            self._put(cell, value)
        return b"OK"

    def _point(self, kind: str, rest: str) -> bytes:
        """Breakpoints (0, 1) and watchpoints of writes (2), reads (3) and both (4)."""
        number, address, length = (int(text, 16) for text in rest.partition(";")[0].split(","))
        first, end = (0, FLASH_END) if number < 2 else (DATA + 32, DATA_END)
        if number > 4 or not first <= address < end or address + length > end:
            return b"E01"
        (self._points.add if kind == "Z" else self._points.discard)((number, address, length))
        self._set_points()
        return b"OK"

    def _set_points(self) -> None:
        debug, ffi = self._debug, self._board.ffi
        ffi.memmove(debug.breakpoints, bytes(FLASH_END // 2), FLASH_END // 2)
        ffi.memmove(debug.watched, bytes(DATA_END - DATA), DATA_END - DATA)
        for number, address, length in self._points:
            if number < 2:
                debug.breakpoints[address // 2] = 1
            for cell in range(address - DATA, address - DATA + length) if number >= 2 else ():
                debug.watched[cell] |= {2: 2, 3: 1, 4: 3}[number]
        debug.watching = any(number >= 2 for number, _, _ in self._points)
