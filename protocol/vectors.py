"""Golden frames of every message: protocol/vectors/frames.json, and the same as a C header for the firmware's tests."""

from __future__ import annotations

import random
import struct
from typing import Any

import reference_frame
import schema


def vectors(spec: schema.Schema) -> list[dict[str, object]]:
    """Frames of every message: all zero, all greatest, all least, and three drawn at random."""
    draw = random.Random(20120321)
    out: list[dict[str, object]] = []
    for message in spec.message:
        rows: list[list[Any]] = [
            [b"" if f.text_length else 0 for f in message.fields],
            [b"x" * f.text_length if f.text_length else f.greatest for f in message.fields],
            [b"a" if f.text_length else f.least for f in message.fields],
            *([_drawn(f, draw) for f in message.fields] for _ in range(3)),
        ]
        for row in rows if message.fields else rows[:1]:
            sequence = draw.randrange(256)
            seed = reference_frame.SEED if message.delivery == "handshake" else draw.randrange(1 << 21)
            payload = struct.pack(message.format, *row)
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


def _drawn(field: schema.Field, draw: random.Random) -> Any:
    if field.text_length:
        return bytes(draw.randrange(97, 123) for _ in range(draw.randrange(field.text_length + 1)))
    return draw.randint(field.least, field.greatest)


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
