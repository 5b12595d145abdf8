"""Where programs meet a served robot (serve.py): a pseudo-terminal or a TCP port of loopback, one client at a
time."""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import sys

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
        """Who came, went and was refused since the last call. Receives what the client sent, up to `BACKLOG` bytes; the
        rest waits at the client. What earlier clients sent is dropped when another one comes."""
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
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    def wait(self, seconds: float) -> None:
        """See `Port`; a hang-up, which lasts, wakes nobody either."""
        if self._is_open() and len(self._received) < BACKLOG:
            self._poll.poll(seconds * 1000)
        else:
            select.select([], [], [], seconds)

    def _is_open(self) -> bool:
        events = self._poll.poll(0)
        return not (events and events[0][1] & select.POLLHUP)

    def _look(self) -> None:
        is_open = self._is_open()
        if is_open and not self._client:
            client = holder_of(self.url) or "a program"
            for _ in range(BACKLOG // READ):  # what the client before has sent; this one may send without a pause
                self._read()
            self._came(client)
            return
        while len(self._received) < BACKLOG and (data := self._read()):
            self._received += data
        if not is_open and self._client:
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
        os.close(self._master)


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
    who speaks HTTP: any page in a browser may ask for a port of this computer. (HTTP begins with a capital letter, a
    frame with a zero.)

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
        self._socket, self._is_new = newcomer, True
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
            elif self._is_new and data[:1].isupper():
                _send_away(self._socket, HTTP_ANSWER)
                self._visits.append(Visit("refused", self._client, "it speaks HTTP, as browsers do"))
                self._socket, self._client, self._to_client = None, "", b""
            else:
                self._received += data
            self._is_new = False

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
