"""What pages ask for, checked: one JSON text each, `type` names which."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from boebot.errors import BoebotError
from boebot.record.interventions import Deed

Name = Annotated[str, msgspec.Meta(max_length=200)]


class _Message(msgspec.Struct, frozen=True, tag_field="type", tag=str.lower, forbid_unknown_fields=True):
    pass


class Hello(_Message, frozen=True):
    """The first message."""


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


class Do(_Message, frozen=True):
    """Something is done to a robot: `Hand` again at least every 0.1 s while it is to move."""

    robot: Annotated[int, msgspec.Meta(ge=0)]
    deed: Deed


Asked = Hello | Pause | Resume | Step | Speed | Restart | Do
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
    numbers = msgspec.structs.astuple(message.deed) if isinstance(message, Do) else ()
    if not all(math.isfinite(number) for number in numbers if isinstance(number, float)):
        raise BoebotError("a page has sent a number that is not finite")
    return message
