"""The board's messages on a CAN bus (protocol/PROTOCOL.md, "On CAN").

    robot ── UART ── bridge ═══ CAN bus ═══ boebot run --on can:BUS, and any CAN tool

`frames` turns messages into CAN frames and back, `translator` the bytes of a serial line. `bus` opens buses by name,
`bridge` puts a board on one, `transport` drives a board through one. `socketcand_server` is a bus of our own.
python-can and can-isotp are imported only where a bus is opened: they are the extra `boebot[can]`.
"""

from boebot.guests import Command

COMMAND = Command("Put a board on a CAN bus, or write the database for CAN tools.", "boebot_can.command:app")
