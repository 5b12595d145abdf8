"""The tables and the worked frame of PROTOCOL.md."""

from __future__ import annotations

from pathlib import Path

import reference_frame
import schema

PAGE = Path(__file__).with_name("PROTOCOL.md")


def protocol_page(spec: schema.Schema, of_guests: dict[str, str]) -> str:
    """PROTOCOL.md with all that is made renewed; `of_guests`: name of a part -> what a guest makes there."""
    text = PAGE.read_text(encoding="utf-8")
    for name, made in {"worked frame": worked_frame(spec), "tables": tables(spec), **of_guests}.items():
        begin, end = f"<!-- {name}: made by generate.py -->", f"<!-- end of {name} -->"
        head, rest = text.split(begin)
        text = f"{head}{begin}\n\n{made}\n\n{end}{rest.split(end)[1]}"
    return text


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
            unit = schema.unit_per_count(f.scale, f.unit)
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
        unit = schema.unit_per_count(p.scale, p.unit)
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
