"""The notes' motors of a robot without a board: their parameters are in the robot's file."""

from __future__ import annotations

from boebot.devices.motor import DcMotor, RegulatedMotor


def dc_parameters(motor: DcMotor) -> dict[str, float]:
    return {
        "torque_constant": motor.torque_constant_n_m_a,
        "emf_constant": motor.emf_constant_v_s,
        "resistance_ohm": motor.resistance_ohm,
        "inductance_h": motor.inductance_h if motor.full else 0.0,
        "coulomb_n_m": motor.coulomb_friction_n_m,
        "viscous_n_m_s": motor.viscous_friction_n_m_s,
        "gear": motor.gear,
        "efficiency": motor.efficiency,
        "torque_maximum_n_m": motor.torque_maximum_n_m,
        "voltage_maximum": motor.voltage_maximum_v,
    }


def regulated_parameters(motor: RegulatedMotor, most: float) -> dict[str, float]:
    return {
        "gain_n_s": motor.gain_n_s,
        "torque_maximum_n_m": motor.torque_maximum_n_m,
        "speed_maximum_m_s": most,
    }
