"""Where programs meet a served robot (serve.py): a pseudo-terminal or a TCP port of loopback, one client at a
time."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import select
import socket
import struct
import sys
from collections.abc import Callable
from typing import Any

from serial import rfc2217

from boebot.boards import Visit
from boebot.errors import BoardError
from boebot.link.ports import holder_of

try:
    import fcntl
    import termios
    import tty
except ImportError:
    HAS_PTY = False
else:
    HAS_PTY = True

BACKLOG = 65536  # bytes that wait in each direction: for the line, and for a client that does not read
READ = 4096  # bytes that are read at once
TCGETS2 = 0x802C542A
TERMIOS2_SIZE = 44  # Linux: the settings of a terminal with its bit rates as numbers, the last one that of the output
NO_PAGE = "this port is a robot's serial line, no web page"
HTTP_METHODS = (b"GET ", b"HEAD ", b"POST ", b"PUT ", b"DELETE ", b"CONNECT ", b"OPTIONS ", b"TRACE ", b"PATCH ")
HTTP_LONGEST = max(map(len, HTTP_METHODS))
HTTP_ANSWER = f"HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n{NO_PAGE}\r\n"


class Port:
    """Where one client at a time comes and goes.

    Attributes:
        url: where clients find it.
    """

    url: str

    def __init__(self) -> None:
        self._client = ""  # its name; "": nobody is there
        self._received = b""
        self._to_client = b""
        self._visits: list[Visit] = []

    def wait(self, seconds: float) -> None:
        """Sleeps until something may have happened; a full backlog wakes nobody."""
        raise NotImplementedError

    def look(self) -> list[Visit]:
        """Who came, went, was refused and reset the board since the last call. Receives what the client sent, up to
        `BACKLOG` bytes; the rest waits at the client. What earlier clients sent is dropped when another one comes."""
        self._look()
        visits, self._visits = self._visits, []
        return visits

    def take(self, count: int) -> bytes:
        """At most that many of the bytes received, oldest first."""
        data, self._received = self._received[:count], self._received[count:]
        return data

    def write(self, data: bytes) -> None:
        """To the client, if there is one; of what it does not read the newest `BACKLOG` bytes are kept."""
        if self._client:
            self._to_client = (self._to_client + data)[-BACKLOG:]
            with contextlib.suppress(OSError):  # it takes no more now, or has gone, as the next look shows
                while self._to_client:
                    self._to_client = self._to_client[self._send(self._to_client) :]

    def baud(self) -> int | None:
        """The bit rate that the client has set; None: the robot's own."""
        return None

    def close(self) -> None:
        """Gives the port back."""
        raise NotImplementedError

    def _look(self) -> None:
        raise NotImplementedError

    def _send(self, data: bytes) -> int:
        raise NotImplementedError

    def _came(self, client: str) -> None:
        self._client, self._received = client, b""
        self._visits.append(Visit("came", client))

    def _went(self, why: str = "") -> None:
        self._visits.append(Visit("went", self._client, why))
        self._client, self._to_client = "", b""


class _Openings:
    """The openings and closings of a file, in their order, where the system says each of them: Linux (inotify(7))."""

    OPEN, CLOSE = 0x20, 0x18
    EVENT = struct.Struct("iIII")

    def __init__(self, path: str) -> None:
        self.descriptors: list[int] = []
        with contextlib.suppress(AttributeError, OSError):
            library = ctypes.CDLL(None)
            descriptor = library.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
            if descriptor >= 0:
                self.descriptors.append(descriptor)
                library.inotify_add_watch(descriptor, path.encode(), self.OPEN | self.CLOSE)

    def read(self) -> list[bool]:
        """Of each since the last call, whether it was an opening."""
        found: list[bool] = []
        for descriptor in self.descriptors:
            with contextlib.suppress(BlockingIOError):
                events = self.EVENT.iter_unpack(os.read(descriptor, READ // self.EVENT.size * self.EVENT.size))
                found += [bool(mask & self.OPEN) for _, mask, _, _ in events if mask & (self.OPEN | self.CLOSE)]
        return found

    def close(self) -> None:
        """No more of them."""
        while self.descriptors:
            os.close(self.descriptors.pop())


class PtyPort(Port):
    """The master side of a pseudo-terminal: to programs a serial port of this computer. The other side hangs up when
    its last client closes it."""

    def __init__(self, baud: int) -> None:
        """`baud`: the bit rate until a client sets another. Raises BoardError where there are no pseudo-terminals."""
        if not HAS_PTY:
            raise BoardError("this system has no pseudo-terminals; use --tcp PORT")
        super().__init__()
        self._master, slave = os.openpty()
        tty.setraw(slave)
        settings = termios.tcgetattr(slave)
        settings[4] = settings[5] = getattr(termios, f"B{baud}", termios.B38400)
        termios.tcsetattr(slave, termios.TCSANOW, settings)
        self.url = os.ttyname(slave)
        os.close(slave)  # from now on the master hears a hang-up while nobody has the other side open
        self._openings = _Openings(self.url)
        self._open = 0  # openings that have not been closed
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    def wait(self, seconds: float) -> None:
        """See `Port`; a hang-up, which lasts, wakes nobody either."""
        is_heard = self._is_open() and len(self._received) < BACKLOG
        select.select([*self._openings.descriptors, *([self._master] if is_heard else [])], [], [], seconds)

    def _is_open(self) -> bool:
        events = self._poll.poll(0)
        return not (events and events[0][1] & select.POLLHUP)

    def _look(self) -> None:
        for is_opening in self._openings.read():
            self._open = max(self._open + (1 if is_opening else -1), 0)
            if is_opening and not self._client:
                self._came(holder_of(self.url) or "a program")
            elif self._client and not self._open:
                self._went()
        is_open = self._is_open()
        if is_open and not self._client:
            self._came(holder_of(self.url) or "a program")
        while len(self._received) < BACKLOG and (data := self._read()):
            self._received += data
        if not is_open:
            self._open = 0
            if self._client:
                self._went()

    def _read(self) -> bytes:
        try:
            return os.read(self._master, READ)
        except OSError:  # nothing there, or nobody
            return b""

    def _send(self, data: bytes) -> int:
        return os.write(self._master, data)

    def baud(self) -> int | None:
        """The bit rate that the terminal is set to; None where it is not known: not on Linux."""
        try:
            settings = fcntl.ioctl(self._master, TCGETS2, bytes(TERMIOS2_SIZE))
        except OSError:
            return None
        return int.from_bytes(settings[-4:], sys.byteorder) or None  # B0 hangs up and is no rate

    def close(self) -> None:
        """Ends the pseudo-terminal."""
        self._openings.close()
        os.close(self._master)


class _SharedLine:
    """A serial port as pyserial's manager of RFC 2217 wants one, and the connection that it answers on.

    Attributes:
        baudrate: what the client has set; 0: nothing.
    """

    bytesize, parity, stopbits = 8, "N", 1
    xonxoff = rtscts = break_condition = ri = False
    rts = cts = dsr = cd = True

    def __init__(self, write: Callable[[bytes], None], switched_on: Callable[[], None]) -> None:
        """`switched_on`: is called when DTR is."""
        self.write = write
        self.baudrate = 0
        self._switched_on = switched_on
        self._dtr = True

    @property
    def dtr(self) -> bool:
        """Data terminal ready, which is wired to an Uno's reset."""
        return self._dtr

    @dtr.setter
    def dtr(self, is_on: bool) -> None:
        was_on, self._dtr = self._dtr, is_on
        if is_on and not was_on:
            self._switched_on()

    def reset_input_buffer(self) -> None:
        """There is none."""

    reset_output_buffer = reset_input_buffer


def listening(port: int) -> socket.socket:
    """A TCP port of loopback, 0: any free one. Raises BoardError where it is taken."""
    try:
        return socket.create_server(("127.0.0.1", port))
    except (OSError, OverflowError) as error:  # Python's own text of it would name the call's arguments
        number = getattr(error, "errno", None)
        reason = "it is in use" if number == errno.EADDRINUSE else os.strerror(number or errno.ERANGE)
        raise BoardError(f"TCP port {port} cannot be opened: {reason}; expected a free one, 0 to 65535") from None


class TcpPort(Port):
    """A listening socket and at most one client. Who comes while one is there is refused with a sentence, and so is
    who speaks HTTP: any page in a browser may ask for a port of this computer.

    A client that begins with Telnet's IAC speaks RFC 2217: it sets the bit rate, and resets the board by DTR. (A frame
    begins with a zero, STK500 with 0x30.)

    A client that has closed its end while more of its bytes wait than are received cannot be told from one that sends
    too much; either of them gives way to the next client.
    """

    def __init__(self, port: int) -> None:
        """Raises BoardError where the port is taken."""
        super().__init__()
        self._listener = listening(port)
        self._listener.setblocking(False)
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self._socket: socket.socket | None = None
        self._begin = b""  # of what the client has sent
        self._shared: _SharedLine | None = None
        self._manager: Any = None  # of RFC 2217, where the client speaks that

    def wait(self, seconds: float) -> None:
        """See `Port`; a client that comes wakes, too."""
        sockets = [self._listener]
        if self._socket is not None and len(self._received) < BACKLOG:
            sockets.append(self._socket)
        select.select(sockets, [], [], seconds)

    def _look(self) -> None:
        self._receive()
        with contextlib.suppress(OSError):  # nobody else waits
            while True:
                self._admit(*self._listener.accept())

    def _admit(self, newcomer: socket.socket, address: tuple[str, int]) -> None:
        name = f"{address[0]}:{address[1]}"
        newcomer.setblocking(False)
        self._receive()  # perhaps the other one has just gone
        if self._client and len(self._received) < BACKLOG:
            _send_away(newcomer, f"boebot serve: refused, {self._client} is connected to this robot\r\n")
            self._visits.append(Visit("refused", name, f"{self._client} is connected"))
            return
        self._went("it sends more than the line carries")
        newcomer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._begin, self._manager, self._shared = newcomer, b"", None, None
        self._came(name)

    def _receive(self) -> None:
        """What the client sent, as long as there is room for it."""
        while self._socket is not None and (room := BACKLOG - len(self._received)) > 0:
            try:
                data = self._socket.recv(room)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self._went()
                return
            is_new, self._begin = not self._begin, (self._begin + data)[:HTTP_LONGEST]
            if self._begin.startswith(HTTP_METHODS):
                _send_away(self._socket, HTTP_ANSWER)
                self._visits.append(Visit("refused", self._client, "it speaks HTTP, as browsers do"))
                self._socket, self._client, self._to_client, self._received = None, "", b"", b""
                return
            if is_new and data.startswith(rfc2217.IAC):
                self._shared = _SharedLine(super().write, self._switched_on)
                self._manager = rfc2217.PortManager(self._shared, self._shared)  # type: ignore[arg-type]
            self._received += data if self._manager is None else b"".join(self._manager.filter(data))

    def _switched_on(self) -> None:
        self._received = b""
        self._visits.append(Visit("reset", self._client))

    def write(self, data: bytes) -> None:
        """See `Port`."""
        super().write(data if self._manager is None else b"".join(self._manager.escape(data)))

    def baud(self) -> int | None:
        """What the client has set by RFC 2217."""
        return self._shared.baudrate or None if self._shared is not None else None

    def _went(self, why: str = "") -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            super()._went(why)

    def _send(self, data: bytes) -> int:
        return self._socket.send(data) if self._socket is not None else len(data)

    def close(self) -> None:
        """Closes client and port."""
        self._went()
        self._listener.close()


def _send_away(client: socket.socket, sentence: str) -> None:
    """Says why, and closes. What the client has sent is read first: unread bytes would make the system drop the
    sentence."""
    with client, contextlib.suppress(OSError):
        client.sendall(sentence.encode())
        client.shutdown(socket.SHUT_WR)
        client.recv(BACKLOG)
