"""A run on its way into its record: where its rows go, and what the record says of the run itself: who ran where, and
what was counted, as JSON in attachments."""

from __future__ import annotations

import json
import platform
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import fields
from importlib.metadata import version
from typing import Any, TypeVar, get_type_hints

import msgspec

from boebot.arenas import Arena
from boebot.arguments import plain
from boebot.errors import BoebotError, as_utf8
from boebot.link.messages import Identity
from boebot.record.brain_record import BrainNames
from boebot.record.record import InMemory, Record, Unrecorded
from boebot.record.record_file import RecordWriter
from boebot.record.run import Run, why
from boebot.record.run_folder import FORMAT, RECORD, RunFolder

R = TypeVar("R", bound=Run)
BEGIN, END = "begin.json", "end.json"


class Recording:
    """Of one run.

    Attributes:
        records: one for each robot.
    """

    def __init__(self, robots: int, *, recorded: bool = True) -> None:
        """`recorded`: else nothing is kept."""
        self._kept = InMemory()
        prefixes = [""] if robots == 1 else [f"robot-{number}/" for number in range(1, robots + 1)]
        self.records: list[Record] = [Record(self._kept, one) if recorded else Unrecorded() for one in prefixes]

    def begin(
        self,
        folder: RunFolder | None,
        results: Sequence[Run],
        sources: Mapping[str, bytes],
        requested: Mapping[str, Any],
        *,
        waits: bool,
    ) -> None:
        """From now on rows go into that folder, too; None: they are kept in memory.

        Args:
            results: what is known of the run as it begins.
            sources: files that it came from, by name.
            requested: what was asked for, as values of JSON.
            waits: for a slow disk; False: time does not stand still meanwhile.

        Raises:
            BoebotError: the folder cannot be written to.
        """
        if folder is not None:
            writer = RecordWriter(folder.new_record(), str(folder.path / RECORD), waits=waits)
            for name, data in sources.items():
                writer.attach(as_utf8(name), data)
            writer.attach(BEGIN, say(results, request=requested))
            for group in self._kept.groups():
                writer.write(group, 0.0)
            self._kept.written = writer

    def end(self, results: Sequence[Run]) -> BoebotError | None:
        """Nothing comes any more. Returns why the file is not whole. `results`: what is known at the run's end."""
        if self._kept.written is not None:
            try:
                self._kept.written.attach(END, say(results))
                self._kept.written.finish()
            except BoebotError as error:
                return error
        return None


def say(results: Sequence[Run], **more: Any) -> bytes:
    """What a record says of a run, as JSON. `more`: as it begins, the `request`; of a record that is mended, what is
    `lost` of the one before and where that is `cut`."""
    said: dict[str, Any] = {
        "format": FORMAT,
        "versions": {"boebot": version("boebot"), "python": platform.python_version()},
        "command_line": sys.argv,
        "written": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "arena": next((result.world.description for result in results if result.world is not None), None),
        "robots": [facts_of(result) for result in results],
    } | more
    return json.dumps(msgspec.to_builtins(said, enc_hook=plain), indent=1).encode()


class RecordedError(BoebotError):
    """Why a run ended before its time, as its record says."""


class _Facts(msgspec.Struct, frozen=True, kw_only=True):
    """What is said otherwise of one robot's run than `Run` has it.

    Attributes:
        error: in words.
        identity: the message, in hexadecimal digits.
        layout: first reading, and the one after the last, of each device.
        processes, behaviors, variables: names, of a brain of processes.
    """

    error: str | None
    interrupted: bool
    identity: str | None
    layout: dict[str, tuple[int, int]] | None
    processes: list[str] | None
    behaviors: list[str]
    variables: list[str]


_SAME = [
    one.name for one in fields(Run) if one.name not in ("record", "world", "error", "identity", "layout", "brain_names")
]
_HINTS = get_type_hints(Run)
_SINCE: Mapping[str, Any] = {"faults": msgspec.field(default_factory=dict)}  # records of before do not have them
Facts = msgspec.defstruct(
    "Facts",
    [(name, _HINTS[name], *([_SINCE[name]] if name in _SINCE else [])) for name in _SAME],
    bases=(_Facts,),
    frozen=True,
    kw_only=True,
)


def facts_of(result: Run) -> msgspec.Struct:
    """Of a result: `Facts`."""
    brain, layout = result.brain_names, result.layout
    return Facts(
        **{name: getattr(result, name) for name in _SAME},
        error=None if result.error is None else why(result.error),
        interrupted=isinstance(result.error, KeyboardInterrupt),
        identity=None if result.identity is None else result.identity.pack().hex(),
        layout=None if layout is None else {name: (part.start, part.stop) for name, part in layout.items()},
        processes=None if brain is None else list(brain.processes),
        behaviors=[] if brain is None else list(brain.behaviors),
        variables=[] if brain is None else list(brain.variables),
    )


def result_of(kind: type[R], data: Mapping[str, Any], record: Record, world: Arena | None) -> R:
    """The result of that JSON, its record and the arena, as a run of that class.

    Raises:
        ValueError: it is not what `facts_of` makes.
    """
    facts: Any = msgspec.convert(data, Facts)
    error: BaseException | None = None
    if facts.error is not None:
        error = KeyboardInterrupt() if facts.interrupted else RecordedError(facts.error)
    processes = facts.processes
    return kind(
        **{name: getattr(facts, name) for name in _SAME},
        record=record,
        world=world,
        error=error,
        identity=None if facts.identity is None else Identity.unpack(bytes.fromhex(facts.identity)),
        layout=None if facts.layout is None else {name: slice(*part) for name, part in facts.layout.items()},
        brain_names=None
        if processes is None
        else BrainNames(tuple(processes), tuple(facts.behaviors), tuple(facts.variables)),
    )
