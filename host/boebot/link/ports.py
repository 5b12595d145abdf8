"""The ports of this computer behind which a board may be: serial ports and ptys, TCP sockets, RFC 2217 servers.

pyserial speaks to serial ports and to RFC 2217 servers. The calling thread reads: a stamp is as late as the caller, and
beside a thread that computes by Python's switch interval (docs/decisions/0003-port-thread.md).

A serial port is this process's alone: by the operating system's advisory lock, and, on a real port, by its refusal to
open it once more (TIOCEXCL).

Reset. An Uno resets when DTR is switched on. With `reset`, DTR is switched off and on after opening, for it may have
been on all the time. Without, Windows opens the port with DTR off, and the board never notices. Linux and macOS switch
DTR on at every opening, whatever a program asks; what can be had there is that DTR stays on when the port is closed
(HUPCL is cleared), so that it is no longer switched on at later openings. The first one after plugging in, or after a
program that switches DTR off at its end, resets the board all the same.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import struct
import sys
import time
import weakref
from pathlib import Path
from typing import Any

import serial
from serial import rfc2217
from serial.tools import list_ports

from boebot.errors import BoardError

try:
    import fcntl
    import grp
    import termios
except ImportError:  # Windows
    POSIX = False
else:
    POSIX = True

BAUD_MIN, BAUD_MAX = 9_600, 1_000_000
CONNECT_S = 1.8  # for a TCP connection; pyserial gives an RFC 2217 server 5 s
_NEGOTIATION_S = 1.2  # pyserial's wait for an RFC 2217 server's consent, in each of two steps
_WRITE_S = 1.0
_STILL_S = 0.05  # longer than a wait for a port ends late
_LOOK_S = 0.005  # how long a wait for bytes may last too long
_DTR_OFF_S = 0.01  # the board's capacitor needs microseconds
_TIOCGICOUNT = 0x545D  # Linux: struct serial_icounter_struct, 20 ints
_ICOUNTER = struct.Struct("20i")
_OVERRUN, _BUF_OVERRUN = 7, 10  # in the port's own buffer, in the driver's
_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
_NO_TERMINAL = (errno.ENOTTY, errno.EINVAL, errno.EISDIR, errno.ENXIO, errno.ENODEV)
_FAILURES = (OSError, TypeError, ValueError, *((termios.error,) if POSIX else ()))  # SerialException is an OSError


class _Port:
    """What all ports have in common.

    Attributes:
        name: the port's.
        resets_board: opening may have reset the board, which then takes some seconds to start.
    """

    realtime = True

    def __init__(self, name: str, device: Any, gone: str, *, resets_board: bool) -> None:
        """Takes over what is open, to be closed at the latest when Python ends. `gone`: why it might be no more."""
        self.name, self.resets_board = name, resets_board
        self._device = device
        self._why_gone = gone
        self._close_once = weakref.finalize(self, _close, device)

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is something, at the latest after `wait_s`."""
        del quiet_s  # bytes wait in the operating system's buffer anyway
        until = time.perf_counter() + wait_s
        try:
            while not (data := self._receive(until - time.perf_counter())) and time.perf_counter() < until:
                pass
        except _FAILURES:
            raise self._gone() from None
        return data

    def write(self, data: bytes) -> None:
        """Sends bytes; gives up when the other side takes none for a second. Not so where that second was much longer:
        then this program stood still, as when a computer sleeps, and a loss of bytes shows in the frames."""
        begun = time.perf_counter()
        try:
            self._send(data)
        except (serial.SerialTimeoutException, TimeoutError):
            if time.perf_counter() - begun <= _WRITE_S + _STILL_S:
                raise BoardError(f"{self.name} takes no bytes: its other side does not read") from None
        except _FAILURES:
            raise self._gone() from None

    def now(self) -> float:
        """The finest clock that never goes back (s), `time.perf_counter()`."""
        return time.perf_counter()

    def close(self) -> None:
        """Closes the port."""
        self._close_once()

    def _receive(self, wait_s: float) -> bytes:
        raise NotImplementedError

    def _send(self, data: bytes) -> None:
        raise NotImplementedError

    def _gone(self) -> BoardError:
        return BoardError(f"{self.name} has gone: {self._why_gone}")


class SerialPort(_Port):
    """A serial port of this computer, or one that another computer shares.

    Attributes:
        baud_given: the URL named the bit rate.
    """

    def __init__(self, name: str, device: Any, gone: str, *, baud_given: bool, resets_board: bool) -> None:
        super().__init__(name, device, gone, resets_board=resets_board)
        self.baud_given = baud_given
        self._overruns_before = _overruns(device)

    @property
    def baud(self) -> int:
        """The line's bit rate (bit/s)."""
        return int(self._device.baudrate)

    def set_baud(self, rate: int) -> None:
        """Another rate, from now on; what was received so far is forgotten."""
        check_baud(self.name, rate)
        before = self.baud
        try:
            self._device.baudrate = rate
            self._device.reset_input_buffer()
        except _FAILURES as error:
            if not self._device.is_open or getattr(error, "errno", None) == errno.EIO:
                raise self._gone() from None
            with contextlib.suppress(*_FAILURES):
                self._device.baudrate = before
            raise BoardError(f"{self.name} does not run at {rate} baud") from None

    @property
    def overruns(self) -> int:
        """Bytes lost since the opening because a buffer was full, where the driver counts them (Linux); else 0."""
        return max(_overruns(self._device) - self._overruns_before, 0)

    def _receive(self, wait_s: float) -> bytes:
        first: bytes = self._device.read(1)  # waits _LOOK_S
        rest = b""
        if first:
            with contextlib.suppress(*_FAILURES):  # the next reading says so
                rest = self._device.read(self._device.in_waiting)
        return first + rest

    def _send(self, data: bytes) -> None:
        self._device.write(data)


class SocketPort(_Port):
    """A TCP connection that carries a board's bytes: `socket://HOST:PORT`. Who serves a board there resets it."""

    def __init__(self, host: str, port: int) -> None:
        """Connects.

        Raises:
            BoardError: no such host, nobody listens, or no answer in time.
        """
        name = f"socket://{f'[{host}]' if ':' in host else host}:{port}"
        try:
            connection = socket.create_connection((host, port), CONNECT_S)
        except OSError as error:
            raise BoardError(f"{name} cannot be opened: {why_not_connected(error, host)}") from None
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.settimeout(_WRITE_S)
        super().__init__(name, connection, "closed by the other side", resets_board=True)

    def _receive(self, wait_s: float) -> bytes:
        if not select.select([self._device], [], [], max(wait_s, 0.0))[0]:
            return b""
        data: bytes = self._device.recv(65536)
        if not data:  # readable at its end: the other side is gone
            raise self._gone()
        return data

    def _send(self, data: bytes) -> None:
        self._device.sendall(data)


def open_serial(port: str, baud: int, *, baud_given: bool = False, reset: bool = True) -> SerialPort:
    """Opens a serial port of this computer: `serial:PORT`, or its path alone.

    Args:
        port: its path, or on Windows its name.
        baud: bit/s, 9,600 to 1,000,000.
        baud_given: the user has named the rate.
        reset: resets a board that has its reset at DTR; see above.

    Raises:
        BoardError: missing, forbidden, busy, no serial port, or not at that rate.
    """
    check_baud(port, baud)
    device = serial.Serial(baudrate=baud, timeout=_LOOK_S, write_timeout=_WRITE_S, exclusive=True if POSIX else None)
    device.port = port
    if not reset and not POSIX:
        device.dtr = False
    try:
        device.open()
        if POSIX:
            _keep_for_us_alone(device.fileno())
            _keep_dtr_at_close(device.fileno(), keep=not reset)
        resets_board = pulse_dtr(device) if reset else POSIX and _has_dtr(device.fileno())
        resets_board = resets_board or (reset and _is_pty(device.fileno()))
    except BaseException as error:  # Ctrl-C, too
        device.close()
        if isinstance(error, _FAILURES):
            raise BoardError(_why_not_opened(port, baud, error)) from None
        raise
    gone = "unplugged, or closed by the other side"
    return SerialPort(port, device, gone, baud_given=baud_given, resets_board=resets_board)


def open_rfc2217(host: str, port: int, baud: int, *, baud_given: bool = False, reset: bool = True) -> SerialPort:
    """Opens a serial port that another computer shares by RFC 2217 (Telnet COM port control): `rfc2217://HOST:PORT`.

    Args:
        host, port: the server's.
        baud, baud_given: as of `open_serial`.
        reset: resets a board that has its reset at DTR; without it DTR is kept off, as far as the server can.

    Raises:
        BoardError: no such host, nobody listens, no answer, or no RFC 2217.
    """
    where = f"{f'[{host}]' if ':' in host else host}:{port}"
    name = f"rfc2217://{where}"
    check_baud(name, baud)
    device = rfc2217.Serial(baudrate=baud, timeout=_LOOK_S)
    device.port = f"rfc2217://{where}?timeout={_NEGOTIATION_S:g}"
    device.dtr = reset
    try:
        device.open()
        resets_board = reset and pulse_dtr(device)
    except BaseException as error:
        device.close()
        if isinstance(error, _FAILURES):
            raise BoardError(_why_not_shared(name, host, baud, error)) from None
        raise
    return SerialPort(name, device, "closed by the other side", baud_given=baud_given, resets_board=resets_board)


def check_baud(port: str, baud: int) -> None:
    """Refuses rates that no board of this kit has."""
    if not BAUD_MIN <= baud <= BAUD_MAX:
        raise BoardError(f"{port} cannot be opened at {baud} baud; expected {BAUD_MIN} to {BAUD_MAX}")


def pulse_dtr(device: serial.SerialBase) -> bool:
    """Switches DTR off and on. False: the port has no such line (a pty), or its RFC 2217 server refuses."""
    try:
        device.dtr = False
        time.sleep(_DTR_OFF_S)
        device.dtr = True
    except (OSError, ValueError):  # pyserial's word for a refusal by a server
        return False
    return True


def holder_of(port: str) -> str | None:
    """The process that has the port open, in words, as in "process 4711 (minicom)", by its open files (Linux); None:
    nobody is known. Open files of other users' processes cannot be seen."""
    device = os.path.realpath(port)
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            for file in (process / "fd").iterdir():
                with contextlib.suppress(OSError):  # closed meanwhile
                    if str(file.readlink()) == device:
                        found.append(int(process.name))
    if not found:
        return None
    if (number := next((other for other in found if other != os.getpid()), None)) is None:
        return f"this program itself (process {os.getpid()})"
    with contextlib.suppress(OSError):
        return f"process {number} ({Path(f'/proc/{number}/comm').read_text().strip()})"
    return f"process {number}"


# ---- why a port cannot be opened ---------------------------------------------------------------------------------


def why_not_connected(error: OSError, host: str) -> str:
    """Why a connection was not made."""
    if isinstance(error, ConnectionRefusedError):
        return "nobody listens there"
    if isinstance(error, TimeoutError):
        return "no answer in time"
    if isinstance(error, socket.gaierror):
        return f"no host is called {host}"
    return (error.strerror or str(error)).lower()


def _why_not_shared(name: str, host: str, baud: int, error: BaseException) -> str:
    text = str(error)
    if "RFC2217" in text and "parameter change" in text:
        return f"{name} does not run at {baud} baud"
    if "RFC2217" in text or "COM_PORT" in text:
        return f"{name} is no RFC 2217 server: something else listens there"
    cause = error.__context__  # pyserial hides the operating system's error behind its own
    return f"{name} cannot be opened: {why_not_connected(cause, host) if isinstance(cause, OSError) else text}"


def _why_not_opened(port: str, baud: int, error: BaseException) -> str:
    number = getattr(error, "errno", None)
    text = str(error).lower()
    if number == errno.ENOENT or "filenotfound" in text:
        found = sorted(port.device for port in list_ports.comports())
        there = f"those there are: {', '.join(found)}" if found else "there is none at all: is the board plugged in?"
        return f"there is no port {port}; {there}"
    if number in (errno.EACCES, errno.EPERM) or "permissionerror" in text:
        return f"{port} may not be opened by this user: permission denied; {remedy(port)}"
    if number in _BUSY:
        return f"{port} is busy: {holder_of(port) or 'another program'} has it open"
    if "baud" in text:
        return f"{port} does not run at {baud} baud"
    if number in _NO_TERMINAL or "configure" in text:
        return f"{port} is no serial port"
    return f"{port} cannot be opened: {getattr(error, 'strerror', None) or error}"


def remedy(port: str) -> str:
    """What to do about a port that this user may not open."""
    if not POSIX:
        return "another program may have it open"
    with contextlib.suppress(OSError, KeyError):
        status = Path(port).stat()
        if status.st_mode & 0o060 == 0o060 and status.st_gid != 0:
            group = grp.getgrgid(status.st_gid).gr_name
            return f"join its group with: sudo usermod -aG {group} $USER, and log in again"
    return "its owner is another user"


# ---- what pyserial does not ask of a POSIX terminal ----------------------------------------------------------------


def _keep_for_us_alone(descriptor: int) -> None:
    """Nobody else may open the port. Not so a pty, whose mark would outlive a killed process."""
    if not _is_pty(descriptor):
        fcntl.ioctl(descriptor, termios.TIOCEXCL)


def _is_pty(descriptor: int) -> bool:
    """A pseudo-terminal: who serves a board there resets it when it is opened."""
    return POSIX and os.ttyname(descriptor).startswith(("/dev/pts/", "/dev/ttys"))


def _has_dtr(descriptor: int) -> bool:
    """Whether there are modem lines: a pty has none."""
    try:
        fcntl.ioctl(descriptor, termios.TIOCMGET, bytearray(4))
    except OSError:
        return False
    return True


def _keep_dtr_at_close(descriptor: int, *, keep: bool) -> None:
    """HUPCL: whether the last close switches DTR off."""
    attributes = termios.tcgetattr(descriptor)
    attributes[2] = attributes[2] & ~termios.HUPCL if keep else attributes[2] | termios.HUPCL
    # Only the flags: pyserial has set the rate, which may be one that termios has no name for.
    with contextlib.suppress(termios.error):
        termios.tcsetattr(descriptor, termios.TCSANOW, attributes)


def _overruns(device: Any) -> int:
    """What the driver has counted since it was loaded; 0 where it does not count: a pty, a shared port."""
    counts = bytearray(_ICOUNTER.size)
    try:
        if sys.platform == "linux" and isinstance(device, serial.Serial):
            fcntl.ioctl(device.fileno(), _TIOCGICOUNT, counts)
    except OSError:
        return 0
    fields: tuple[int, ...] = _ICOUNTER.unpack(counts)
    return fields[_OVERRUN] + fields[_BUF_OVERRUN]


def _close(device: Any) -> None:
    with contextlib.suppress(OSError):
        device.close()
