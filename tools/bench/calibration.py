"""How many measurements of the calibration come out in the emulator as the data sheet says, beside avr8js."""

from __future__ import annotations

from hil_tests.calibration import avr8js, emulator, table
from hil_tests.calibration.program import ROWS
from tools.bench.figures import Peer, figure


def in_avr8js() -> float:
    """The same program there."""
    measured = avr8js.measure()
    if measured is None:
        raise RuntimeError("avr8js is not installed; `make bench` brings it")
    return float(sum(table.right_rows(measured)))


@figure(
    f"measurements that come out as the data sheet says, of the calibration's {len(ROWS)}",
    "rows",
    at_least=len([row for row in ROWS if not row.difference]),
    peers=[Peer(f"avr8js {avr8js.VERSION}", in_avr8js)],
)
def calibration() -> float:
    return float(sum(table.right_rows(emulator.measure())))
