"""Compasses: the HMC5883L on its bus, and the notes' compass (section 1.8)."""

from __future__ import annotations

from typing import Any

from boebot.devices.compass import HeadingCompass, MagneticCompass
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, joined, modelled
from sim_bridge.robots.imperfections import Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, TURN

COMPASS = SensorKind("compass", {"sigma": NOT_NEGATIVE, "bias": TURN})


@joined(MagneticCompass)
def part(device: MagneticCompass, at: At) -> Part:
    """The chip on its two-wire bus."""
    return Part("compass_kind", at.number, [device.sda_pin, device.scl_pin], compass_parameters(at.draw))


@modelled(HeadingCompass)
def heading(device: HeadingCompass, name: str, model: Model) -> None:
    """A heading."""
    model.sensor("compass", name, period=device.period_s, sigma=device.sigma_rad, bias=device.bias_rad)


def compass_parameters(draw: Draw) -> Any:
    """The HMC5883L in C; without noise it is not disturbed by iron and currents either."""
    on = float(draw.noise)
    return ffi.new(
        "hmc5883l_parameters *",
        {
            "field": {
                "sigma": draw["compass_sigma"] * on,
                "bias": draw["compass_bias_rad"] * draw(61, 0),
                "iron_x": draw["compass_iron"] * draw(61, 1),
                "iron_y": draw["compass_iron"] * draw(61, 2),
                "current_x": draw["compass_per_ampere"] * draw(61, 3),
                "current_y": draw["compass_per_ampere"] * draw(61, 4),
            },
            "horizontal_gauss": draw["compass_horizontal_g"],
            "down_gauss": draw["compass_down_g"],
        },
    )
