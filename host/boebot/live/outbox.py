"""What waits to be sent to one page. A page that is slow gets fewer and newer chunks: of those that it has missed only
what must not be lost is kept, such as events, and that is bounded."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any

import msgspec

Message = dict[str, Any]
EVENTS = 500  # of a kind, that wait at most
LETTERS = 20_000  # printed, that wait at most
_NEWEST = frozenset({"chunk", "state", "end"})  # kinds of which one waits at most; a run's end never before its chunks


class Outbox:
    """Filled by the thread of the run, emptied by that of the server.

    Attributes:
        number: of its page, of all so far.
        ready: there is something; of the server's loop.
    """

    def __init__(self, number: int = 1) -> None:
        self.number = number
        self.ready = asyncio.Event()
        self._lock = threading.Lock()
        self._first: list[Message] = []  # must be sent, and before the rest
        self._newest: dict[str, Message] = {}  # by their kinds, in the order in which they came

    def begin(self, run: Message, past: list[Message]) -> None:
        """A run begins, or the page comes in the middle of it: what it needs first. Nothing else counts any more."""
        with self._lock:
            self._first, self._newest = [run, *past], {}

    def put(self, message: Message) -> None:
        """Something for the page."""
        with self._lock:
            kind = message["type"]
            if kind in _NEWEST:
                older = self._newest.pop(kind, None)
                self._newest[kind] = merged(older, message) if older is not None and kind == "chunk" else message
            elif len(self._first) < EVENTS:
                self._first.append(message)

    @property
    def is_waiting(self) -> bool:
        """There is something in it."""
        with self._lock:
            return bool(self._first or self._newest)

    def take(self) -> list[str]:
        """All of it, to be sent in this order."""
        with self._lock:
            waiting = [*self._first, *self._newest.values()]
            self._first, self._newest = [], {}
        return [_text(message) for message in waiting]


def _text(message: Message) -> str:
    try:
        return msgspec.json.encode(message).decode()
    except UnicodeEncodeError:  # half a character, as a brain may print it
        return json.dumps(json.loads(json.dumps(message), parse_constant=lambda name: None))


def merged(old: Message, new: Message) -> Message:
    """The newer of two chunks, with what must not be lost of the older one."""
    return new | {
        "runs": [_merged_rows(one, other) for one, other in zip(old["runs"], new["runs"], strict=True)],
        "printed": (old["printed"] + new["printed"])[-LETTERS:],
    }


def _merged_rows(old: Message, new: Message) -> Message:
    layers = {layer["name"]: layer for layer in (*old["layers"], *new["layers"])}
    rows = new | {"events": (old["events"] + new["events"])[-EVENTS:], "layers": list(layers.values())}
    minds = [one["mind"] for one in (old, new) if one["mind"] is not None]  # none where the brain did not step
    if minds:
        rows["mind"] = minds[-1] | {"switches": [one for mind in minds for one in mind["switches"]][-EVENTS:]}
    return rows
