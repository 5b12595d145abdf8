"""A serial port or pseudo-terminal: `serial:PORT`, or its path alone.

The port is this process's alone: by a lock file, by the operating system's advisory lock, and, on a real port, by its
refusal to open it once more (TIOCEXCL).

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
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path

import serial
from serial.tools import list_ports

from boebot.errors import BoardError
from boebot.link.ports.descriptor import DescriptorTransport
from boebot.link.ports.holders import holder_of, in_words
from boebot.link.ports.lock_file import LockFile, PortBusyError
from boebot.link.ports.polled import PolledTransport
from boebot.link.transport import Transport

BAUD_MIN, BAUD_MAX = 9_600, 1_000_000
POSIX = os.name == "posix"
_DTR_OFF_S = 0.01  # the board's capacitor needs microseconds
_TIOCGICOUNT = 0x545D  # Linux: struct serial_icounter_struct, 20 ints
_ICOUNTER = struct.Struct("20i")
_OVERRUN, _BUF_OVERRUN = 7, 10  # in the port's own buffer, in the driver's
_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
_NO_TERMINAL = (errno.ENOTTY, errno.EINVAL, errno.EISDIR, errno.ENXIO, errno.ENODEV)

if POSIX:
    import fcntl
    import grp
    import termios


def open_serial(port: str, baud: int, *, baud_given: bool = False, reset: bool = True) -> Transport:
    """Opens a serial port of this computer.

    Args:
        port: its path, or on Windows its name.
        baud: bit/s, 9,600 to 1,000,000.
        baud_given: the user has named the rate.
        reset: resets a board that has its reset at DTR; see above.

    Raises:
        BoardError: missing, forbidden, busy, no serial port, or not at that rate.
    """
    if not POSIX:
        return WindowsSerialTransport(port, baud, baud_given=baud_given, reset=reset)
    return SerialTransport(port, baud, baud_given=baud_given, reset=reset)


class SerialTransport(DescriptorTransport):
    """A serial port with a file descriptor.

    Attributes:
        baud_given: the user has named the bit rate.
        resets_board: opening may have reset the board, which then takes some seconds to start.
    """

    def __init__(
        self, port: str, baud: int = 500_000, *, baud_given: bool = False, reset: bool = True, thread: bool = True
    ) -> None:
        """As `open_serial`."""
        check_baud(port, baud)
        device = configured(port, baud, reset)
        device.exclusive = True
        release = _releaser(device, take_lock(port))
        try:
            device.open()
            descriptor = device.fileno()
            _keep_for_us_alone(descriptor)
            _keep_dtr_at_close(descriptor, keep=not reset)
            self.resets_board = pulse_dtr(device) if reset else _has_dtr(descriptor)
            self._device = device
            self.baud_given = baud_given
            self._overruns_before = _overruns(descriptor)
            super().__init__(port, descriptor, release, thread)
        except BaseException as error:  # Ctrl-C, too: the lock must not stay with this process
            release()
            if isinstance(error, (OSError, ValueError, termios.error)):  # pyserial's SerialException is an OSError
                raise BoardError(why_not(port, baud, error)) from None
            raise

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
            termios.tcflush(self._descriptor, termios.TCIFLUSH)
        except (OSError, ValueError, termios.error) as error:
            if not self._device.is_open or getattr(error, "errno", None) == errno.EIO:
                raise BoardError(self._gone()) from None
            with contextlib.suppress(OSError, ValueError):
                self._device.baudrate = before
            raise BoardError(f"{self.name} does not run at {rate} baud") from None
        self._forget_received()

    @property
    def overruns(self) -> int:
        """Bytes lost since the opening because a buffer was full, where the driver counts them (Linux); else 0."""
        return 0 if self._closed else max(_overruns(self._descriptor) - self._overruns_before, 0)

    def _gone(self) -> str:
        return f"{self.name} has gone: unplugged, or closed by the other side"


class WindowsSerialTransport(PolledTransport):
    """A serial port without a file descriptor."""

    def __init__(self, port: str, baud: int, *, baud_given: bool, reset: bool) -> None:
        """As `open_serial`."""
        check_baud(port, baud)
        device = configured(port, baud, reset)
        device.write_timeout = 1.0
        try:
            device.open()
            self.resets_board = reset and pulse_dtr(device)
        except BaseException as error:
            device.close()
            if isinstance(error, (OSError, ValueError)):
                raise BoardError(why_not(port, baud, error)) from None
            raise
        super().__init__(port, device, baud_given=baud_given, gone="unplugged, or closed by the other side")


def check_baud(port: str, baud: int) -> None:
    """Refuses rates that no board of this kit has."""
    if not BAUD_MIN <= baud <= BAUD_MAX:
        raise BoardError(f"{port} cannot be opened at {baud} baud; expected {BAUD_MIN} to {BAUD_MAX}")


def configured(port: str, baud: int, reset: bool) -> serial.Serial:
    """A port that is not yet open."""
    device = serial.Serial()
    device.port = port
    device.baudrate = baud
    device.timeout = 0.01
    if not reset and not POSIX:
        device.dtr = False
    return device


def pulse_dtr(device: serial.SerialBase) -> bool:
    """Switches DTR off and on. False: the port has no such line (a pty), or its RFC 2217 server refuses."""
    try:
        device.dtr = False
        time.sleep(_DTR_OFF_S)
        device.dtr = True
    except (OSError, ValueError):  # pyserial's word for a refusal by a server
        return False
    return True


def take_lock(port: str) -> LockFile:
    """The port's lock file."""
    try:
        return LockFile(port)
    except PortBusyError as busy:
        raise BoardError(f"{port} is busy: {in_words(busy.owner)} has it open") from None


def why_not(port: str, baud: int, error: Exception) -> str:
    """One sentence about a port that could not be opened."""
    number = getattr(error, "errno", None)
    text = str(error).lower()
    if number == errno.ENOENT or "filenotfound" in text:
        return f"there is no port {port}{_those_there_are()}"
    if number in (errno.EACCES, errno.EPERM) or "permissionerror" in text:
        return f"{port} may not be opened by this user: permission denied; {remedy(port)}"
    if number in _BUSY:
        return f"{port} is busy: {holder_of(port) or 'another program'} has it open"
    if "baud" in text:
        return f"{port} does not run at {baud} baud"
    if number in _NO_TERMINAL or "configure" in text:
        return f"{port} is no serial port"
    return f"{port} cannot be opened: {getattr(error, 'strerror', None) or error}"


def _those_there_are() -> str:
    found = sorted(port.device for port in list_ports.comports())
    return f"; those there are: {', '.join(found)}" if found else "; there is none at all: is the board plugged in?"


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


def _keep_for_us_alone(descriptor: int) -> None:
    """Nobody else may open the port. Not so a pty, whose mark would outlive a killed process."""
    if not os.ttyname(descriptor).startswith(("/dev/pts/", "/dev/ttys")):
        fcntl.ioctl(descriptor, termios.TIOCEXCL)


def _has_dtr(descriptor: int) -> bool:
    """Whether there are modem lines: a pty has none."""
    try:
        fcntl.ioctl(descriptor, termios.TIOCMGET, bytearray(4))
    except OSError:
        return False
    return True


def _overruns(descriptor: int) -> int:
    """What the driver has counted since it was loaded; 0 where it does not count: a pty."""
    counts = bytearray(_ICOUNTER.size)
    try:
        if sys.platform == "linux":
            fcntl.ioctl(descriptor, _TIOCGICOUNT, counts)
    except OSError:
        return 0
    fields: tuple[int, ...] = _ICOUNTER.unpack(counts)
    return fields[_OVERRUN] + fields[_BUF_OVERRUN]


def _keep_dtr_at_close(descriptor: int, *, keep: bool) -> None:
    """HUPCL: whether the last close switches DTR off."""
    attributes = termios.tcgetattr(descriptor)
    attributes[2] = attributes[2] & ~termios.HUPCL if keep else attributes[2] | termios.HUPCL
    # Only the flags: pyserial has set the rate, which may be one that termios has no name for.
    with contextlib.suppress(termios.error):
        termios.tcsetattr(descriptor, termios.TCSANOW, attributes)


def _releaser(device: serial.Serial, lock: LockFile) -> Callable[[], None]:
    def release() -> None:
        try:
            device.close()
        finally:
            lock.release()

    return release
