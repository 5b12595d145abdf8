"""What a board has to bear while its times are measured.

A scenario is a function of its seed alone: the seed stands for a handful of numbers, the phases of all that comes from
outside and what the host asks for, so that a search may change one of them at a time, and whoever has the seed sees the
same run again.

Periods share no factor with the control tick, so that a longer run sweeps the phases by itself.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from math import prod

from boebot import robots
from boebot.link import frame, messages
from boebot.robots import RobotDescription
from sim_bridge.timing.line import BYTE_CYCLES, Line
from sim_bridge.timing.loads import Bench, Contact, Ping, PulseTrain, wheels

SETPOINT_PERIOD = 159_979  # cycles: a prime just below the control tick
EDGES_PER_S = {"figures": 1500, "saturated": 4000, "noise": 1500, "everything": 1500}
NOISE_PERIOD = 80  # cycles from edge to edge of a 100 kHz square wave
CONTACT_PERIOD, BOUNCE = 799_999, 20_011  # cycles between two touches, and how long one lasts
DEVICES = messages.Devices
SILENCE = 5_600_000  # cycles at the end of "everything": the dead man's 250 ms and the tasks that follow
FIGURE_DEVICES = DEVICES.SERVOS | DEVICES.ENCODERS | DEVICES.WHISKERS | DEVICES.INFRARED | DEVICES.PING


@dataclass(frozen=True, slots=True)
class Numbers:
    """What a seed stands for; each is below its place in RANGES."""

    line: int  # cycles from the end of the preparations to the host's first byte
    wheels: int  # to the first edge of an encoder
    contact: int  # to the first touch of a whisker
    echo: int  # by how much the first echo is longer than the shortest, cycles
    signal: int  # left motor signal + 10,000, in 1/10,000
    frame: int  # bytes on a full line of each frame, less 20
    mix: int  # what the host asks for


RANGES = {
    "line": 160_000,
    "wheels": 40_000,
    "contact": 800_000,
    "echo": 288_000,
    "signal": 20_001,
    "frame": 21,
    "mix": 65_536,
}
STATES = prod(RANGES.values())
SPREAD = pow(2**61 - 1, 1, STATES)  # shares no factor with STATES: neighbouring seeds are as different as any
BACK = pow(SPREAD, -1, STATES)


def numbers_of(seed: int) -> Numbers:
    """The numbers that a seed stands for."""
    rest, values = seed * SPREAD % STATES, {}
    for name, size in RANGES.items():
        rest, values[name] = divmod(rest, size)
    return Numbers(**values)


def seed_of(numbers: Numbers) -> int:
    """The least seed that stands for those numbers."""
    packed = 0
    for field in reversed(fields(numbers)):
        packed = packed * RANGES[field.name] + getattr(numbers, field.name)
    return packed * BACK % STATES


# ---- hosts -----------------------------------------------------------------------------------------------------------


class Setpoints:
    """A set-point each tick; see Source."""

    def __init__(self, line: Line, numbers: Numbers, first: int) -> None:
        self._line, self._next = line, first
        self._signals = (numbers.signal - 10_000, 10_000 - numbers.signal // 2)

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        del bench
        while self._next < until:
            self._line.send(messages.SetpointSignal(*self._signals, 250, self._line.tick), self._next)
            self._next += SETPOINT_PERIOD


class FullLine:
    """50,000 bytes/s both ways: each frame takes 20 to 40 bytes of the line, delimiters behind it included; answers
    and telemetry fill the way back. See Source."""

    def __init__(self, line: Line, numbers: Numbers, first: int) -> None:
        self._line, self._first = line, first
        self._bytes = 20 + numbers.frame
        self._signals = (numbers.signal - 10_000, 10_000 - numbers.signal // 2)
        self._identify = 2 + numbers.mix % 9
        self._count = 0
        self._request = line.numbered(messages.SetParameter, messages.PARAMETERS["track_width"].id, 10_000)

    def queue(self, bench: Bench, until: int) -> None:
        """See Source. The board answers a request that comes again as it answered the first time."""
        line = self._line
        while (at := max(self._first, line.free, bench.now)) < until:
            line.send(self._message(), at)
            padding = self._bytes - (line.free - at) // BYTE_CYCLES
            if padding > 0:
                bench.access.send(bytes(padding), at=line.free)
                line.free += padding * BYTE_CYCLES
            self._count += 1

    def _message(self) -> messages.SetpointSignal | messages.SetParameter | messages.Identify:
        if self._count % 10 == 0:
            return messages.SetpointSignal(*self._signals, 250, self._line.tick)
        return messages.Identify() if self._count % self._identify == 1 else self._request


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
        bench.access.send(bytes(wire), at=begin)
        self._line.free = begin + len(wire) * BYTE_CYCLES

    def _endless(self) -> Iterator[object]:
        pick, line = self._random, self._line
        known = messages.PARAMETERS
        yield line.numbered(messages.SaveParameters)
        while True:
            self._token = self._token % 255 + 1
            signals = pick.randrange(-10_000, 10_001), pick.randrange(-10_000, 10_001)
            changed = pick.choice(("track_width", "infrared_period", "ping_period", "encoder_limit", "servo_left_gain"))
            value = pick.randrange(known[changed].minimum, known[changed].maximum + 1)
            kinds: list[Callable[[], object]] = [
                lambda signals=signals: messages.SetpointSignal(*signals, 250, line.tick),
                lambda signals=signals: messages.SetpointSpeed(signals[0] // 8, signals[1] // 8, 250, line.tick),
                lambda: messages.SetpointCoast(250, line.tick),
                lambda: messages.Buzzer(pick.randrange(40, 8001), pick.randrange(1, 20), self._token),
                lambda: messages.Turret(pick.randrange(-15_000, 15_001), 1),
                lambda changed=changed, value=value: line.numbered(messages.SetParameter, known[changed].id, value),
                lambda changed=changed: line.numbered(messages.SetParameter, known[changed].id, 2**31 - 1),
                lambda: line.numbered(messages.GetParameter, pick.randrange(40)),
                lambda: messages.Identify(),
                lambda: messages.Describe(pick.randrange(30), 0),
                lambda: messages.ClockProbe(pick.randrange(65_536)),
                lambda: messages.Open(messages.PROTOCOL_VERSION, 1, 2),
                lambda: messages.SetpointSignal(0, 0, 250, (line.tick - 400) & 0xFFFF),  # too late
                lambda: messages.Arm(1, 0),  # out of order
            ]
            weights = [6, 4, 1, 2, 2, 3, 2, 3, 1, 1, 2, 1, 1, 1]
            yield pick.choices(kinds, weights)[0]()


# ---- preparation -----------------------------------------------------------------------------------------------------


def encoder_pins(robot: RobotDescription) -> list[tuple[int, ...]]:
    """The encoder lines of each wheel, one or two each."""
    lines: list[tuple[int, ...]] = []
    for device in robot.device.values():
        if isinstance(device, robots.Encoder):
            lines.append((robots.pin_number(device.pin),))
        elif isinstance(device, robots.QuadratureEncoder):
            lines.append((robots.pin_number(device.pin_a), robots.pin_number(device.pin_b)))
    return lines


def built(robot: RobotDescription) -> DEVICES:
    """All devices that the robot's pin map has."""
    found = DEVICES(0)
    for bit, name in messages.DEVICE_OF_BIT.items():
        if name in robot.device:
            found |= bit
    return found


def prepare(bench: Bench, robot: RobotDescription, scenario: str) -> Line:
    """Opens a session with the board, switches on what the scenario needs, and arms the motors."""
    line = Line(bench)
    line.open()
    devices = built(robot) if scenario == "everything" else built(robot) & FIGURE_DEVICES
    line.set("devices", int(devices))
    line.set("infrared_period", 2)
    line.set("infrared_sweep", 1)
    line.set("ping_period", messages.PARAMETERS["ping_period"].minimum)
    if scenario == "everything":
        line.set("devices_period", 1)
    line.arm()
    return line


def load(bench: Bench, line: Line, robot: RobotDescription, scenario: str, numbers: Numbers, cycles: int) -> None:
    """Begins what the scenario does to a board that is prepared, for so many cycles from now."""
    start = bench.now + 2_000
    lines = encoder_pins(robot)
    trains = [train for wheel in wheels(lines, EDGES_PER_S[scenario], start + numbers.wheels) for train in wheel]
    if scenario == "noise" and trains:
        trains[0] = PulseTrain(trains[0].pin, NOISE_PERIOD, start + numbers.wheels)
    bench.sources += trains
    first = start + numbers.line
    if scenario == "everything":
        whiskers = [d for d in robot.device.values() if isinstance(d, robots.Whisker)]
        bench.sources += [
            Contact(robots.pin_number(d.pin), CONTACT_PERIOD + 2 * i, BOUNCE, start + numbers.contact // (i + 1))
            for i, d in enumerate(whiskers)
        ]
        bench.sources.append(AllSorts(line, numbers, first, max(first, bench.now + cycles - SILENCE)))
        return
    for device in robot.device.values():
        if isinstance(device, robots.Ping):
            bench.sources.append(Ping(robots.pin_number(device.pin), step=23_459 + numbers.echo))
    bench.sources.append((FullLine if scenario == "saturated" else Setpoints)(line, numbers, first))
