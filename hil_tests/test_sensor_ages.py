"""The SENSOR rows of an image's timing table, measured at its pins: how old a reading is when telemetry takes it, and
how long one takes in hardware.

What a sensor sees is changed at phases that sweep its period. Telemetry that does not yet show all of a change was made
of a reading whose measurement had begun before it: from the change to the first byte of the last such telemetry is an
age that the row has to hold, and the next telemetry, a tick later at most, shows the change.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from boebot import resources
from boebot.link import messages
from boebot.link.messages import Devices, DevicesTelemetry, Telemetry
from boebot.timing.table import read_table
from hil_tests.device_bench import SLICE, TwoWireDevice
from sim_bridge.boards import avr
from sim_bridge.boards.board import BoardAccess, Level
from sim_bridge.timing.line import Line
from sim_bridge.timing.loads import CYCLES_PER_US, ECHO_DELAY_CYCLES, TICK_CYCLES, Bench, Ping, wheels

pytestmark = pytest.mark.emulated

IMAGE = resources.folder("images") / "boebot.elf"  # every sensor but the encoders
ENCODER_IMAGE = resources.folder("images") / "shieldbot-quad.elf"
ROWS = {row.name: row for row in read_table(IMAGE).sensors}

SECONDS = 8.0  # of the board's time
TELEMETRY_US = TICK_CYCLES // CYCLES_PER_US  # from one telemetry to the next
JITTER_US = 1_000  # of a telemetry's first byte: what else its slot does, more in one tick than in the next
PROBE_CYCLES = 1_600_000  # 0.1 s: a session lives as long as it hears of us
WHISKER, RECEIVER, PING = 5, 10, 8
LEDS = (9, 2)  # left and right, infra-red
LIGHTS = (15, 6)
BATTERY_CHANNEL, SHARP_CHANNEL = 0, 2
ECHO_LONGEST_US = 18_500  # Parallax #28015
LIGHT_LONGEST_US = 14_000  # what is darker is told as this
SHARP_PERIOD, SHARP_LATE = 766_400, 121_600  # cycles: 38.3 + 9.6 ms, 7.6 ms (GP2Y0A21)
COMPASS_PERIOD = 13_333 * CYCLES_PER_US  # 75 Hz (HMC5883L)
COMPASS_RUNS = COMPASS_PERIOD * 97 // 100  # 3 transfers' and 9 measurements' time would else stay in step
ADCSRA, ADSC = 0x7A, 0x40  # data sheet, 24.9.2: the bit is set while a conversion runs
ADC_CLOCK_US = 8  # 125 kHz


@dataclass
class Stimulus:
    """What one sensor sees: one of two states; when it changed into which."""

    period: int
    """cycles between two changes: longer than the age, and what remains of the sensor's period sweeps it"""
    apply: Callable[[bool], None]
    changes: list[tuple[int, bool]] = field(default_factory=lambda: [(0, False)])

    def at(self, cycle: int) -> bool:
        """The state at that time."""
        return self.changes[bisect_right(self.changes, cycle, key=lambda change: change[0]) - 1][1]

    @property
    def now(self) -> bool:
        """The newest state."""
        return self.changes[-1][1]


class Surroundings:
    """A board on a bench, and what is around it; everything happens at the cycle for which it is due."""

    def __init__(self, elf: Any = IMAGE) -> None:
        self.board: BoardAccess = avr.create(elf).access()
        self.bench = Bench(elf, self.board)
        self.line = Line(self.bench)
        self.stimuli: dict[str, Stimulus] = {}
        self._due: list[tuple[int, int, Callable[[], None]]] = []
        self._number = 0

    def begin(self, devices: Devices) -> None:
        """Opens a session with those devices on, each told as often as it can be."""
        self.line.open()
        self.line.set("devices", int(devices))
        if devices & Devices.BATTERY:
            self.line.set("devices_period", 1)
        self.bench.run(20 * TICK_CYCLES)
        self.each(self.bench.now + PROBE_CYCLES, PROBE_CYCLES, lambda: self.line.send(messages.ClockProbe(0)))

    def at(self, cycle: int, action: Callable[[], Any]) -> None:
        """Does something at that time."""
        self._number += 1
        heapq.heappush(self._due, (cycle, self._number, action))

    def each(self, first: int, period: int, action: Callable[[], Any]) -> None:
        """Does something again and again."""

        def once(cycle: int) -> None:
            action()
            self.at(cycle + period, lambda: once(cycle + period))

        self.at(first, lambda: once(first))

    def change(self, name: str, first: int, period: int, apply: Callable[[bool], None]) -> None:
        """Changes what a sensor sees, again and again."""
        self.stimuli[name] = stimulus = Stimulus(period, apply)

        def other() -> None:
            stimulus.changes.append((self.bench.now, not stimulus.now))
            apply(stimulus.now)

        self.each(first, period, other)

    def run(self, seconds: float, advance: Callable[[int], None] | None = None) -> None:
        """Lets time pass."""
        end = self.bench.now + round(seconds * 16e6)
        while self._due and self._due[0][0] < end:
            cycle, _, action = heapq.heappop(self._due)
            (advance or self.bench.run_until)(cycle)
            action()
        (advance or self.bench.run_until)(end)

    def ages(self, name: str, kind: type, shows: Callable[[Any, bool], bool]) -> Ages:
        """Of all changes of a stimulus, by the telemetry of that kind. `shows(message, state)`: it is of that state
        alone."""
        told = [heard for heard in self.line.heard if isinstance(heard.message, kind)]
        firsts = [heard.first for heard in told]
        changes = self.stimuli[name].changes[1:]
        ages, delays = [], []
        for (cycle, state), (until, _) in pairwise(changes):
            since = told[bisect_right(firsts, cycle) : bisect_right(firsts, until)]
            old = [number for number, heard in enumerate(since) if not shows(heard.message, state)]
            shown = old[-1] + 1 if old else 0
            assert shown < len(since), f"{name}: a change was never told"
            ages.append((since[shown - 1].first - cycle) / CYCLES_PER_US if old else 0.0)
            delays.append((since[shown].first - cycle) / CYCLES_PER_US)
        return Ages(name, np.array(ages), np.array(delays))


@dataclass
class Ages:
    """us from each change to the last telemetry that did not show it, and to the first that did."""

    name: str
    ages: np.ndarray
    delays: np.ndarray

    def check(self, row: str, share: float) -> None:
        """Against the row; the sweep has to find that share of it."""
        most = ROWS[row].age
        print(f"{row}: row {most} us, measured {self.ages.max():.0f} us, to telemetry {self.delays.max():.0f} us")
        assert len(self.ages) >= 15
        assert self.ages.max() <= most
        assert self.delays.max() <= most + TELEMETRY_US
        assert self.delays.max() <= self.ages.max() + TELEMETRY_US + JITTER_US, "telemetry was left out"
        assert self.ages.max() >= share * most, "the row says nothing"


class RangeFinder(Ping):
    """Answers a trigger with the echo of what is there at that time."""

    def __init__(self, pin: int, stimulus: Stimulus, lengths: tuple[int, int]) -> None:
        super().__init__(pin)
        self.stimulus, self.lengths = stimulus, lengths  # us

    def _answer(self, bench: Bench, triggered: int) -> None:
        if self.echoes and triggered < self.echoes[-1][1]:
            return
        rise = triggered + ECHO_DELAY_CYCLES
        fall = rise + self.lengths[self.stimulus.at(triggered)] * CYCLES_PER_US
        bench.access.drive(self.pin, Level.HIGH, at=rise)
        bench.access.drive(self.pin, Level.LOW, at=fall)
        self.echoes.append((rise, fall))


class LightSensor:
    """A capacitor that the board charges and the light discharges; `decays`: us, in either light."""

    def __init__(self, pin: int, decays: tuple[int, int]) -> None:
        self.pin, self.decays = pin, [us * CYCLES_PER_US for us in decays]
        self.bright = False
        self._seen = 0
        self._left, self._since = 0.0, 0  # charge, of 1, and when it was that
        self._falls: int | None = None

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. A decay takes longer than a slice."""
        del until
        for edge in bench.edges[self.pin][self._seen :]:
            self._seen += 1
            if edge.level == Level.HIGH:
                self._falls = None
                bench.access.drive(self.pin, Level.HIGH)
            else:
                self._left, self._since = 1.0, edge.cycle
                self._fall(bench)

    def shine(self, bench: Bench, bright: bool) -> None:
        """The light changes; what is left of the charge goes at the new rate."""
        self.queue(bench, bench.now)
        if self._falls is not None and bench.now < self._falls:
            self._left -= (bench.now - self._since) / self.decays[self.bright]
            self._since, self.bright = bench.now, bright
            self._fall(bench)
        self.bright = bright

    def _fall(self, bench: Bench) -> None:
        self._falls = self._since + round(self._left * self.decays[self.bright])
        bench.access.drive(self.pin, Level.LOW, at=self._falls)


class Held:
    """A sensor with a clock of its own: what was there when a measurement began comes out `late` cycles after its end,
    and stays until the next one does."""

    def __init__(
        self, around: Surroundings, name: str, first: int, timing: tuple[int, int], out: Callable[[bool], None]
    ) -> None:
        period, late = timing
        self._around, self._name, self._out, self._takes = around, name, out, period + late
        around.each(first, period, self._measure)

    def _measure(self) -> None:
        state = self._around.stimuli[self._name].now
        self._around.at(self._around.bench.now + self._takes, lambda: self._out(state))


DECAYS_US = (13_000, 2_000)
ECHOES_US = (18_000, ECHO_LONGEST_US)
BATTERY_V, SHARP_V, SUPPLY_V = (1.0, 3.0), (0.4, 2.4), (5.0, 4.6)


@pytest.fixture(scope="module")
def around() -> Iterator[Surroundings]:
    """All sensors of the map but the compass, each of its own."""
    here = Surroundings()
    bench, board = here.bench, here.board
    for pin in (WHISKER, 7, RECEIVER, 3):
        board.drive(pin, Level.HIGH)
    here.begin(
        Devices.WHISKERS | Devices.INFRARED | Devices.PING | Devices.BATTERY | Devices.LIGHT | Devices.ANALOG_INFRARED
    )
    here.line.set("infrared_sweep", 1)
    lights = [LightSensor(pin, DECAYS_US) for pin in LIGHTS]

    def shine(bright: bool) -> None:
        for one in lights:
            one.shine(bench, bright)

    start = bench.now + 20 * TICK_CYCLES
    here.change("whiskers", start, 643_009, lambda on: board.drive(WHISKER, Level(not on)))
    here.change("receiver", start, 2_416_001, lambda on: board.drive(RECEIVER, Level(not on)))
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
    bench.sources += [RangeFinder(PING, here.stimuli["ping"], ECHOES_US), *lights]
    here.run(SECONDS)
    yield here
    bench.close()


def is_of(value: float, pair: tuple[float, float], on: bool) -> bool:
    """Whether it is nearer to what stands for that state than to the other."""
    return abs(value - pair[on]) < abs(value - pair[not on])


def volts(told: int) -> float:
    """Of a ratio in 1/1024 of the supply, whichever of the two that is."""
    return told / 1024 * SUPPLY_V[0]


def test_whiskers(around: Surroundings) -> None:
    around.ages("whiskers", Telemetry, lambda told, on: bool(told.whiskers & 1) == on).check("whiskers", 0.5)


def test_infrared(around: Surroundings) -> None:
    """The left receiver, which is looked at first."""
    around.ages("receiver", Telemetry, lambda told, on: bool(told.infrared & 1) == on).check("infrared", 0.9)


def test_infrared_zone(around: Surroundings) -> None:
    found = around.ages("receiver", DevicesTelemetry, lambda told, on: bool(told.infrared_zone_left == (0, 5)[on]))
    found.check("infrared_zone", 0.9)


def test_ping(around: Surroundings) -> None:
    """Echoes as late as they come."""
    around.ages("ping", Telemetry, lambda told, on: abs(told.ping_echo - ECHOES_US[on]) <= 1).check("ping", 0.9)


def test_analog_infrared(around: Surroundings) -> None:
    """The slowest sensor of its kind, at its worst phase."""
    found = around.ages(
        "analog_infrared", DevicesTelemetry, lambda told, on: is_of(volts(told.analog_infrared), SHARP_V, on)
    )
    found.check("analog_infrared", 0.9)


def test_battery(around: Surroundings) -> None:
    found = around.ages("battery", DevicesTelemetry, lambda told, on: is_of(volts(told.battery), BATTERY_V, on))
    found.check("battery", 0.5)


def test_supply(around: Surroundings) -> None:
    """The row is of the worst slot that the bandgap's conversion may have come to; here it is that of the start."""
    found = around.ages("supply", Telemetry, lambda told, on: is_of(told.supply / 1000, SUPPLY_V, on))
    found.check("supply", 0.5)


def test_light(around: Surroundings) -> None:
    """A decay that the light changed in has old light in it."""

    def shows(told: DevicesTelemetry, on: bool) -> bool:
        return all(abs(us - DECAYS_US[on]) <= 20 for us in (told.light_left, told.light_right))

    around.ages("light", DevicesTelemetry, shows).check("light", 0.9)


def test_encoders() -> None:
    """Four lines of 4 kHz. The row is the slot, of which telemetry takes but a part unless its tasks are at their
    budgets: how near the ages come says how busy this board is, nothing of the row."""
    around = Surroundings(ENCODER_IMAGE)
    row = next(row for row in read_table(ENCODER_IMAGE).sensors if row.name == "encoders")
    try:
        around.begin(Devices.ENCODERS)
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
    around = Surroundings()
    bench = around.bench
    try:
        device = TwoWireDevice(around.board, 0x1E)
        told_x = (100, 1000)

        def advance(until: int) -> None:
            """In the steps that the bus needs where it may be at work: from slot 3 of a tick on."""
            begin, end = 113_000, 145_000
            while bench.now < until:
                into = (bench.now - told) % TICK_CYCLES
                if begin <= into < end:
                    around.board.run(SLICE)
                    device.step()
                else:
                    bench.run_until(min(until, bench.now + (begin - into) % TICK_CYCLES))

        def hold(on: bool) -> None:
            device.registers[3:5] = told_x[on].to_bytes(2, "big")

        around.begin(Devices.COMPASS | Devices.BATTERY)
        told = around.line.telemetry[-1].first
        start = bench.now + 20 * TICK_CYCLES
        around.change("compass", start + 1, 8 * COMPASS_RUNS + 1, lambda on: None)
        Held(around, "compass", start, (COMPASS_RUNS, 0), hold)
        hold(False)
        around.run(2.5, advance)
        found = around.ages("compass", DevicesTelemetry, lambda told, on: bool(told.compass_x == told_x[on]))
    finally:
        bench.close()
    found.check("compass", 0.85)


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
    assert max(abs(us - ROWS["infrared"].conversion) for us in one) <= 2 * 13, (
        "but for half a period of the carrier at each end"
    )
    five = {round((ends[bisect_right(ends, left[n][0]) + 4] - left[n][0]) / CYCLES_PER_US) for n in range(20, 120)}
    print(f"infrared: {min(one)} to {max(one)} us, five: {min(five)} to {max(five)} us")
    assert max(abs(us - ROWS["infrared_zone"].conversion) for us in five) <= 2 * 13


def test_ping_takes_trigger_hold_off_and_echo(around: Surroundings) -> None:
    """The longest echo is measured, not given up; see test_ping for its being told."""
    triggers = around.bench.pulses(PING)
    widths = triggers[triggers[:, 1] < 1_000, 1] / CYCLES_PER_US
    assert len(widths) >= SECONDS * 19
    whole = widths + ECHO_DELAY_CYCLES / CYCLES_PER_US + ECHO_LONGEST_US
    print(f"ping: row {ROWS['ping'].conversion} us, measured {whole.min():.1f} to {whole.max():.1f} us")
    assert np.all(np.abs(whole - ROWS["ping"].conversion) <= 1)


def test_analog_conversions_take_13_of_the_converters_clocks() -> None:
    """From the bit's setting to its clearing, which waits for the clock's next edge (data sheet, 24.4)."""
    around = Surroundings()
    try:
        around.begin(Devices.BATTERY)
        began, spans = None, []
        end = around.bench.now + 10 * TICK_CYCLES
        while around.bench.now < end:
            around.board.run(SLICE)
            busy = around.board.read_memory(ADCSRA, 1)[0] & ADSC
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
    """All of it is waited for, and no more is told."""
    around = Surroundings()
    try:
        around.begin(Devices.LIGHT | Devices.BATTERY)
        around.bench.sources += [LightSensor(pin, (decay_us, decay_us)) for pin in LIGHTS]
        around.run(0.2)
        told = next(one.message for one in reversed(around.line.heard) if isinstance(one.message, DevicesTelemetry))
    finally:
        around.bench.close()
    assert ROWS["light"].conversion == LIGHT_LONGEST_US
    for us in (told.light_left, told.light_right):
        assert abs(us - min(decay_us, LIGHT_LONGEST_US)) <= 2
