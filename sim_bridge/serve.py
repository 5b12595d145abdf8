"""Offers an emulated robot to other programs, at real-time pace: on a pseudo-terminal or on a TCP port of loopback.

To a client it is a robot on a port: `boebot run BRAIN --on /dev/pts/N`. Time also passes while no client is there. As
on a real Uno, the board is reset when a client opens the port, and on a pseudo-terminal the client sets the bit rate of
its side of the line: at a wrong one both sides read garbage. A TCP port has no bit rate. Pseudo-terminals exist on
POSIX systems only.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import sys
import time
from collections.abc import Callable
from typing import Protocol

from boebot.boards import BoardRequest
from boebot.errors import BoardError
from sim_bridge.sessions.opening import Pace
from sim_bridge.sessions.with_board import SimSession, open_avr, open_native

IDLE_S = 0.002  # how long the loop sleeps when no byte comes
BRISK_S = 0.0002  # and for a while after one came, so that its answer is not late
BRISK_FOR_S = 0.004
CHUNK = 4096
BACKLOG = 65536  # bytes that wait for a client that does not read; older ones are lost


class Port(Protocol):
    """Where a client comes and goes."""

    url: str

    def wait(self, seconds: float) -> None:
        """Sleeps until something may have happened."""

    def opened(self) -> bool:
        """Whether a client came since the last call."""

    def read(self) -> bytes:
        """What the client sent."""

    def write(self, data: bytes) -> None:
        """To the client, if there is one."""

    def baud(self) -> int | None:
        """The bit rate that the client has set; None: the robot's own."""

    def close(self) -> None:
        """Gives the port back."""


TCGETS2 = 0x802C542A
TERMIOS2_SIZE = 44  # Linux: the settings of a terminal with its bit rates as numbers, the last one that of the output


def _rates() -> dict[int, int]:
    """Bit rates by the numbers that this system's terminals have for them."""
    import termios

    return {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()}


class PtyPort:
    """The master side of a pseudo-terminal. The other side hangs up when its last client closes it."""

    def __init__(self, baud: int) -> None:
        """`baud`: the bit rate until a client sets another. Raises BoardError where there are no pseudo-terminals."""
        try:
            import termios
            import tty
        except ImportError:
            raise BoardError("this system has no pseudo-terminals; use --tcp PORT") from None
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._rates = _rates()
        settings = termios.tcgetattr(slave)
        settings[4] = settings[5] = next((code for code, rate in self._rates.items() if rate == baud), termios.B38400)
        termios.tcsetattr(slave, termios.TCSANOW, settings)
        self.url = os.ttyname(slave)
        os.close(slave)  # from now on the master hears a hang-up while nobody has the other side open
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)
        self._connected = False
        self._waiting = b""

    def _look(self, milliseconds: float) -> int:
        events = self._poll.poll(milliseconds)
        return events[0][1] if events else 0

    def wait(self, seconds: float) -> None:
        """Sleeps until bytes come; a hang-up, which lasts, wakes nobody."""
        if self._look(0) & select.POLLHUP:
            select.select([], [], [], seconds)
        else:
            self._look(seconds * 1000)

    def opened(self) -> bool:
        """Whether a client came since the last call."""
        before, self._connected = self._connected, not self._look(0) & select.POLLHUP
        if not self._connected:
            self._waiting = b""
        return self._connected and not before

    def read(self) -> bytes:
        """What the client sent."""
        try:
            return os.read(self._master, CHUNK)
        except OSError:  # nothing there, or nobody
            return b""

    def write(self, data: bytes) -> None:
        """To the client; what nobody reads is lost."""
        if not self._connected:
            return
        self._waiting = (self._waiting + data)[-BACKLOG:]
        with contextlib.suppress(OSError):
            while self._waiting:
                self._waiting = self._waiting[os.write(self._master, self._waiting) :]

    def baud(self) -> int | None:
        """The bit rate that the terminal is set to; None where it is not known."""
        import fcntl
        import termios

        code = termios.tcgetattr(self._master)[5]
        if code in self._rates:
            return self._rates[code] or None  # B0 hangs up and is no rate
        try:
            settings = fcntl.ioctl(self._master, TCGETS2, bytes(TERMIOS2_SIZE))
        except OSError:
            return None
        return int.from_bytes(settings[-4:], sys.byteorder)

    def close(self) -> None:
        """Ends the pseudo-terminal."""
        os.close(self._master)


def _reason(error: OSError | OverflowError) -> str:
    """Why a port cannot be opened; Python's own text of it would name the call's arguments."""
    if isinstance(error, OverflowError) or error.errno is None:
        return "expected 0 to 65535"
    return "it is in use" if error.errno == errno.EADDRINUSE else os.strerror(error.errno)


class TcpPort:
    """A port of loopback for one client at a time; a new client takes the place of the old one."""

    def __init__(self, port: int) -> None:
        """Raises BoardError where the port is taken."""
        try:
            self._listener = socket.create_server(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            reason = _reason(error)
            raise BoardError(f"TCP port {port} cannot be opened: {reason}") from None
        self._listener.setblocking(False)
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self._client: socket.socket | None = None
        self._waiting = b""

    def wait(self, seconds: float) -> None:
        """Sleeps until a client or bytes come."""
        select.select([self._listener] if self._client is None else [self._listener, self._client], [], [], seconds)

    def opened(self) -> bool:
        """Whether a client came since the last call."""
        try:
            client, _ = self._listener.accept()
        except OSError:
            return False
        self._drop()
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        return True

    def _drop(self) -> None:
        client, self._client, self._waiting = self._client, None, b""
        if client is not None:
            client.close()

    def read(self) -> bytes:
        """What the client sent."""
        if self._client is None:
            return b""
        try:
            data = self._client.recv(CHUNK)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def write(self, data: bytes) -> None:
        """To the client; what nobody reads is lost."""
        if self._client is None:
            return
        self._waiting = (self._waiting + data)[-BACKLOG:]
        try:
            self._waiting = self._waiting[self._client.send(self._waiting) :]
        except BlockingIOError:
            pass
        except OSError:
            self._drop()

    def baud(self) -> int | None:
        """TCP has none."""
        return None

    def close(self) -> None:
        """Closes client and port."""
        self._drop()
        self._listener.close()


def carry(session: SimSession, port: Port, running: Callable[[], bool]) -> None:
    """Carries bytes between `session` and `port` at real-time pace until `running()` is false.

    Raises:
        BoardError: the board's program crashed.
    """
    sim = session.sim
    pace = Pace(sim)
    baud = None
    brisk_until = 0.0
    while running():
        if port.opened():
            session.board.reset("external")
        if (now := port.baud()) is not None and now != baud:
            session.transport.set_baud(now)
            baud = now
        heard = b""
        while data := port.read():
            heard += data
        cycles = pace.due()
        sim.run(cycles)  # first: bytes that came meanwhile reach the board at the end of that time
        if heard:
            session.robot.send(heard)
            brisk_until = time.monotonic() + BRISK_FOR_S
        if data := session.robot.receive():
            port.write(data)
        port.wait(BRISK_S if time.monotonic() < brisk_until else IDLE_S)


def serve(
    kind: str,
    request: BoardRequest,
    *,
    tcp: int | None,
    announce: Callable[[str], None],
    running: Callable[[], bool],
) -> None:
    """Serves the board of that kind ("native" or "avr") until `running()` is false or Ctrl-C.

    On a new pty, or on TCP port `tcp` of loopback (0: any free one). Calls `announce(url)` once clients may come.

    Raises:
        BoebotError: no such board or port, or the board's program crashed.
    """
    openers = {"native": open_native, "avr": open_avr}
    if kind not in openers:
        raise BoardError(f"there is no emulated board {kind!r} to serve; expected one of: {', '.join(openers)}")
    with contextlib.ExitStack() as stack:
        session = openers[kind](request)
        stack.callback(session.close)
        port: Port = PtyPort(session.transport.baud) if tcp is None else TcpPort(tcp)
        stack.callback(port.close)
        announce(port.url)
        with contextlib.suppress(KeyboardInterrupt):
            carry(session, port, running)
