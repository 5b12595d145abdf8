"""Follow a wall at a distance (named in Fig. 5.1 of the notes; the law is the kit's own).

    e = S_side - S_ref,   s_L = s_0 ∓ k e,   s_R = s_0 ± k e        upper signs: the wall is on the right

The nearer, the larger S: too close to a wall on the right (e > 0), it turns left. Something ahead: it turns on the
spot, away from the wall.

What measures S_side is the IR sensor of that side, while Ping or an analog IR sensor looks ahead. IR pairs of a board
say yes or no, with which no distance can be kept: where the robot has a turret, it turns its Ping to the wall instead,
and the IR pairs look ahead.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Literal

from boebot.behaviors.straight_run import within_signals
from boebot.brain import checks
from boebot.brain.process import MotorBehavior
from boebot.cognition.proximity import left_nearness, nearness_ahead, ping_nearness, right_nearness
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot

LOOK_RAD = 1.047  # 60 degrees: obliquely ahead, so that the robot also notices when it heads for the wall or from it
SETTLING_S = 0.4  # the turret's way there, and a new echo
HELD = 0.05  # rad; farther off the turret was turned elsewhere, or released
ECHOES = 3  # Ping misses some: the median of the last ones counts


@dataclass(kw_only=True)
class FollowWall(MotorBehavior):
    """Keeps a wall at its side.

    Args:
        side: where the wall is.
        signal: s_0, motor signal straight on.
        gain: k, motor signal for each unit of nearness.
        reference: S_ref: nearness of the wall that is kept; by Ping 0.25 stands for 0.30 m from it.
        ahead: nearness of something ahead, or on the other side, from which on it turns on the spot.
        turn: motor signal of turning on the spot.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("infrared",)

    side: Literal["left", "right"] = "right"
    signal: float = 0.5
    gain: float = 0.5
    reference: float = 0.25
    ahead: float = 0.25
    turn: float = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in ("left", "right"):
            raise BrainError(f"{self.name}: side is {self.side!r}; expected 'left' or 'right'")
        checks.signals(self, "signal", "turn")

    def enter(self, robot: Robot) -> None:
        self._by_turret = robot.has("turret") and robot.has("ping")
        self._echoes: deque[float] = deque(maxlen=ECHOES)
        self._settled = robot.time

    def step(self, robot: Robot) -> None:
        away = 1.0 if self.side == "right" else -1.0  # counter-clockwise
        beside, ahead = self._look_by_turret(robot, away) if self._by_turret else self._look(robot)
        if beside is None:
            robot.drive(0.0, 0.0)
        elif ahead > self.ahead:
            robot.drive(-away * self.turn, away * self.turn)
        else:
            correction = away * self.gain * (beside - self.reference)
            robot.drive(within_signals(self.signal - correction), within_signals(self.signal + correction))

    def exit(self, robot: Robot) -> None:
        if self._by_turret:
            robot.turn_turret(0.0)  # others use Ping to look ahead

    def _look(self, robot: Robot) -> tuple[float | None, float]:
        """Nearness beside it, and ahead or on the other side."""
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        beside, other = (right, left) if self.side == "right" else (left, right)
        return beside, max(nearness_ahead(robot) or 0.0, other)

    def _look_by_turret(self, robot: Robot, away: float) -> tuple[float | None, float]:
        """The same by Ping on its turret and both IR pairs; beside it None while the turret is on its way."""
        angle = robot.turret.angle if robot.turret.valid else None
        if angle is None or abs(angle + away * LOOK_RAD) > HELD:
            robot.turn_turret(-away * LOOK_RAD)
            self._settled = robot.time + SETTLING_S
        if robot.time < self._settled - 1e-9:
            self._echoes.clear()
            return None, 0.0
        echo = ping_nearness(robot)
        if echo is not None:
            self._echoes.append(echo)
        beside = median(self._echoes) if self._echoes else None
        return beside, max(left_nearness(robot) or 0.0, right_nearness(robot) or 0.0)
