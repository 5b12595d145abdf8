"""One run under a load: what acts on the board, and all that is kept of it.

Periods of all that comes from outside share no factor with the control tick, so that a run sweeps the phases; another
`seed` begins at other ones. Nothing is added to the image, and nothing read from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.device import pin_number
from boebot.link import messages
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import TICK_CYCLES, Contact, Ping, PulseTrain, wheels, with_noise
from boebot_timing.emulated.scenarios import EDGES_PER_S
from boebot_timing.emulated.traffic import SETPOINT_PERIOD, EachTick, FullLine
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import Level

Progress = Callable[[float], None]

CENTRE, GAIN = 24_000, 3_200  # cycles of the pulses that stand for signals 0 and 1, set before the run
MIRROR = {"left": 1, "right": -1}  # the right servo turns the other way round
PHASE_STEP = 7_919  # cycles from one seed's beginning to the next one's, a prime
DRAIN_TICKS = 20  # after a run, for what is under way
# cycles, from one closing to the next: what remains of whole ticks, and of whole sweeps, sweeps both evenly
CONTACT_PERIODS = {"whisker left": 2_178_887, "whisker right": 2_338_897}
CONTACT_CLOSED = 1_120_000  # cycles
PROBE_PERIOD = 311_009  # cycles; shares no factor with the tick
HOLD = 1_113_007  # cycles from one change of the motor signals to the next: three servo frames at least
SIGNALS = ((3000, -3000), (-1500, 4500))  # in 1/10000; the widths of all of them are whole cycles


class Change(NamedTuple):
    """A set-point that asks for other pulses than the one before: the cycle at which its last byte had come."""

    arrived: int
    signals: tuple[int, int]


class Probe(NamedTuple):
    """A question for the board's time: the cycle at which its last byte had come."""

    arrived: int
    token: int


class Asking(EachTick):
    """Other set-points now and then, and with them probes of the board's clock; what was asked is kept."""

    PROBED_AFTER = SETPOINT_PERIOD // 3  # cycles from a set-point to a probe

    def __init__(self, line: Line, first: int) -> None:
        super().__init__(line, first, SIGNALS[0])
        self.changes: list[Change] = []
        self.probes: list[Probe] = []
        self.newest = self._change_at = self._probe_at = first
        """`newest`: the cycle at which the last byte of the last set-point has arrived"""
        self.muted = False
        """no set-point more"""

    def setpoint(self, at: int) -> int:
        """See EachTick."""
        if self.muted:
            return at
        changed = at >= self._change_at
        if changed:
            self._change_at += HOLD
            self.signals = SIGNALS[(len(self.changes) + 1) % len(SIGNALS)]
        self.newest = super().setpoint(at)
        if changed:
            self.changes.append(Change(self.newest, self.signals))
        if at >= self._probe_at:
            self._probe_at += PROBE_PERIOD
            token = len(self.probes) & 0xFFFF
            arrived = self.line.send(messages.ClockProbe(token), at + self.PROBED_AFTER)
            self.probes.append(Probe(arrived, token))
        return self.newest


class AskingWithoutAGap(Asking, FullLine):
    """The same on a full line."""

    PROBED_AFTER = 0


@dataclass
class Run:
    """What acted on a board and what was seen of it under one load."""

    load: (
        str  # "figures" or "overload": a set-point and telemetry each tick, or frames back to back and noise on a line
    )
    edges_per_s: int  # of each encoder line
    bench: Bench
    line: Line
    pins: dict[str, int]
    begun: int
    ended: int
    traffic: Asking
    encoders: list[list[PulseTrain]]  # lines by wheel; none of a wheel that has a noisy one
    contacts: dict[str, Contact]
    ping: Ping


def drive(bench: Bench, load: str, seconds: float, seed: int, share: Progress, edges_per_s: int | None = None) -> Run:
    """Runs a board under a load for that long, and then until all that was under way has come."""
    edges_per_s = edges_per_s or EDGES_PER_S[load]
    line = Line(bench)
    robot = load_robot(line.open().robot.split(b"\0", 1)[0].decode())
    pins = pins_of(robot)
    for pin in (pin for name, pin in pins.items() if name.startswith(("whisker", "ir"))):  # nothing is seen
        bench.drive(pin, Level.HIGH)
    prepare(line)
    first = bench.now + TICK_CYCLES + seed * PHASE_STEP % TICK_CYCLES
    lines = [tuple(pin for name, pin in pins.items() if name.startswith(f"encoder {side}")) for side in MIRROR]
    traffic = AskingWithoutAGap(line, first) if load == "overload" else Asking(line, first)
    turning = wheels([one for one in lines if one], edges_per_s, first)
    noisy = load == "overload" and bool(turning)
    run = Run(
        load=load,
        edges_per_s=edges_per_s,
        bench=bench,
        line=line,
        pins=pins,
        begun=first + TICK_CYCLES,
        ended=first + TICK_CYCLES + round(seconds * 16e6),
        traffic=traffic,
        encoders=[[], *turning[1:]] if noisy else turning,
        contacts={
            name: Contact(pins[name], period, CONTACT_CLOSED, first + 3 * TICK_CYCLES + number * PHASE_STEP)
            for number, (name, period) in enumerate(CONTACT_PERIODS.items())
        },
        ping=Ping(pins["ping"]),
    )
    trains = with_noise(turning, first) if noisy else [train for wheel in turning for train in wheel]
    bench.sources += [*trains, *run.contacts.values(), run.ping, traffic]
    while bench.now < run.ended:
        bench.run(TICK_CYCLES)
        share(min(1.0, 1.0 - (run.ended - bench.now) / (seconds * 16e6)))
    bench.sources[:] = [run.ping]  # an echo ends that has begun
    bench.run(DRAIN_TICKS * TICK_CYCLES)
    return run


def pins_of(robot: RobotDescription) -> dict[str, int]:
    """The pins that are looked at or driven, by what is there: "servo left", "encoder left a", "ir right", ..."""
    found = {}
    parts = {"": ("pin", "receiver_pin"), " a": ("pin_a",), " b": ("pin_b",)}
    for name in ("servo", "encoder", "whisker", "infrared"):
        for side in MIRROR:
            device = robot.device.get(f"{name}_{side}")
            for part, fields in parts.items():
                for pin in (getattr(device, one, None) for one in fields):
                    if pin is not None:
                        found[f"{'ir' if name == 'infrared' else name} {side}{part}"] = pin_number(pin)
    found["ping"] = pin_number(getattr(robot.device.get("ping"), "pin", 8))
    return found


def prepare(line: Line) -> None:
    """All that the loads name is on and at its fastest; the motors are armed."""
    line.set("ping_period", int(messages.PARAMETERS["ping_period"].minimum))
    line.set("infrared_sweep", 1)
    line.set("encoder_gap", 0)  # these edges do not bounce
    line.set("infrared_period", int(messages.PARAMETERS["infrared_period"].minimum))
    for side, mirror in MIRROR.items():
        line.set(f"servo_{side}_centre", CENTRE)
        line.set(f"servo_{side}_gain", mirror * GAIN)
    line.arm()
