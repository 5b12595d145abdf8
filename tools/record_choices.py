"""What was measured to choose the form of a run's record: python -m tools.record_choices [--page FILE]

Prints tables in Markdown; --page puts them behind the line `<!-- printed -->` of a page. The rows are those of a run of
five minutes of the native board, with a brain at every tick of 10 ms.
"""

from __future__ import annotations

import argparse
import base64
import dataclasses
import io
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import reduce
from pathlib import Path
from typing import IO

import numpy as np
from mcap.writer import CompressionType, Writer

import boebot
from boebot.record import overview
from boebot.record.blocks import SCHEMA, Block, Group, joined, packed, schema, unpacked
from boebot.record.record_file import RecordReader, RecordWriter
from boebot.record.result import RunResult
from boebot.view import picture, replay

SECONDS = 300.0
PERIOD_S = 0.01
MARK = "<!-- printed -->\n"
Form = Callable[[Writer, Group], None]


def timed(work: Callable[[], object], rounds: int = 3) -> float:
    """The median of its times (s)."""
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def table(heading: list[str], rows: list[list[str]]) -> list[str]:
    return ["", *(f"| {' | '.join(row)} |" for row in (heading, ["---"] * len(heading), *rows))]


# ---- the form of messages --------------------------------------------------------------------------------------------


def as_blocks(writer: Writer, group: Group) -> None:
    for stream, block in group.items():
        writer.add_message(channel(writer, stream, "protobuf"), 0, packed(block), 0)


def as_rows(writer: Writer, group: Group) -> None:
    for stream, block in group.items():
        number = channel(writer, stream, "protobuf")
        for row in block.rows():
            writer.add_message(number, 0, packed(Block.of([row])), 0)


def as_json(writer: Writer, group: Group) -> None:
    for stream, block in group.items():
        number = channel(writer, stream, "json")
        for at_s, data in block.rows():
            writer.add_message(
                number, 0, json.dumps({"time": at_s, "data": base64.b64encode(data).decode()}).encode(), 0
            )


CHANNELS: dict[tuple[int, str], int] = {}


def channel(writer: Writer, stream: str, encoding: str) -> int:
    key = (id(writer), stream)
    if key not in CHANNELS:
        number = writer.register_schema(SCHEMA, "protobuf", schema()) if encoding == "protobuf" else 0
        CHANNELS[key] = writer.register_channel(stream, encoding, number)
    return CHANNELS[key]


def written(groups: list[Group], form: Form, compression: CompressionType = CompressionType.ZSTD) -> bytes:
    CHANNELS.clear()
    file = io.BytesIO()
    writer = Writer(file, chunk_size=sys.maxsize, compression=compression)
    writer.start()
    for group in groups:
        form(writer, group)
        writer.flush()  # type: ignore[no-untyped-call]
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def forms(groups: list[Group]) -> list[str]:
    rows = []
    for name, form, compression in (
        ("a block of rows, Protobuf, zstd (chosen)", as_blocks, CompressionType.ZSTD),
        ("a block of rows, Protobuf, lz4", as_blocks, CompressionType.LZ4),
        ("a block of rows, Protobuf, not compressed", as_blocks, CompressionType.NONE),
        ("one row, Protobuf, zstd", as_rows, CompressionType.ZSTD),
        ("one row, JSON, zstd", as_json, CompressionType.ZSTD),
    ):
        size = len(written(groups, form, compression))
        cost = timed(lambda form=form, compression=compression: written(groups, form, compression))  # type: ignore[misc]
        rows.append([name, f"{size / SECONDS / 1000:.2f}", f"{1e3 * cost / SECONDS:.3f}"])
    return table(["a message holds", "kB for each second of the run", "ms to write it"], rows)


# ---- the size of groups ----------------------------------------------------------------------------------------------


def cut(groups: list[Group], parts: int) -> list[Group]:
    """The same rows in so many groups."""
    whole = {
        name: reduce(joined, [group[name] for group in groups if name in group])
        for name in {n for g in groups for n in g}
    }
    ends = {name: np.linspace(0, len(block), parts + 1).astype(int) for name, block in whole.items()}
    return [
        {
            name: block.part(int(ends[name][part]), int(ends[name][part + 1]))
            for name, block in whole.items()
            if ends[name][part] < ends[name][part + 1]
        }
        for part in range(parts)
    ]


def sizes(groups: list[Group], folder: Path) -> list[str]:
    rows = []
    for steps in (100, 1_000, 5_000, 30_000):
        some = cut(groups, round(SECONDS / PERIOD_S / steps))
        waited: list[float] = []

        def write(some: list[Group] = some, waited: list[float] = waited) -> None:
            with (folder / "record.mcap").open("wb", buffering=0) as file:
                writer = RecordWriter(file, "it")
                for group in some:
                    rows = {name: block.rows() for name, block in group.items()}
                    begun = time.perf_counter()
                    writer.write(rows, 0.0)
                    waited.append(time.perf_counter() - begun)
                writer.finish()

        cost = timed(write)
        size = (folder / "record.mcap").stat().st_size
        chunk = size / len(some)
        name = f"{steps:,}" + (" (chosen)" if steps == 5_000 else "")
        per_second = size / SECONDS / 1000
        each_ms, waits_ms = 1e3 * cost / len(some), 1e3 * statistics.median(waited)
        rows.append([name, f"{chunk / 1000:,.0f}", f"{per_second:.2f}", f"{each_ms:.1f}", f"{waits_ms:.3f}"])
    heading = ["steps in a chunk", "kB of a chunk", "kB for each second of the run", "ms for a chunk, fsync included"]
    return table([*heading, "ms that the run waits"], rows)


# ---- the overview ----------------------------------------------------------------------------------------------------


def points(result: RunResult, folder: Path) -> list[str]:
    rows = []
    for count in (2_000, 20_000, 200_000):
        overview.POINTS = count

        def draw() -> None:
            fresh = dataclasses.replace(result)
            picture.write(fresh, folder / "run.png")
            replay.write([fresh], folder / "replay.html")

        cost = timed(draw)
        size = (folder / "replay.html").stat().st_size
        shown = min(count, result.record.ticks)
        name = f"{shown:,}" + (" (chosen)" if count == 20_000 else " (all)" if shown < count else "")
        rows.append([name, f"{cost:.2f}", f"{size / 1e6:.1f}"])
    return table(["points", "s for figures, picture and page", "MB of the page"], rows)


# ---- all -------------------------------------------------------------------------------------------------------------


def groups_of(file: IO[bytes]) -> Iterator[Group]:
    for kept in RecordReader(file, "it").groups():
        yield dict(unpacked(packed(block, name)) for name, block in kept.group.items())


def printed() -> str:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        result = boebot.run("wander", seconds=SECONDS, period=PERIOD_S, out=folder / "run")
        with (folder / "run" / "record.mcap").open("rb") as file:
            groups = list(groups_of(file))
        lines = [*forms(groups), *sizes(groups, folder), *points(result, folder)]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser("python -m tools.record_choices", description="Costs of forms of a record.")
    parser.add_argument("--page", type=Path, help=f"page whose end, after {MARK.strip()}, is printed anew")
    page = parser.parse_args().page
    text = printed()
    if page is None:
        print(text, end="")
    else:
        before = page.read_text(encoding="utf-8")
        page.write_text(before[: before.index(MARK) + len(MARK)] + text, encoding="utf-8")


if __name__ == "__main__":
    main()
