"""The DC motor of section 1.2 of the notes by itself, (1.1)-(1.10): for plots and exercises, and for vehicles."""

from __future__ import annotations

import math

from boebot.errors import RobotError
from sim_bridge._core import ffi, lib


class DCMotor:
    """A DC motor with its gear (C struct motor_dc_parameters, world/motor_dc.h), quasi-static.

    Attributes:
        parameters: the C struct, SI units; what was not said is as in the notes' default motor.
    """

    def __init__(self, **parameters: float) -> None:
        """`parameters`: torque_constant, emf_constant, resistance_ohm, inductance_h, coulomb_n_m, viscous_n_m_s, gear,
        efficiency, torque_maximum_n_m, voltage_maximum.

        Raises:
            RobotError: there is no parameter of that name, or it is no finite number.
        """
        self.parameters = ffi.new("motor_dc_parameters *")
        lib.motor_dc_default(self.parameters)
        names = dir(self.parameters)
        for name, value in parameters.items():
            if name not in names or not math.isfinite(value):
                raise RobotError(f"motor: {name} = {value}; expected a finite number for one of {', '.join(names)}")
            setattr(self.parameters, name, value)

    def voltage(self, signal: float) -> float:
        """Volts for a motor signal in [-1, 1], beyond it limited: V = s V_max."""
        return float(lib.motor_dc_voltage(self.parameters, signal))

    def torque(self, voltage: float, axis_speed: float) -> float:
        """Torque (N m) on the wheel while that turns at `axis_speed` (rad/s): (1.8), friction (1.9), gear (1.10)."""
        return float(lib.motor_dc_torque(self.parameters, voltage, axis_speed, 0.0))
