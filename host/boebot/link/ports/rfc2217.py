"""A serial port that another computer shares by RFC 2217 (Telnet COM port control): `rfc2217://HOST:PORT`.

pyserial speaks the protocol; its own Python thread receives, so that receipt stamps here are only as good as the
calling thread is quick (docs/decisions/0003-port-thread.md).
"""

from __future__ import annotations

from serial import rfc2217

from boebot.errors import BoardError
from boebot.link.ports.descriptor import within
from boebot.link.ports.polled import PolledTransport
from boebot.link.ports.serial_port import check_baud, pulse_dtr
from boebot.link.ports.tcp import TIMEOUT_S, why_not

_NEGOTIATION_S = 1.2  # pyserial's wait for the server's consent, in each of two steps


class Rfc2217Transport(PolledTransport):
    """A serial port behind an RFC 2217 server."""

    def __init__(
        self, host: str, port: int, baud: int = 500_000, *, baud_given: bool = False, reset: bool = True
    ) -> None:
        """Connects, and sets the line's rate.

        Args:
            host, port: the server's.
            baud: bit/s, 9,600 to 1,000,000.
            baud_given: the user has named the rate.
            reset: resets a board that has its reset at DTR; without it DTR is kept off, as far as the server can.

        Raises:
            BoardError: no such host, nobody listens, no answer, or no RFC 2217.
        """
        where = f"{f'[{host}]' if ':' in host else host}:{port}"
        name = f"rfc2217://{where}"
        check_baud(name, baud)
        device = rfc2217.Serial()
        device.port = f"rfc2217://{where}?timeout={_NEGOTIATION_S:g}"
        device.baudrate = baud
        device.timeout = 0.01
        device.dtr = reset
        try:
            within(TIMEOUT_S, lambda: _open(device), lambda _: device.close())
        except (OSError, ValueError) as error:
            raise BoardError(_why_not(name, host, baud, error)) from None
        try:
            self.resets_board = reset and pulse_dtr(device)
        except BaseException:  # Ctrl-C
            device.close()
            raise
        super().__init__(name, device, baud_given=baud_given, gone="closed by the other side")

    def set_baud(self, rate: int) -> None:
        """Another rate, from now on; what was received so far is forgotten."""
        check_baud(self.name, rate)
        super().set_baud(rate)


def _open(device: rfc2217.Serial) -> rfc2217.Serial:
    device.open()
    return device


def _why_not(name: str, host: str, baud: int, error: Exception) -> str:
    """One sentence about a server that could not be used."""
    if isinstance(error, TimeoutError):
        return f"{name} cannot be opened: {why_not(error, host)}; is that an RFC 2217 server?"
    text = str(error)
    if "RFC2217" in text and "parameter change" in text:
        return f"{name} does not run at {baud} baud"
    if "RFC2217" in text or "COM_PORT" in text:
        return f"{name} is no RFC 2217 server: something else listens there"
    cause = error.__context__  # pyserial hides the operating system's error behind its own
    reason = why_not(cause, host) if isinstance(cause, OSError) else text
    return f"{name} cannot be opened: {reason}"
