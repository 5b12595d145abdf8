"""The laser range finder of a robot without a board (section 1.7)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from boebot.devices.laser import Laser
from sim_bridge.devices.catalogue import Model, SensorKind, modelled, place_of
from sim_bridge.vehicles.checked_structs import HEADING, NOT_NEGATIVE, POSITIVE, TURN, Range


def _fan(values: Mapping[str, Any]) -> str:
    step, rays = values["step"], values["rays"]
    if rays > 1 and not step > 0.0:
        return f"step is {step:g}; expected a number more than 0, with {rays} rays"
    if not step * (rays - 1) < 2 * math.pi:
        return f"step is {step:g}; expected a fan of {rays} rays of less than a turn"
    return ""


LASER = SensorKind(
    "laser",
    {"heading": HEADING, "first": TURN, "step": NOT_NEGATIVE, "rays": Range(1, 4096)}
    | {"range": POSITIVE, "sigma": NOT_NEGATIVE},
    _fan,
)


@modelled(Laser)
def laser(device: Laser, name: str, model: Model) -> None:
    """A fan of rays."""
    model.sensor(
        "laser",
        name,
        period=device.period_s,
        **place_of(device, device.height_m),
        first=-device.step_rad * (device.rays - 1) / 2,
        step=device.step_rad,
        rays=device.rays,
        range=device.range_m,
        sigma=device.sigma,
    )
