"""Motors of the notes by themselves, sections 1.2.3 and 3.2.4: for plots, exercises and vehicles.

`DCMotor` (1.1)-(1.10), `RegulatedMotor` (3.15) and `ServoMotor`, a servo modified for continuous rotation, drive a
`VehicleModel`; a `PositionServo` turns to an angle. Each has its parameters as a C struct of sim_bridge/world, SI units
except for pulses, which are in us; a wrong one raises RobotError.
"""

from __future__ import annotations

from typing import Any

from boebot.errors import RobotError
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE, number, struct, values_of
from sim_bridge.vehicles.drives import dc_parameters, regulated_parameters, servo_parameters


class DCMotor:
    """A DC motor with its gear (world/motor_dc.h): quasi-static by `torque`, with the inductance by `step`.

    Attributes:
        parameters: the C struct motor_dc_parameters; what was not said is as in the notes' default motor.
    """

    def __init__(self, **parameters: float) -> None:
        """`parameters`: torque_constant, emf_constant, resistance_ohm, inductance_h, coulomb_n_m, viscous_n_m_s, gear,
        efficiency, torque_maximum_n_m, voltage_maximum.

        Raises:
            RobotError: there is no parameter of that name, or it is outside its range.
        """
        self.parameters = dc_parameters("motor", parameters)

    def voltage(self, signal: float) -> float:
        """Volts for a motor signal in [-1, 1], beyond it limited: V = s V_max."""
        return float(lib.motor_dc_voltage(self.parameters, number("motor", "signal", signal)))

    def current(self, voltage: float, axis_speed: float) -> float:
        """Current (A) once it has settled, while the wheel turns at `axis_speed` (rad/s): (1.1) with di/dt = 0."""
        return float(lib.motor_dc_current(self.parameters, *_question(voltage, axis_speed)))

    def torque(self, voltage: float, axis_speed: float) -> float:
        """Torque (N m) on the wheel while that turns at `axis_speed` (rad/s): (1.8), friction (1.9), gear (1.10)."""
        return float(lib.motor_dc_torque(self.parameters, *_question(voltage, axis_speed), 0.0))

    def step(self, voltage: float, axis_speed: float, current: float, dt: float) -> tuple[float, float]:
        """The full motor (1.6), (1.7) for the next `dt` seconds, from a `current` (A) at their beginning.

        Returns the mean torque (N m) on the wheel meanwhile, and the current at their end; exact for any `dt` as long
        as voltage and speed hold still.
        """
        now = ffi.new("double *", number("motor", "current", current))
        seconds = number("motor", "dt", dt, POSITIVE)
        torque = lib.motor_dc_step(self.parameters, now, *_question(voltage, axis_speed), 0.0, seconds)
        return float(torque), float(now[0])


def _question(voltage: float, axis_speed: float) -> tuple[float, float]:
    return number("motor", "voltage", voltage), number("motor", "axis_speed", axis_speed)


class RegulatedMotor:
    """The velocity-regulated motor (3.15), world/motor_regulated.h.

    Attributes:
        parameters: the C struct motor_regulated_parameters; K 10 N s, 1 N m and 0.3 m/s unless said otherwise.
    """

    def __init__(self, **parameters: float) -> None:
        """`parameters`: gain_n_s (K, N m per m/s at the rim), torque_maximum_n_m, speed_maximum_m_s (at signal 1).

        Raises:
            RobotError: there is no parameter of that name, or it is outside its range.
        """
        self.parameters = regulated_parameters("motor", parameters)

    def reference(self, signal: float) -> float:
        """v_ref (m/s) of a motor signal in [-1, 1], beyond it limited."""
        return float(lib.motor_regulated_reference(self.parameters, number("motor", "signal", signal)))

    def torque(self, reference: float, speed: float) -> float:
        """Torque (N m) on the wheel whose rim moves at `speed` (m/s): K (v_ref - v), limited."""
        wanted, now = number("motor", "reference", reference), number("motor", "speed", speed)
        return float(lib.motor_regulated(self.parameters, wanted, now, 1.0))


class ServoMotor:
    """A servo modified for continuous rotation (world/servo_motor.h): pulses set its speed. Nominal Parallax servo.

    Attributes:
        parameters: the C struct servo_motor_parameters.
    """

    def __init__(self, **parameters: Any) -> None:
        """`parameters`: mount (1 left, -1 right), wheel_radius, centre_us, dead_band_us, top_ccw_rad_s, scale_ccw_us,
        top_cw_rad_s, scale_cw_us, lag_s, motor (gain_n_s, torque_maximum_n_m, coast_n_s, coast_maximum_n_m).

        Raises:
            RobotError: there is no parameter of that name, or it is outside its range.
        """
        self.parameters = servo_parameters("servo", parameters)

    def pulse(self, signal: float) -> float:
        """Width (us) for a motor signal in [-1, 1], beyond it limited: 1500 us +- 200 us s, mirrored on the right."""
        return float(lib.servo_motor_pulse_of(self.parameters, number("servo", "signal", signal)))

    def speed(self, pulse_us: float) -> float:
        """Steady speed of the rim (m/s, forward) under pulses of that width."""
        return float(lib.servo_motor_curve(self.parameters, number("servo", "pulse_us", pulse_us)))


class PositionServo:
    """A servo that turns to the angle of its pulses (world/motor_position.h); a turret sits on one.

    Attributes:
        parameters: the C struct motor_position_parameters; the notes' standard servo unless said otherwise.
    """

    def __init__(self, angle: float = 0.0, **parameters: float) -> None:
        """At rest at `angle` (rad, counter-clockwise from straight ahead).

        Args:
            angle: where it begins.
            parameters: mount, centre_us, us_per_rad, range_rad, gain_per_s, top_speed_rad_s, dead_band_us.

        Raises:
            RobotError: there is no parameter of that name, or it is outside its range.
        """
        usual = ffi.new("motor_position_parameters *")
        lib.motor_position_default(usual)
        self.parameters = struct("motor_position_parameters", "servo", parameters, values_of(usual))
        self._state = ffi.new("motor_position *")
        lib.motor_position_init(self._state, number("servo", "angle", angle))

    @property
    def angle(self) -> float:
        """Where its shaft is, rad."""
        return float(self._state.angle)

    def pulse_of(self, angle: float) -> float:
        """Width (us) of the pulse that asks for an angle (rad)."""
        return float(lib.motor_position_pulse_of(self.parameters, number("servo", "angle", angle)))

    def pulse(self, pulse_us: float) -> None:
        """A pulse ends now. After 50 ms without another one the controller rests, and the gear holds.

        Raises:
            RobotError: no servo takes a pulse of that width.
        """
        width = number("servo", "pulse_us", pulse_us)
        if not lib.motor_position_pulse(self.parameters, self._state, width):
            raise RobotError(f"servo: pulse_us is {width:g}; expected a number from 500 to 2500")

    def step(self, dt: float, supply: float = 1.0) -> float:
        """Moves for `dt` seconds; `supply` is the share of its nominal voltage. Returns the angle (rad)."""
        seconds, share = number("servo", "dt", dt, POSITIVE), number("servo", "supply", supply, NOT_NEGATIVE)
        lib.motor_position_step(self.parameters, self._state, share, seconds)
        return self.angle
