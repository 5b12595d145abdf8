"""Compasses: the HMC5883L on its bus, and the notes' compass (section 1.8)."""

from __future__ import annotations

from typing import Any

from boebot.devices.compass import HeadingCompass, MagneticCompass
from sim_bridge._core import ffi
from sim_bridge.devices.catalogue import joined, modelled, off
from sim_bridge.devices.part import At, Part
from sim_bridge.devices.sensor import SensorKind
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, TURN
from sim_bridge.vehicles.model import VehicleModel

COMPASS_HORIZONTAL_G = 0.19  # central Europe
COMPASS_DOWN_G = 0.45
COMPASS_SIGMA = 0.01  # 2 mG of noise (data)
COMPASS_BIAS_RAD = 0.05  # of the mounting (chosen)
COMPASS_IRON = 0.2  # (chosen)
COMPASS_PER_AMPERE = 0.05  # (chosen)

SWITCHES = {
    "compass_noise": off("the compass reads the same each time", "COMPASS_SIGMA", "HeadingCompass.sigma_rad"),
    "compass_bias": off(
        "no turned mounting, iron or motor current deflects the compass",
        "COMPASS_BIAS_RAD",
        "COMPASS_IRON",
        "COMPASS_PER_AMPERE",
        "HeadingCompass.bias_rad",
    ),
}

COMPASS = SensorKind("compass", {"sigma": NOT_NEGATIVE, "bias": TURN})


@joined(MagneticCompass)
def part(device: MagneticCompass, at: At) -> Part:
    """The chip on its two-wire bus."""
    return Part("compass_kind", at.number, [device.sda_pin, device.scl_pin], compass_parameters(at.draw))


@modelled(HeadingCompass)
def heading(device: HeadingCompass, name: str, model: VehicleModel) -> None:
    """A heading."""
    model.sensor("compass", name, period=device.period_s, sigma=device.sigma_rad, bias=device.bias_rad)


def compass_parameters(draw: Draw) -> Any:
    """The HMC5883L in C; without noise it is not disturbed by iron and currents either."""
    on = float(draw.noise)
    return ffi.new(
        "hmc5883l_parameters *",
        {
            "field": {
                "sigma": draw["COMPASS_SIGMA"] * on,
                "bias": draw["COMPASS_BIAS_RAD"] * draw(61, 0),
                "iron_x": draw["COMPASS_IRON"] * draw(61, 1),
                "iron_y": draw["COMPASS_IRON"] * draw(61, 2),
                "current_x": draw["COMPASS_PER_AMPERE"] * draw(61, 3),
                "current_y": draw["COMPASS_PER_AMPERE"] * draw(61, 4),
            },
            "horizontal_gauss": COMPASS_HORIZONTAL_G,
            "down_gauss": COMPASS_DOWN_G,
        },
    )
