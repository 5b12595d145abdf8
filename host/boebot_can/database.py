"""The CAN database (DBC) of the protocol's messages, for each node of a bus.

protocol/can_database.py makes it; the package holds that of node 1.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from boebot import resources
from boebot.errors import BoebotError
from boebot.link import messages
from boebot_can.extra import import_extra
from boebot_can.frames import NODE_MASK
from boebot_can.layout import NODE_SHIFT


def of_node(node: int) -> str:
    """The text of the database of the board with that number, 1 to 7."""
    text = (resources.folder("protocol") / "boebot.dbc").read_text("utf-8")
    shift = node - 1 << NODE_SHIFT
    return re.sub(r"\b(BO_|SG_|VAL_) (\d+)\b", lambda found: f"{found[1]} {int(found[2]) + shift}", text)


def check(path: Path) -> int:
    """How many frames a database has that fits this version's messages.

    Raises:
        BoebotError: it cannot be read, or is of another version.
    """
    cantools = import_extra("cantools.database")
    try:
        database = cantools.load_file(path, strict=True)
    except OSError as error:
        raise BoebotError(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except Exception as error:  # parsers of several formats
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise BoebotError(f"{path} is no CAN database: {reason[0]}") from None
    attribute = getattr(getattr(database, "dbc", None), "attributes", {}).get("SchemaHash")
    wanted = f"0x{messages.SCHEMA_HASH:08X}"
    if attribute is None:
        raise BoebotError(
            f"{path} does not name its schema; expected SchemaHash {wanted}, as `boebot can dbc` writes it"
        )
    if attribute.value != wanted:
        raise BoebotError(
            f"{path} is of another version of the protocol: its SchemaHash is {attribute.value}, expected {wanted}; "
            "write it anew with `boebot can dbc`"
        )
    own = cantools.load_string(of_node(1), "dbc", strict=True)
    wrong = sorted(_layout(own) ^ _layout(database))
    if wrong:
        raise BoebotError(
            f"{path} lays out {wrong[0][0]} in another way than this version; write it anew with `boebot can dbc`"
        )
    return len(database.messages)


def _layout(database: Any) -> set[tuple[Any, ...]]:
    """What must agree of each signal, whatever the node."""
    return {
        (
            frame.name,
            frame.frame_id & ~NODE_MASK,
            frame.length,
            one.name,
            one.start,
            one.length,
            one.is_signed,
            one.scale,
        )
        for frame in database.messages
        for one in frame.signals
    }
