"""Variants for one experiment: bundled robots with some devices or lengths changed, and arenas written down for it.

Not an experiment itself. Robots follow docs/reference/notes.md except where a variant says otherwise; arenas have the
keys of docs/reference/arenas.md.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.device import Device
from boebot.devices.infrared import InfraredProximity
from boebot.devices.motor import RegulatedMotor
from boebot.navigation import Lattice, LineMap

SMALL_RADIUS, SMALL_SPEED = 0.07, 0.17  # m, of a Boe-Bot; m/s at motor signal 1, of its servos
NARROW_RAD = 0.3324  # directions of IR sensors that also see what lies ahead; arsim's own ±0.7854 rad leave it out


def varied(
    robot: str, name: str, body: Mapping[str, Any] | None = None, **devices: Device | Mapping[str, Any]
) -> RobotDescription:
    """A bundled robot under another name.

    Args:
        body: keys of its body to be changed.
        devices: keys to change of its devices, or whole devices to replace or add.
    """
    described = load_robot(robot)
    changed = {
        device: new if isinstance(new, Device) else msgspec.structs.replace(described.device[device], **new)
        for device, new in devices.items()
    }
    return msgspec.structs.replace(
        described,
        name=name,
        body=msgspec.structs.replace(described.body, **(body or {})),
        device=described.device | changed,
    )


def at_angle(radius: float, angle: float) -> dict[str, Any]:
    """Keys of a sensor on a round body's rim that looks outwards (m, rad), (3.9)."""
    return {"position_m": (radius * math.cos(angle), radius * math.sin(angle)), "heading_rad": angle}


def narrow_arsim() -> RobotDescription:
    """The notes' robot with its IR sensors at ±0.3324 rad."""
    radius = load_robot("arsim").body.radius_m
    left, right = at_angle(radius, NARROW_RAD), at_angle(radius, -NARROW_RAD)
    return varied("arsim", "arsim-narrow", infrared_left=left, infrared_right=right)


def small_arsim(full_speed: float = SMALL_SPEED, **devices: Device) -> RobotDescription:
    """arsim in the size of a Boe-Bot (docs/reference/notes.md), one IR sensor ahead and one at -60 degrees.

    Args:
        full_speed: m/s at motor signal 1.
        devices: more of them.
    """
    sensor = partial(InfraredProximity, range_m=0.8, c1_m2=0.012, c2=0.02, sigma=0.03)
    motor = RegulatedMotor(gain_n_s=1.2, torque_maximum_n_m=0.268)
    body = {
        "mass_kg": 0.6,
        "inertia_kg_m2": 1.2e-3,
        "radius_m": SMALL_RADIUS,
        "track_width_m": 0.105,
        "wheel_radius_m": 0.0333,
        "wheel_mass_kg": 0.03,
        "wheel_inertia_kg_m2": 1.7e-5,
        "angular_damping_n_m_s": 0.004,
        "wheel_speed_maximum_m_s": full_speed,
    }
    return varied(
        "arsim",
        "arsim-small",
        body,
        motor_left=motor,
        motor_right=motor,
        infrared_left=sensor(**at_angle(SMALL_RADIUS, 0.0)),
        infrared_right=sensor(**at_angle(SMALL_RADIUS, -1.0472)),
        **devices,
    )


def exact_roller() -> RobotDescription:
    """The bundled robot, with odometry that does not drift."""
    return varied("roller", "roller-exact", odometer={"sigma_step_m": 0.0})


def poses_on(lattice: Lattice, chance: np.random.Generator, count: int) -> list[tuple[float, float, float]]:
    """In free cells, under any heading (m, m, rad)."""
    cells = np.argwhere(lattice.free)
    places = [lattice.centre((int(row), int(column))) for row, column in cells[chance.integers(len(cells), size=count)]]
    return [(x, y, float(chance.uniform(-math.pi, math.pi))) for x, y in places]


@contextmanager
def arena_file(name: str, text: str) -> Iterator[Path]:
    """A file of an arena of that TOML text, for as long as it is needed."""
    with tempfile.TemporaryDirectory(prefix="boebot-") as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(f'name = "{name}"\n{text}', encoding="utf-8")
        yield path


@contextmanager
def scaled_arena(name: str, scale: float) -> Iterator[str | Path]:
    """A bundled arena with its lengths times `scale`, for as long as it is needed."""
    if scale == 1:
        yield name
        return
    plan = LineMap.of(name)
    text = "".join(
        f"[[{kind}]]\ncorners_m = {np.round(scale * shape, 9).tolist()}\n"
        for kind, shapes in (("outline", plan.outlines), ("obstacle", plan.obstacles))
        for shape in shapes
    )
    with arena_file(f"{name}-small", text) as path:
        yield path
