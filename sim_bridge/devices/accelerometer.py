"""The accelerometer of a robot without a board (Fig. 1.10)."""

from __future__ import annotations

from boebot.devices.accelerometer import Accelerometer
from sim_bridge.devices.catalogue import Model, SensorKind, modelled
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE

ACCELEROMETER = SensorKind(
    "accelerometer",
    dict.fromkeys(("mass", "stiffness", "range"), POSITIVE) | dict.fromkeys(("damping", "sigma"), NOT_NEGATIVE),
)


@modelled(Accelerometer)
def accelerometer(device: Accelerometer, name: str, model: Model) -> None:
    """A proof mass on a spring."""
    model.sensor(
        "accelerometer",
        name,
        period=device.period_s,
        mass=device.proof_mass_kg,
        stiffness=device.stiffness_n_m,
        damping=device.damping_n_s_m,
        range=device.range_m_s2,
        sigma=device.sigma_m_s2,
        bias=device.bias_m_s2,
    )
