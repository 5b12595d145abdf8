"""A board with any image on a test bench: by itself, or in the world of a robot (sessions/world.py), which answers at
its pins. Both are one simulation, so that what can be done with a robot's board can be done with a bare one."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import TracebackType

import msgspec

from boebot.boards import BoardRequest
from boebot.description.robots import RobotDescription, load_robot
from boebot.record.blocks import Group, merged
from boebot.record.record import Record
from sim_bridge.sessions.world import AVR, NATIVE, open_on


@cache
def bare() -> RobotDescription:
    """A robot of which only the board is used: no device is joined to it, and nothing drives it anywhere."""
    return msgspec.structs.replace(
        load_robot("rover"), name="bare", title="a board by itself", device={}, supply=None, imperfections={}
    )


class Bench:
    """A board, powered on. Times in cycles since then.

    Attributes:
        session: the simulation of the board (SimSession).
        pins, robot: its pins; the robot that it is on.
        mark: when what was last waited for happened.
    """

    def __init__(
        self,
        image: Path | str | None = None,
        *,
        on: str = "avr",
        robot: RobotDescription | str | None = None,
        arena: str = "empty",
        seed: int = 1,
        noise: bool = False,
    ) -> None:
        """`image`: None: the kit's firmware for the robot. `robot`: None: nothing is around the board.

        Raises:
            BoebotError: the image or the robot is none, or the arena is not there.
        """
        described = bare() if robot is None else load_robot(robot) if isinstance(robot, str) else robot
        request = BoardRequest(
            robot=described, arena=arena, seed=seed, noise=noise, pins=True, image=None if image is None else str(image)
        )
        self.session = open_on(NATIVE if on == NATIVE.name else AVR, request)
        self.pins, self.robot = self.session.board, self.session.robot
        self.robot.handle.is_stamped = True
        self.mark = 0
        self._record = Record()

    @property
    def now(self) -> int:
        """Up to where it has run."""
        return self.session.sim.cycle

    def streams(self) -> Group:
        """What its pins and its robot have done so far: "pins", "inputs", "line_in", "line_out", "truth"."""
        self._record.put(self.session.drain())
        return merged(list(self._record.groups()))

    def run_until(self, cycle: int) -> None:
        """Lets time pass up to that cycle."""
        self.session.sim.run(max(0, cycle - self.now))

    def received(self) -> tuple[bytes, list[int]]:
        """Takes the bytes that left the board since the last call, and the cycle at which each one's stop bit ended."""
        stamped = self.robot.receive_stamped()
        return bytes(byte for _, byte in stamped), [cycle for cycle, _ in stamped]

    def send(self, data: bytes, at: int = 0) -> None:
        """Puts bytes on the line towards the board, back to back, not before cycle `at`."""
        board = self.robot.board.handle
        board.op.send(board, at, data, len(data))

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        self.session.close()

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
