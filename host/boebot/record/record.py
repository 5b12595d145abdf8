"""The record of a run: what crossed the wire, or what a vehicle's devices said; every command.

While a run goes on, only that is put aside. Everything else is computed afterwards (boebot.record.series).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from boebot.devices.readings import Readings
from boebot.link.delivery import BoardEvent


@dataclass(repr=False)
class Record:
    """What is put aside while a run goes on.

    Attributes:
        telemetry: a board's payloads, oldest first.
        readings: those of a robot without a board, and the motor signals in force, oldest first.
        devices: (index into telemetry of the latest that had come, message id, payload) of each message of a board's
        slow devices, oldest first.
        times: the run's time (s) of each, by the board's clock.
        stamps: (host time of the tick in s, its error bound in s) of each.
        events: what the board told exactly once, oldest first.
        steps: (index into telemetry or readings of the observation, command kind, left, right), one per step of the
        brain.
    """

    telemetry: list[bytes] = field(default_factory=list)
    readings: list[tuple[Readings, float, float]] = field(default_factory=list)
    devices: list[tuple[int, int, bytes]] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    stamps: list[tuple[float, float]] = field(default_factory=list)
    events: list[BoardEvent] = field(default_factory=list)
    steps: list[tuple[int, str, float, float]] = field(default_factory=list)

    def __repr__(self) -> str:
        """How much of each there is."""
        counts = ", ".join(f"{len(rows)} {name}" for name, rows in vars(self).items() if rows)
        return f"<Record: {counts or 'empty'}>"
