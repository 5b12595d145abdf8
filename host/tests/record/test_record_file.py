"""Tests of a record on disk: what was written is read, wherever the file is cut, and by somebody else's reader."""

from __future__ import annotations

import io
import re
import struct
import time
import tracemalloc
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from boebot.record.blocks import Block, Group, Kept, packed, schema, unpacked
from boebot.record.record import PLAIN, InMemory, Record
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


def read(data: bytes) -> RecordReader:
    return RecordReader(io.BytesIO(data), "it").read()


def rows_of(groups: Sequence[Group | Kept]) -> dict[str, list[tuple[float, bytes]]]:
    found: dict[str, list[tuple[float, bytes]]] = {}
    for group in groups:
        for stream, block in (group.group if isinstance(group, Kept) else group).items():
            found.setdefault(stream, []).extend(block.rows())
    return found


GROUPS = [
    {"telemetry": Block.of([(k + i / 100, struct.pack("<I", i)) for i in range(20)]), "command": Block.of([(k, b"go")])}
    for k in range(6)
]


@given(ROWS)
def test_block_is_what_it_was_made_of(rows: list[tuple[float, bytes]]) -> None:
    stream, block = unpacked(packed(Block.of(rows), "truth"))
    assert (stream, block.rows()) == ("truth", rows) and len(block) == len(rows)


@given(st.binary(max_size=200))
def test_bytes_that_are_no_block_are_refused(data: bytes) -> None:
    try:
        _, block = unpacked(data)
    except ValueError:
        return
    assert sum(len(row) for _, row in block.rows()) == len(block.data)


def test_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    reader = read(data)
    groups = list(reader.groups())
    assert rows_of(groups) == rows_of(GROUPS)
    assert [kept[:3] for kept in groups] == [(k, max(k - 1, 0), k) for k in range(6)]
    assert not reader.found.is_cut and not reader.found.damages and reader.found.whole_bytes < len(data)
    assert reader.found.attachments == {"begin.json": b"{}", "end.json": b'{"ended": "complete"}'}


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


def test_record_cut_anywhere_is_read_up_to_its_last_whole_group(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    begins = chunks(data)
    ends = [begin + 9 + int.from_bytes(data[begin + 1 : begin + 9], "little") for begin in begins]
    for size in sorted({*range(8, len(data), 9), *range(begins[1], begins[2] + 70)}):
        reader = read(data[:size])
        found = list(reader.groups())
        assert reader.found.is_cut and not reader.found.damages
        assert len(found) == sum(end <= size for end in ends)
        assert rows_of(found) == rows_of(GROUPS[: len(found)])
        assert set(reader.found.attachments) <= {"begin.json", "end.json"} and reader.found.whole_bytes <= size


def chunks(data: bytes) -> list[int]:
    """Where they begin: 37 B before the name of their compression."""
    return [match.start() - 37 for match in re.finditer(rb"\x04\0\0\0zstd", data) if data[match.start() - 37] == 6]


def test_another_reader_of_the_format_finds_every_stream(tmp_path: Path) -> None:
    reader = make_reader(io.BytesIO(write(tmp_path / "record.mcap", GROUPS)), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None and summary.statistics.message_count == 12
    assert [one.data for one in summary.schemas.values()] == [schema()]
    found = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    assert [(topic, time) for topic, time, _ in found[:3]] == [("telemetry", 0), ("command", 0), ("telemetry", 10**9)]
    assert unpacked(found[0][2])[1].rows() == GROUPS[0]["telemetry"].rows()


@pytest.mark.parametrize("size", [0, 3, 8])
def test_beginning_of_a_record_is_a_record_that_is_cut(size: int) -> None:
    reader = read(b"\x89MCAP0\r\n"[:size])
    assert list(reader.groups()) == [] and reader.found.is_cut


def test_a_changed_bit_is_noticed_wherever_it_is(tmp_path: Path) -> None:
    """And what is sound elsewhere is read: of a group and an attachment at most one is lost."""
    data = write(tmp_path / "record.mcap", GROUPS)
    for place in range(8, len(data), 19):
        changed = bytearray(data)
        changed[place] ^= 1 << place % 8
        found = read(bytes(changed)).found
        assert found.damages or (found.is_cut and place >= len(data) - 8), place
        groups = list(read(bytes(changed)).groups())
        assert rows_of(groups) == rows_of([GROUPS[kept.number] for kept in groups])
        assert len(groups) + len(found.attachments) >= 7, place


def test_changed_bit_is_noticed_in_a_record_that_is_cut(tmp_path: Path) -> None:
    """It has no CRC of all; each chunk has its own, and what that does not cover changes no row."""
    data = write(tmp_path / "record.mcap", GROUPS)
    begins = chunks(data)
    noticed = []
    for place in range(begins[1], begins[4], 5):
        changed = bytearray(data[: begins[5] + 50])
        changed[place] ^= 1 << place % 8
        reader = read(bytes(changed))
        assert reader.found.is_cut
        noticed.append(bool(reader.found.damages))
        assert noticed[-1] or rows_of(list(reader.groups())) == rows_of(GROUPS[:5]), place
    assert sum(noticed) > len(noticed) / 2


def test_damage_is_named_with_its_place_and_time(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    begins = [*chunks(data), data.index(b"end.json") - 29]
    holes = {  # of zeros: from and to, what is said of it, groups that are left
        (begins[2] + 20, begins[3] - 20): (begins[2], begins[3], "1.00 s to 2.00 s", (0, 1, 3, 4, 5)),
        (begins[2] - 40, begins[3] + 9): (begins[2], begins[4], "1.00 s to 3.00 s", (0, 1, 4, 5)),
        (begins[5] + 9, begins[5] + 29): (begins[5], begins[6], "4.00 s to its end", (0, 1, 2, 3, 4)),
    }
    for (begin, end), (first, last, span, left) in holes.items():
        reader = read(data[:begin] + bytes(end - begin) + data[end:])
        (damage,) = reader.found.damages
        assert str(damage) == f"bytes {first:,} to {last:,}: the run from {span} is lost"
        assert tuple(kept.number for kept in reader.groups()) == left
        before = list(reader.groups(up_to_damage=True))
        assert rows_of(before) == rows_of(GROUPS[: len(before)]) and len(before) == (5 if first == begins[5] else 2)
    changed = data.replace(b'"complete"', b'"completd"')
    (damage,) = read(changed).found.damages
    assert "attachment 'end.json' is lost" in str(damage) and set(read(changed).found.attachments) == {"begin.json"}


def test_group_that_is_missing_or_there_twice_is_noticed(tmp_path: Path) -> None:
    """Though all that is there is sound, as in a record that was mended."""
    data = write(tmp_path / "record.mcap", GROUPS)
    begins = chunks(data)
    third = data[begins[2] : begins[3]]
    (missing,) = read(data[: begins[2]] + data[begins[3] : begins[5]]).found.damages
    assert str(missing).endswith("the run from 1.00 s to 2.00 s is lost")
    twice = read(data[: begins[3]] + third + data[begins[3] : begins[5]])
    assert twice.found.damages and rows_of(list(twice.groups())) == rows_of(GROUPS[:5])
    footer = data[-37:]  # and nothing between it and the chunk, not even the chunk's index
    (missing,) = read(data[: begins[3] - 2 * 31] + footer).found.damages
    assert str(missing).endswith("the run from 2.00 s to its end is lost")


def test_checksum_of_nothing_is_none(tmp_path: Path) -> None:
    """MCAP lets a writer say 0, for no CRC: of ours that is a wrong one."""
    data = bytearray(write(tmp_path / "record.mcap", GROUPS))
    crc = chunks(bytes(data))[2] + 33
    data[crc : crc + 4] = bytes(4)
    assert [kept.number for kept in read(bytes(data)).groups()] == [0, 1, 3, 4, 5]
    end = data.index(b"end.json") - 29
    after = end + 9 + int.from_bytes(data[end + 1 : end + 9], "little")
    data[after - 4 : after] = bytes(4)
    assert set(read(bytes(data)).found.attachments) == {"begin.json"}


def test_damage_that_comes_while_a_record_is_used_is_an_error(tmp_path: Path) -> None:
    """Figures were announced as those of a whole record."""
    data = write(tmp_path / "record.mcap", GROUPS)
    file = io.BytesIO(data)
    reader = RecordReader(file, "run/record.mcap").read()
    file.getbuffer()[chunks(data)[3] + 60] ^= 4
    with pytest.raises(RecordError, match=r"run/record\.mcap is damaged: bytes .* from 2\.00 s to 3\.00 s is lost"):
        list(reader.groups())


def test_lengths_that_a_record_claims_take_no_memory(tmp_path: Path) -> None:
    data = write(tmp_path / "record.mcap", GROUPS)
    chunk, attachment = chunks(data)[1], data.index(b"end.json") - 29
    frame = data.index(b"\x28\xb5\x2f\xfd", chunk)  # of zstd
    claims = {  # place, bytes: of a record, the data in an attachment, the name of one, a chunk, what it unpacks to
        attachment + 1: (1 << 62).to_bytes(8, "little"),
        attachment + 25 + 4 + 8 + 4 + 16: (1 << 62).to_bytes(8, "little"),
        attachment + 25: b"\xff\xff\xff\x7f",
        chunk + 1: (1 << 28).to_bytes(8, "little"),
        chunk + 25: (1 << 40).to_bytes(8, "little"),
        frame + 4: b"\xe0" + (1 << 38).to_bytes(8, "little"),
        len(data) - 28: (1 << 63).to_bytes(8, "little"),
    }
    read(data)  # imports are done
    tracemalloc.start()
    try:
        for place, claim in claims.items():
            assert read(data[:place] + claim + data[place + len(claim) :]).found.damages
        assert tracemalloc.get_traced_memory()[1] < 8e6
    finally:
        tracemalloc.stop()


def test_file_full_of_beginnings_is_read_in_time(tmp_path: Path) -> None:
    """Each of them claims all that follows."""
    head = write(tmp_path / "record.mcap", GROUPS)[:200]
    claim = b"\x09" + (1 << 20).to_bytes(8, "little") + bytes(16)
    begun = time.process_time()
    assert read(head + claim * 40_000 + b"\x89MCAP0\r\n").found.damages
    assert time.process_time() - begun < 10


def test_other_file_is_refused() -> None:
    with pytest.raises(RecordError, match=r"notes\.txt is no record of a run; expected an MCAP file"):
        RecordReader(io.BytesIO(b"# Notes\n"), "notes.txt")


def test_chunk_larger_than_any_of_ours_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boebot.record.record_file.LARGEST_CHUNK", 1 << 20)
    from mcap.writer import Writer

    bomb = io.BytesIO()
    writer: Any = Writer(bomb, chunk_size=1 << 40)
    writer.start()
    channel = writer.register_channel("x", "protobuf", writer.register_schema("boebot.Block", "protobuf", schema()))
    writer.add_message(channel, 0, bytes((1 << 20) + 1), 0)
    writer.finish()
    reader = read(bomb.getvalue())
    assert list(reader.groups()) == [] and reader.found.damages


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
def test_full_disk_is_one_sentence() -> None:
    with Path("/dev/full").open("wb", buffering=0) as full:
        writer = RecordWriter(full, "run/record.mcap")
        with pytest.raises(RecordError, match=r"cannot be written to run/record\.mcap: No space left on device"):
            write_all(writer, GROUPS * 20)


def test_record_in_memory_is_packed_and_read_as_it_came() -> None:
    record = Record()
    groups = [GROUPS[k % 6] for k in range(3 * PLAIN)]
    for group in groups:
        for stream, block in group.items():
            for time_s, data in block.rows():
                record.append(stream, time_s, data)
        record.keep(0.0)
    record.append("command", 6.0, b"last")
    assert record.count("command") == 3 * PLAIN + 1 and record.count("telemetry") == 60 * PLAIN
    rows = rows_of(groups)
    assert record.rows("telemetry") == rows["telemetry"]
    assert record.rows("command") == [*rows["command"], (6.0, b"last")]
    assert record.span("command") == (0.0, 6.0)


def test_each_of_several_robots_finds_its_own_rows_and_the_worlds() -> None:
    shared = InMemory()
    one, two = (Record(shared, f"robot-{number}/") for number in (1, 2))
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
    (kept,) = read(data).groups()
    assert kept.group["truth"].times.tobytes() == times.tobytes()
    assert kept.group["truth"].rows()[1] == (times[1], b"\x02\x03")
