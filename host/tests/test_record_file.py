"""Tests of a record on disk: what was written is read, wherever the file is cut, and by somebody else's reader."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from boebot.record.blocks import Block, Group, packed, schema, unpacked
from boebot.record.keepers import InMemory, Shared, Temporary
from boebot.record.record import Record
from boebot.record.record_file import RecordError, RecordReader, RecordWriter

ROWS = st.lists(st.tuples(st.floats(allow_nan=False), st.binary(max_size=40)), min_size=1, max_size=40)


def write(path: Path, groups: Sequence[Group]) -> bytes:
    with path.open("wb") as file:
        write_all(RecordWriter(file, str(path)), groups)
    return path.read_bytes()


def write_all(writer: RecordWriter, groups: Sequence[Group]) -> None:
    writer.attach("begin.json", b"{}")
    for number, group in enumerate(groups):
        writer.write(group, number)
    writer.attach("end.json", b'{"ended": "complete"}')
    writer.finish()


def rows_of(groups: Sequence[Group]) -> dict[str, list[tuple[float, bytes]]]:
    found: dict[str, list[tuple[float, bytes]]] = {}
    for group in groups:
        for stream, block in group.items():
            found.setdefault(stream, []).extend(block.rows())
    return found


GROUPS = [
    {"telemetry": Block.of([(k + i / 100, struct.pack("<I", i)) for i in range(20)]), "command": Block.of([(k, b"go")])}
    for k in range(6)
]


@given(ROWS)
def test_block_is_what_it_was_made_of(rows: list[tuple[float, bytes]]) -> None:
    block = unpacked(packed(Block.of(rows)))
    assert block.rows() == rows and len(block) == len(rows)


@given(st.binary(max_size=200))
def test_bytes_that_are_no_block_are_refused(data: bytes) -> None:
    try:
        block = unpacked(data)
    except ValueError:
        return
    assert sum(len(row) for _, row in block.rows()) == len(block.data)


def test_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    reader = RecordReader(io.BytesIO(data), "it")
    assert rows_of(list(reader.groups())) == rows_of(GROUPS)
    assert not reader.is_cut and reader.whole_bytes < len(data)
    assert reader.attachments == {"begin.json": b"{}", "end.json": b'{"ended": "complete"}'}


def test_what_cannot_be_written_for_whatever_reason_is_said_and_what_is_before_it_stays_whole(tmp_path: Path) -> None:
    path = tmp_path / "record.mcap"
    with path.open("wb") as file:
        writer = RecordWriter(file, "it")
        writer.write(GROUPS[0], 0.0)
        writer.attach("name\udcff", b"")  # no UTF-8
        with pytest.raises(RecordError, match=r"^the record cannot be written to it: UnicodeEncodeError: "):
            writer.finish()
    assert rows_of(list(RecordReader(io.BytesIO(path.read_bytes()), "it").groups())) == rows_of(GROUPS[:1])


def test_record_that_was_deleted_meanwhile_is_an_error(tmp_path: Path) -> None:
    with (tmp_path / "record.mcap").open("wb") as file:
        writer = RecordWriter(file, "it")
        (tmp_path / "record.mcap").unlink()
        with pytest.raises(RecordError, match="it was deleted"):
            writer.finish()


def test_record_cut_at_every_byte_is_read_up_to_its_last_whole_group(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    ends = []  # of each group in the file
    whole = RecordReader(io.BytesIO(data), "it")
    for _group in whole.groups():
        ends.append(whole.whole_bytes)
    for size in range(8, len(data)):
        reader = RecordReader(io.BytesIO(data[:size]), "it")
        found = list(reader.groups())
        assert reader.is_cut
        assert len(found) == sum(end <= size for end in ends)
        assert rows_of(found) == rows_of(GROUPS[: len(found)])
        assert set(reader.attachments) <= {"begin.json", "end.json"} and reader.whole_bytes <= size


def test_another_reader_of_the_format_finds_every_stream(tmp_path: Path) -> None:
    reader = make_reader(io.BytesIO(write(tmp_path / "record.mcap", GROUPS)), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None and summary.statistics.message_count == 12
    assert [one.data for one in summary.schemas.values()] == [schema()]
    found = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    assert [(topic, time) for topic, time, _ in found[:3]] == [("telemetry", 0), ("command", 0), ("telemetry", 10**9)]
    assert unpacked(found[0][2]).rows() == GROUPS[0]["telemetry"].rows()


@pytest.mark.parametrize("size", [0, 3])
def test_beginning_of_a_record_is_a_record_that_is_cut(size: int) -> None:
    reader = RecordReader(io.BytesIO(b"\x89MCAP0\r\n"[:size]), "it")
    assert list(reader.groups()) == [] and reader.is_cut


def test_damaged_group_ends_the_record(tmp_path: Path) -> None:
    data = bytearray(write(tmp_path / "record.mcap", GROUPS))
    first = RecordReader(io.BytesIO(bytes(data)), "it")
    next(iter(first.groups()))
    data[first.whole_bytes + 200] ^= 1  # within the chunk of the second one
    reader = RecordReader(io.BytesIO(bytes(data)), "it")
    assert rows_of(list(reader.groups())) == rows_of(GROUPS[:1]) and reader.is_cut


def test_other_file_is_refused() -> None:
    with pytest.raises(RecordError, match=r"notes\.txt is no record of a run; expected an MCAP file"):
        RecordReader(io.BytesIO(b"# Notes\n"), "notes.txt")


def test_chunk_larger_than_any_of_ours_is_not_unpacked(tmp_path: Path) -> None:
    from mcap.writer import Writer

    bomb = io.BytesIO()
    writer: Any = Writer(bomb, chunk_size=1 << 40)
    writer.start()
    channel = writer.register_channel("x", "protobuf", writer.register_schema("boebot.Block", "protobuf", schema()))
    writer.add_message(channel, 0, bytes((1 << 28) + 1), 0)
    writer.finish()
    reader = RecordReader(bomb, "it")
    assert list(reader.groups()) == [] and reader.is_cut


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_full_disk_is_one_sentence() -> None:
    with Path("/dev/full").open("wb", buffering=0) as full:
        writer = RecordWriter(full, "run/record.mcap", sync=False)
        with pytest.raises(RecordError, match=r"cannot be written to run/record\.mcap: No space left on device"):
            write_all(writer, GROUPS * 20)


@pytest.mark.parametrize("in_memory_s", [0.0, 60.0])
def test_record_without_a_folder_is_in_memory_first_and_then_on_disk(
    in_memory_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("boebot.record.keepers.IN_MEMORY_S", in_memory_s)
    record = Record(Temporary())
    for group in GROUPS:
        for stream, block in group.items():
            for time_s, data in block.rows():
                record.append(stream, time_s, data)
        record.keep(0.0)
    record.append("command", 6.0, b"last")
    assert record.count("command") == 7 and record.count("telemetry") == 120
    rows = rows_of(GROUPS)
    assert record.rows("telemetry") == rows["telemetry"]
    assert record.rows("command") == [*rows["command"], (6.0, b"last")]
    assert record.span("telemetry") == (0.0, 5.19)


def test_each_of_several_robots_finds_its_own_rows_and_the_worlds() -> None:
    shared = InMemory()
    one, two = (Record(Shared(shared, number)) for number in (1, 2))
    one.append("command", 1.0, b"one")
    one.append("waits", 1.0, b"world")
    two.append("command", 2.0, b"two")
    for record in (one, two):
        record.keep(0.0)
    assert (one.rows("command"), two.rows("command")) == ([(1.0, b"one")], [(2.0, b"two")])
    assert one.rows("waits") == two.rows("waits") == [(1.0, b"world")]


def test_times_keep_every_bit(tmp_path: Path) -> None:
    times = np.nextafter(np.arange(5.0), 10.0)
    block = Block(times, bytes(range(10)), np.array([2], dtype=np.uint32))
    data = write(tmp_path / "record.mcap", [{"truth": block}])
    (group,) = RecordReader(io.BytesIO(data), "it").groups()
    assert group["truth"].times.tobytes() == times.tobytes()
    assert group["truth"].rows()[1] == (times[1], b"\x02\x03")
