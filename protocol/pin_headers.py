"""The C headers of the pin maps, with the parameters that each robot begins with."""

from __future__ import annotations

import robot_files
import schema


def pin_map_header(robots: list[robot_files.Robot]) -> str:
    """firmware/src/generated/pin_map.h"""
    lines = [
        "/* pin_map.h: the pin map that this image is built for, chosen by a -DPIN_MAP_...",
        f" * {schema.MADE_NOTE} */",
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
    lines = [
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
    on = devices_default(spec, robot)
    lines += [f"#define DEFAULT_{name.upper()} {on >> i & 0xFFFF}" for name, i in spec.devices_parameters.items()]
    for p in spec.parameter:
        if p.default_from:
            lines.append(f"#define DEFAULT_{p.name.upper()} {default_counts(p, robot)}")
    doc = f"pin map and defaults of the {robot.table['title']}, from protocol/robots."
    return schema.c_header(pins_file(robot), doc, lines)


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
