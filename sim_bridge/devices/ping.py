"""Ultrasonic range finders: the Ping))) at its pin, and the notes' sonar (section 1.6)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from boebot.devices.ping import PingSensor, RangeFinder, Sonar
from boebot.running.driver import TICK_S
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, beam_of, joined, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE, SHARE, SWITCH, Range, values_of


def _ranges(values: Mapping[str, Any]) -> str:
    low, high = values["range_minimum"], values["range_maximum"]
    return "" if low < high else f"range_minimum is {low:g}; expected less than range_maximum, {high:g}"


SONAR = SensorKind(
    "sonar",
    {"range_minimum": NOT_NEGATIVE, "range_maximum": POSITIVE, "sigma": NOT_NEGATIVE}
    | {"miss": SHARE, "grazing_cosine": SHARE, "temperature": Range(-100.0, 200.0), "absorption": SWITCH},
    _ranges,
    reach="range_maximum",
    nothing=None,
)


PING = replace(SONAR, name="ping")


@joined(PingSensor)
def part(device: PingSensor, at: At) -> Part:
    """Trigger and echo."""
    return Part("ping_kind", at.number, [device.pin], ping_parameters(device, at.draw))


@modelled(Sonar)
def sonar(device: Sonar, name: str, model: Model) -> None:
    """A distance."""
    model.sensor(
        "sonar",
        name,
        period=device.period_s,
        beam=beam_of(device, device.height_m, device.rays),
        range_minimum=device.range_min_m,
        range_maximum=device.range_max_m,
        sigma=device.sigma,
        miss=device.miss,
    )


@modelled(PingSensor)
def echo(device: PingSensor, name: str, model: Model) -> None:
    """The length of its echo pulse."""
    model.sensor("ping", name, period=device.period_ticks * TICK_S, **values_of(ping_parameters(device, model.draw)))


def ping_parameters(ping: PingSensor, draw: Draw = AS_BUILT) -> Any:
    """The Ping))) in C."""
    return ffi.new("sonar_parameters *", sonar_parameters(ping, draw, draw["ping_spread"]))


def sonar_parameters(device: RangeFinder, draw: Draw, spread: float) -> dict[str, Any]:
    """sonar_parameters in C of a range finder at a board; `spread`: noise of the distance, as a share."""
    return {
        "beam": beam_of(device, draw["ping_height_m"], int(draw["ping_rays"])),
        "range_minimum": device.range_min_m,
        "range_maximum": device.range_max_m,
        "sigma": spread,
        "miss": draw["ping_miss"],
        "grazing_cosine": math.cos(draw["ping_grazing_rad"]),
        "temperature": draw["temperature_c"],
        "absorption": 1,
    }
