"""What pages ask for, checked: one JSON text each, `type` names which."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from boebot.errors import BoebotError

Signal = Annotated[float, msgspec.Meta(ge=-1, le=1)]
Index = Annotated[int, msgspec.Meta(ge=0, le=1000)]
Name = Annotated[str, msgspec.Meta(max_length=200)]


class _Message(msgspec.Struct, frozen=True, tag_field="type", tag=str.lower, forbid_unknown_fields=True):
    pass


class Hello(_Message, frozen=True):
    """The first message. `format`: of data that the page knows."""

    format: int


class Pause(_Message, frozen=True):
    """Time stands still."""


class Resume(_Message, frozen=True):
    """It goes on."""


class Step(_Message, frozen=True):
    """One step of the brains, and time stands still again."""


class Speed(_Message, frozen=True):
    """Simulated seconds in one of the wall clock; None: as fast as possible."""

    speed: Annotated[float, msgspec.Meta(ge=0.01, le=10_000)] | None


class Restart(_Message, frozen=True):
    """The same once more, with this seed and without these imperfections."""

    seed: Annotated[int, msgspec.Meta(ge=0, le=2**53)]
    without: Annotated[list[Name], msgspec.Meta(max_length=200)]


class Place(_Message, frozen=True):
    """A robot is put there: m, m, rad."""

    robot: Index
    pose: tuple[float, float, float]


class Shape(_Message, frozen=True):
    """A moving shape is put there: m, m, rad."""

    shape: Index
    pose: tuple[float, float, float]


class Parameter(_Message, frozen=True):
    """A parameter of a robot's brain gets a value."""

    robot: Index
    name: Name
    value: float


class Hand(_Message, frozen=True):
    """A robot is driven by hand; said again at least every 0.1 s while it is to move."""

    robot: Index
    left: Signal
    right: Signal


class Release(_Message, frozen=True):
    """Its brain drives it again."""

    robot: Index


class Stop(_Message, frozen=True):
    """Its motors are latched off."""

    robot: Index


class Arm(_Message, frozen=True):
    """They are no longer."""

    robot: Index


class Visible(_Message, frozen=True):
    """The page can be seen, or is hidden."""

    visible: bool


Asked = (
    Hello | Pause | Resume | Step | Speed | Restart | Place | Shape | Parameter | Hand | Release | Stop | Arm | Visible
)
_DECODER: msgspec.json.Decoder[Asked] = msgspec.json.Decoder(Asked)


def decode(data: str) -> Asked:
    """A page's message.

    Raises:
        BoebotError: it is none, in one sentence.
    """
    try:
        message = _DECODER.decode(data)
    except (msgspec.MsgspecError, RecursionError, UnicodeError) as error:
        raise BoebotError(f"a page has sent what this boebot does not know: {error}") from None
    numbers = getattr(message, "pose", ()) or (getattr(message, "value", 0.0),)
    if not all(math.isfinite(number) for number in numbers):
        raise BoebotError("a page has sent a number that is not finite")
    return message
