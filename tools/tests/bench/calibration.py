"""How many measurements of the calibration come out in the emulator as the data sheet says, beside avr8js."""

from __future__ import annotations

from tools.tests.bench.figures import Peer, figure
from tools.tests.calibration import avr8js, emulator, table
from tools.tests.calibration.emulator import Measured
from tools.tests.calibration.program import ROWS


def _share(right: list[bool]) -> float:
    return 100.0 * sum(right) / len(right)


def in_avr8js() -> float:
    """The same program there."""
    measured: Measured | None = avr8js.measure()
    if measured is None:
        raise RuntimeError("avr8js is not installed; `make bench` brings it")
    return _share(table.right_rows(measured))


@figure(
    "rows of the calibration that come out as the data sheet says",
    "%",
    at_least=_share([not row.difference for row in ROWS]),
    peers=[Peer(f"avr8js {avr8js.VERSION}", in_avr8js)],
)
def calibration() -> float:
    return _share(table.right_rows(emulator.measure()))
