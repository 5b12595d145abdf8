"""The CAN database boebot.dbc: the frames that can_layout.py lays out, of the board with node number 1, for CAN tools.

A number is one signal with its field's name, scale, unit and range; flags are one signal for each bit, and one for the
bits without a name; a text is cut into signals of up to 6 bytes.
"""

from __future__ import annotations

from typing import NamedTuple

import can_layout
import schema
from can_layout import Frame, Place

NODE = 1  # of the board in protocol/boebot.dbc
NAME_LENGTH = 32  # longest name that the format allows
SENDERS = {"to_board": ("HOST", "BOARD"), "to_host": ("BOARD", "HOST")}  # direction -> sender, receiver
ADDED = {
    "session": "low byte of the session's number, which hello names: what is of another session is dropped",
    "sequence": "of this set-point: telemetry says which one was the last accepted, setpoint_sequence",
    "round": "one more with each message of this kind: frames with the same one belong together",
    "part": "number of this frame among those of its message",
}


class Signal(NamedTuple):
    """Some bits of a CAN frame; `start` is the number of the lowest."""

    name: str
    start: int
    bits: int
    signed: bool
    scale: float
    least: float  # in units
    greatest: float
    unit: str
    doc: str
    values: list[str]


def signals(spec: schema.Schema, frame: Frame) -> list[Signal]:
    """The signals of a frame, the lowest bits first."""
    return [signal for place in frame.places for signal in _of_place(spec, frame, place)]


def _of_place(spec: schema.Schema, frame: Frame, place: Place) -> list[Signal]:
    field = place.field
    if field is None:
        least, greatest = (frame.part, frame.part) if place.name == "part" else (0, 255)
        return [_integer(place, 1.0, least, greatest, doc=ADDED[place.name])]
    if field.flags:
        return _flag_bits(spec, field, place)
    if field.text_length:
        doc = "; ".join(filter(None, (field.doc, f"UTF-8 from byte {place.start} on, the first byte lowest")))
        return [_integer(place, 1.0, 0, 2 ** (8 * place.size) - 1, doc=doc)]
    if place.counts_time_to_live:
        scale = can_layout.TIME_TO_LIVE_MS
        return [_integer(place, scale, 0, field.greatest // scale, field.unit, field.doc)]
    if place.is_low_byte:
        doc = "; ".join(filter(None, (field.doc, "low byte")))
        return [_integer(place, 1.0, 0, 255, field.unit, doc)]
    signal = _integer(place, field.scale, field.least, field.greatest, field.unit, field.doc)
    values = spec.enum[field.enum].values if field.enum else []
    return [signal._replace(signed=field.least < 0, values=values)]


def _integer(place: Place, scale: float, least: int, greatest: int, unit: str = "", doc: str = "") -> Signal:
    """All bytes of a place as one unsigned integer; `least` and `greatest` in counts."""
    low, high = round(least * scale, 9), round(greatest * scale, 9)
    return Signal(place.name, 8 * place.at, 8 * place.size, False, scale, low, high, unit, doc, [])


def _flag_bits(spec: schema.Schema, field: schema.Field, place: Place) -> list[Signal]:
    """A flags field, bit by bit, and what is left of it."""
    flags = spec.flags[field.flags]
    start = 8 * place.at
    bits = [
        Signal(
            f"{field.name}_{bit}", start + i, 1, False, 1.0, 0, 1, "", flags.docs.get(bit) or field.doc or flags.doc, []
        )
        for i, bit in enumerate(flags.bits)
    ]
    spare = 8 * place.size - len(bits)
    if spare:
        name, doc = f"{field.name}_spare", "bits without a name"
        bits.append(Signal(name, start + len(bits), spare, False, 1.0, 0, 2**spare - 1, "", doc, []))
    return bits


# ---- the file --------------------------------------------------------------------------------------------------------


def database(spec: schema.Schema) -> str:
    """protocol/boebot.dbc"""
    rows = [
        (identifier + (NODE << can_layout.NODE_SHIFT), message, frame, signals(spec, frame))
        for identifier, (message, frame) in can_layout.identifiers(spec).items()
    ]
    lines = [f'VERSION "{spec.version}.{spec.minor}"', "", "NS_ :", "", "BS_:", "", "BU_: BOARD HOST", ""]
    for identifier, message, frame, held in rows:
        lines += [*_frame_lines(identifier, message, frame, held), ""]
    lines.append(_comment("", "Made by protocol/generate.py from protocol/messages.toml; do not edit."))
    for identifier, message, _, held in rows:
        lines.append(_comment(f"BO_ {identifier} ", message.doc))
        lines += [_comment(f"SG_ {identifier} {s.name} ", s.doc) for s in held if s.doc]
    lines += _attributes(spec, [(identifier, message, frame) for identifier, message, frame, _ in rows])
    for identifier, _, _, held in rows:
        lines += [_value_table(identifier, signal) for signal in held if signal.values]
    return "\n".join(lines) + "\n"


def _frame_lines(identifier: int, message: schema.Message, frame: Frame, held: list[Signal]) -> list[str]:
    """BO_ and SG_ of one CAN frame."""
    sender, receiver = SENDERS[message.direction]
    for name in (frame.name, *(signal.name for signal in held)):
        if len(name) > NAME_LENGTH:
            raise ValueError(f"message {message.name}: {name} is longer than {NAME_LENGTH} characters")
    lines = [f"BO_ {identifier} {frame.name}: {frame.size} {sender}"]
    for s in held:
        limits = f"[{_number(s.least)}|{_number(s.greatest)}]"
        place = f"{s.start}|{s.bits}@1{'-' if s.signed else '+'}"
        lines.append(f' SG_ {s.name} : {place} ({_number(s.scale)},0) {limits} "{s.unit}" {receiver}')
    return lines


def _number(value: float) -> str:
    """A number as short as it can be written, without an exponent."""
    return str(int(value)) if float(value).is_integer() else f"{value:.9f}".rstrip("0")


def _comment(owner: str, text: str) -> str:
    """A CM_ line."""
    quoted = text.replace('"', "'")
    return f'CM_ {owner}"{quoted}";'


def _attributes(spec: schema.Schema, rows: list[tuple[int, schema.Message, Frame]]) -> list[str]:
    """What the format has no field for: message, part, class and cycle time of each frame, and the schema's hash."""
    classes = ",".join(f'"{name}"' for name in can_layout.CLASSES)
    lines = [
        'BA_DEF_ "SchemaHash" STRING ;',
        'BA_DEF_ BO_ "MessageId" INT 0 255;',
        'BA_DEF_ BO_ "Part" INT 1 16;',
        f'BA_DEF_ BO_ "Class" ENUM {classes};',
        'BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;',
        'BA_DEF_DEF_ "SchemaHash" "";',
        'BA_DEF_DEF_ "MessageId" 0;',
        'BA_DEF_DEF_ "Part" 1;',
        f'BA_DEF_DEF_ "Class" "{can_layout.CLASSES[0]}";',
        'BA_DEF_DEF_ "GenMsgCycleTime" 0;',
        f'BA_ "SchemaHash" "0x{spec.hash:08X}";',
    ]
    for identifier, message, frame in rows:
        lines.append(f'BA_ "MessageId" BO_ {identifier} {message.id};')
        lines.append(f'BA_ "Part" BO_ {identifier} {frame.part};')
        lines.append(f'BA_ "Class" BO_ {identifier} {frame.identifier >> can_layout.CLASS_SHIFT};')
        if message.cycle_ms:
            lines.append(f'BA_ "GenMsgCycleTime" BO_ {identifier} {message.cycle_ms};')
    return lines


def _value_table(identifier: int, signal: Signal) -> str:
    """A VAL_ line."""
    values = " ".join(f'{i} "{name}"' for i, name in enumerate(signal.values))
    return f"VAL_ {identifier} {signal.name} {values} ;"
