"""The laser range finder of a robot without a board (section 1.7)."""

from __future__ import annotations

from boebot.devices.laser import Laser
from sim_bridge.devices.catalogue import modelled, off
from sim_bridge.vehicles.model import VehicleModel

SWITCHES = {
    "laser_noise": off("laser distances are exact", "Laser.sigma"),
}


@modelled(Laser)
def laser(device: Laser, name: str, model: VehicleModel) -> None:
    """A fan of rays."""
    x, y = device.position_m
    model.laser(
        name,
        period=device.period_s,
        x=x,
        y=y,
        heading=device.heading_rad,
        height=device.height_m,
        first=-device.step_rad * (device.rays - 1) / 2,
        step=device.step_rad,
        rays=device.rays,
        range=device.range_m,
        sigma=device.sigma,
    )
