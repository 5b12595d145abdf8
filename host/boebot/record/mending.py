"""A record that is cut, made whole: what can be read of it, in a new file with an end."""

from __future__ import annotations

from pathlib import Path

from boebot.record.record_file import RecordReader, RecordWriter
from boebot.record.recording import END, say
from boebot.record.result import RunResult, TogetherResult
from boebot.record.run_folder import MENDED, unfinished


def mend(path: Path, result: RunResult | TogetherResult) -> Path:
    """Writes it beside the record; `result`: what was read of it. Returns the new file.

    Raises:
        BoebotError: it cannot be written.
    """
    mended = path.with_name(MENDED)
    part = unfinished(mended)
    with path.open("rb") as cut, part.open("wb", buffering=0) as file:
        reader, writer = RecordReader(cut, str(path)), RecordWriter(file, str(mended))
        for name, data in reader.read().attachments.items():
            writer.attach(name, data)
        for group in reader.groups():
            writer.write(group, 0.0)
        writer.attach(END, say([result] if isinstance(result, RunResult) else result.robots))
        writer.finish()
    part.replace(mended)
    return mended
