"""What drives a robot in a run, behind one small interface: over the link to its board, or direct.

Each turn of `Driver.steps` shows the brain a new observation, the brain steps, and the next turn carries out its
command (boebot.running.loop). A brain sees no difference between drivers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

from boebot.arguments import duration
from boebot.boards import BoardSession, VehicleSession, WatchdogReset
from boebot.description.robots import RobotDescription
from boebot.devices.readings import Layout
from boebot.errors import BoebotError, CallError
from boebot.link.bad_line import BadLine
from boebot.link.link import Link
from boebot.link.messages import Identity
from boebot.robot import Robot
from boebot.running.stepping import AT_LEISURE, StepLimit

TICK_S = 0.01  # of the firmware's control tick
PERIOD_MAXIMUM_S = 10.0  # of any brain
TIME_TO_LIVE_MS = 250  # of set-points, at least; longer brain periods live 2.5 periods
TIME_TO_LIVE_LIMIT_MS = 2000


class Status(NamedTuple):
    """How a robot's run has gone so far; names and meaning are those of `boebot.record.run.Run`."""

    run_time: float
    clock_offset: float
    late_steps: int | None
    resets: int | None = 0
    lost_frames: int | None = 0
    bad_frames: int | None = 0
    sessions_lost: int | None = None
    link: Mapping[str, Mapping[str, int]] = {}
    notices: Sequence[str] = ()
    watchdog_resets: Sequence[WatchdogReset] = ()


class Driver(Protocol):
    """Drives one robot through one run.

    Attributes:
        session: the robot as it was opened.
        robot: what the brain meets.
        description: the robot as its board has it.
        step_limit: how long a step of the brain may take.
        period_s, tick_s: from step to step of the brain, and of the control ticks.
        link: to its board; None: it has none.
        identity: what the board says of itself; None: there is no board.
        layout: where the readings of each device stand; None: they come by the link.
        is_program: a program on its board drives the robot, and no brain.
        has_faults: something is made to fail, so that a board may be silent for a while.
    """

    session: BoardSession | VehicleSession
    robot: Robot
    description: RobotDescription
    step_limit: StepLimit
    period_s: float
    tick_s: float
    link: Link | None
    identity: Identity | None
    layout: Layout | None
    is_program: bool = False
    has_faults: bool = False

    def begin(self) -> None:
        """Makes the robot ready to move.

        Raises:
            BoebotError: it cannot be.
        """

    def steps(self) -> Iterator[float]:
        """One turn per step of the brain, until the run's time is up: gives the run's time (s) of the observation that
        `robot` then shows. `robot.command` is carried out at the beginning of the next turn.

        Raises:
            BoebotError: the robot cannot go on.
        """

    def type(self, text: str) -> None:
        """Text for the program that drives the robot.

        Raises:
            BoebotError: a brain does.
        """
        raise BoebotError(f"a brain drives robot {self.description.name!r}; only a program takes what is typed")

    def bad_line(self, seed: int) -> BadLine:
        """What damages the line to its board from now on; `seed`: of its draws.

        Raises:
            CallError: there is none.
        """
        raise CallError(f"robot {self.description.name!r} has no board, and so no line that could fail")

    def end(self) -> None:
        """Stops the motors and lets go of the robot, whatever happened before."""

    def status(self) -> Status:
        """How the run has gone so far."""


def step_limit(seconds: float | None, otherwise: StepLimit = AT_LEISURE) -> StepLimit:
    """As the user wants it (s by the wall clock), or else."""
    return otherwise if seconds is None else AT_LEISURE._replace(seconds=seconds)


def check_period(period_s: float, most_s: float = PERIOD_MAXIMUM_S) -> None:
    """Raises BoebotError where a brain's period is none, or longer than `most_s`."""
    if not (period_s > 0 and math.isfinite(period_s)):
        raise BoebotError(f"a brain period of {duration(period_s)} is none; expected more than 0")
    if period_s > most_s:
        meant = f"; {period_s:g} ms would be {period_s / 1000:g}, or {period_s:g}ms as an option"
        raise BoebotError(
            f"a brain period of {duration(period_s)} is too long; expected at most {duration(most_s)}"
            + (meant if period_s / 1000 <= most_s else "")
        )


def check_time_to_live(period_s: float, least_s: float = 0.0) -> int:
    """The set-points' time to live (ms) at a brain period; at least `least_s`.

    Raises:
        BoebotError: the period is so long that the motors would stop between two steps, or telemetry so seldom.
    """
    check_period(period_s, TIME_TO_LIVE_LIMIT_MS / 2500)
    time_to_live_ms = max(TIME_TO_LIVE_MS, math.ceil(2.5 * period_s * 1000), math.ceil(least_s * 1000))
    if time_to_live_ms > TIME_TO_LIVE_LIMIT_MS:
        raise BoebotError(
            f"set-points would have to live {duration(least_s)}, so seldom does telemetry come; "
            f"expected at most {duration(TIME_TO_LIVE_LIMIT_MS / 1000)}"
        )
    return time_to_live_ms


def whole_ticks(period_s: float, tick_s: float) -> int:
    """A brain's period in ticks.

    Raises:
        BoebotError: it is none, or no whole number of them.
    """
    check_period(period_s)
    ticks = round(period_s / tick_s)
    if ticks < 1 or abs(ticks * tick_s - period_s) > 1e-6:
        raise BoebotError(
            f"a brain period of {duration(period_s)} does not fit; expected a multiple of {duration(tick_s)}"
        )
    return ticks
