"""Single fields of a message's payload, where unpacking all of it takes too long; and its texts."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import Any

from boebot.link import messages


def reader(message: type[messages.Message], *names: str) -> Callable[[bytes], tuple[Any, ...]]:
    """A function that unpacks only these fields of a payload; it returns them in the message's order.

    Raises:
        ValueError: the message has no such field.
    """
    if missing := set(names) - set(message._fields):
        raise ValueError(f"message {message.NAME} has no field {', '.join(sorted(missing))}")
    codes = re.findall(r"\d*[a-zA-Z]", message.STRUCT.format)
    wanted = (
        code if name in names else f"{struct.calcsize('<' + code)}x"
        for name, code in zip(message._fields, codes, strict=True)
    )
    return struct.Struct("<" + "".join(wanted)).unpack


def text(field: bytes) -> str:
    """A text field without its padding."""
    return field.split(b"\0", 1)[0].decode("utf-8", errors="replace")
