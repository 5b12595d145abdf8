"""Messages on CAN: the database says what the schema says, and cantools, the C code that cantools makes from it and the
library make the same bytes."""

from __future__ import annotations

import random
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import can_layout
import cantools.database
import pytest
import schema
from cantools.database.can import Database, Message, Signal
from cantools.database.can.c_source import generate
from cffi import FFI

from boebot.link import messages
from boebot_can.frames import PARTS, Assembler, FrameMaker

DATABASE = Path(__file__).resolve().parents[3] / "protocol" / "boebot.dbc"
SCHEMA = schema.load()
ON_CAN = [message for message in SCHEMA.message if message.can_id]
CLASSES = {"stop": {0}, "set_point": {1}, "exactly_once": {2, 5}, "telemetry": {1, 2, 3, 4, 6}, "handshake": {6}}
each_message = pytest.mark.parametrize("message", ON_CAN, ids=lambda message: message.name)


@cache
def database() -> Database:
    loaded = cantools.database.load_file(DATABASE, strict=True)
    assert isinstance(loaded, Database)
    return loaded


def attribute(frame: Message, name: str) -> Any:
    assert frame.dbc is not None
    found = frame.dbc.attributes.get(name)
    return None if found is None else found.value


def parts(message: schema.Message) -> list[Message]:
    """The CAN frames that say that they belong to the message, in order."""
    mine = [frame for frame in database().messages if attribute(frame, "MessageId") == message.id]
    return sorted(mine, key=lambda frame: int(attribute(frame, "Part")))


def signal(message: schema.Message, name: str) -> Signal:
    """The first signal of that name in a message's frames."""
    return next(one for frame in parts(message) for one in frame.signals if one.name == name)


def test_identifiers_say_urgency_node_and_direction() -> None:
    frames = database().messages
    assert len({frame.frame_id for frame in frames}) == len(frames)
    for frame in frames:
        message = next(m for m in SCHEMA.message if m.id == attribute(frame, "MessageId"))
        assert 0 < frame.frame_id < 0x700 and frame.frame_id >> 5 & 7 == 1
        assert frame.frame_id & 1 == (message.direction == "to_host")
        assert frame.frame_id >> 8 in CLASSES[message.delivery]
        sender, receiver = ("HOST", "BOARD") if message.direction == "to_board" else ("BOARD", "HOST")
        assert frame.senders == [sender] and all(one.receivers == [receiver] for one in frame.signals)
        assert frame.comment == message.doc
        assert (attribute(frame, "GenMsgCycleTime") or 0) == message.cycle_ms
    absent = {message.name for message in SCHEMA.message} - {message.name for message in ON_CAN}
    assert absent == {"identify", "identity"}, "longer than 8 frames, or the question for it"


@each_message
def test_frames_are_full_of_signals_without_gaps(message: schema.Message) -> None:
    for number, frame in enumerate(parts(message), start=1):
        assert frame.length <= 8 and attribute(frame, "Part") == number
        covered = sorted(bit for one in frame.signals for bit in range(one.start, one.start + one.length))
        assert covered == list(range(8 * frame.length))


@each_message
def test_numbers_keep_scale_unit_range_names_and_explanations(message: schema.Message) -> None:
    for field in message.fields:
        if field.text_length or field.flags:
            continue
        found = signal(message, field.name)
        short = message.delivery == "set_point" and field.name == "answers_tick"
        scale = 10 if message.delivery == "set_point" and field.name == "time_to_live" else field.scale
        assert found.is_signed == (field.least < 0) and found.byte_order == "little_endian"
        assert found.scale == pytest.approx(scale) and found.offset == 0
        assert (found.unit or "") == field.unit
        assert found.minimum == pytest.approx(field.least * field.scale)
        assert found.maximum == pytest.approx(255 if short else field.greatest * field.scale)
        assert (found.comment or "").startswith(field.doc)
        names = {int(i): str(name) for i, name in (found.choices or {}).items()}
        assert names == (dict(enumerate(SCHEMA.enum[field.enum].values)) if field.enum else {})


def test_flags_are_bits_with_their_names() -> None:
    seen = set()
    for message in ON_CAN:
        for field in (field for field in message.fields if field.flags):
            lowest = signal(message, f"{field.name}_{SCHEMA.flags[field.flags].bits[0]}").start
            for place, bit in enumerate(SCHEMA.flags[field.flags].bits):
                one = signal(message, f"{field.name}_{bit}")
                assert (one.length, one.start) == (1, lowest + place)
            seen.add(field.flags)
    assert seen == set(SCHEMA.flags)


# ---- bytes -----------------------------------------------------------------------------------------------------------

Pack = Callable[[Message, dict[str, int]], bytes]


@pytest.fixture(scope="module")
def pack_in_c(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    """Packs counts by the C code that cantools makes from the database, as a board with a CAN controller may."""
    folder = tmp_path_factory.mktemp("c")
    header, source, *_ = generate(database(), "boebot", "boebot.h", "boebot.c", "", floating_point_numbers=False)
    (folder / "boebot.h").write_text(header)
    (folder / "boebot.c").write_text(source)
    strict = ["-Wall", "-Wextra", "-Werror", "boebot.c"]
    subprocess.run(["avr-gcc", "-mmcu=atmega328p", "-O0", "-c", *strict, "-o", "avr.o"], cwd=folder, check=True)
    subprocess.run(["cc", "-shared", "-fPIC", *strict, "-o", "boebot.so"], cwd=folder, check=True)
    ffi = FFI()
    for frame in database().messages:
        fields = "".join(f"{_c_type(one)} {one.name};" for one in frame.signals)
        name = f"boebot_{frame.name}"
        ffi.cdef(f"struct {name}_t {{{fields}}}; int {name}_pack(uint8_t *, const struct {name}_t *, size_t);")
    library = ffi.dlopen(str(folder / "boebot.so"))

    def pack(frame: Message, values: dict[str, int]) -> bytes:
        source = ffi.new(f"struct boebot_{frame.name}_t *", values)
        data = ffi.new("uint8_t[8]")
        size = getattr(library, f"boebot_{frame.name}_pack")(data, source, 8)
        assert size == frame.length
        return bytes(ffi.buffer(data, size))

    return pack


def _c_type(one: Signal) -> str:
    bits = next(bits for bits in (8, 16, 32, 64) if one.length <= bits)
    return f"{'' if one.is_signed else 'u'}int{bits}_t"


def fill(message: schema.Message, draw: random.Random) -> dict[str, int | bytes]:
    """Values of its fields, in counts, as CAN carries them."""
    values: dict[str, int | bytes] = {}
    for field in message.fields:
        if field.text_length:
            values[field.name] = draw.randbytes(field.text_length)
        elif message.delivery == "set_point" and field.name == "time_to_live":
            values[field.name] = 10 * draw.randint(1, field.greatest // 10)
        else:
            values[field.name] = draw.choice((field.least, field.greatest, draw.randint(field.least, field.greatest)))
    return values


def counts(
    message: schema.Message, frame: Message, values: dict[str, int | bytes], added: dict[str, int]
) -> dict[str, int]:
    """The count of each signal of a frame, from the values of the message's fields."""
    found = {}
    for one in frame.signals:
        name, _, end = one.name.rpartition("_")
        if one.name in values:
            value = values[one.name]
            assert isinstance(value, int)
            if message.delivery == "set_point" and one.name == "time_to_live":
                value //= 10
            found[one.name] = value if one.is_signed else value & (1 << one.length) - 1
        elif isinstance(text := values.get(name), bytes):
            start = 6 * (int(end) - 1)
            found[one.name] = int.from_bytes(text[start : start + one.length // 8], "little")
        elif one.name in added or one.name == "part":
            found[one.name] = added.get(one.name, attribute(frame, "Part"))
        else:
            found[one.name] = _bit(message, one, values)
    return found


def _bit(message: schema.Message, one: Signal, values: dict[str, int | bytes]) -> int:
    """The count of a flag, or of the bits without a name."""
    field = next(f for f in message.fields if f.flags and one.name.startswith(f"{f.name}_"))
    lowest = signal(message, f"{field.name}_{SCHEMA.flags[field.flags].bits[0]}").start
    value = values[field.name]
    assert isinstance(value, int)
    return value >> one.start - lowest & (1 << one.length) - 1


@each_message
def test_cantools_c_and_the_library_make_the_same_bytes(message: schema.Message, pack_in_c: Pack) -> None:
    draw = random.Random(message.name)
    maker = FrameMaker(1)
    kind: Any = messages.MESSAGES[message.id]
    assembler = Assembler(message.direction == "to_board", frozenset({1}))
    for sequence in range(60):
        session = draw.randrange(1, 1 << 21)
        values = fill(message, draw)
        payload = kind(*values.values()).pack()
        ours = maker.frames(message.id, payload, session, sequence)
        added = {"session": session & 0xFF, "sequence": sequence, "round": sequence + 1}
        assert [frame.identifier for frame in ours] == [frame.frame_id for frame in parts(message)]
        for frame, made in zip(parts(message), ours, strict=True):
            wanted = counts(message, frame, values, added)
            assert frame.encode(wanted, scaling=False, strict=True) == made.data
            assert pack_in_c(frame, wanted) == made.data
            told = frame.decode(made.data, scaling=False, decode_choices=False, allow_truncated=False)
            assert told == wanted
        back = [assembler.add(frame) for frame in ours]
        assert back[:-1] == [None] * (len(ours) - 1) and back[-1] is not None
        assert back[-1].id == message.id
        if message.delivery == "set_point":  # of its tick there is the low byte
            assert back[-1].payload == payload[:-2] + bytes([payload[-2], 0])
            assert back[-1].sequence == sequence
        else:
            assert back[-1].payload == payload


def test_database_in_use_lays_out_what_the_library_does() -> None:
    laid_out = {
        identifier + (1 << can_layout.NODE_SHIFT): frame.size
        for identifier, (_, frame) in can_layout.identifiers(SCHEMA).items()
    }
    assert laid_out == {frame.frame_id: frame.length for frame in database().messages}
    assert set(PARTS) == set(can_layout.identifiers(SCHEMA))


@pytest.mark.parametrize(
    ("can_id", "direction", "sentence"),
    [
        (0x301, "to_board", "expected an even one to the board, an odd one to the host"),
        (0x320, "to_board", "expected one of node 0"),
        (0x700, "to_board", "expected one of node 0 and of a class below 7"),
        (0x31E, "to_board", "run into another class"),
        (0x100, "to_board", "its CAN identifier 0x100 is that of setpoint_signal"),
    ],
)
def test_identifier_that_breaks_the_rules_is_refused(can_id: int, direction: str, sentence: str) -> None:
    fields = [schema.Field("text", "text[12]")]
    wrong = schema.Message("wrong", 0x70, direction, "telemetry", "", fields, can_id=can_id)
    spec = schema.Schema(SCHEMA.version, 0, SCHEMA.flags, SCHEMA.enum, [*SCHEMA.message, wrong], [])
    with pytest.raises(ValueError, match=sentence):
        can_layout.identifiers(spec)
