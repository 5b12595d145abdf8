"""What CAN has of the protocol, for protocol/generate.py: the module host/boebot_can/layout.py, the database
protocol/boebot.dbc, and the table of CAN frames in PROTOCOL.md."""

from __future__ import annotations

from pathlib import Path

import can_database
import can_layout
import schema

ROOT = Path(__file__).resolve().parents[3]


def built(spec: schema.Schema) -> dict[Path, str]:
    """As of generate.py."""
    return {ROOT / "host" / "boebot_can" / "layout.py": can_module(spec)}


def pages(spec: schema.Schema) -> dict[Path, str]:
    """As of generate.py."""
    return {ROOT / "protocol" / "boebot.dbc": can_database.database(spec)}


def parts(spec: schema.Schema) -> dict[str, str]:
    """As of generate.py."""
    return {"CAN frames": can_frames(spec)}


def can_module(spec: schema.Schema) -> str:
    """host/boebot_can/layout.py"""
    doc = "Which bytes of a message stand in which CAN frame, from protocol/messages.toml by generator/can_layout.py."
    lines = [
        *schema.python_head(doc),
        "",
        "from typing import NamedTuple",
        "",
        f"NODE_SHIFT = {can_layout.NODE_SHIFT}",
        f"TIME_TO_LIVE_MS = {can_layout.TIME_TO_LIVE_MS}  # one count of a set-point's time to live",
        f"ISO_TP_TO_BOARD = 0x{can_layout.ISO_TP_IDS['to_board']:03X}",
        f"ISO_TP_TO_HOST = 0x{can_layout.ISO_TP_IDS['to_host']:03X}",
        "",
        "",
        "class Layout(NamedTuple):",
        '    """The CAN frames of one message."""',
        "",
        "    length: int  # bytes of the payload",
        "    identifiers: tuple[int, ...]  # at node 0, one for each frame",
        "    choices: tuple[bytes, ...]  # each frame's bytes, see below",
        "    payload: bytes  # its bytes by their places in the frames' data, one after another, and NULs behind",
        "    session: int  # where its byte stands there; -1: nowhere",
        "    is_set_point: bool",
        "",
        "",
        "LAYOUTS: dict[int, Layout] = {",
    ]
    for message in spec.message:
        frames = can_layout.frames(message)
        if not frames:
            continue
        choices = "".join(f"bytes({frame.choice}), " for frame in frames)
        identifiers = "".join(f"0x{frame.identifier:03X}, " for frame in frames)
        lines.append(
            f"    0x{message.id:02X}: Layout({message.length}, ({identifiers}), ({choices}), "
            f"bytes({can_layout.payload_choice(message)}), {can_layout.session_place(message)}, "
            f"{message.delivery == 'set_point'}),  # {message.name}"
        )
    return "\n".join([*lines, "}", ""])


def can_frames(spec: schema.Schema) -> str:
    """The table of CAN frames: what each data byte holds."""
    lines = ["| at node 0 | frame | class | data, each with its bytes |", "|---|---|---|---|"]
    for identifier, (_, frame) in can_layout.identifiers(spec).items():
        data = ", ".join(f"`{place.name}` {place.size}" for place in frame.places)
        kind = can_layout.CLASSES[identifier >> can_layout.CLASS_SHIFT]
        lines.append(f"| `0x{identifier:03X}` | `{frame.name}` | {kind} | {data} |")
    return "\n".join(lines)
