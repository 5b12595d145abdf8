"""A robot without a board in a simulated world, as the host opens it: a vehicle built from the robot's description.

`open_direct` is what the entry point of the group `boebot.vehicles` names: called with one request it gives a session,
its `together` puts several such robots into one world. Where there are robots with boards too, it is the boards' turn
(with_board.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from boebot.boards import BoardRequest, SharedWorld
from boebot.record.blocks import Group
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.sessions.opening import InWorld, Wait, alone, drain, new_sim
from sim_bridge.sessions.together import SimWorld
from sim_bridge.sim import Sim, SimRobot
from sim_bridge.vehicles import STEP_S

DEFAULT_ARENA = "arsim"


class DirectSession(InWorld):
    """An opened vehicle (VehicleSession of boebot.boards)."""

    tick_s = STEP_S

    def __init__(self, robot: SimRobot, wait: Wait, *, shared: bool = False) -> None:
        """`shared`: the world is not this robot's alone, and is closed by somebody else."""
        super().__init__(robot)
        self.layout: Mapping[str, slice] = robot.layout
        self.description = f"robot without a board in arena {robot.sim.arena.name}"
        self._wait = wait
        self._cycles = round(STEP_S * CLOCK_HZ)
        self._shared = shared

    def readings(self) -> tuple[float, ...]:
        """All readings now."""
        return self.robot.readings()

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals."""
        self.robot.signals(left, right)
        self._wait(self.robot, self._cycles, self._cycles)

    def stop(self) -> None:
        """No motor signals from now on."""
        self.robot.signals(0.0, 0.0)

    @property
    def ended(self) -> str:
        """Why it can go no further, or ""."""
        return self.robot.ended

    def drain(self, *, ended: bool = False) -> Group:
        """See `boebot.boards.BoardSession`."""
        return drain(self.robot, ended=ended)

    def counters(self) -> Mapping[str, float]:
        """`true_contacts`, `true_distance_m` and `time_s`."""
        return {
            "true_contacts": float(self.robot.true_contacts),
            "true_distance_m": float(self.robot.body().distance),
            "time_s": self.sim.cycle / CLOCK_HZ,
        }

    def close(self) -> None:
        """Frees the world. May be called twice."""
        if not self._shared:
            self.sim.close()


def add_vehicle(sim: Sim, request: BoardRequest) -> SimRobot:
    """Puts the request's robot, which has no board, into a world.

    Raises:
        RobotError: its description is none of such a robot.
        ArenaError: its place is not free.
        BoardError: an imperfection is none, is out of its range, or changes nothing of this robot.
    """
    return sim.add(
        None, request.robot, pose=request.start_pose, without=request.without, imperfections=request.imperfections
    )


class DirectKind:
    """Robots without boards (VehicleFactory and TogetherFactory of boebot.boards)."""

    def __call__(self, request: BoardRequest) -> DirectSession:
        """Opens one, alone in its world. Raises as `add_vehicle`, and an ArenaError where there is no such arena."""
        sim = new_sim(_in_arena(request), STEP_S)
        try:
            return DirectSession(add_vehicle(sim, request), alone(sim))
        except Exception:
            sim.close()
            raise

    def together(self, requests: Sequence[BoardRequest]) -> SharedWorld:
        """Opens several in one world."""
        sim = new_sim(_in_arena(requests[0]), STEP_S)
        return SimWorld(sim, requests, add_vehicle, lambda robot, wait: DirectSession(robot, wait, shared=True))


def _in_arena(request: BoardRequest) -> BoardRequest:
    return request if request.arena else replace(request, arena=DEFAULT_ARENA)


open_direct = DirectKind()
"""Robots that motor signals drive."""
