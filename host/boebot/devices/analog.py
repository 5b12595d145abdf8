"""What the readers of analog inputs share: the converter's result is a ratio of the supply.

voltage = result / 1024 · supply   (data sheet of the ATmega328P, 24.7)
"""

from __future__ import annotations

from typing import Final

STEPS: Final = 1024
READ_TICKS: Final = 2  # from one reading of an input to the next, when both are on
VOLTS: Final = 0.001  # per count of the supply on the wire


def voltage(result: int, supply: int) -> float | None:
    """Voltage at the pin (V) for a result and the supply in mV; None while the supply is not known."""
    return result / STEPS * supply * VOLTS if supply else None
