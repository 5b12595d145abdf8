"""The notes' odometer of a robot without a board."""

from __future__ import annotations

from boebot.devices.odometer import Odometer
from sim_bridge.compiled import lib
from sim_bridge.devices.catalogue import Model, SensorKind, modelled
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE, SHARE, Range

ODOMETER = SensorKind(
    "odometer",
    dict.fromkeys(("half_track", "wheel_radius", "factor_left", "factor_right"), POSITIVE)
    | dict.fromkeys(("sigma_step", "sigma_share", "edges_per_turn", "slips_per_s"), NOT_NEGATIVE)
    | {"slip_share": SHARE, "rule": Range(choices=(0, 1, 2))},
    usual={"factor_left": 1.0, "factor_right": 1.0},
    of_body=("half_track", "wheel_radius"),
    has_period=False,
)


@modelled(Odometer)
def odometer(device: Odometer, name: str, model: Model) -> None:
    """Calibrated once at the start. ARSim lays off a whole step at the heading after it."""
    by_arsim = model.robot is not None and model.robot.scheme == "arsim"
    model.sensor(
        "odometer",
        name,
        rule=lib.ODOMETER_NEW_HEADING if by_arsim else lib.ODOMETER_MIDPOINT,
        sigma_step=device.sigma_step_m,
        factor_left=device.factor_left,
        factor_right=device.factor_right,
    )
