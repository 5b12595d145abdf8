"""A record that is cut or damaged, made whole: what can be read of it, in a new file with an end.

What was damaged stays said in it, and groups keep their numbers: so who reads it finds where something is missing.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from boebot.record.reading import CutError
from boebot.record.record_file import RecordReader, RecordWriter
from boebot.record.recording import END, say
from boebot.record.result import RunResult, TogetherResult
from boebot.record.run_folder import MENDED, write_whole


def mend(path: Path, result: RunResult | TogetherResult) -> Path:
    """Writes it beside the record; `result`: what was read of it, with a `CutError`. Returns the new file.

    Raises:
        BoebotError: it cannot be written.
    """
    mended = path.with_name(MENDED)
    robots = [result] if isinstance(result, RunResult) else result.robots
    lost = robots[0].error.lost if isinstance(robots[0].error, CutError) else ()
    said = [replace(one, error=one.error.other) if isinstance(one.error, CutError) and lost else one for one in robots]

    def write(part: Path) -> None:
        with path.open("rb") as old, part.open("wb", buffering=0) as file:
            reader, writer = RecordReader(old, str(path)).read(), RecordWriter(file, str(mended))
            for name, data in reader.found.attachments.items():
                if name != END:
                    writer.attach(name, data)
            for kept in reader.groups():
                writer.write(kept.group, kept.end_s, kept.begin_s, kept.number)
            writer.attach(END, say(said, lost=lost))
            writer.finish()

    return write_whole(mended, write)
