"""A port that pyserial reads without a file descriptor: serial ports on Windows, RFC 2217 servers.

The calling thread reads, and a stamp is as late as the caller: beside a thread that computes, by several milliseconds.
"""

from __future__ import annotations

import contextlib
import time
import weakref

import serial
from serial import rfc2217

from boebot.errors import BoardError
from boebot.link.ports import switch_interval

PyserialPort = serial.Serial | rfc2217.Serial


class PolledTransport:
    """Reads and writes one of pyserial's ports, whose time-out must be short: it is how long a wait may last too long.

    Attributes:
        name: the port's.
        baud_given: the URL named the bit rate.
        resets_board: opening has reset the board, which then takes some seconds to start.
    """

    realtime = True
    resets_board = False

    def __init__(self, name: str, device: PyserialPort, *, baud_given: bool, gone: str) -> None:
        """Takes over an open port. `gone`: why it might not be there any more."""
        self.name = name
        self.baud_given = baud_given
        self._device = device
        self._why_gone = gone
        switch_interval.shorten()
        self._close_once = weakref.finalize(self, _close, device)

    @property
    def baud(self) -> int:
        """The line's bit rate (bit/s)."""
        return int(self._device.baudrate)

    def set_baud(self, rate: int) -> None:
        """Another rate, from now on; what was received so far is forgotten."""
        try:
            self._device.baudrate = rate
            self._device.reset_input_buffer()
        except ValueError:
            raise BoardError(f"{self.name} does not run at {rate} baud") from None
        except OSError as error:
            if "parameter change" in str(error):  # an RFC 2217 server that refuses
                raise BoardError(f"{self.name} does not run at {rate} baud") from None
            raise self._gone() from None

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is something, at the latest after `wait_s`."""
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """The same with the instant at which this thread had it (s, monotonic clock)."""
        del quiet_s
        until = time.monotonic() + wait_s
        try:
            while True:
                waiting = self._device.in_waiting
                data = bytes(self._device.read(max(1, waiting)))
                if data:
                    return [(time.monotonic(), data)]
                if time.monotonic() >= until:
                    return []
        except (OSError, TypeError, ValueError):
            raise self._gone() from None

    def write(self, data: bytes) -> None:
        """Sends bytes."""
        try:
            self._device.write(data)
        except serial.SerialTimeoutException:
            raise BoardError(f"{self.name} takes no bytes: its other side does not read") from None
        except (OSError, TypeError, ValueError):
            raise self._gone() from None

    def now(self) -> float:
        """The monotonic clock (s)."""
        return time.monotonic()

    def close(self) -> None:
        """Closes the port."""
        self._close_once()

    def _gone(self) -> BoardError:
        return BoardError(f"{self.name} has gone: {self._why_gone}")


def _close(device: PyserialPort) -> None:
    with contextlib.suppress(OSError):
        device.close()
    switch_interval.restore()
