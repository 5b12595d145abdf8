"""A record that is cut or damaged, made whole: what can be read of it, in a new file with an end.

What was damaged, and where it was cut, stays said in it, and groups keep their numbers: so who reads it finds where
something is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from boebot.record.reading import CutError
from boebot.record.record_file import RecordReader, RecordWriter
from boebot.record.recording import END, say
from boebot.record.run import Run
from boebot.record.run_folder import MENDED, write_whole


def mend(path: Path, robots: Sequence[Run]) -> Path:
    """Writes it beside the record; `robots`: what was read of it, with a `CutError`. Returns the new file.

    Raises:
        BoebotError: it cannot be written.
    """
    mended = path.with_name(MENDED)
    errors = [one.error for one in robots if isinstance(one.error, CutError)]
    end = say(
        [replace(one, error=error.other) for one, error in zip(robots, errors, strict=True)],
        lost=errors[0].lost,
        cut=errors[0].cut,
    )

    def write(part: Path) -> None:
        with path.open("rb") as old, part.open("wb", buffering=0) as file:
            reader, writer = RecordReader(old, str(path)).read(), RecordWriter(file, str(mended))
            for name, data in reader.found.attachments.items():
                if name != END:
                    writer.attach(name, data)
            for kept in reader.groups():
                writer.write(kept.group, kept.end_s, kept.begin_s, kept.number)
            writer.attach(END, end)
            writer.finish()

    return write_whole(mended, write)
