"""A simulated world as a request wants it: how it is opened, how time passes in it, and the truth afterwards."""

from __future__ import annotations

import time
from collections.abc import Callable

from boebot.arenas import load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import BoardRequest, Truth, TruthNow
from boebot.errors import BoardError
from boebot.record.blocks import Group
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sim import Sim, SimRobot

Wait = Callable[[SimRobot, int, int], None]
"""Lets time pass for a robot: (robot, cycles, quiet) at most `cycles`; after `quiet` of them only until bytes come."""


def new_sim(request: BoardRequest, step_s: float) -> Sim:
    """The world that a request wants, without robots; `step_s`: its step, unless the request has one.

    Raises:
        BoardError: the request has an option that there is not.
    """
    if unknown := request.options.keys() - {"world_step_s"}:
        raise BoardError(f"there is no option {min(unknown)!r} of a simulated world; expected world_step_s")
    step_cycles = round(float(request.options.get("world_step_s", step_s)) * CLOCK_HZ)
    return Sim(
        load_arena(request.arena),
        seed=request.seed,
        noise=request.noise,
        record=request.record,
        step_cycles=step_cycles,
    )


class Pace:
    """Holds simulated time to the wall clock."""

    LAG_S = 0.5  # what cannot be caught up is forgotten

    def __init__(self, sim: Sim) -> None:
        self._sim = sim
        self._start = time.monotonic() - sim.cycle / CLOCK_HZ

    def due(self) -> int:
        """Cycles that the wall clock is ahead of the simulation."""
        ahead = time.monotonic() - self._start - self._sim.cycle / CLOCK_HZ
        if ahead > self.LAG_S:
            self._start += ahead
            ahead = 0.0
        return max(0, int(ahead * CLOCK_HZ))

    def wait(self) -> None:
        """Sleeps until the wall clock has caught up."""
        behind = self._sim.cycle / CLOCK_HZ + self._start - time.monotonic()
        if behind > 0:
            time.sleep(behind)
        elif behind < -self.LAG_S:
            self._start -= behind


def alone(sim: Sim, *, paced: bool = False) -> Wait:
    """Time passes for one robot only. `paced`: at most as fast as on the wall."""
    if not paced:
        return SimRobot.wait
    pace = Pace(sim)

    def wait(robot: SimRobot, cycles: int, quiet: int) -> None:
        robot.wait(cycles, quiet)
        pace.wait()

    return wait


class InWorld:
    """What every simulated robot's session offers: the truth, and hands that lift things. Of `BoardSession` and
    `VehicleSession` of boebot.boards."""

    def __init__(self, robot: SimRobot) -> None:
        self.robot = robot
        self.sim = robot.sim
        self.arena = robot.sim.arena

    def truth_now(self) -> TruthNow:
        """Where the robot and the arena's moving shapes are."""
        return self.robot.truth_now()

    def place(self, x: float, y: float, heading: float) -> None:
        """Lifts the robot and puts it there, at rest."""
        self.robot.place(x, y, heading)

    def place_shape(self, index: int, x: float, y: float, heading: float) -> None:
        """Puts a moving shape there; it goes on along its way shifted by as much."""
        self.sim.place_shape(index, (x, y, heading))

    def truth(self) -> Truth | None:
        """What happened so far; None without recording."""
        return truth_of(self.robot)


def drain(robot: SimRobot, *, ended: bool) -> Group:
    """See `boebot.boards.BoardSession`. What belongs to the world goes with its first robot."""
    world = robot.sim.drain(ended=ended) if robot.number == min(robot.sim.members) else {}
    return {**robot.drain(to_now=ended and not robot.description.has_board), **world}


def truth_of(robot: SimRobot) -> Truth | None:
    """What happened to a robot so far; None without recording."""
    columns = robot.truth() if robot.description.has_board else robot.truth_to_now()
    if not len(columns["time"]):
        return None
    return Truth(
        time=columns["time"],
        x=columns["x"],
        y=columns["y"],
        heading=columns["heading"],
        contact=columns["contact"] > 0,
        left_speed=columns["left"],
        right_speed=columns["right"],
        plan=floor_plan(
            robot.sim.arena,
            float(columns["time"][0]),
            float(columns["time"][-1]),
            robot.sim.lateness(),
            robot.sim.shifts(),
        ),
    )
