"""The SENSOR rows of an image's timing table, measured at its pins: how old a reading is when telemetry takes it, and
how long one takes in hardware.

What a sensor sees is changed at phases that sweep its period. Telemetry that does not yet show all of a change was made
of a reading whose measurement had begun before it: from the change to the first byte of the last such telemetry is an
age that the row has to hold, and the next telemetry, a tick later at most, shows the change.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

import numpy as np
import pytest

from boebot import resources
from boebot.link.messages import Devices, DevicesTelemetry, PingStatus, Telemetry
from boebot_timing.emulated.loads import CYCLES_PER_US, ECHO_DELAY_CYCLES, TICK_CYCLES, wheels
from boebot_timing.table import read_table
from boebot_timing.tests.sensor_bench import Ages, Held, LightSensor, RangeFinder, Receiver, Surroundings
from sim_bridge.bench.pins import Pin
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.devices import TwoWireDevice

IMAGE = resources.folder("images") / "boebot.elf"  # every sensor but the encoders
ENCODER_IMAGE = resources.folder("images") / "shieldbot-quad.elf"
ROWS = {row.name: row for row in read_table(IMAGE).sensors}

SECONDS = 8.0  # of the board's time
TELEMETRY_US = TICK_CYCLES // CYCLES_PER_US  # from one telemetry to the next
SLICE = 32  # cycles: how often a test looks at the converter
JITTER_US = 1_000  # of a telemetry's first byte: what else its slot does, more in one tick than in the next
WHISKER, RECEIVER, PING = 5, 10, 8
LEDS = (9, 2)  # left and right, infra-red
LIGHTS = (15, 6)
BATTERY_CHANNEL, SHARP_CHANNEL = 0, 2
ECHO_LONGEST_US = 18_500  # Parallax #28015
LIGHT_LONGEST_US = 14_000  # what is darker is reported as this
SHARP_PERIOD, SHARP_LATE = 766_400, 121_600  # cycles: 38.3 + 9.6 ms, 7.6 ms (GP2Y0A21)
COMPASS_PERIOD = 13_333 * CYCLES_PER_US  # 75 Hz (HMC5883L)
COMPASS_RUNS = COMPASS_PERIOD * 97 // 100  # 3 transfers' and 9 measurements' time would else stay in step
ADCSRA, ADSC = 0x7A, 0x40  # data sheet, 24.9.2: the bit is set while a conversion runs
ADC_CLOCK_US = 8  # 125 kHz


def check(found: Ages, row: str, share: float) -> None:
    """Against the row; the sweep has to find that share of it."""
    most = ROWS[row].age
    print(f"{row}: row {most} us, measured {found.ages.max():.0f} us, to telemetry {found.delays.max():.0f} us")
    assert len(found.ages) >= 15
    assert found.ages.max() <= most
    assert found.delays.max() <= most + TELEMETRY_US
    assert found.delays.max() <= found.ages.max() + TELEMETRY_US + JITTER_US, "telemetry was left out"
    assert found.ages.max() >= share * most, "the row says nothing"


DECAYS_US = (13_000, 2_000)
ECHOES_US = (18_000, ECHO_LONGEST_US)
BATTERY_V, SHARP_V, SUPPLY_V = (1.0, 3.0), (0.4, 2.4), (5.0, 4.6)


@pytest.fixture(scope="module")
def around() -> Iterator[Surroundings]:
    """All sensors of the map but the compass, each one's."""
    here = Surroundings(IMAGE)
    bench, board = here.bench, here.bench.pins
    for pin in (WHISKER, 7, RECEIVER, 3):
        bench.drive(pin, Level.HIGH)
    here.begin(
        Devices.WHISKER | Devices.INFRARED | Devices.PING | Devices.BATTERY | Devices.LIGHT | Devices.ANALOG_INFRARED
    )
    here.line.set("infrared_sweep", 1)
    lights = [LightSensor(bench, pin, DECAYS_US) for pin in LIGHTS]

    def shine(bright: bool) -> None:
        for one in lights:
            one.shine(bright)

    start = bench.now + 20 * TICK_CYCLES
    here.change("whisker", start, 643_009, lambda on: bench.drive(WHISKER, Level(not on)))
    here.change("receiver", start, 2_416_001, lambda on: None)
    here.change("ping", start, 1_620_947, lambda on: None)
    here.change("battery", start, 642_003, lambda on: board.analog(BATTERY_CHANNEL, BATTERY_V[on]))
    here.change("supply", start, 480_601, lambda on: board.supply(SUPPLY_V[on]))
    here.change("light", start, 964_001, shine)
    # Just after a measurement of the sensor has begun, its worst; three of those later the board's phase is another.
    here.change("analog_infrared", start + 1, 3 * SHARP_PERIOD + 1, lambda on: None)
    Held(
        here, "analog_infrared", start, (SHARP_PERIOD, SHARP_LATE), lambda on: board.analog(SHARP_CHANNEL, SHARP_V[on])
    )
    board.analog(BATTERY_CHANNEL, BATTERY_V[0])
    board.analog(SHARP_CHANNEL, SHARP_V[0])
    bench.sources.append(RangeFinder(PING, here.stimuli["ping"], ECHOES_US))
    Receiver(bench, LEDS[0], RECEIVER, here.stimuli["receiver"])
    here.run(SECONDS)
    yield here
    bench.close()


def is_of(value: float, pair: tuple[float, float], on: bool) -> bool:
    """Whether it is nearer to what stands for that state than to the other."""
    return abs(value - pair[on]) < abs(value - pair[not on])


def volts(reported: int) -> float:
    """Of a ratio in 1/1024 of the supply, at the one or the other of its two values."""
    return reported / 1024 * SUPPLY_V[0]


def test_whiskers(around: Surroundings) -> None:
    check(around.ages("whisker", Telemetry, lambda reported, on: bool(reported.whiskers & 1) == on), "whisker", 0.5)


def test_infrared(around: Surroundings) -> None:
    """The left receiver, which is looked at first."""
    check(around.ages("receiver", Telemetry, lambda reported, on: bool(reported.infrared & 1) == on), "infrared", 0.9)


def test_infrared_zone(around: Surroundings) -> None:
    found = around.ages(
        "receiver", DevicesTelemetry, lambda reported, on: bool(reported.infrared_zone_left == (0, 5)[on])
    )
    check(found, "infrared_zone", 0.9)


def test_ping(around: Surroundings) -> None:
    """Echoes as late as they come."""
    told_as = (PingStatus.OK, PingStatus.NOTHING_NEAR)
    check(around.ages("ping", Telemetry, lambda reported, on: reported.ping_status == told_as[on]), "ping", 0.9)


def test_analog_infrared(around: Surroundings) -> None:
    """The slowest sensor of its kind, at its worst phase."""
    found = around.ages(
        "analog_infrared", DevicesTelemetry, lambda reported, on: is_of(volts(reported.analog_infrared), SHARP_V, on)
    )
    check(found, "analog_infrared", 0.9)


def test_battery(around: Surroundings) -> None:
    found = around.ages("battery", DevicesTelemetry, lambda reported, on: is_of(volts(reported.battery), BATTERY_V, on))
    check(found, "battery", 0.5)


def test_supply(around: Surroundings) -> None:
    """The row is of the worst slot that the bandgap's conversion may have come to; here it is that of the start."""
    found = around.ages("supply", Telemetry, lambda reported, on: is_of(reported.supply / 1000, SUPPLY_V, on))
    check(found, "supply", 0.5)


def test_light(around: Surroundings) -> None:
    """A decay that the light changed in has old light in it."""

    def shows(reported: DevicesTelemetry, on: bool) -> bool:
        return all(abs(us - DECAYS_US[on]) <= 20 for us in (reported.light_left, reported.light_right))

    check(around.ages("light", DevicesTelemetry, shows), "light", 0.9)


def test_encoders() -> None:
    """Four lines of 4 kHz. The row is the slot, of which telemetry takes but a part unless its tasks are at their
    budgets: how near the ages come says how busy this board is, nothing of the row."""
    around = Surroundings(ENCODER_IMAGE)
    row = next(row for row in read_table(ENCODER_IMAGE).sensors if row.name == "encoder")
    try:
        around.begin(Devices.ENCODER)
        trains = wheels([(14, 15), (16, 17)], 4000, around.bench.now + TICK_CYCLES)
        around.bench.sources += [train for wheel in trains for train in wheel]
        base = around.line.newest
        since = len(around.line.telemetry) + 2
        assert base is not None
        around.run(1.0)
    finally:
        around.bench.close()
    ages, delays = [], []
    for side, wheel in zip(("left", "right"), trains, strict=True):
        edges = np.sort(np.concatenate([train.edges for train in wheel]))
        total = [getattr(heard.message, f"encoder_{side}") for heard in around.line.telemetry[since:]]
        before = total[0] - getattr(base, f"encoder_{side}")
        for heard in around.line.telemetry[since + 1 :]:
            counted = getattr(heard.message, f"encoder_{side}") - getattr(base, f"encoder_{side}")
            ages.append(max(0, heard.first - int(edges[counted])) / CYCLES_PER_US)
            delays.append((heard.first - int(edges[before])) / CYCLES_PER_US if counted > before else 0.0)
            before = counted
    print(f"encoders: row {row.age} us, measured {max(ages):.0f} us, to telemetry {max(delays):.0f} us")
    assert len(ages) >= 180 and 0 < max(ages) <= row.age
    assert TELEMETRY_US / 2 < max(delays) <= row.age + TELEMETRY_US


def test_compass() -> None:
    """A module that measures by its own clock; each transfer takes what its registers hold."""
    around = Surroundings(IMAGE)
    bench = around.bench
    try:
        device = TwoWireDevice(bench.pins, 0x1E)
        told_x = (100, 1000)

        def hold(on: bool) -> None:
            device.registers[3:5] = told_x[on].to_bytes(2, "big")

        around.begin(Devices.COMPASS | Devices.BATTERY)
        start = bench.now + 20 * TICK_CYCLES
        around.change("compass", start + 1, 8 * COMPASS_RUNS + 1, lambda on: None)
        Held(around, "compass", start, (COMPASS_RUNS, 0), hold)
        hold(False)
        around.run(2.5)
        found = around.ages("compass", DevicesTelemetry, lambda reported, on: bool(reported.compass_x == told_x[on]))
    finally:
        bench.close()
    check(found, "compass", 0.85)


# ---- how long a reading takes in hardware ----------------------------------------------------------------------------


def bursts(around: Surroundings, pin: int) -> list[tuple[int, int]]:
    """First and last edge of each burst of the carrier on a pin."""
    cycles = np.array([edge.cycle for edge in around.bench.edges[pin]], dtype=np.int64)
    groups = np.split(cycles, np.where(np.diff(cycles) > 16_000)[0] + 1)
    return [(int(group[0]), int(group[-1])) for group in groups if len(group) > 10]


def test_infrared_takes_two_bursts_and_a_zone_five_of_both(around: Surroundings) -> None:
    left, right = (bursts(around, pin) for pin in LEDS)
    ends = [end for _, end in right]
    one = {round((ends[bisect_right(ends, begin)] - begin) / CYCLES_PER_US) for begin, _ in left[5:-5]}
    assert abs(max(one) - ROWS["infrared"].conversion) <= 2 * 13, "a half period at each end"
    five = {round((ends[bisect_right(ends, left[n][0]) + 4] - left[n][0]) / CYCLES_PER_US) for n in range(20, 120)}
    print(f"infrared: {min(one)} to {max(one)} us, five: {min(five)} to {max(five)} us")
    assert abs(max(five) - ROWS["infrared_zone"].conversion) <= 2 * 13


def test_ping_takes_trigger_hold_off_and_echo(around: Surroundings) -> None:
    """The longest echo is measured, not given up; that it is reported is in test_ping."""
    triggers = Pin(around.bench, PING).all_pulses(1)
    widths = triggers[triggers[:, 1] < 1_000, 1] / CYCLES_PER_US
    assert len(widths) >= SECONDS * 19
    whole = widths + ECHO_DELAY_CYCLES / CYCLES_PER_US + ECHO_LONGEST_US
    print(f"ping: row {ROWS['ping'].conversion} us, measured {whole.min():.1f} to {whole.max():.1f} us")
    assert np.all((whole >= ROWS["ping"].conversion) & (whole <= ROWS["ping"].conversion + 12)), "an interrupt in it"


def test_analog_conversions_take_13_of_the_converters_clocks() -> None:
    """From the bit's setting to its clearing, which waits for the clock's next edge (data sheet, 24.4)."""
    around = Surroundings(IMAGE)
    try:
        around.begin(Devices.BATTERY)
        began, spans = None, []
        end = around.bench.now + 10 * TICK_CYCLES
        while around.bench.now < end:
            around.bench.robot.run_to_edge(around.bench.now + SLICE, ())
            busy = around.bench.pins.read_memory(ADCSRA, 1)[0] & ADSC
            if busy and began is None:
                began = around.bench.now
            elif not busy and began is not None:
                spans.append((around.bench.now - began) / CYCLES_PER_US)
                began = None
    finally:
        around.bench.close()
    print(f"conversions: {min(spans):.0f} to {max(spans):.0f} us")
    assert len(spans) >= 15
    slack = 2 * SLICE / CYCLES_PER_US
    for name in ("battery", "supply"):
        row = ROWS[name].conversion
        assert row - slack <= min(spans) and max(spans) <= row + ADC_CLOCK_US + slack


@pytest.mark.parametrize("decay_us", [13_900, 16_000])
def test_light_takes_its_longest_decay(decay_us: int) -> None:
    """All of it is waited for, and no more is reported."""
    around = Surroundings(IMAGE)
    try:
        around.begin(Devices.LIGHT | Devices.BATTERY)
        for pin in LIGHTS:
            LightSensor(around.bench, pin, (decay_us, decay_us))
        around.run(0.2)
        reported = next(one.message for one in reversed(around.line.heard) if isinstance(one.message, DevicesTelemetry))
    finally:
        around.bench.close()
    assert ROWS["light"].conversion == LIGHT_LONGEST_US
    for us in (reported.light_left, reported.light_right):
        assert -2 <= us - min(decay_us, LIGHT_LONGEST_US) <= 9, "interrupts keep its stamp waiting"
