"""The C headers of the schema: values, messages, parameters, and the table of the checksum."""

from __future__ import annotations

import zlib

import schema

DIRECTIONS = ("to_board", "to_host")


def values_header(spec: schema.Schema) -> str:
    """firmware/src/generated/values.h"""
    lines: list[str] = []
    for name, flags in spec.flags.items():
        lines += ["", f"/* {flags.doc} */"]
        lines += [
            f"#define {name.upper()}_{bit.upper()} 0x{1 << i:X}u" + c_comment(flags.docs.get(bit, ""))
            for i, bit in enumerate(flags.bits)
        ]
    for name, enum in spec.enum.items():
        lines += ["", f"/* {enum.doc} */", "enum {"]
        upper = str if name == "task" else str.upper  # TASK_session, as in tasks.def
        lines += [
            f"  {name.upper()}_{upper(value)} = {i}," + c_comment(enum.docs.get(value, ""))
            for i, value in enumerate(enum.values)
        ]
        lines += [f"  {name.upper()}_COUNT"]
        lines += ["};"]
    return schema.c_header(
        "values.h", "the flags and values that messages speak of, from protocol/messages.toml.", lines
    )


def messages_header(spec: schema.Schema) -> str:
    """firmware/src/generated/messages.h"""
    lines = [
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
                comment = field.comment
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
    lines += continued("#define MESSAGE_LIST(X)", rows)
    doc = "the layout of every message of the protocol, from protocol/messages.toml."
    return schema.c_header("messages.h", doc, lines)


def parameters_header(spec: schema.Schema) -> str:
    """firmware/src/generated/parameters.h"""
    lines = ["", "#include <stdint.h>", ""]
    for p in spec.parameter:
        unit = schema.unit_per_count(p.scale, p.unit)
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
    lines += continued("#define PARAMETER_LIST(X)", rows)
    devices = [f"  X({name.upper()}, {first})" for name, first in spec.devices_parameters.items()]
    lines += [
        "",
        "/* X(NAME, first bit) for each that holds 16 of the DEVICES_... bits, and all of these in one number. */",
    ]
    lines += [*continued("#define DEVICES_LIST(X)", devices), f"typedef uint{16 * len(devices)}_t device_set;"]
    return schema.c_header("parameters.h", "the run-time parameters, from protocol/messages.toml.", lines)


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
    doc = "the remainder of each byte in CRC-21, in the top 21 of 24 bits."
    return schema.c_header("crc21_table.h", doc, lines)


def c_comment(text: str) -> str:
    """Behind a line of C, if there is one."""
    return f" /* {text} */" if text else ""


def continued(head: str, rows: list[str]) -> list[str]:
    """The lines of a macro, each but the last continued."""
    width = max(len(row) for row in [*rows, head]) + 1
    return [*[row.ljust(width) + "\\" for row in [head, *rows[:-1]]], rows[-1]]
