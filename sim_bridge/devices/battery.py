"""The pack that everything runs on, what draws from it, and its measurement; the notes' battery (section 1.9)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boebot.description.robots import Supply
from boebot.devices.battery import Energy
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import Model, SensorKind, modelled
from sim_bridge.robots.imperfections import AS_BUILT, Draw
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE


def _order(values: Mapping[str, Any]) -> str:
    low, high = values["empty"], values["full"]
    return "" if low < high else f"full is {high:g}; expected more than empty, {low:g}"


CHARGE = SensorKind("charge", {"sigma": NOT_NEGATIVE}, _order, usual={"empty": 5.0, "full": 7.75}, has_period=False)


@modelled(Energy)
def energy(device: Energy, name: str, model: Model) -> None:
    """Its voltage."""
    model.battery(
        name,
        empty=device.empty_v,
        full=device.full_v,
        sigma=device.sigma_v,
        idle_per_s=device.idle_per_s,
        signal_per_s=device.signal_per_s,
        charger_per_s=device.charger_per_s,
    )


def battery_parameters(supply: Supply, ratio: float = 2.0, draw: Draw = AS_BUILT) -> Any:
    """The battery in C; `ratio`: the pack's voltage for each volt at the analog pin."""
    return ffi.new(
        "battery_parameters *",
        {
            "supply": {
                "full_v": supply.full_v,
                "empty_v": supply.empty_v,
                "capacity_as": supply.capacity_as,
                "resistance_ohm": supply.resistance_ohm,
                "drop_out_v": supply.drop_out_v,
                "board_a": draw["board_a"],
                "servo_idle_a": draw["servo_idle_a"],
                "servo_run_a_s_m": draw["servo_run_a_s_m"],
                "servo_a_per_n_m": draw["servo_a_per_n_m"],
                "charger_a": supply.charger_a,
                "unregulated": float(supply.servos == "pack"),
            },
            "divider": 1.0 / ratio,
            "noise_v": draw["battery_noise_v"],
            "charge": supply.charge,
        },
    )
