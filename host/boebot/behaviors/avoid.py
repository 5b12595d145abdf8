"""Obstacle avoidance by infra-red sensors (named in Fig. 5.1 of the notes; the law is the kit's own).

Active while max(S_l, S_r) is above a limit; then (∓0.5, ±0.5), away from the stronger side, until both are clear, and
a little longer. The limit is the utility's, against Wander's tanh(0.5) with "near" = max(S_l, S_r):

    Utility(b=-0.5, w={"near": 10.0}, tau=0.05)        above tanh(0.5) where 10 S - 0.5 > 0.5, that is, S > 0.10

S > 0.3, clear below 0.15, 0.2 s longer, as were first tried, are too little for a body that is wider than its
sensors' beams. At the beam's edge one ray of three hits a pillar's corner, S = (c_1/d² + c_2) cos(γ/2) / 3 (3.12),
(3.13). On the notes' robot with sensors at ±0.3324 rad that is 0.3 at d = 0.19 m, where the corner lies 0.17 m beside
the path of a body with a radius of 0.20 m: those from 0.17 to 0.20 m are grazed. S = 0.10 is at 0.39 m, 0.28 m beside.
What lies farther to the side is in no beam: who turns that way next to a corner and then drives grazes it, which is
why things are to be heeded early. The utility's lag costs way as well: at 0.68 m/s and τ = 0.2 s some 0.17 m until a
sudden S has called it.

In a nook the way out may be narrower than that, and it would turn for ever: so with each whole turn that has brought
nothing, half the time longer and twice the nearness are enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import MotorBehavior
from boebot.brain.utility import HOLD
from boebot.cognition.proximity import left_nearness, right_nearness

if TYPE_CHECKING:
    from boebot.robot import Robot


@dataclass(kw_only=True)
class Avoid(MotorBehavior):
    """Turns on the spot away from the side that is nearer, until both are clear and a little longer.

    Args:
        turn: motor signal of one wheel, and the other's reversed.
        clear: nearness below which a side is clear.
        after: s to turn on once both are clear.
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    NEEDS = ("infrared",)

    turn: float = 0.5
    clear: float = 0.08
    after: float = 0.4

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "turn")
        checks.signals(self, "turn")
        checks.not_negative(self, "clear", "after")

    def enter(self, robot: Robot) -> None:
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        self.turns_left = self.chance(0.5) if left == right else right > left
        self._begun = self._seen = robot.time
        # 2π over the rate 2 s v / track width
        self._a_turn = math.pi * robot.dimensions.track_width / (self.turn * robot.dimensions.speed)

    def step(self, robot: Robot) -> None:
        patience = 0.5 ** math.floor((robot.time - self._begun) / self._a_turn)
        left, right = left_nearness(robot) or 0.0, right_nearness(robot) or 0.0
        if max(left, right) * patience >= self.clear:
            self._seen = robot.time
        # its utility falls as soon as things are out of sight: gamma holds it until the turn is done
        self.kick(self, HOLD if robot.time < self._seen + self.after * patience else 0.0)
        turn = -self.turn if self.turns_left else self.turn
        robot.drive(turn, -turn)
