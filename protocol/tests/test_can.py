"""The CAN database: cantools reads it strictly, it says what the schema says, and it carries every golden message."""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import cantools.database
import pytest
from cantools.database.can import Database, Message, Signal

PROTOCOL = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PROTOCOL))

import can_database  # noqa: E402
import schema  # noqa: E402

GOLDEN = json.loads((PROTOCOL / "vectors" / "frames.json").read_text())
SCHEMA = schema.load()
MESSAGES = {message.name: message for message in SCHEMA.message}
URGENCY = ["stop", "set_point", "exactly_once", "telemetry", "handshake"]


@cache
def database() -> Database:
    loaded = cantools.database.load_file(PROTOCOL / "boebot.dbc", strict=True)
    assert isinstance(loaded, Database)
    return loaded


def attribute(message: Message, name: str) -> Any:
    assert message.dbc is not None
    return message.dbc.attributes[name].value


def delivery(frame: Message) -> str:
    dbc = database().dbc
    assert dbc is not None
    return str(dbc.attribute_definitions["Delivery"].choices[int(attribute(frame, "Delivery"))])


def parts(message: schema.Message) -> list[Message]:
    """The CAN frames that say that they belong to the message, in order."""
    mine = [frame for frame in database().messages if attribute(frame, "MessageId") == message.id]
    return sorted(mine, key=lambda frame: int(attribute(frame, "Part")))


def signals(message: schema.Message) -> dict[str, list[tuple[int, Signal]]]:
    """field -> its signals, each with the place of its lowest bit in the payload."""
    found: dict[str, list[tuple[int, Signal]]] = {field.name: [] for field in message.fields}
    before = 0
    for frame in parts(message):
        for signal in frame.signals:
            owner = max((name for name in found if f"{signal.name}_".startswith(f"{name}_")), key=len)
            found[owner].append((8 * before + signal.start, signal))
        before += frame.length
    return found


def counts(message: schema.Message, payload: bytes) -> dict[str, Any]:
    """The scaled value of each signal of the message, from the payload's bits, for cantools to encode."""
    bits = int.from_bytes(payload, "little")
    values: dict[str, Any] = {}
    for rows in signals(message).values():
        for place, signal in rows:
            raw = bits >> place & (1 << signal.length) - 1
            if signal.is_signed and raw >> signal.length - 1:
                raw -= 1 << signal.length
            values[signal.name] = raw * signal.scale if signal.scale != 1 else raw
    return values


@pytest.mark.parametrize("message", SCHEMA.message, ids=lambda message: message.name)
def test_every_bit_of_every_field_is_there_once(message: schema.Message) -> None:
    assert sum(frame.length for frame in parts(message)) == message.length
    assert all(frame.length <= 8 for frame in parts(message))
    offset = 0
    for field in message.fields:
        covered = sorted(
            bit for place, signal in signals(message)[field.name] for bit in range(place, place + signal.length)
        )
        assert covered == list(range(8 * offset, 8 * (offset + field.size))), field.name
        offset += field.size


@pytest.mark.parametrize("message", SCHEMA.message, ids=lambda message: message.name)
def test_integers_keep_scale_unit_range_names_and_explanations(message: schema.Message) -> None:
    found = signals(message)
    for field in message.fields:
        if field.text_length or field.flags:
            continue
        ((_, signal),) = found[field.name]
        assert signal.name == field.name
        assert signal.is_signed == (field.type[0] == "i") and signal.byte_order == "little_endian"
        assert signal.scale == pytest.approx(field.scale) and signal.offset == 0
        assert (signal.unit or "") == field.unit
        assert signal.minimum == pytest.approx(field.least * field.scale)
        assert signal.maximum == pytest.approx(field.greatest * field.scale)
        assert (signal.comment or "") == field.doc
        names = {int(i): str(name) for i, name in (signal.choices or {}).items()}
        assert names == (dict(enumerate(SCHEMA.enum[field.enum].values)) if field.enum else {})


def test_flags_are_bits_with_their_names() -> None:
    seen = 0
    for message in SCHEMA.message:
        for field in (field for field in message.fields if field.flags):
            rows = sorted(signals(message)[field.name], key=lambda row: row[0])
            names = [signal.name.removeprefix(f"{field.name}_") for _, signal in rows if signal.length == 1]
            bits = SCHEMA.flags[field.flags].bits
            assert names[: len(bits)] == bits
            seen += 1
    assert seen == 4  # devices, whiskers, infrared, status


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: f"{golden['message']}-{golden['sequence']}")
def test_golden_message_goes_through_the_database_and_back(golden: dict[str, Any]) -> None:
    message, payload = MESSAGES[golden["message"]], bytes.fromhex(golden["payload"])
    values = counts(message, payload)
    data = b""
    for frame in parts(message):
        mine = {signal.name: values[signal.name] for signal in frame.signals}
        data += frame.encode(mine, strict=True)
    assert data == payload
    decoded: dict[str, Any] = {}
    at = 0
    for frame in parts(message):
        part = frame.decode(payload[at : at + frame.length], decode_choices=False, allow_truncated=False)
        assert isinstance(part, dict)
        decoded.update(part)
        at += frame.length
    assert decoded == pytest.approx(values)
    for field in message.fields:
        rows = signals(message)[field.name]
        if field.text_length:
            text = b"".join(int(decoded[s.name]).to_bytes(s.length // 8, "little") for _, s in rows)
            assert text.rstrip(b"\0").decode() == golden["fields"][field.name]
        elif field.flags:
            first = rows[0][0]
            assert sum(int(decoded[s.name]) << place - first for place, s in rows) == golden["fields"][field.name]
        else:
            assert decoded[field.name] == pytest.approx(golden["fields"][field.name] * field.scale)


def test_identifiers_go_by_urgency_and_are_unlike() -> None:
    frames = sorted(database().messages, key=lambda frame: frame.frame_id)
    assert len({frame.frame_id for frame in frames}) == len(frames)
    assert all(frame.frame_id < 2**11 and not frame.is_extended_frame for frame in frames)
    order = [URGENCY.index(delivery(frame)) for frame in frames]
    assert order == sorted(order) and set(order) == set(range(5))
    for message in SCHEMA.message:
        assert {delivery(frame) for frame in parts(message)} == {message.delivery}


@pytest.mark.parametrize("message", SCHEMA.message, ids=lambda message: message.name)
def test_nodes_and_explanation(message: schema.Message) -> None:
    sender, receiver = ("HOST", "BOARD") if message.direction == "to_board" else ("BOARD", "HOST")
    for frame in parts(message):
        assert frame.senders == [sender]
        assert all(signal.receivers == [receiver] for signal in frame.signals)
        assert frame.comment == message.doc


def test_the_hash_of_the_schema_stands_in_it() -> None:
    dbc = database().dbc
    assert dbc is not None and dbc.attributes["SchemaHash"].value == f"0x{SCHEMA.hash:08X}"


def test_a_message_of_too_many_parts_is_refused() -> None:
    long = schema.Message("long", 0x70, "to_board", "telemetry", "", [schema.Field("text", "text[65]")])
    spec = schema.Schema(SCHEMA.version, 0, SCHEMA.flags, SCHEMA.enum, [*SCHEMA.message, long], [])
    with pytest.raises(ValueError, match="long: 9 CAN frames"):
        can_database.frames(spec, long)
