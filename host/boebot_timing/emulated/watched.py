"""What is watched of an image in the emulator, by the names in its ELF file, and what the records of a run amount to:
spans of its tasks and interrupts, its load, its worst tick, its lowest stack.

Tasks and interrupts are those of the image's timing table: a task is a function NAME_task. (An image that uses others
is refused: firmware.py.)
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.image.elf import read_image
from boebot_timing.emulated.loads import TICK_CYCLES
from boebot_timing.measured import Measurement, Moment, Spans, Worst
from boebot_timing.table import read_table
from sim_bridge.boards.avr import FUNCTION_IDS, Watch

SLOT_VECTOR = 12  # TIMER1_COMPB: begins each slot (hal_avr.h)
SLOTS_PER_TICK = 4
PATIENCE = 50 * TICK_CYCLES  # without sleep: the program hangs; longer than its start takes
POLL = "link_poll"


@dataclass(frozen=True, slots=True)
class Watched:
    """Functions of an image and their names, in the order of their ids; names of interrupts by vector."""

    entries: tuple[int, ...]
    names: tuple[str, ...]
    vectors: dict[int, str]

    @property
    def watch(self) -> Watch:
        """For the recorder."""
        return Watch(self.entries, PATIENCE)

    @property
    def poll_id(self) -> int | None:
        """Of the link's poll, if the image has one."""
        return FUNCTION_IDS + self.names.index(POLL) if POLL in self.names else None


def watched(path: Path) -> Watched:
    """What there is to watch in an image."""
    image, table = read_image(path), read_table(path)
    functions = {s.name: s.address for s in image.symbols if s.kind in ("STT_FUNC", "STT_NOTYPE")}
    symbols = {row.name: f"{row.name}_task" for row in table.tasks} | {POLL: POLL}
    found = {name: functions[symbol] for name, symbol in symbols.items() if symbol in functions}
    vectors = {row.vector: row.name for row in sorted(table.interrupts, key=lambda row: row.vector)}
    return Watched(tuple(found.values()), tuple(found), vectors)


@dataclass(frozen=True, slots=True)
class Run:
    """What was recorded of a scenario from power-on to the end. Load and ticks are those of the `cycles` cycles since
    the load began, in `executed` of which something was executed."""

    what: Watched
    scenario: str
    seed: int
    spans: NDArray[Any]  # all of them (dtype SPAN), those of the preparations too
    cycles: int
    executed: int
    lowest_stack: int
    loaded_from: int  # cycle at which the load began
    lost: dict[str, int]  # what should have come and did not (Losses), as far as it was asked for
    sent: int  # bytes to the board and from it under the load
    received: int

    def measurement(self) -> Measurement:
        """What the record amounts to."""
        what, spans, since = self.what, self.spans, self.loaded_from
        work, busy = _ticks(what, spans, since)
        return Measurement(
            tasks={
                name: self._spans(name, FUNCTION_IDS + number) for number, name in enumerate(what.names) if name != POLL
            },
            interrupts={name: self._spans(name, vector, since) for vector, name in what.vectors.items()},
            lowest_stack=self.lowest_stack,
            seconds=self.cycles / 16e6,
            load=self.executed / self.cycles,
            worst_tick=int(work.max(initial=0)),
            scenarios=(self.scenario,),
            busiest_tick=int(busy.max(initial=0)),
            between_polls=_between_polls(what, spans),
            tick=_fullest_tick(what, spans, since, work),
            losses=self.lost,
        )

    def _spans(self, name: str, number: int, latency_since: int | None = None) -> Spans:
        spans = self.spans[self.spans["id"] == number]
        at = int(spans["begin"][np.argmax(spans["net"])]) if len(spans) else 0
        counted = spans[:0] if latency_since is None else spans[spans["begin"] >= latency_since]
        worst = Worst(self.scenario, self.seed, at)
        return Spans(name, spans["net"].copy(), spans["gross"].copy(), worst, counted["latency"].copy())


def _ticks(what: Watched, spans: NDArray[Any], since: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Cycles of tasks and interrupts in each control tick from `since` on, and all executed cycles of it. The first
    slot after power-on is slot 0."""
    starts = spans[spans["id"] == SLOT_VECTOR][::SLOTS_PER_TICK]
    starts = starts[starts["begin"] >= since]
    if len(starts) < 2:
        none = np.empty(0, dtype=np.int64)
        return none, none
    counted = spans[(spans["id"] < FUNCTION_IDS) | (spans["id"] != what.poll_id)]
    tick = np.searchsorted(starts["begin"], counted["begin"], side="right") - 1
    whole = (tick >= 0) & (tick < len(starts) - 1)
    work = np.bincount(tick[whole], weights=counted["net"][whole], minlength=len(starts) - 1)
    return work.astype(np.int64), np.diff(starts["executed"].astype(np.int64))


def _fullest_tick(what: Watched, spans: NDArray[Any], since: int, work: NDArray[Any]) -> tuple[Moment, ...]:
    """The spans of the tick with the most work, in the order in which they began; none where no tick was whole."""
    if not len(work):
        return ()
    starts = spans[spans["id"] == SLOT_VECTOR][::SLOTS_PER_TICK]["begin"]
    begin = int(starts[starts >= since][np.argmax(work)])
    inside = spans[(spans["begin"] >= begin) & (spans["begin"] < begin + TICK_CYCLES)]
    found = []
    for span in np.sort(inside, order="begin"):
        number, first = int(span["id"]), int(span["begin"]) - begin
        name = what.names[number - FUNCTION_IDS] if number >= FUNCTION_IDS else what.vectors.get(number, "")
        if name and name != POLL:
            kind = "task" if number >= FUNCTION_IDS else "interrupt"
            found.append(Moment(name, kind, first, first + int(span["gross"])))
    return tuple(found)


def _between_polls(what: Watched, spans: NDArray[Any]) -> int:
    """Most cycles from the beginning of one poll of the link to the next without sleep: before it sleeps the main loop
    has asked whether the link is due."""
    polls = spans[spans["id"] == what.poll_id] if what.poll_id is not None else spans[:0]
    time, executed = (np.diff(polls[name].astype(np.int64)) for name in ("begin", "executed"))
    return int(time[time == executed].max(initial=0))
