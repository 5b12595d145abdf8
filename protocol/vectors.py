"""Golden frames of every message: protocol/vectors/frames.json, and the same as a C header for the firmware's tests."""

from __future__ import annotations

import random

import reference_frame
import schema


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
    doc = "the golden frames of protocol/vectors/frames.json for the C tests."
    return schema.c_header("vectors.h", doc, [*lines, "};"])
