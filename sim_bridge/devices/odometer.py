"""The notes' odometer of a robot without a board."""

from __future__ import annotations

from boebot.devices.odometer import Odometer
from sim_bridge.devices.catalogue import modelled
from sim_bridge.vehicles.model import VehicleModel


@modelled(Odometer)
def odometer(device: Odometer, name: str, model: VehicleModel) -> None:
    """Calibrated once at the start."""
    model.odometer(
        name, sigma_step=device.sigma_step_m, factor_left=device.factor_left, factor_right=device.factor_right
    )
