"""The devices of a robot's description as parts at its board's pins: which part, which pins, what parameters."""

from __future__ import annotations

from typing import Any

from boebot.description import robots
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.battery import BatteryDivider
from boebot.devices.buzzer import PiezoBuzzer
from boebot.devices.compass import MagneticCompass
from boebot.devices.device import Device, pin_number
from boebot.devices.encoder import QuadratureEncoder, SingleEncoder
from boebot.devices.infrared import InfraredPair
from boebot.devices.light import LightSensor
from boebot.devices.ping import PingSensor
from boebot.devices.servo import ContinuousServo
from boebot.devices.turret import PositionServo
from boebot.devices.whisker import WhiskerSwitch
from boebot.errors import BoardError
from sim_bridge._core import lib
from sim_bridge.robots import imperfections

NO_PIN = 255
FIRST_ANALOG_PIN = 14


def join(handle: Any, number: int, description: robots.RobotDescription, draw: imperfections.Draw) -> None:
    """Joins battery and every device that is on to robot `number` of a simulation (C `sim *`).

    Devices without a part in the world are left alone. A Ping sits on the turret where there are both.

    Raises:
        BoardError: a device cannot be joined; one sentence names it.
        MemoryError: there is none.
    """
    _join_supply(handle, number, description, draw)
    for name, device in description.device.items():
        if device.on:
            _join_drive(handle, number, name, device, description.body, draw)
            _join_sensor(handle, number, name, device, draw)
    for device in description.device.values():
        if isinstance(device, PositionServo) and device.on:
            _mount(handle, number, device, description)
    for name, device in description.device.items():
        if device.on and not device.plugged:
            for pin in device.pins().values():
                done(lib.sim_unplug(handle, number, pin, 1), f"device {name!r}")


def done(status: int, what: str) -> None:
    """Raises what a status of loop.h means for `what` was to be joined.

    Raises:
        BoardError: a pin is taken, a parameter is out of its range, the board was built for another interface.
        MemoryError: there is none.
    """
    if status == lib.SIM_OK:
        return
    if status == lib.SIM_NO_MEMORY:
        raise MemoryError("simulation")
    why = {
        lib.SIM_PIN_TAKEN: "another device listens on its pins",
        lib.SIM_WRONG_BOARD: "it was built for another interface of boards",
    }
    raise BoardError(f"{what} cannot be joined to the simulation: {why.get(status, 'a value is out of its range')}")


def _pin(pin: int | str) -> int:
    return pin_number(pin)


def _join_supply(handle: Any, number: int, description: robots.RobotDescription, draw: imperfections.Draw) -> None:
    """The pack, and where the board measures it."""
    if description.supply is None:
        return
    gauges = [d for d in description.device.values() if isinstance(d, BatteryDivider) and d.on]
    channel = _pin(gauges[0].pin) - FIRST_ANALOG_PIN if gauges else NO_PIN
    ratio = gauges[0].ratio if gauges else 2.0
    battery = imperfections.battery_parameters(description.supply, ratio, draw)
    done(lib.sim_add_battery(handle, number, channel, battery), "the battery")


def _side(name: str) -> int:
    return int(lib.SIM_RIGHT if name.endswith("right") else lib.SIM_LEFT)


def _join_drive(
    handle: Any, number: int, name: str, device: Device, body: robots.Body, draw: imperfections.Draw
) -> None:
    side, what = _side(name), f"device {name!r}"
    match device:
        case ContinuousServo():
            servo = imperfections.servo_parameters(device, body, side, draw)
            done(lib.sim_add_servo(handle, number, side, _pin(device.pin), servo), what)
        case SingleEncoder():
            encoder = imperfections.encoder_parameters(device.edges_per_turn, draw)
            done(lib.sim_add_encoder(handle, number, side, _pin(device.pin), NO_PIN, encoder), what)
        case QuadratureEncoder():
            encoder = imperfections.encoder_parameters(device.edges_per_turn, draw)
            done(lib.sim_add_encoder(handle, number, side, _pin(device.pin_a), _pin(device.pin_b), encoder), what)
        case PositionServo():
            x, y = device.position_m
            turret = imperfections.turret_parameters(device, draw)
            done(lib.sim_add_turret(handle, number, _pin(device.pin), x, y, turret), what)
        case PiezoBuzzer():
            done(lib.sim_add_buzzer(handle, number, _pin(device.pin)), what)


def _join_sensor(handle: Any, number: int, name: str, device: Device, draw: imperfections.Draw) -> None:
    what = f"device {name!r}"
    match device:
        case WhiskerSwitch():
            whisker = imperfections.whisker_parameters(device, draw)
            done(lib.sim_add_whisker(handle, number, _pin(device.pin), whisker), what)
        case InfraredPair():
            pair = imperfections.infrared_parameters(device, draw)
            done(lib.sim_add_infrared(handle, number, _pin(device.led_pin), _pin(device.receiver_pin), pair), what)
        case PingSensor():
            ping = imperfections.ping_parameters(device, draw)
            done(lib.sim_add_ping(handle, number, _pin(device.pin), ping), what)
        case SharpSensor():
            sharp = imperfections.analog_infrared_parameters(device, draw)
            done(lib.sim_add_analog_infrared(handle, number, _pin(device.pin) - FIRST_ANALOG_PIN, sharp), what)
        case LightSensor():
            light = imperfections.light_parameters(device, _side(name), draw)
            done(lib.sim_add_light_sensor(handle, number, _pin(device.pin), light), what)
        case MagneticCompass():
            compass = imperfections.compass_parameters(draw)
            done(lib.sim_add_compass(handle, number, _pin(device.sda_pin), _pin(device.scl_pin), compass), what)


def _mount(handle: Any, number: int, turret: PositionServo, description: robots.RobotDescription) -> None:
    """The Ping sits on the turret where there are both."""
    for device in description.device.values():
        if isinstance(device, PingSensor) and device.on:
            done(lib.sim_mount(handle, number, _pin(turret.pin), _pin(device.pin)), "the Ping on the turret")
