"""The devices of a robot's description as parts at its board's pins: which part, which pins, what parameters."""

from __future__ import annotations

from typing import Any

from boebot import robots
from sim_bridge import imperfections
from sim_bridge._core import lib

NO_PIN = 255
FIRST_ANALOG_PIN = 14


def join(handle: Any, number: int, description: robots.RobotDescription, draw: imperfections.Draw) -> None:
    """Joins battery and every device that is on to robot `number` of a simulation (C `sim *`).

    Devices without a part in the world are left alone. A Ping sits on the turret where there are both.

    Raises:
        MemoryError: there is none; descriptions are checked when they are loaded, so nothing else can fail.
    """
    battery = imperfections.battery_parameters()
    done(lib.sim_add_battery(handle, number, _battery_channel(description), battery))
    for name, device in description.device.items():
        if device.on:
            _join_drive(handle, number, name, device, description.body, draw)
            _join_sensor(handle, number, name, device, draw)
    for device in description.device.values():
        if isinstance(device, robots.PositionServo) and device.on:
            _mount(handle, number, device, description)


def done(status: int) -> None:
    """Raises what a status of loop.h means."""
    if status < 0:
        raise MemoryError(f"simulation: error {status}")


def _pin(pin: int | str) -> int:
    return robots.pin_number(pin)


def _battery_channel(description: robots.RobotDescription) -> int:
    for device in description.device.values():
        if isinstance(device, robots.Battery) and device.on:
            return _pin(device.pin) - FIRST_ANALOG_PIN
    return NO_PIN


def _side(name: str) -> int:
    return int(lib.SIM_RIGHT if name.endswith("right") else lib.SIM_LEFT)


def _join_drive(
    handle: Any, number: int, name: str, device: robots.Device, body: robots.Body, draw: imperfections.Draw
) -> None:
    side = _side(name)
    match device:
        case robots.ContinuousServo():
            servo = imperfections.servo_parameters(device, body, side, draw)
            done(lib.sim_add_servo(handle, number, side, _pin(device.pin), servo))
        case robots.Encoder():
            encoder = imperfections.encoder_parameters(device.edges_per_turn)
            done(lib.sim_add_encoder(handle, number, side, _pin(device.pin), NO_PIN, encoder))
        case robots.QuadratureEncoder():
            encoder = imperfections.encoder_parameters(device.edges_per_turn)
            done(lib.sim_add_encoder(handle, number, side, _pin(device.pin_a), _pin(device.pin_b), encoder))
        case robots.PositionServo():
            x, y = imperfections.TURRET_M
            turret = imperfections.turret_parameters(device, draw)
            done(lib.sim_add_turret(handle, number, _pin(device.pin), x, y, turret))
        case robots.Buzzer():
            done(lib.sim_add_buzzer(handle, number, _pin(device.pin)))


def _join_sensor(handle: Any, number: int, name: str, device: robots.Device, draw: imperfections.Draw) -> None:
    match device:
        case robots.Whisker():
            whisker = imperfections.whisker_parameters(device)
            done(lib.sim_add_whisker(handle, number, _pin(device.pin), whisker))
        case robots.InfraredPair():
            pair = imperfections.infrared_parameters(device)
            done(lib.sim_add_infrared(handle, number, _pin(device.led_pin), _pin(device.receiver_pin), pair))
        case robots.Ping():
            done(lib.sim_add_ping(handle, number, _pin(device.pin), imperfections.ping_parameters(device)))
        case robots.AnalogInfrared():
            sharp = imperfections.analog_infrared_parameters(draw)
            done(lib.sim_add_analog_infrared(handle, number, _pin(device.pin) - FIRST_ANALOG_PIN, sharp))
        case robots.LightSensor():
            light = imperfections.light_parameters(_side(name), draw)
            done(lib.sim_add_light_sensor(handle, number, _pin(device.pin), light))
        case robots.Compass():
            compass = imperfections.compass_parameters(draw)
            done(lib.sim_add_compass(handle, number, _pin(device.sda_pin), _pin(device.scl_pin), compass))


def _mount(handle: Any, number: int, turret: robots.PositionServo, description: robots.RobotDescription) -> None:
    """The Ping sits on the turret where there are both."""
    for device in description.device.values():
        if isinstance(device, robots.Ping) and device.on:
            done(lib.sim_mount(handle, number, _pin(turret.pin), _pin(device.pin)))
