"""Makes everything that follows from messages.toml and robots/*.toml, by Python's standard library alone.

    python protocol/generate.py            makes what is built, and is not in git
    python protocol/generate.py --pages    writes what is in git, for it is read there
    python protocol/generate.py --check    exits 1 and names each file in git that is stale

Built: the C headers in firmware/src/generated, the Python module host/boebot/link/messages.py, and the stub
host/boebot/devices/attributes.pyi (attributes.py). `make`, setup.py, PlatformIO and pytest begin with it; a file that
would be the same is left alone. In git: the golden vectors protocol/vectors/frames.json, the CAN database
protocol/boebot.dbc, and the tables of PROTOCOL.md.
"""

from __future__ import annotations

import sys

if sys.version_info < (3, 11):  # noqa: UP036  # PlatformIO may run on an older one
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    sys.exit(f"protocol/generate.py: expected Python 3.11 or newer; {sys.executable} is {version}")

import argparse
import json
import os
import random
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

import attributes  # noqa: E402
import can_database  # noqa: E402
import device_header  # noqa: E402
import reference_frame  # noqa: E402
import robot_files  # noqa: E402
import schema  # noqa: E402

DIRECTIONS = ("to_board", "to_host")
STATUS_NOTE = "Made by protocol/generate.py; do not edit."


def number(value: float) -> str:
    """A number as short as it can be written."""
    return str(int(value)) if float(value).is_integer() else repr(float(value))


# ---- C ---------------------------------------------------------------------------------------------------------------


def values_header(spec: schema.Schema) -> str:
    """firmware/src/generated/values.h"""
    lines = [
        "/* values.h: the flags and values that messages speak of, from protocol/messages.toml.",
        f" * {STATUS_NOTE} */",
        "#ifndef GENERATED_VALUES_H",
        "#define GENERATED_VALUES_H",
    ]
    for name, flags in spec.flags.items():
        lines += ["", f"/* {flags.doc} */"]
        lines += [
            f"#define {name.upper()}_{bit.upper()} (1u << {i})" + c_comment(flags.docs.get(bit, ""))
            for i, bit in enumerate(flags.bits)
        ]
    for name, enum in spec.enum.items():
        lines += ["", f"/* {enum.doc} */", "enum {"]
        lines += [
            f"  {name.upper()}_{value.upper()} = {i}," + c_comment(enum.docs.get(value, ""))
            for i, value in enumerate(enum.values)
        ]
        lines += [f"  {name.upper()}_COUNT"]
        lines += ["};"]
    return "\n".join([*lines, "", "#endif", ""])


def messages_header(spec: schema.Schema) -> str:
    """firmware/src/generated/messages.h"""
    lines = [
        "/* messages.h: the layout of every message of the protocol, from protocol/messages.toml.",
        f" * {STATUS_NOTE} */",
        "#ifndef GENERATED_MESSAGES_H",
        "#define GENERATED_MESSAGES_H",
        "",
        "#include <stdbool.h>",
        "#include <stdint.h>",
        "",
        '#include "generated/values.h"',
        "",
        f"#define PROTOCOL_VERSION 0x{spec.version_byte:02X}u /* {spec.version}.{spec.minor} */",
        f"#define PROTOCOL_MAJOR(version) ((version) / {schema.MINORS}u)",
        f"#define SCHEMA_HASH 0x{spec.hash:08X}ul",
    ]
    for direction in DIRECTIONS:
        longest = max(m.length for m in spec.of_direction(direction))
        lines.append(f"#define MESSAGE_PAYLOAD_MAX_{direction.upper()} {longest}u /* bytes */")
    for message in spec.message:
        upper = message.name.upper()
        lines += ["", f"/* {message.doc} */", f"#define MSG_{upper}_ID 0x{message.id:02X}u"]
        lines += [f"#define MSG_{upper}_LENGTH {message.length}u"]
        if message.fields:
            lines += ["typedef struct __attribute__((packed)) {"]
            for field in message.fields:
                ctype = "char" if field.text_length else schema.INTEGERS[field.type][1]
                size = f"[{field.text_length}]" if field.text_length else ""
                comment = field_comment(field)
                lines.append(f"  {ctype} {field.name}{size};" + (f" /* {comment} */" if comment else ""))
            lines += [f"}} msg_{message.name};"]
        for field in message.fields:
            if field.min is not None or field.max is not None:
                lines.append(f"#define MSG_{upper}_{field.name.upper()}_MIN ({field.least})")
                lines.append(f"#define MSG_{upper}_{field.name.upper()}_MAX ({field.greatest})")
    for direction in DIRECTIONS:
        lines += [
            "",
            f"/* Payload bytes of a message {direction.replace('_', ' the ')}, or -1 if there is no such message. */",
            f"static inline int16_t message_length_{direction}(uint8_t id) {{",
            "  switch (id) {",
        ]
        for message in spec.of_direction(direction):
            lines += [f"    case MSG_{message.name.upper()}_ID:", f"      return MSG_{message.name.upper()}_LENGTH;"]
        lines += ["    default:", "      return -1;", "  }", "}"]
    lines += [
        "",
        "/* Whether the message belongs to the handshake, whose checksums start from the constant seed. */",
        "static inline bool message_is_handshake(uint8_t id) {",
        "  switch (id) {",
        *[f"    case MSG_{m.name.upper()}_ID:" for m in spec.message if m.delivery == "handshake"],
        "      return true;",
        "    default:",
        "      return false;",
        "  }",
        "}",
        "",
        "/* X(id, payload bytes, hash) for each message, in order of ids. */",
        f"#define MESSAGE_COUNT {len(spec.message)}u",
    ]
    rows = [
        f"  X(0x{m.id:02X}, {m.length}, 0x{spec.message_hash(m):08X}ul)"
        for m in sorted(spec.message, key=lambda m: m.id)
    ]
    lines += [*continued("#define MESSAGE_LIST(X)", rows), "", "#endif", ""]
    return "\n".join(lines)


def c_comment(text: str) -> str:
    """Behind a line of C, if there is one."""
    return f" /* {text} */" if text else ""


def continued(head: str, rows: list[str]) -> list[str]:
    """The lines of a macro, each but the last continued."""
    width = max(len(row) for row in [*rows, head]) + 1
    return [*[row.ljust(width) + "\\" for row in [head, *rows[:-1]]], rows[-1]]


def field_comment(field: schema.Field) -> str:
    """Unit, scale and explanation of a field in one phrase."""
    unit = field.unit if field.scale == 1.0 else f"{number(field.scale)} {field.unit}"
    return "; ".join(part for part in (unit, field.flags or field.enum, field.doc) if part)


def parameters_header(spec: schema.Schema) -> str:
    """firmware/src/generated/parameters.h"""
    lines = [
        "/* parameters.h: the run-time parameters, from protocol/messages.toml.",
        f" * {STATUS_NOTE} */",
        "#ifndef GENERATED_PARAMETERS_H",
        "#define GENERATED_PARAMETERS_H",
        "",
    ]
    for p in spec.parameter:
        unit = p.unit if p.scale == 1.0 else f"{number(p.scale)} {p.unit}"
        lines.append(f"#define PARAMETER_{p.name.upper()} {p.id}u /* {unit}: {p.doc} */")
    table = ",".join(f"{p.id} {p.name} {p.type} {p.min} {p.max}" for p in spec.parameter)
    lines += [f"#define PARAMETER_COUNT {len(spec.parameter)}u"]
    lines += [
        f"#define PARAMETER_TABLE 0x{zlib.crc32(table.encode()) & 0xFFFF:04X}u /* differs for another table */",
        "",
    ]
    lines += ["/* X(NAME, type, min, max, default) for each; a DEFAULT_... is the robot's, from its pins header. */"]
    rows = []
    for p in spec.parameter:
        default = str(p.default) if not p.default_from and p.default is not None else f"DEFAULT_{p.name.upper()}"
        rows.append(f"  X({p.name.upper()}, {p.type}, {p.min}, {p.max}, {default})")
    lines += [*continued("#define PARAMETER_LIST(X)", rows), "", "#endif", ""]
    return "\n".join(lines)


CRC21_POLYNOMIAL = 0x1DBF6F


def crc21_header() -> str:
    """firmware/src/generated/crc21_table.h"""
    entries = []
    for byte in range(256):
        register = byte << 16
        for _ in range(8):
            register = register << 1 ^ (CRC21_POLYNOMIAL << 3 | 1 << 24 if register & 0x800000 else 0)
        entries.append(register)
    lines = [
        "/* crc21_table.h: the remainder of each byte in CRC-21, in the top 21 of 24 bits.",
        f" * {STATUS_NOTE} */",
        "#ifndef GENERATED_CRC21_TABLE_H",
        "#define GENERATED_CRC21_TABLE_H",
        "",
        "#include <stdint.h>",
        "",
        "#ifdef __AVR__",
        "#include <avr/pgmspace.h>",
        "#define CRC21_IN_FLASH __attribute__((__progmem__))",
        "#else",
        "#define CRC21_IN_FLASH",
        "#endif",
    ]
    for name, shift in (("HIGH", 16), ("MIDDLE", 8), ("LOW", 0)):
        lines += ["", f"static const uint8_t CRC21_{name}[256] CRC21_IN_FLASH = {{"]
        for row in range(0, 256, 16):
            lines.append("  " + " ".join(f"0x{entry >> shift & 0xFF:02X}," for entry in entries[row : row + 16]))
        lines += ["};"]
    return "\n".join([*lines, "", "#endif", ""])


def pin_map_header(robots: list[robot_files.Robot]) -> str:
    """firmware/src/generated/pin_map.h"""
    lines = [
        "/* pin_map.h: the pin map that this image is built for, chosen by a -DPIN_MAP_...",
        f" * {STATUS_NOTE} */",
    ]
    for robot in robots:
        condition = "if" if robot is robots[0] else "elif"
        lines += [f"#{condition} defined({pin_map_macro(robot)})", f'#include "generated/{pins_file(robot)}"']
    options = ", ".join(f"-D{pin_map_macro(robot)}" for robot in robots)
    return "\n".join([*lines, "#else", f'#error "choose a pin map: {options}"', "#endif", ""])


def pin_map_macro(robot: robot_files.Robot) -> str:
    """shieldbot-basic -> PIN_MAP_SHIELDBOT_BASIC"""
    return f"PIN_MAP_{robot.pin_map.replace('-', '_').upper()}"


def pins_file(robot: robot_files.Robot) -> str:
    """Name of the robot's pin header."""
    return f"pins_{robot.pin_map.replace('-', '_')}.h"


def pins_header(spec: schema.Schema, robot: robot_files.Robot) -> str:
    """firmware/src/generated/pins_<map>.h"""
    guard = f"GENERATED_PINS_{robot.pin_map.upper().replace('-', '_')}_H"
    lines = [
        f"/* {pins_file(robot)}: pin map and defaults of the {robot.table['title']}, from protocol/robots.",
        f" * {STATUS_NOTE} */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        f'#define ROBOT_NAME "{robot.table["name"]}"',
        f'#define PIN_MAP_NAME "{robot.pin_map}"',
    ]
    for name in robot.devices:
        for role, pin in robot.pins(name).items():
            full = "_".join(part.upper() for part in (name, role) if part)
            port, bit = ("D", pin) if pin < 8 else ("B", pin - 8) if pin < 14 else ("C", pin - 14)
            lines += ["", f"#define PIN_{full} {pin}"]
            lines += [f"#define {full}_PORT PORT{port}", f"#define {full}_DDR DDR{port}"]
            lines += [f"#define {full}_PINR PIN{port}", f"#define {full}_BIT {bit}"]
    encoder_lines = len(robot.pins("encoder_left")) if "encoder_left" in robot.devices else 0
    lines += ["", f"#define ENCODER_LINES {encoder_lines} /* of each wheel */"]
    lines += [
        "",
        "/* Devices bits of what the map has pins for. */",
        f"#define DEVICES_BUILT {devices_built(spec, robot)}",
    ]
    lines += ["", "/* Defaults of the parameters, in counts of their scale. */"]
    lines.append(f"#define DEFAULT_DEVICES {devices_default(spec, robot)}")
    for p in spec.parameter:
        if p.default_from:
            lines.append(f"#define DEFAULT_{p.name.upper()} {default_counts(p, robot)}")
    lines += ["", "#endif", ""]
    return "\n".join(lines)


def devices_default(spec: schema.Schema, robot: robot_files.Robot) -> int:
    """The devices bits of what the robot has switched on."""
    return sum(1 << i for i, device in enumerate(spec.flags["devices"].device) if robot.has(device))


def devices_built(spec: schema.Schema, robot: robot_files.Robot) -> int:
    """The devices bits of what the robot's map gives pins to, on or off, on one side at least."""
    sides = [{device, device.replace("_left", "_right")} for device in spec.flags["devices"].device]
    return sum(1 << i for i, either in enumerate(sides) if either & set(robot.devices))


def default_counts(parameter: schema.Parameter, robot: robot_files.Robot) -> int:
    """The parameter's default for that robot in counts: what the robot says, or else the parameter's own."""
    value = robot.value(parameter.default_from)
    counts = parameter.default if value is None else round(value / parameter.scale)
    if counts is None:
        raise ValueError(f"{robot.file}: {parameter.default_from} is missing")
    if not parameter.min <= counts <= parameter.max:
        raise ValueError(f"{robot.file}: {parameter.default_from} is outside the range of parameter {parameter.name}")
    return counts


# ---- Python ----------------------------------------------------------------------------------------------------------


def class_name(name: str) -> str:
    """telemetry -> Telemetry, setpoint_signal -> SetpointSignal"""
    return "".join(part.capitalize() for part in name.split("_"))


def python_module(spec: schema.Schema) -> str:
    """host/boebot/link/messages.py"""
    lines = [
        '"""Every message of the protocol, from protocol/messages.toml: wire integers in, wire integers out.',
        "",
        STATUS_NOTE,
        '"""',
        "",
        "# fmt: off",
        "# ruff: noqa: E501",
        "",
        "from __future__ import annotations",
        "",
        "import struct",
        "from enum import IntEnum, IntFlag",
        "from typing import ClassVar, NamedTuple, Self",
        "",
        f"PROTOCOL_VERSION = 0x{spec.version_byte:02X}  # {spec.version}.{spec.minor}",
        f"SCHEMA_HASH = 0x{spec.hash:08X}",
    ]
    for name, flags in spec.flags.items():
        lines += ["", "", f"class {class_name(name)}(IntFlag):", f'    """{flags.doc}"""', ""]
        lines += [f"    {bit.upper()} = 1 << {i}" for i, bit in enumerate(flags.bits)]
    devices = spec.flags["devices"]
    lines += ["", "", "# The robot's device behind each bit.", "DEVICE_OF_BIT: dict[Devices, str] = {"]
    lines += [f'    Devices.{bit.upper()}: "{name}",' for bit, name in zip(devices.bits, devices.device, strict=True)]
    lines += ["}"]
    lines += [
        "",
        "",
        "class _Values(IntEnum):",
        '    """Values by name; one that a later minor version has added is called by its number."""',
        "",
        "    @classmethod",
        "    def _missing_(cls, value: object) -> _Values | None:",
        "        if not isinstance(value, int):",
        "            return None",
        "        unknown = int.__new__(cls, value)",
        '        unknown._name_, unknown._value_ = f"UNKNOWN_{value}", value',
        "        return unknown",
    ]
    for name, enum in spec.enum.items():
        lines += ["", "", f"class {class_name(name)}(_Values):", f'    """{enum.doc}"""', ""]
        lines += [f"    {value.upper()} = {i}" for i, value in enumerate(enum.values)]
    for message in spec.message:
        lines += python_message(message)
    lines += ["", "", "Message = ("]
    lines += [f"    {'' if i == 0 else '| '}{class_name(m.name)}" for i, m in enumerate(spec.message)]
    lines += [")", "", "MESSAGES: dict[int, type[Message]] = {"]
    lines += [f"    0x{m.id:02X}: {class_name(m.name)}," for m in spec.message]
    lines += ["}", "", "# In which devices speak besides telemetry.", "DEVICE_MESSAGES: tuple[type[Message], ...] = ("]
    lines += [f"    {class_name(m.name)}," for m in spec.message if m.devices and m.name != "telemetry"]
    lines += [")", "", "# id -> hash of the message", "HASHES: dict[int, int] = {"]
    lines += [f"    0x{m.id:02X}: 0x{spec.message_hash(m):08X}," for m in spec.message]
    lines += ["}"]
    lines += ["", "", "class ParameterSpec(NamedTuple):", '    """A run-time parameter of the firmware."""', ""]
    lines += ["    id: int", "    unit: str", "    scale: float  # unit per count", "    minimum: int  # counts"]
    lines += ["    maximum: int  # counts", "    doc: str"]
    lines += [
        '    default_from: str = ""  # key of the robot description that gives the default',
        "    since: int = 0  # minor version",
        "",
        "",
        "PARAMETERS: dict[str, ParameterSpec] = {",
    ]
    for p in spec.parameter:
        row = f'{p.id}, "{p.unit}", {p.scale!r}, {p.min}, {p.max}, "{p.doc}"'
        row += f', "{p.default_from}"' if p.default_from else ""
        row += f", since={p.since}" if p.since else ""
        lines.append(f'    "{p.name}": ParameterSpec({row}),')
    lines += ["}", ""]
    return "\n".join(lines)


def python_message(message: schema.Message) -> list[str]:
    """The class of one message."""
    code = "<" + "".join(field.struct_code for field in message.fields)
    name = class_name(message.name)
    lines = ["", "", f"class _{name}Fields(NamedTuple):"]
    for field in message.fields:
        comment = field_comment(field)
        kind = "bytes" if field.text_length else "int"
        shadows = "  # type: ignore[assignment]" if hasattr(tuple, field.name) else ""
        lines.append(f"    {field.name}: {kind}{shadows}" + (f"  # {comment}" if comment else ""))
    if not message.fields:
        lines.append("    pass")
    return [
        *lines,
        "",
        "",
        f"class {name}(_{name}Fields):",
        f'    """{message.doc}"""',
        "",
        "    __slots__ = ()",
        f"    ID: ClassVar[int] = 0x{message.id:02X}",
        f'    NAME: ClassVar[str] = "{message.name}"',
        f'    DELIVERY: ClassVar[str] = "{message.delivery}"',
        f"    LENGTH: ClassVar[int] = {message.length}",
        f'    STRUCT: ClassVar[struct.Struct] = struct.Struct("{code}")',
        "",
        "    def pack(self) -> bytes:",
        '        """The payload."""',
        "        return self.STRUCT.pack(*self)",
        "",
        "    @classmethod",
        "    def unpack(cls, payload: bytes) -> Self:",
        '        """The message in a payload of exactly its length."""',
        "        return cls(*cls.STRUCT.unpack(payload))",
    ]


# ---- golden vectors --------------------------------------------------------------------------------------------------


def vectors(spec: schema.Schema) -> list[dict[str, object]]:
    """Frames of every message: all zero, all greatest, all least, and three drawn at random."""
    draw = random.Random(20120321)
    out: list[dict[str, object]] = []
    for message in spec.message:
        rows: list[list[object]] = [[0 if not f.text_length else b"" for f in message.fields]]
        rows.append([f.greatest if not f.text_length else b"x" * f.text_length for f in message.fields])
        rows.append([f.least if not f.text_length else b"a" for f in message.fields])
        for _ in range(3):
            rows.append(
                [
                    draw.randint(f.least, f.greatest)
                    if not f.text_length
                    else bytes(draw.randrange(97, 123) for _ in range(draw.randrange(f.text_length + 1)))
                    for f in message.fields
                ]
            )
        for row in rows if message.fields else rows[:1]:
            sequence = draw.randrange(256)
            seed = reference_frame.SEED if message.delivery == "handshake" else draw.randrange(1 << 21)
            payload = b"".join(
                value.ljust(f.text_length, b"\0")
                if isinstance(value, bytes)
                else int(str(value)).to_bytes(f.size, "little", signed=f.type.startswith("i"))
                for f, value in zip(message.fields, row, strict=True)
            )
            out.append(
                {
                    "message": message.name,
                    "id": message.id,
                    "sequence": sequence,
                    "seed": seed,
                    "fields": {
                        f.name: value.decode() if isinstance(value, bytes) else value
                        for f, value in zip(message.fields, row, strict=True)
                    },
                    "payload": payload.hex(),
                    "frame": reference_frame.frame(message.id, sequence, payload, seed).hex(),
                }
            )
    return out


def vectors_header(rows: list[dict[str, object]]) -> str:
    """firmware/src/generated/vectors.h"""
    lines = [
        "/* vectors.h: the golden frames of protocol/vectors/frames.json for the C tests.",
        f" * {STATUS_NOTE} */",
        "#ifndef GENERATED_VECTORS_H",
        "#define GENERATED_VECTORS_H",
        "",
        "#include <stdint.h>",
        "",
        "typedef struct {",
        "  const char *message;",
        "  uint8_t id;",
        "  uint8_t sequence;",
        "  uint32_t seed;",
        "  const char *payload; /* hexadecimal */",
        "  const char *frame;   /* hexadecimal, with both delimiters */",
        "} golden_frame;",
        "",
        "static const golden_frame GOLDEN_FRAMES[] = {",
    ]
    for row in rows:
        head = f"{row['id']}, {row['sequence']}, {row['seed']}"
        lines.append(f'    {{"{row["message"]}", {head}, "{row["payload"]}",')
        lines.append(f'     "{row["frame"]}"}},')
    lines += ["};", "", "#endif", ""]
    return "\n".join(lines)


# ---- tables of PROTOCOL.md -------------------------------------------------------------------------------------------


def tables(spec: schema.Schema) -> str:
    """The message and parameter tables, in Markdown."""
    lines = [
        f"Version {spec.version}.{spec.minor}: `protocol_version` {spec.version_byte}, `schema_hash` "
        f"`0x{spec.hash:08X}`.",
        "",
    ]
    hashes = {m.id: f"{spec.message_hash(m):08X}" for m in spec.message}
    lines += ["| id | message | direction | delivery | payload | hash | meaning |", "|---|---|---|---|---|---|---|"]
    for m in spec.message:
        way = "host → board" if m.direction == "to_board" else "board → host"
        lines.append(
            f"| `0x{m.id:02X}` | `{m.name}` | {way} | {m.delivery} | {m.length} B | `0x{hashes[m.id]}` | {m.doc} |"
        )
    for m in spec.message:
        if not m.fields:
            continue
        lines += ["", f"#### `{m.name}`", "", "| offset | field | type | unit per count | range | meaning |"]
        lines += ["|---|---|---|---|---|---|"]
        offset = 0
        for f in m.fields:
            unit = " ".join(part for part in ("" if f.scale == 1.0 else number(f.scale), f.unit) if part)
            limits = f"{f.least} … {f.greatest}" if f.min is not None or f.max is not None else ""
            meaning = "; ".join(x for x in (f.doc, f"see {f.flags or f.enum}" if f.flags or f.enum else "") if x)
            lines.append(f"| {offset} | `{f.name}` | {f.type} | {unit} | {limits} | {meaning} |")
            offset += f.size
    for name, flags in spec.flags.items():
        lines += ["", f"#### Flags `{name}`", "", flags.doc, "", *named("bit", flags.bits, flags.docs)]
    for name, enum in spec.enum.items():
        lines += ["", f"#### Values `{name}`", "", enum.doc, "", *named("value", enum.values, enum.docs)]
    lines += ["", "#### Parameters", "", "| number | parameter | unit per count | range | default | meaning |"]
    lines += ["|---|---|---|---|---|---|"]
    for p in spec.parameter:
        unit = " ".join(part for part in ("" if p.scale == 1.0 else number(p.scale), p.unit) if part)
        default = str(p.default) if not p.default_from and p.default is not None else "the robot's"
        lines.append(f"| {p.id} | `{p.name}` | {unit} | {p.min} … {p.max} | {default} | {p.doc} |")
    return "\n".join(lines)


def named(head: str, names: list[str], docs: dict[str, str]) -> list[str]:
    """The table of flags or values, with their meanings if there are some."""
    if not docs:
        return [f"| {head} | name |", "|---|---|", *(f"| {i} | `{name}` |" for i, name in enumerate(names))]
    rows = [f"| {i} | `{name}` | {docs.get(name, '')} |" for i, name in enumerate(names)]
    return [f"| {head} | name | meaning |", "|---|---|---|", *rows]


def worked_frame(spec: schema.Schema) -> str:
    """One frame, made step by step."""
    message = next(m for m in spec.message if m.name == "setpoint_coast")
    sequence, seed, payload = 5, 0x12345, bytes([0xFA, 0x00, 0x02, 0x01])
    content = bytes([message.id, sequence]) + payload
    stuffed = reference_frame.cobs(content)
    registers = [reference_frame.crc21(stuffed[: n + 1], seed) for n in range(len(stuffed))]
    check = registers[-1]
    sevens = [check >> shift & 0x7F for shift in (14, 7, 0)]
    wire = reference_frame.frame(message.id, sequence, payload, seed)
    steps = [
        ("message", f"{message.name}, time_to_live 250 ms, answers_tick 258"),
        ("session's seed", f"0x{seed:06X}"),
        ("id, sequence, payload", content.hex(" ")),
        ("stuffed", stuffed.hex(" ")),
        *((f"CRC after {byte:02x}", f"0x{register:06X}") for byte, register in zip(stuffed, registers, strict=True)),
        ("seven bits each", " ".join(f"{part:02x}" for part in sevens)),
        ("c2 c1 c0", " ".join(f"{0x80 | part:02x}" for part in sevens)),
        ("on the wire", wire.hex(" ")),
    ]
    return "\n".join(["```text", *(f"{name:<23}{value}" for name, value in steps), "```"])


BEGIN, END = "<!-- tables: made by generate.py -->", "<!-- end of tables -->"
WORKED_BEGIN, WORKED_END = "<!-- worked frame: made by generate.py -->", "<!-- end of worked frame -->"


def protocol_page(spec: schema.Schema) -> str:
    """PROTOCOL.md with its worked frame and its tables renewed."""
    text = (HERE / "PROTOCOL.md").read_text(encoding="utf-8")
    for begin, end, made in ((WORKED_BEGIN, WORKED_END, worked_frame(spec)), (BEGIN, END, tables(spec))):
        head, rest = text.split(begin)
        text = f"{head}{begin}\n\n{made}\n\n{end}{rest.split(end)[1]}"
    return text


# ---- all together ----------------------------------------------------------------------------------------------------


GENERATED = ROOT / "firmware" / "src" / "generated"


def built() -> dict[Path, str]:
    """Each file that is made when building, and its text."""
    spec = schema.load()
    images = [robot for robot in robot_files.load_all() if robot.has_image]
    headers = {
        "values.h": values_header(spec),
        "crc21_table.h": crc21_header(),
        "messages.h": messages_header(spec),
        "parameters.h": parameters_header(spec),
        "devices.h": device_header.devices_header(spec, STATUS_NOTE),
        "vectors.h": vectors_header(vectors(spec)),
        "pin_map.h": pin_map_header(images),
        **{pins_file(robot): pins_header(spec, robot) for robot in images},
    }
    return {
        **{GENERATED / name: text for name, text in headers.items()},
        ROOT / "host" / "boebot" / "link" / "messages.py": python_module(spec),
        attributes.STUB: attributes.stub(),
    }


def pages() -> dict[Path, str]:
    """Each made file that is in git, and its text."""
    spec = schema.load()
    return {
        HERE / "vectors" / "frames.json": json.dumps(vectors(spec), indent=1) + "\n",
        HERE / "boebot.dbc": can_database.database(spec),
        HERE / "PROTOCOL.md": protocol_page(spec),
    }


def stale(made: dict[Path, str]) -> list[Path]:
    """Those of the files that are missing or have another text."""
    return [path for path, text in made.items() if not path.is_file() or path.read_text("utf-8") != text]


def write(path: Path, text: str) -> None:
    """Writes a file as a whole, for others may read it now."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    partial.write_text(text, "utf-8")
    partial.replace(path)


def main() -> int:
    """Makes the files, or checks them."""
    parser = argparse.ArgumentParser(description="Makes everything that follows from the protocol's schema.")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--pages", action="store_true", help="write the files in git: PROTOCOL.md, vectors, DBC")
    choice.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file in git is stale")
    asked = parser.parse_args()
    made = pages() if asked.pages or asked.check else built()
    for path in stale(made):
        if asked.check:
            print(f"{path.relative_to(ROOT)} is stale; run: python protocol/generate.py --pages")
        else:
            write(path, made[path])
    if not asked.pages and not asked.check:
        for path in set(GENERATED.glob("*.h")) - set(made):  # of a pin map that is no more
            path.unlink(missing_ok=True)
    return 1 if asked.check and stale(made) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ValueError, OSError) as error:
        sys.exit(f"protocol/generate.py: {error}")
