"""What a board has to bear while its times are measured.

A scenario is a function of its seed alone: the seed stands for a handful of numbers, the phases of all that comes from
outside and what the host asks for, so that a search may change one of them at a time, and the same seed gives the
same run again.

Periods share no factor with the control tick, so that a longer run sweeps the phases by itself.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from math import gcd, prod

from boebot.description.board_parameters import devices_values
from boebot.description.robots import RobotDescription
from boebot.devices.compass import MagneticCompass
from boebot.devices.device import pin_number
from boebot.devices.encoder import QuadratureEncoder, SingleEncoder
from boebot.devices.ping import PingSensor
from boebot.devices.whisker import WhiskerSwitch
from boebot.link import frame, messages
from boebot_timing.emulated.line import BYTE_CYCLES, Line
from boebot_timing.emulated.loads import Bursts, Contact, Ping, PulseTrain, wheels, with_noise
from boebot_timing.emulated.traffic import EachTick, FullLine
from sim_bridge.bench.bench import Bench, Source

EDGES_PER_S = {"figures": 1500, "overload": 4000, "faults": 1500, "everything": 1500}
BURSTS = ((10, 120, 101_009), (110, 300, 397_001))  # edges, cycles apart and to the next burst: too close; too many
BOUNCE_PERIOD, BOUNCE_CLOSED = 283_007, 90_001  # "faults": two slots are a touch, four without one its end
CONTACT_PERIOD, BOUNCE = 799_999, 20_011  # cycles between two touches, and how long one lasts
SHORT_LIFE_MS = 18  # of a set-point in "faults": telemetry is a tick old at most when it is answered
DEVICES = messages.Devices
STUCK, NEVER_AGAIN = 1_600_000, 1 << 60  # cycles for which the two-wire bus is held, once
SILENCE = 13_600_000  # cycles at the end of "everything": 250 ms to the dead man, 500 ms to the fallback's first move
FALLBACK_AFTER_MS = 20  # the host never pauses for that long before
CHANGED = ("track_width", "infrared_period", "ping_period", "encoder_limit", "servo_left_gain")
FIGURE_DEVICES = DEVICES.SERVO | DEVICES.ENCODER | DEVICES.WHISKER | DEVICES.INFRARED | DEVICES.PING
FAULT_DEVICES = FIGURE_DEVICES | DEVICES.TURRET | DEVICES.BUZZER


@dataclass(frozen=True, slots=True)
class Numbers:
    """What a seed stands for; each is below its place in RANGES."""

    line: int  # cycles from the end of the preparations to the host's first byte
    wheels: int  # to the first edge of an encoder
    contact: int  # to the first touch of a whisker
    echo: int  # by how much the first echo is longer than the shortest, cycles
    signal: int  # left motor signal + 10,000, in 1/10,000
    mix: int  # what the host asks for in "everything"


RANGES = {
    "line": 160_000,
    "wheels": 40_000,
    "contact": 800_000,
    "echo": 288_000,
    "signal": 20_001,
    "mix": 65_536,
}
STATES = prod(RANGES.values())
GOLDEN = STATES * 6_180_339_887_498_948_482 // 10**19
SPREAD = next(n for n in count(GOLDEN) if gcd(n, STATES) == 1)  # neighbouring seeds differ in all numbers


def numbers_of(seed: int) -> Numbers:
    """The numbers that a seed stands for."""
    rest, values = seed * SPREAD % STATES, {}
    for name, size in RANGES.items():
        rest, values[name] = divmod(rest, size)
    return Numbers(**values)


# ---- hosts -----------------------------------------------------------------------------------------------------------


class AllSorts:
    """Whatever a host can send, and damaged frames, in a random order; at `last` it falls silent. See Source."""

    def __init__(self, line: Line, numbers: Numbers, first: int, last: int) -> None:
        self._line, self._next, self._last = line, first, last
        self._random = random.Random(numbers.mix)
        self._asks = self._endless()
        self._token = 0

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        while self._next < min(until, self._last):
            if self._random.random() < 0.08:
                self._damaged(bench)
            else:
                self._line.send(next(self._asks), self._next)
            self._next += self._random.choice((9_973, 24_989, 49_999, 99_991))

    def _damaged(self, bench: Bench) -> None:
        """A frame of any length with a bit that is wrong, or a piece of one."""
        payload = self._random.randbytes(self._random.randrange(1, frame.LONGEST_PAYLOAD))
        wire = bytearray(frame.encode(messages.SetParameter.ID, 0, payload, self._line.seed))
        wire[self._random.randrange(1, len(wire) - 1)] ^= 1 << self._random.randrange(8)
        begin = max(self._next, self._line.free, bench.now)
        bench.send(bytes(wire), at=begin)
        self._line.free = begin + len(wire) * BYTE_CYCLES

    def _endless(self) -> Iterator[object]:
        yield self._line.numbered(messages.SaveParameters)
        while True:
            make = self._random.choices(
                [self._setpoint, self._device, self._parameter, self._question, self._refused], [11, 4, 5, 7, 4]
            )[0]
            yield make()

    def _setpoint(self) -> object:
        left, right = (self._random.randrange(-10_000, 10_001) for _ in range(2))
        kind, tick = self._random.choices(("signal", "speed", "coast"), [6, 4, 1])[0], self._line.tick
        if kind == "coast":
            return messages.SetpointCoast(250, tick)
        if kind == "speed":
            return messages.SetpointSpeed(left // 8, right // 8, 250, tick)
        return messages.SetpointSignal(left, right, 250, tick)

    def _device(self) -> object:
        if self._random.random() < 0.5:
            return messages.Turret(self._random.randrange(-15_000, 15_001), 1)
        self._token = self._token % 255 + 1
        return messages.Buzzer(self._random.randrange(40, 8001), self._random.randrange(1, 20), self._token)

    def _parameter(self) -> object:
        spec = messages.PARAMETERS[self._random.choice(CHANGED)]
        value = self._random.randrange(spec.minimum, spec.maximum + 1)
        if self._random.random() < 0.4:
            value = 2**31 - 1  # out of range
        return self._line.numbered(messages.SetParameter, spec.id, value)

    def _question(self) -> object:
        kind = self._random.choices(("get", "identify", "describe", "probe"), [3, 1, 1, 2])[0]
        if kind == "get":
            return self._line.numbered(messages.GetParameter, self._random.randrange(40))
        if kind == "identify":
            return messages.Identify()
        if kind == "describe":
            return messages.Describe(self._random.randrange(30), 0)
        return messages.ClockProbe(self._random.randrange(65_536))

    def _refused(self) -> object:
        kind = self._random.choice(("open", "late", "order"))
        if kind == "open":
            return messages.Open(messages.PROTOCOL_VERSION, 1, 2)
        if kind == "late":
            return messages.SetpointSignal(0, 0, 250, (self._line.tick - 400) & 0xFFFF)
        return messages.Arm(1, 0)


class Deaf:
    """A host that acknowledges no event, stops and arms the motors again and again, and lets each set-point run out.

    So events of all kinds come while the board's queue of them is full. See Source.
    """

    STEP = 99_991  # cycles, a prime: set-points come every fourth, and a stop every 24th

    def __init__(self, line: Line, first: int) -> None:
        line.acknowledges = False
        self._line, self._next, self._count = line, first, 0

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        del bench
        while self._next < until:
            for message in self._messages():
                self._line.send(message, self._next)
            self._count += 1
            self._next += self.STEP

    def _messages(self) -> Sequence[object]:
        step, newest = self._count % 24, self._line.newest
        if step == 0:
            return [messages.Stop(0)]
        if step == 4 and newest is not None:
            return [self._line.numbered(messages.Arm, newest.latches)]
        if step % 4 or step < 8:
            return []
        token = self._count % 255 + 1
        return [
            messages.Turret(-9_000, 1),
            messages.Buzzer(1_000, 100, token),
            messages.SetpointSignal(2_000, -2_000, SHORT_LIFE_MS, self._line.tick),
        ]


# ---- preparation -----------------------------------------------------------------------------------------------------


def encoder_pins(robot: RobotDescription) -> list[tuple[int, ...]]:
    """The encoder lines of each wheel, one or two each."""
    lines: list[tuple[int, ...]] = []
    for device in robot.device.values():
        if isinstance(device, SingleEncoder):
            lines.append((pin_number(device.pin),))
        elif isinstance(device, QuadratureEncoder):
            lines.append((pin_number(device.pin_a), pin_number(device.pin_b)))
    return lines


def built(robot: RobotDescription) -> DEVICES:
    """All devices that the robot's pin map has."""
    found = DEVICES(0)
    for bit, left in messages.DEVICE_OF_BIT.items():
        if {left, left.replace("_left", "_right")} & set(robot.device):
            found |= bit
    return found


def prepare(bench: Bench, robot: RobotDescription, scenario: str) -> Line:
    """Opens a session with the board, switches on what the scenario needs, and arms the motors."""
    line = Line(bench)
    line.open()
    devices = built(robot) & {"everything": ~DEVICES(0), "faults": FAULT_DEVICES}.get(scenario, FIGURE_DEVICES)
    for name, value in devices_values(devices).items():
        line.set(name, int(value))
    line.set("infrared_period", 2)
    line.set("infrared_sweep", 1)
    line.set("encoder_gap", 0)  # these edges do not bounce
    line.set("ping_period", messages.PARAMETERS["ping_period"].minimum)
    if scenario == "everything":
        line.set("devices_period", 1)
        line.set("fallback_after", FALLBACK_AFTER_MS)
    line.arm()
    return line


def turn(bench: Bench, robot: RobotDescription, scenario: str, numbers: Numbers, start: int) -> list[list[PulseTrain]]:
    """Turns the wheels. Returns the encoder lines of each; a noisy wheel has none."""
    first = start + numbers.wheels
    turning = wheels(encoder_pins(robot), EDGES_PER_S[scenario], first)
    if scenario == "overload" and turning:
        bench.sources += with_noise(turning, first)
        return [[], *turning[1:]]
    noise: list[Source] = []
    if scenario == "faults":
        noise = [Bursts(wheel[0].pin, *burst, first) for wheel, burst in zip(turning, BURSTS, strict=False)]
    lines = [train for number, wheel in enumerate(turning) for train in wheel[number < len(noise) :]]
    bench.sources += [*noise, *lines]
    return [[] if number < len(noise) else wheel for number, wheel in enumerate(turning)]


def load(
    bench: Bench, line: Line, robot: RobotDescription, scenario: str, numbers: Numbers, cycles: int
) -> list[list[PulseTrain]]:
    """Begins what the scenario does to a board that is prepared, for that many cycles from now.

    Returns the encoder lines of each wheel; a noisy wheel has none.
    """
    start = bench.now + 2_000
    turning = turn(bench, robot, scenario, numbers, start)
    first = start + numbers.line
    whiskers = [d for d in robot.device.values() if isinstance(d, WhiskerSwitch)]
    if scenario == "everything":
        bench.sources += [
            Contact(pin_number(d.pin), CONTACT_PERIOD + 2 * i, BOUNCE, start + numbers.contact // (i + 1))
            for i, d in enumerate(whiskers)
        ]
        last = max(first, bench.now + cycles - SILENCE)
        bench.sources += [
            Contact(pin_number(d.sda_pin), NEVER_AGAIN, STUCK, last - STUCK)
            for d in robot.device.values()
            if isinstance(d, MagneticCompass)
        ]
        bench.sources.append(AllSorts(line, numbers, first, last))
        return turning
    for device in robot.device.values():
        if isinstance(device, PingSensor):
            bench.sources.append(Ping(pin_number(device.pin), step=23_459 + numbers.echo))
    if scenario == "faults":
        bench.sources += [
            Contact(pin_number(d.pin), BOUNCE_PERIOD, BOUNCE_CLOSED, start + numbers.contact) for d in whiskers
        ]
        bench.sources.append(Deaf(line, first))
        return turning
    signals = (numbers.signal - 10_000, 10_000 - numbers.signal // 2)
    bench.sources.append((FullLine if scenario == "overload" else EachTick)(line, first, signals))
    return turning
