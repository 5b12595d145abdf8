"""Infra-red sensors: pairs of LED and receiver at pins, and the notes' proximity sensor (3.9) to (3.14)."""

from __future__ import annotations

from typing import Any

from boebot.devices.infrared import InfraredPair, InfraredProximity, schedule_of
from boebot.running.driver import TICK_S
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import At, Model, Part, SensorKind, beam_of, joined, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE, SHARE, SWITCH, values_of

INFRARED_PROXIMITY = SensorKind(
    "infrared_proximity",
    {"range": POSITIVE, "reflectance": SWITCH} | dict.fromkeys(("c1", "c2", "sigma"), NOT_NEGATIVE),
    reach="range",
)
INFRARED_PAIR = SensorKind(
    "infrared_pair",
    dict.fromkeys(("range", "range_sigma", "direct"), NOT_NEGATIVE) | {"false_hit": SHARE},
    reach="range",
)


@joined(InfraredPair)
def part(device: InfraredPair, at: At) -> Part:
    """LED and receiver."""
    pins = [device.led_pin, device.receiver_pin]
    return Part("infrared_kind", at.number, pins, infrared_parameters(device, at.draw))


@modelled(InfraredProximity)
def proximity(device: InfraredProximity, name: str, model: Model) -> None:
    """A reading from 0 to 1."""
    model.sensor(
        "infrared_proximity",
        name,
        period=device.period_s,
        beam=beam_of(device, device.height_m, device.rays),
        range=device.range_m,
        c1=device.c1_m2,
        c2=device.c2,
        sigma=device.sigma,
    )


@modelled(InfraredPair)
def pair(device: InfraredPair, name: str, model: Model) -> None:
    """Seen or not."""
    assert model.robot is not None
    period_s = schedule_of(model.robot.device).period_ticks * TICK_S
    model.sensor("infrared_pair", name, period=period_s, **values_of(infrared_parameters(device, model.draw)))


def infrared_parameters(pair: InfraredPair, draw: Draw = AS_BUILT) -> Any:
    """The IR pair in C."""
    return ffi.new(
        "infrared_pair_parameters *",
        {
            "beam": beam_of(pair, draw["infrared_height_m"], int(draw["infrared_rays"])),
            "range": pair.range_m,
            "range_sigma": draw["infrared_spread"],
            "false_hit": draw["infrared_false_hit"],
            "direct": draw["infrared_direct_m"],
        },
    )
