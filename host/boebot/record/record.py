"""The record of a run: an append-only sequence of (stream, time, bytes), and what its streams mean.

While a run goes on, only that is put aside, into a sink. Everything else is computed afterwards (boebot.record.series).

stream              time, s                     bytes
to_board, to_host   transport's clock           as they crossed the wire, piece by piece
telemetry           the run's, of the tick      the payload; then host time of the tick and its error bound (s), doubles
NAME of a message   that of the newest tick     the payload of a message of slow devices (`devices_telemetry`)
event               the board's, since reset    kind, value, whether it was before the session
readings            the run's, of the step      of a robot without a board: tick, status, motor signals, ages, readings
command             that of the observation     kind (index of KINDS), left, right: what the brain asked for in one step
vehicle, movers     the run's, of the step      of a vehicle stepped by hand (sim_bridge.recorder)
"""

from __future__ import annotations

import bisect
from collections import defaultdict
from collections.abc import Callable, Sequence
from struct import Struct
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from boebot.devices.readings import Readings
from boebot.link.events import BoardEvent

Row = tuple[float, bytes]
Append = Callable[[str, float, bytes], None]
Decoded = TypeVar("Decoded")

KINDS = ("stop", "signal", "speed")  # of commands
_STAMP = Struct("<dd")
_COMMAND = Struct("<Bdd")
_EVENT = Struct("<BIB")
_READINGS = Struct("<IHdd")


class Sink(Protocol):
    """Where a record goes."""

    def append(self, stream: str, time_s: float, data: bytes) -> None:
        """Puts a row at the end of a stream."""

    def rows(self, stream: str) -> Sequence[Row]:
        """The rows of a stream, oldest first."""


class Memory:
    """A sink in memory."""

    def __init__(self) -> None:
        self._streams: defaultdict[str, list[Row]] = defaultdict(list)

    def append(self, stream: str, time_s: float, data: bytes) -> None:
        """See `Sink`."""
        self._streams[stream].append((time_s, data))

    def rows(self, stream: str) -> Sequence[Row]:
        """See `Sink`."""
        return self._streams.get(stream, ())


class Record:
    """A record: written row by row while the run goes on, read by stream afterwards.

    Attributes:
        append: puts (stream, time in s, bytes) at the end.
        rows: the rows (time, bytes) of a stream, oldest first.
    """

    def __init__(self, sink: Sink | None = None) -> None:
        """Into that sink; None: into memory."""
        sink = Memory() if sink is None else sink
        self.append: Append = sink.append
        self.rows = sink.rows
        self._decoded: dict[str, list[Any]] = {}

    def __repr__(self) -> str:
        names = ("telemetry", "readings", "event", "command", "vehicle")
        return "<Record: " + ", ".join(f"{len(self.rows(name))} {name}" for name in names if self.rows(name)) + ">"

    # ---- writing -----------------------------------------------------------------------------------------------------

    def append_telemetry(self, time_s: float, payload: bytes, host_s: float, bound_s: float) -> None:
        """One tick of a board."""
        self.append("telemetry", time_s, payload + _STAMP.pack(host_s, bound_s))

    def append_readings(self, time_s: float, sample: Readings, left: float, right: float) -> None:
        """One step of a robot without a board, and the motor signals in force."""
        numbers = Struct(f"<{len(sample.ages)}d{len(sample.values)}d").pack(*sample.ages, *sample.values)
        self.append("readings", time_s, _READINGS.pack(sample.tick, sample.status, left, right) + numbers)

    def append_command(self, time_s: float, kind: str, left: float, right: float) -> None:
        """What the brain asked for in one step."""
        self.append("command", time_s, _COMMAND.pack(KINDS.index(kind), left, right))

    def append_event(self, event: BoardEvent) -> None:
        """What the board sends exactly once."""
        self.append("event", event.time, _EVENT.pack(event.kind, event.value, event.earlier))

    # ---- reading -----------------------------------------------------------------------------------------------------

    @property
    def times(self) -> list[float]:
        """The run's time (s) of each tick or step, by the board's clock."""
        return self._each("times", self.rows("telemetry") or self.rows("readings"), lambda row: row[0])

    @property
    def telemetry(self) -> list[bytes]:
        """A board's payloads."""
        return self._each("telemetry", self.rows("telemetry"), lambda row: row[1][: -_STAMP.size])

    @property
    def stamps(self) -> list[tuple[float, float]]:
        """(host time of the tick in s, its error bound in s) of each telemetry."""
        return self._each("stamps", self.rows("telemetry"), lambda row: _STAMP.unpack(row[1][-_STAMP.size :]))

    def readings(self, count: int) -> NDArray[np.void]:
        """Steps of a robot without a board that has `count` readings, with the motor signals in force."""
        numbers = [("left", "<f8"), ("right", "<f8"), ("ages", "<f8", (count,)), ("values", "<f8", (count,))]
        columns = np.dtype([("tick", "<u4"), ("status", "<u2"), *numbers])
        return np.frombuffer(b"".join(data for _, data in self.rows("readings")), dtype=columns)

    @property
    def events(self) -> list[BoardEvent]:
        """What the board sent exactly once."""
        return self._each("event", self.rows("event"), _event)

    @property
    def steps(self) -> list[tuple[int, str, float, float]]:
        """(index of the tick of the observation, command kind, left, right), one per step of the brain."""
        return self._each("command", self.rows("command"), self._step)

    def messages(self, kind: Any) -> list[tuple[int, Any]]:
        """(index of the newest tick when it came, message) of each message of slow devices of that kind."""
        return [(self._index(time_s), kind.unpack(data)) for time_s, data in self.rows(kind.NAME)]

    def _index(self, time_s: float) -> int:
        return bisect.bisect_right(self.times, time_s) - 1

    def _step(self, row: Row) -> tuple[int, str, float, float]:
        kind, left, right = _COMMAND.unpack(row[1])
        return self._index(row[0]), KINDS[kind], left, right

    def _each(self, name: str, rows: Sequence[Row], decode: Callable[[Row], Decoded]) -> list[Decoded]:
        """Each row decoded; kept until there are more."""
        found = self._decoded.get(name)
        if found is None or len(found) != len(rows):
            found = self._decoded[name] = [decode(row) for row in rows]
        return found


def _event(row: Row) -> BoardEvent:
    kind, value, earlier = _EVENT.unpack(row[1])
    return BoardEvent(kind, value, row[0], bool(earlier))
