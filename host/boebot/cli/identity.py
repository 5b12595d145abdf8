"""`boebot doctor --identity`: who is there. The handshake, firmware, compiler, image, devices, parameters, and the
state of the board."""

from __future__ import annotations

from typing import Any

from boebot.boards import BoardRequest
from boebot.cli import output
from boebot.cli.board_link import board_link
from boebot.description.robots import RobotDescription
from boebot.errors import BoardError
from boebot.link import finding, messages
from boebot.link.frame import text
from boebot.link.link import Link


def show(url: str, robot: RobotDescription, as_json: bool) -> None:
    """Says who is at a port: firmware, compiler, image, devices."""
    with board_link(url, BoardRequest(robot=robot, record=False)) as (link, description):
        hello = link.open()
        identity = link.identity()
        values: dict[str, Any] = {
            "board": description,
            "robot": text(hello.robot),
            "protocol_version": finding.version_name(hello.protocol_version),
            "schema": f"{hello.schema_hash:08x}",
            "firmware": text(identity.firmware_version),
            "compiler": text(identity.compiler),
            "pin_map": text(identity.pin_map),
            "image_size_bytes": identity.image_size or None,
            "image_hash": f"{identity.image_hash:08x}" if identity.image_size else None,
            "tick_rate_hz": hello.tick_rate,
            "telemetry_period_s": round(hello.telemetry_period / hello.tick_rate, 6),
            "session_time_out_s": hello.session_time_out / 1000,
            "boot_counter": hello.boot_counter,
            "reset_cause": finding.reset_in_words(hello.reset_cause),
            "parameters_saved": bool(hello.parameters_saved),
            "devices": [
                device.name.lower() for device in messages.Devices if hello.devices & device and device.name is not None
            ],
        }
        names = [name for name in link.parameters.names if name not in messages.DEVICES_PARAMETERS]
        parameters = {name: round(link.parameters.get(name), 6) for name in names}
        telemetry = _latest(link)
    values["supply_v"] = telemetry.supply / 1000 or None
    values["latch"] = _name(messages.Latch, telemetry.latch)
    values["uptime_s"] = round(telemetry.tick / hello.tick_rate, 2)
    values["status"] = [flag.name.lower() for flag in messages.Status if telemetry.status & flag and flag.name]
    if as_json:
        output.print_json(values | {"parameters": parameters})
        return
    output.print_table(values | {"status": values["status"] or "nothing to report"})
    output.print_table({f"{name}": f"{value:g} {messages.PARAMETERS[name].unit}" for name, value in parameters.items()})


def _latest(link: Link) -> messages.Telemetry:
    for _ in range(50):
        telemetry = link.poll(0.02)
        if telemetry:
            return messages.Telemetry.unpack(telemetry[-1][0])
    raise BoardError(f"the board at {link.transport.name} sends no telemetry")


def _name(kind: type[messages.Latch], value: int) -> str:
    return kind(value).name.lower().replace("_", " ")
