"""A run on its way into its record: where its rows go, and what the record says of the run itself."""

from __future__ import annotations

import json
import platform
import sys
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import msgspec

from boebot.arguments import plain
from boebot.errors import BoebotError, as_utf8
from boebot.record.keepers import Keeper, OnDisk, Shared, Temporary
from boebot.record.record import Record, Unrecorded
from boebot.record.record_file import RecordError
from boebot.record.run_folder import FORMAT, RECORD, RunFolder

if TYPE_CHECKING:
    from boebot.record.run import Run

BEGIN, END = "begin.json", "end.json"
JSON = "application/json"


class Recording:
    """Of one run.

    Attributes:
        records: one for each robot.
    """

    def __init__(self, robots: int, *, recorded: bool = True) -> None:
        """`recorded`: else nothing is kept."""
        self._disk: OnDisk | None = None
        self.records: list[Record] = [Record() if recorded else Unrecorded() for _ in range(robots)]

    def begin(
        self,
        folder: RunFolder | None,
        results: Sequence[Run],
        sources: Mapping[str, bytes],
        requested: Mapping[str, Any],
        *,
        waits: bool,
    ) -> None:
        """From now on rows go into that folder; None: into a temporary file, once a second of the wall clock is over.

        Args:
            results: what is known of the run as it begins.
            sources: files that it came from, by name.
            requested: what was asked for, as values of JSON.
            waits: for a slow disk; False: time does not stand still meanwhile.

        Raises:
            BoebotError: the folder cannot be written to.
        """
        keeper: Keeper = Temporary(waits=waits)
        if folder is not None:
            keeper = self._disk = OnDisk(folder.new_record(), str(folder.path / RECORD), waits=waits)
            for name, data in sources.items():
                self._disk.writer.attach(as_utf8(name), data)
            self._disk.writer.attach(BEGIN, say(results, request=requested), JSON)
        for number, record in enumerate(self.records, 1):
            record.keep_in(keeper if len(self.records) == 1 else Shared(keeper, number))

    def end(self, results: Sequence[Run]) -> BoebotError | None:
        """Nothing comes any more. Returns why the record is not whole. `results`: what is known at the run's end."""
        failure: BoebotError | None = None
        if self._disk is not None:
            try:
                self._disk.writer.attach(END, say(results), JSON)
                self._disk.finish()
            except BoebotError as error:
                failure = error
        if failure is not None or any(isinstance(result.error, RecordError) for result in results):
            for record in self.records:
                record.recount()
        return failure


def say(results: Sequence[Run], **more: Any) -> bytes:
    """What a record says of a run, as JSON. `more`: as it begins, the `request`; of a record that is mended, what is
    `lost` of the one before and where that is `cut`."""
    from boebot.record.facts import facts_of

    said: dict[str, Any] = {
        "format": FORMAT,
        "versions": {"boebot": version("boebot"), "python": platform.python_version()},
        "command_line": sys.argv,
        "written": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        "arena": next((result.world.description for result in results if result.world is not None), None),
        "robots": [facts_of(result) for result in results],
    } | more
    return json.dumps(msgspec.to_builtins(said, enc_hook=plain), indent=1).encode()
