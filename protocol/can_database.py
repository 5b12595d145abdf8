"""The CAN database boebot.dbc: the messages as CAN frames of at most 8 data bytes (PROTOCOL.md, "On CAN").

A message's fields are packed in their order, each into the frame before it where it still fits, else into a new one; so
the data of a message's frames, one after another, are its payload. A text is cut into chunks of 8 bytes. Flags become
one signal for each bit, the bits without a name one more. Identifiers are ordered by urgency:

    bits 10..8  delivery class, the most urgent first     bit 7  0: to the board, 1: to the host
    bits 6..3   the message among those of its class and direction, in order of ids     bits 2..0  frame of the message
"""

from __future__ import annotations

from typing import NamedTuple

import schema

# The most urgent first: on a CAN bus the lowest identifier wins.
URGENCY = ("stop", "set_point", "exactly_once", "telemetry", "handshake")
DATA_BYTES = 8
NAME_LENGTH = 32  # longest name that the format allows
NODES = {"to_board": ("HOST", "BOARD"), "to_host": ("BOARD", "HOST")}  # direction -> sender, receiver


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


class CanFrame(NamedTuple):
    """One CAN frame of a message; `part` counts from 0."""

    identifier: int
    name: str
    part: int
    size: int
    signals: list[Signal]


def frames(spec: schema.Schema, message: schema.Message) -> list[CanFrame]:
    """The CAN frames of a message."""
    packed: list[tuple[int, list[Signal]]] = [(0, [])]
    for size, signals in pieces(spec, message):
        used, _ = packed[-1]
        if used + size > DATA_BYTES:
            packed.append((0, []))
            used = 0
        packed[-1][1].extend(signal._replace(start=signal.start + 8 * used) for signal in signals)
        packed[-1] = (used + size, packed[-1][1])
    first = first_identifier(spec, message)
    if len(packed) > 8:
        raise ValueError(f"message {message.name}: {len(packed)} CAN frames, but identifiers have room for 8")
    return [
        CanFrame(first + part, message.name if len(packed) == 1 else f"{message.name}_{part + 1}", part, size, signals)
        for part, (size, signals) in enumerate(packed)
    ]


def first_identifier(spec: schema.Schema, message: schema.Message) -> int:
    """The identifier of the message's first CAN frame."""
    alike = [m.id for m in spec.message if (m.delivery, m.direction) == (message.delivery, message.direction)]
    place = sorted(alike).index(message.id)
    if place > 15:
        raise ValueError(f"message {message.name}: more than 16 of its class and direction")
    return (URGENCY.index(message.delivery) + 1) << 8 | (message.direction == "to_host") << 7 | place << 3


def pieces(spec: schema.Schema, message: schema.Message) -> list[tuple[int, list[Signal]]]:
    """What must not be split: bytes, and the signals in them."""
    found: list[tuple[int, list[Signal]]] = []
    for field in message.fields:
        if field.text_length:
            found += text_chunks(field)
        elif field.flags:
            found.append((field.size, flag_bits(spec, field)))
        else:
            found.append((field.size, [number_signal(spec, field)]))
    return found


def number_signal(spec: schema.Schema, field: schema.Field) -> Signal:
    """An integer field with its scale, unit, range and named values."""
    values = spec.enum[field.enum].values if field.enum else []
    least, greatest = (round(count * field.scale, 9) for count in (field.least, field.greatest))
    signed = field.type.startswith("i")
    return Signal(field.name, 0, 8 * field.size, signed, field.scale, least, greatest, field.unit, field.doc, values)


def flag_bits(spec: schema.Schema, field: schema.Field) -> list[Signal]:
    """A flags field, bit by bit, and what is left of it."""
    flags = spec.flags[field.flags]
    bits = [
        Signal(f"{field.name}_{bit}", i, 1, False, 1.0, 0, 1, "", field.doc or flags.doc, [])
        for i, bit in enumerate(flags.bits)
    ]
    spare = 8 * field.size - len(bits)
    if spare:
        doc = "bits without a name"
        bits.append(Signal(f"{field.name}_spare", len(bits), spare, False, 1.0, 0, 2**spare - 1, "", doc, []))
    return bits


def text_chunks(field: schema.Field) -> list[tuple[int, list[Signal]]]:
    """A text as integers of up to 8 bytes, the first byte lowest."""
    chunks = []
    for part, start in enumerate(range(0, field.text_length, DATA_BYTES)):
        size = min(DATA_BYTES, field.text_length - start)
        doc = "; ".join(filter(None, (field.doc, f"UTF-8 from byte {start} on, the first byte lowest")))
        signal = Signal(f"{field.name}_{part + 1}", 0, 8 * size, False, 1.0, 0, 2 ** (8 * size) - 1, "", doc, [])
        chunks.append((size, [signal]))
    return chunks


def number(value: float) -> str:
    """A number as short as it can be written, without an exponent."""
    return str(int(value)) if float(value).is_integer() else f"{value:.9f}".rstrip("0")


def database(spec: schema.Schema) -> str:
    """protocol/boebot.dbc"""
    rows = sorted(((f, m) for m in spec.message for f in frames(spec, m)), key=lambda row: row[0].identifier)
    lines = [f'VERSION "{spec.version}"', "", "NS_ :", "", "BS_:", "", "BU_: BOARD HOST", ""]
    for frame, message in rows:
        lines += [*frame_lines(frame, message), ""]
    lines += [comment("", "Made by protocol/generate.py from protocol/messages.toml; do not edit.")]
    for frame, message in rows:
        lines += [comment(f"BO_ {frame.identifier} ", message.doc)]
        lines += [comment(f"SG_ {frame.identifier} {s.name} ", s.doc) for s in frame.signals if s.doc]
    lines += attributes(spec, rows)
    for frame, _ in rows:
        lines += [value_table(frame, signal) for signal in frame.signals if signal.values]
    return "\n".join(lines) + "\n"


def frame_lines(frame: CanFrame, message: schema.Message) -> list[str]:
    """BO_ and SG_ of one CAN frame."""
    sender, receiver = NODES[message.direction]
    for name in (frame.name, *(signal.name for signal in frame.signals)):
        if len(name) > NAME_LENGTH:
            raise ValueError(f"message {message.name}: {name} is longer than {NAME_LENGTH} characters")
    lines = [f"BO_ {frame.identifier} {frame.name}: {frame.size} {sender}"]
    for s in frame.signals:
        limits = f"[{number(s.least)}|{number(s.greatest)}]"
        place = f"{s.start}|{s.bits}@1{'-' if s.signed else '+'}"
        lines.append(f' SG_ {s.name} : {place} ({number(s.scale)},0) {limits} "{s.unit}" {receiver}')
    return lines


def comment(owner: str, text: str) -> str:
    """A CM_ line."""
    quoted = text.replace('"', "'")
    return f'CM_ {owner}"{quoted}";'


def attributes(spec: schema.Schema, rows: list[tuple[CanFrame, schema.Message]]) -> list[str]:
    """What the format has no field for: the message behind a CAN frame, its class, the schema's hash."""
    classes = ",".join(f'"{name}"' for name in URGENCY)
    lines = [
        'BA_DEF_ "SchemaHash" STRING ;',
        'BA_DEF_ BO_ "MessageId" INT 0 255;',
        'BA_DEF_ BO_ "Part" INT 0 7;',
        f'BA_DEF_ BO_ "Delivery" ENUM {classes};',
        'BA_DEF_DEF_ "SchemaHash" "";',
        'BA_DEF_DEF_ "MessageId" 0;',
        'BA_DEF_DEF_ "Part" 0;',
        f'BA_DEF_DEF_ "Delivery" "{URGENCY[0]}";',
        f'BA_ "SchemaHash" "0x{spec.hash:08X}";',
    ]
    for frame, message in rows:
        lines.append(f'BA_ "MessageId" BO_ {frame.identifier} {message.id};')
        lines.append(f'BA_ "Part" BO_ {frame.identifier} {frame.part};')
        lines.append(f'BA_ "Delivery" BO_ {frame.identifier} {URGENCY.index(message.delivery)};')
    return lines


def value_table(frame: CanFrame, signal: Signal) -> str:
    """A VAL_ line."""
    values = " ".join(f'{i} "{name}"' for i, name in enumerate(signal.values))
    return f"VAL_ {frame.identifier} {signal.name} {values} ;"
