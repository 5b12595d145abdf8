"""Who notices what fails, or why it goes unnoticed: each fault in a run by itself on the native board, beside the same
run without it.

The robot drives to a wall, touches it and backs off, whatever its sensors say, without noise and other random draws.
So what differs from the run without the fault comes of the fault, as long as that does not change its way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from boebot.description.robots import RobotDescription
from boebot.imperfections import switches
from boebot.link.messages import EventKind, Hello
from boebot.record.columns import events
from boebot.record.interventions import Fault
from boebot.record.run import Run
from boebot.result import RunResult
from boebot.robot import Robot
from boebot.running.faults import UnfiredError, known
from boebot.running.hands import Hands, Onlooker
from boebot.running.loop import execute
from boebot.running.tasks import Request

ARENA, POSE = "room", (1.1, 1.0, 0.0)  # 0.4 m from a wall, and heading for it
BEGIN_S, BACK_S, END_S, SECONDS = 0.5, 2.5, 3.0, 4.5
FIGURES = {
    "bad_frames": "host: checksum",
    "lost_frames": "host: sequence",
    "late_steps": "host: late steps",
    "sessions_lost": "host: new session",
    "resets": "host: reset",
    "dead_man_stops": "board: dead-man",
}
BOARD = {"bad": "board: checksum", "late": "board: late set-points", "duplicate": "board: request numbers"}
DRAWN = [name for name in switches() if name not in ("coast_drag", "slip", "battery_sag")]  # with random draws
_STILL_M_S, _STILL_S = 0.01, 0.3
RESET = Fault("board.reset", "external", 1.0)  # beside eeprom.corrupted: the firmware reads its memory as it starts

NOTICED, HARMLESS = "noticed", "changes nothing"
NOT_HERE, NEVER, BROKEN = "not by this kit", "cannot be noticed", "does not hold"
_COMPARED = (NOT_HERE, "nothing compares command and edges")
_DIRTY = (NEVER, "less light is as over a darker floor, or in the shade")
REASONS = {
    "servos.dead": _COMPARED,
    "servos.weak": _COMPARED,
    "servos.reversed": _COMPARED,
    "servos.offset": _COMPARED,
    "wheel.blocked": _COMPARED,
    "encoders.missing": _COMPARED,
    "encoders.extra": (HARMLESS, "edges this fast are taken for bounces"),
    "wheel.slipping": (NEVER, "encoders turn as always"),
    "robot.lifted": (NEVER, "nothing feels the floor"),
    "whiskers.stuck": (NEVER, "as a touch, or none"),
    "whiskers.bouncing": (NEVER, "what outlasts debouncing is as a touch"),
    "infrared.blinded": (BROKEN, "the firmware sees light before its burst; telemetry has no bit for that"),
    "ping.doubled": (HARMLESS, "only the first pulse counts"),
    "serial.rate": (HARMLESS, "bytes come whole; further off: checksum"),
    "battery.sagging": (HARMLESS, "that is enough for the board, and what is measured is true"),
    "host.killed": (NOTICED, "board: dead-man; no host hears of it"),
    **dict.fromkeys(("line.dirty", "lines.dirty", "lights.dirty"), _DIRTY),
}
"""Of faults of which nothing shows: what that means, and why."""


class Noticed(NamedTuple):
    """What came of one fault."""

    fault: str
    fired: int
    verdict: str
    """NOTICED, or what else of those above; empty: it is not noticed, and there is no reason."""
    by: tuple[str, ...]
    """Who noticed it, or why it goes unnoticed."""
    after_s: float | None
    """From its begin to the first row of the record that shows it; None: figures at the end do."""
    wrong: float | None
    """Share of the steps within its span with a reading that claims to be valid and is another than without the fault;
    None: it is of no sensor."""
    still_s: float | None
    """From its begin until the wheels stood still; None: they went on."""


class _Run(Onlooker):
    """One run, and what the brain read in each of its steps."""

    hello: Hello | None = None  # the board's last

    def __init__(self, robot: RobotDescription, faults: list[Fault]) -> None:
        self.readings: dict[float, dict[str, Any]] = {}
        names = [name for name, device in robot.device.items() if device.on and device.READING is not None]

        def step(robot: Robot) -> None:
            self.readings[round(robot.time, 6)] = {name: getattr(robot, name) for name in names}
            signal = -0.5 if BACK_S <= robot.time < END_S else 0.5
            robot.drive(signal, signal)

        request = Request.single(
            step, robot, arena=ARENA, pose=POSE, on="native", seconds=SECONDS, without=DRAWN, faults=faults
        )
        self.result: RunResult = execute(request, onlooker=self)

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        """The board saves its parameters where it is going to read them."""
        assert robots[0].driver.link is not None
        self._link = robots[0].driver.link
        if RESET in robots[0].task.faults:
            self._link.parameters.save()

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        """See `Onlooker`."""
        self.hello = self._link.session.hello or self.hello

    def figures(self) -> dict[str, Any]:
        """Those that may show a fault, by who has them."""
        table, board = self.result.table(), self.result.link["board"]
        return {
            **{who: table[name] for name, who in FIGURES.items()},
            **{who: board[name] for name, who in BOARD.items()},
            "board: checksum at its next start": self.hello is not None and not self.hello.parameters_saved,
        }

    def signs(self) -> list[float]:
        """Times at which the record shows that something is not as it should be: telemetry that is missing, events of
        the board, readings that are not valid."""
        ticks = np.array([time_s for time_s, _ in self.result.record.each_row("telemetry")])
        gaps: list[float] = ticks[1:][np.diff(ticks) > 1.5 * self.result.tick].tolist()
        told = [time_s for time_s, event in events(self.result) if event.kind != EventKind.WHISKERS]
        doubted = [at_s for at_s, read in self.readings.items() if not all(_is_valid(one) for one in read.values())]
        return gaps + told + doubted

    def still_from(self) -> float:
        """When the wheels came to stand still for longer than they do as they turn round (s of the run); infinite:
        never before the end."""
        truth = self.result.truth
        assert truth is not None and truth.left_speed is not None and truth.right_speed is not None
        time_s = truth.time - self.result.clock_offset
        moves = np.maximum(np.abs(truth.left_speed), np.abs(truth.right_speed)) > _STILL_M_S
        last = np.append(time_s[moves], np.inf)
        stops = last[:-1][np.diff(last) > _STILL_S]
        return float(min(stops[stops > BEGIN_S], default=np.inf))


def _is_valid(reading: Any) -> bool:
    return bool(getattr(reading, "valid", True))


def noticed(robot: RobotDescription, names: Iterable[str]) -> Iterator[Noticed]:
    """Of each fault of those names what came of it, with its usual value."""
    plain = _Run(robot, [])
    for name in names:
        beside = [RESET] if name == "eeprom.corrupted" else []
        yield _noticed(robot, name, _Run(robot, beside) if beside else plain, beside)


def _noticed(robot: RobotDescription, name: str, plain: _Run, beside: list[Fault]) -> Noticed:
    kind, owners = known(robot)[name]
    run = _Run(robot, [Fault(name, None, BEGIN_S, None if kind.when == "once" else END_S), *beside])
    figures, signs = plain.figures(), set(plain.signs())
    by = [who for who, value in run.figures().items() if (value or 0) > (figures[who] or 0)]
    within = {at_s: read for at_s, read in run.readings.items() if BEGIN_S <= at_s < END_S and at_s in plain.readings}
    sensors = [one for one in owners if one in next(iter(plain.readings.values())) and one != "battery"]
    if any(not _is_valid(read[one]) for read in within.values() for one in sensors):
        by.append("board: not valid")
    if run.result.error is not None and not isinstance(run.result.error, UnfiredError):
        by.append("host: run ended")
    wrong = [
        any(_is_valid(read[one]) and _value(read[one]) != _value(plain.readings[at_s][one]) for one in sensors)
        for at_s, read in within.items()
    ]
    sign_s = min((at_s for at_s in run.signs() if at_s >= BEGIN_S and at_s not in signs), default=None)
    stood_s = run.still_from()
    verdict, why = (BROKEN if any(wrong) else NOTICED, "") if by else REASONS.get(name, ("", ""))
    return Noticed(
        name,
        next(iter(run.result.faults.values())),
        verdict,
        (*by, *([why] if why else [])),
        sign_s - BEGIN_S if by and sign_s is not None else None,
        float(np.mean(wrong)) if sensors else None,
        stood_s - BEGIN_S if stood_s < plain.still_from() else None,
    )


def _value(reading: Any) -> tuple[Any, ...]:
    """A reading without its age."""
    return tuple(value for name, value in zip(reading._fields, reading, strict=True) if name != "age")
