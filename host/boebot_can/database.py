"""The CAN database (DBC) of the protocol's messages, for each node of a bus.

generator/can_database.py makes it; the package holds that of node 1. Its attribute SchemaHash says for which version.
"""

from __future__ import annotations

import re

from boebot import resources
from boebot_can.layout import NODE_SHIFT


def of_node(node: int) -> str:
    """The text of the database of the board with that number, 1 to 7."""
    text = (resources.folder("protocol") / "boebot.dbc").read_text("utf-8")
    shift = node - 1 << NODE_SHIFT
    return re.sub(r"\b(BO_|SG_|VAL_) (\d+)\b", lambda found: f"{found[1]} {int(found[2]) + shift}", text)
