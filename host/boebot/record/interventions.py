"""What a person does to a run between two steps of its brain, as its record has it: drives by hand, lifts the robot,
changes a parameter, types, presses a button (boebot.running.hands carries it out); and what is made to fail."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from boebot.record.record import Record

STREAM = "intervention"  # of the record
Signal = Annotated[float, msgspec.Meta(ge=-1, le=1)]
TEXT_MAXIMUM = 1000  # letters that are typed at once
SLIDE_S = 1.0  # of the run; a slider that is dragged gives new values all the time


class Intervention(msgspec.Struct, frozen=True, tag_field="kind", tag=str.lower):
    """One of those below, of one robot."""


class Hand(Intervention, frozen=True):
    """The robot is driven by these motor signals (-1 to 1), whatever its brain says, until `Release`."""

    left: Signal
    right: Signal


class Release(Intervention, frozen=True):
    """Its brain drives it again."""


class Stop(Intervention, frozen=True):
    """Its motors are latched off."""


class Arm(Intervention, frozen=True):
    """They are no longer."""


class Place(Intervention, frozen=True):
    """A simulated robot is lifted and put elsewhere: x (m), y (m), heading (rad)."""

    x: float
    y: float
    heading: float


class Shape(Intervention, frozen=True):
    """So is a moving shape of the arena, the `index`-th from 0."""

    index: Annotated[int, msgspec.Meta(ge=0)]
    x: float
    y: float
    heading: float


class Parameter(Intervention, frozen=True):
    """A parameter of a process of its brain gets another value; `name`: as "avoid.turn"."""

    name: str
    value: float


class Typed(Intervention, frozen=True, omit_defaults=True):
    """Text goes to the program that drives the robot, by its board's serial line. `scripted`: the run was asked for
    with it, and no person has interfered."""

    text: Annotated[str, msgspec.Meta(max_length=TEXT_MAXIMUM)]
    scripted: bool = False


class Set(Intervention, frozen=True, omit_defaults=True):
    """A device at the robot's board is worked: a button pressed (1) or let go (0), a switch closed or opened, a knob
    turned (0 to 1). `scripted`: as of `Typed`."""

    part: Annotated[str, msgspec.Meta(max_length=TEXT_MAXIMUM)]
    value: Annotated[float, msgspec.Meta(ge=0, le=1)]
    scripted: bool = False


class Fault(Intervention, frozen=True, omit_defaults=True):
    """Something fails, from `begin_s` to `end_s` of the run (None: to its end; or what happens once). `name` and
    `value`: see boebot.running.faults."""

    name: str
    value: float | str | None = None
    begin_s: float = 0.0
    end_s: float | None = None

    def __str__(self) -> str:
        """As at the command line."""
        value = self.value if isinstance(self.value, str | None) else f"{self.value:.10g}"
        end = "" if self.end_s is None else f"..{self.end_s:.10g}s"
        return f"{self.name}{'' if value is None else f'={value}'}@{self.begin_s:.10g}s{end}"


Deed = Hand | Release | Stop | Arm | Place | Shape | Parameter | Typed | Set | Fault
_DECODER: msgspec.json.Decoder[Deed] = msgspec.json.Decoder(Deed)


def interventions(record: Record) -> list[tuple[float, Deed]]:
    """Those of a robot's run, with their times (s)."""
    return [(time_s, _DECODER.decode(data)) for time_s, data in record.rows(STREAM)]


def in_words(deed: Deed) -> str:
    """An intervention, for people."""
    match deed:
        case Hand(left, right):
            return f"driven by hand: {left:+.2f}, {right:+.2f}"
        case Release():
            return "the brain drives again"
        case Stop():
            return "motors latched off by hand"
        case Arm():
            return "motors armed by hand"
        case Place(x, y, heading):
            return f"put at {x:.2f}, {y:.2f} m, {math.degrees(heading):.0f}°"
        case Shape(index, x, y):
            return f"moving shape {index + 1} put at {x:.2f}, {y:.2f} m"
        case Parameter(name, value):
            return f"{name} = {value:g}"
        case Typed(text):
            return f"typed {text!r}"
        case Set(part, value):
            return f"{part} set to {value:g}"
        case Fault() as fault:
            return f"fault {fault}"


def happenings(record: Record) -> list[tuple[float, str]]:
    """Those of a stretch of a robot's run in words, with the times (s) at which they show: a fault when it begins."""
    return [
        (max(time_s, deed.begin_s) if isinstance(deed, Fault) else time_s, in_words(deed))
        for time_s, deed in interventions(record)
    ]


def touched(record: Record) -> int:
    """How often a person has interfered with a robot's run, as `Tally` counts."""
    tally = Tally()
    for time_s, one in interventions(record):
        tally.add(time_s, one)
    return tally.count


class Tally:
    """Counts interventions: driving by hand once, until the brain drives again; a parameter or a device that is set
    again within `SLIDE_S` of the run, and nothing else in between, once.

    Attributes:
        count: so far.
    """

    def __init__(self) -> None:
        self.count = 0
        self._by_hand = False
        self._slid: tuple[str, float] = "", 0.0  # what was set last, and when

    def add(self, time_s: float, one: Deed) -> None:
        """It has been carried out before the step at that time of the run."""
        if isinstance(one, Fault) or (isinstance(one, Typed | Set) and one.scripted):
            return
        name, last_s = self._slid
        slides = one.name if isinstance(one, Parameter) else one.part if isinstance(one, Set) else ""
        self._slid = slides, time_s
        if isinstance(one, Hand):
            self.count += not self._by_hand
            self._by_hand = True
        elif isinstance(one, Release):
            self._by_hand = False
        else:
            self.count += not (slides and slides == name and time_s - last_s < SLIDE_S)
