"""The slow devices' drivers, each with its device at the board's pins: from the pin to devices_telemetry, and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from boebot.description.robots import load_robot
from boebot.link import messages
from boebot.link.messages import CompassStatus, Devices
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, FRAME_CYCLES, LINE_BYTES_PER_TICK, TICK_S
from sim_bridge.bench.bench import bare
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.devices import Capacitor, Receiver, TwoWireDevice
from sim_bridge.tests.rigs import SessionRig

pytestmark = [pytest.mark.unsanitized, pytest.mark.soak_on_native]

COMPASS_ADDRESS = 0x1E
LIGHT_LEFT, LIGHT_RIGHT, TURRET, BUZZER = 15, 6, 11, 4
STAMP_LATE_US = 3530 / CYCLES_PER_US  # at most, of port D's changes in overload (docs/reference/timing.md)


@pytest.fixture
def bench(board_url: str) -> Iterator[SessionRig]:
    with SessionRig.open(board_url, robot=bare("boebot")) as rig:
        rig.start()
        yield rig


def pulses_since(rig: SessionRig, pin: int, cycle: int) -> np.ndarray:
    """Start and width of each whole pulse on `pin` that began since then, in cycles."""
    pulses = rig.pulses(pin)
    return pulses[pulses[:, 0] >= cycle]


def test_compass_is_set_and_read_in_the_order_of_its_registers(bench: SessionRig) -> None:
    device = TwoWireDevice(bench.board, COMPASS_ADDRESS)
    for x, y, z in ((1, -2, 3), (-4096, 2047, -2048), (255, 256, -256)):
        device.registers[3:9] = b"".join(value.to_bytes(2, "big", signed=True) for value in (x, z, y))
        reported = bench.devices(after_s=0.12)
        assert reported.compass_status == CompassStatus.OK
        assert (reported.compass_x, reported.compass_y, reported.compass_z) == (x, y, z)
        assert reported.compass_age <= 6
    assert device.registers[:3] == bytes([0x78, 0x20, 0x00])


def test_compass_without_a_device_a_held_bus_and_a_recovery(bench: SessionRig) -> None:
    device = TwoWireDevice(bench.board, COMPASS_ADDRESS)
    device.plugged = False
    assert bench.devices(after_s=0.1).compass_status == CompassStatus.NO_ANSWER
    device.plugged = True
    assert bench.devices(after_s=0.1).compass_status == CompassStatus.OK
    device.hold(True)
    assert bench.devices(after_s=0.15).compass_status == CompassStatus.BUS_STUCK
    device.hold(False)
    reported = bench.devices(after_s=0.4)
    assert reported.compass_status == CompassStatus.OK and reported.compass_age <= 6
    assert bench.latest().overruns == 0


@pytest.mark.parametrize("us", [20, 600, 1500, 4200, 9000])
def test_light_is_the_decay_time(bench: SessionRig, us: int) -> None:
    Capacitor(bench.board, LIGHT_LEFT, us)
    Capacitor(bench.board, LIGHT_RIGHT, us + 1000)
    reported = bench.devices(after_s=0.08)
    assert abs(reported.light_left - us) <= 6
    assert abs(reported.light_right - (us + 1000)) <= 6
    assert reported.light_age <= 2


@pytest.mark.parametrize("us", [7, 400, 2_500, 13_000, 20_000])
def test_light_sensors_of_the_basic_shieldbot(board_url: str, us: int) -> None:
    """The left one on Timer1's capture pin, where others have the Ping."""
    with SessionRig.open(board_url, robot=bare("shieldbot-basic")) as rig:
        rig.start()
        Capacitor(rig.board, 8, us)
        Capacitor(rig.board, LIGHT_RIGHT, us + 500)
        reported = rig.devices(after_s=0.08)
        assert abs(reported.light_left - min(us, 14_000)) <= 6
        assert abs(reported.light_right - min(us + 500, 14_000)) <= 6
        assert reported.light_age <= 2


def test_analog_inputs_are_ratios_of_the_supply(bench: SessionRig) -> None:
    for battery, sharp in ((3.1, 0.42), (2.2, 2.9), (0.0, 4.9)):
        bench.board.analog(0, battery)
        bench.board.analog(2, sharp)
        reported = bench.devices(after_s=0.08)
        assert abs(reported.battery - battery / 5.0 * 1024) <= 1
        assert abs(reported.analog_infrared - sharp / 5.0 * 1024) <= 1
        assert reported.battery_age <= 3 and reported.analog_infrared_age <= 3
        assert abs(reported.supply - 5000) <= 25


@pytest.mark.parametrize("angle", [-1.2, -0.3, 0.0, 0.7, 1.5])
def test_turret_turns_and_is_released_by_a_stop(bench: SessionRig, angle: float) -> None:
    bench.send(messages.Turret(round(angle * 1e4), 1))
    bench.listen(0.05)
    since = bench.board.cycle
    bench.listen(0.2)
    pulses = pulses_since(bench, TURRET, since)
    expected = np.clip(24000 + 9168 * angle, 9600, 38400)
    assert len(pulses) >= 8
    assert np.all(np.abs(pulses[:, 1] - expected) <= 16)
    assert np.all(np.abs(np.diff(pulses[:, 0]) - FRAME_CYCLES) <= 16)
    bench.stop()
    bench.listen(0.05)
    since = bench.board.cycle
    bench.listen(0.1)
    assert len(pulses_since(bench, TURRET, since)) == 0
    assert bench.devices().turret_pulse == 0


@pytest.mark.parametrize("frequency", [60, 440, 2000, 8000])
def test_buzzer_has_its_frequency_and_ends(bench: SessionRig, frequency: int) -> None:
    bench.send(messages.Buzzer(frequency, 20, 1))
    bench.listen(0.4)
    pulses = bench.pulses(BUZZER)
    seconds = (pulses[-1].sum() - pulses[0, 0]) / CYCLES_PER_S
    assert 0.18 <= seconds <= 0.20
    measured = CYCLES_PER_S / np.mean(np.diff(pulses[:, 0]))
    assert abs(measured / frequency - 1) <= 0.02
    assert bench.devices().buzzer_token == 1


def test_zones_count_the_frequencies_at_which_the_receiver_answers(bench: SessionRig) -> None:
    for receiver in (10, 3):
        bench.board.drive(receiver, Level.HIGH)
    bench.set("infrared_sweep", 1)
    assert bench.devices(after_s=0.15).infrared_zone_left == 0
    Receiver(bench.board, led=9, pin=10)
    reported = bench.devices(after_s=0.15)
    assert (reported.infrared_zone_left, reported.infrared_zone_right) == (5, 0)
    since = bench.board.cycle
    bench.listen(0.1)
    periods = np.diff(pulses_since(bench, 9, since)[:, 0])
    found = {
        round(CYCLES_PER_S / np.median(burst)) for burst in np.split(periods, np.where(periods > 10_000)[0] + 1)[1:-1]
    }
    for expected in (38_000, 39_000, 40_000, 41_000, 42_000):
        assert sum(abs(frequency - expected) <= 300 for frequency in found) >= 1


def saturate(rig: SessionRig, seconds: float) -> None:
    """All that the line carries to the board; back come answers (15 bytes for 11), telemetry (46 bytes a tick) and that
    of the slow devices (39 bytes a tick): 480 of 500 bytes."""
    wire, request = bytearray(), rig.numbered(messages.GetParameter, 0)
    for _ in range(round(seconds / TICK_S)):
        while len(wire) < LINE_BYTES_PER_TICK:
            wire += rig.encode(rig.signal(0.3, -0.3)) + rig.encode(request) + rig.encode(request)
        rig.transport.write(bytes(wire[:LINE_BYTES_PER_TICK]))
        del wire[:LINE_BYTES_PER_TICK]
        rig.listen(TICK_S)
    rig.transport.write(bytes(wire))


@pytest.mark.parametrize("pin_map", [pytest.param("shieldbot", marks=pytest.mark.soak), "boebot"])
def test_all_devices_on_and_a_saturated_line_disturb_neither_tick_nor_pulse(board_url: str, pin_map: str) -> None:
    """Every device of the map at work, encoders at 1.5 kHz, the UART saturated both ways: ±4 cycles, no tick missed,
    no byte lost."""
    with SessionRig.open(board_url, robot=bare(pin_map)) as rig:
        rig.start()
        device = TwoWireDevice(rig.board, COMPASS_ADDRESS)
        Capacitor(rig.board, LIGHT_LEFT, 1300.0)
        Capacitor(rig.board, LIGHT_RIGHT, 2100.0)
        on = sum(int(bit) for bit, name in messages.DEVICE_OF_BIT.items() if name in load_robot(pin_map).device)
        rig.set("devices", on)
        rig.set("encoder_gap", 0)
        rig.set("infrared_sweep", 1)
        rig.set("devices_period", 1)
        rig.send(messages.Turret(5000, 1))
        rig.send(messages.Buzzer(8000, 255, 3))
        rig.listen(0.1)
        for i, pin in enumerate((16, 17) if on & Devices.ENCODER else ()):
            start = rig.board.cycle + 1000
            for edge in range(1100):
                rig.board.drive(pin, edge % 2, start + edge * (CYCLES_PER_S // 3000 + 7 * i))
        rig.answers.clear()
        before, first, moved = rig.board.counters(), len(rig.telemetry) + 1, device.bytes_moved
        since = rig.board.cycle
        saturate(rig, seconds=0.3)
        after = rig.board.counters()
        frames = rig.telemetry[first:]
        assert [f.tick - frames[0].tick for f in frames] == list(range(len(frames))) and len(frames) >= 27
        assert frames[-1].overruns == frames[0].overruns
        assert (after["bytes_in"] - before["bytes_in"]) >= 0.95 * 0.3 * 50_000
        for pin in (13, 12):
            rises, widths = pulses_since(rig, pin, since)[2:].T
            assert len(widths) >= 10
            assert np.all(np.abs(widths - 1560 * CYCLES_PER_US) <= 16), widths - 1560 * CYCLES_PER_US
            assert np.all(np.abs(np.diff(rises) - FRAME_CYCLES) <= 16)
        widths = pulses_since(rig, TURRET, since)[:, 1]
        assert len(widths) >= (10 if on & Devices.TURRET else 0)
        assert np.all(np.abs(widths - (24000 + 4584)) <= 16)
        slow = [answer for answer in rig.answers if isinstance(answer, messages.DevicesTelemetry)]
        assert len(slow) >= 20
        for fallen_us, told in ((1300, [a.light_left for a in slow]), (2100, [a.light_right for a in slow])):
            assert abs(np.median(told) - fallen_us) <= 3  # an edge is stamped once the interrupts before it have ended
            assert fallen_us - 1 <= min(told) and max(told) <= fallen_us + STAMP_LATE_US
        reported = rig.devices(after_s=0.05)
        assert device.bytes_moved > moved + 50 and reported.compass_status == CompassStatus.OK
        assert reported.buzzer_token == 3 and reported.infrared_zone_age <= 7
