"""A reflex that warms up and gets tired (section 4.4.1 of the notes; the model is the kit's own).

    τ_w dW/dt = S - W (warm-up),   τ_f dF/dt = W - F (fatigue),   ρ = max(0, W - g F)

A stimulus that lasts is answered less and less: the reflex is tired, not muscles or sensors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.brain import checks
from boebot.brain.process import CognitiveProcess, MotorBehavior
from boebot.brain.utility import HOLD
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot


class ReflexIntensity:
    """W and F, advanced exactly while the stimulus S is held:

    W(t) = S + (W_0 - S) e^(-t/τ_w),   F(t) = S + C e^(-t/τ_w) + (F_0 - S - C) e^(-t/τ_f),
    C = (W_0 - S) τ_w / (τ_w - τ_f), from W put into the equation of F.

    Attributes:
        value: ρ.
    """

    def __init__(self, warm_up: float = 0.3, fatigue: float = 2.0, weight: float = 0.9) -> None:
        """`warm_up`: τ_w (s); `fatigue`: τ_f (s), another than τ_w; `weight`: g."""
        if not (warm_up > 0 and fatigue > 0 and warm_up != fatigue):
            raise BrainError(f"warm-up {warm_up!r} s and fatigue {fatigue!r} s; expected two different times above 0")
        self._warm_up, self._fatigue, self._weight = warm_up, fatigue, weight
        self._warmth = self._tired = self.value = 0.0

    def advance(self, stimulus: float, elapsed: float) -> float:
        """By `elapsed` seconds with that stimulus; the new ρ."""
        quick, slow = math.exp(-elapsed / self._warm_up), math.exp(-elapsed / self._fatigue)
        part = (self._warmth - stimulus) * self._warm_up / (self._warm_up - self._fatigue)
        self._tired = stimulus + part * quick + (self._tired - stimulus - part) * slow
        self._warmth = stimulus + (self._warmth - stimulus) * quick
        self.value = max(0.0, self._warmth - self._weight * self._tired)
        return self.value


@dataclass(kw_only=True)
class Withdraw(MotorBehavior):
    """Backs off from a touch and turns away from its side, as strongly as the reflex is fresh.

    Args:
        back: s to back off.
        turn: s to turn away.
        signal: motor signal at full intensity.
        warm_up: τ_w (s).
        fatigue: τ_f (s), another than τ_w.
        weight: g, of fatigue.
        name, utility, period: as of every process (`boebot.brain.Process`).

    Attributes:
        intensity: ρ at the last touch.
    """

    NEEDS = ("whiskers",)

    back: float = 0.3
    turn: float = 0.5
    signal: float = 0.7
    warm_up: float = 0.3
    fatigue: float = 2.0
    weight: float = 0.9

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "back", "turn")
        checks.shares(self, "signal")
        self.fresh()  # refuses times that are none

    def forget(self) -> None:
        self.intensity = 0.0

    def fresh(self) -> ReflexIntensity:
        """The reflex, neither warm nor tired."""
        return ReflexIntensity(self.warm_up, self.fatigue, self.weight)

    def companions(self) -> tuple[CognitiveProcess, ...]:
        return (Irritation(reflex=self, name=f"{self.name}_irritation"),)

    def enter(self, robot: Robot) -> None:
        self._begun = robot.time
        self._left = robot.whisker_right.pressed and not robot.whisker_left.pressed  # turns away from the touch

    def step(self, robot: Robot) -> None:
        since = robot.time - self._begun
        strength = self.signal * min(self.intensity, 1.0)
        if since < self.back - 1e-9:
            robot.drive(-strength, -strength)
        elif since < self.back + self.turn - 1e-9:
            turn = strength if self._left else -strength
            robot.drive(-turn, turn)
        else:
            robot.drive(0.0, 0.0)

    @property
    def duration(self) -> float:
        """Seconds of the whole reflex."""
        return self.back + self.turn


@dataclass(kw_only=True)
class Irritation(CognitiveProcess):
    """Lets touches warm up and tire a reflex, and calls it while it lasts."""

    reflex: Withdraw
    least: float = 0.15
    """intensity below which the reflex does not answer"""

    def enter(self, robot: Robot) -> None:
        self._intensity = self.reflex.fresh()
        self._time = robot.time
        self._until = -math.inf

    def step(self, robot: Robot) -> None:
        reflex, now = self.reflex, robot.time
        touched = robot.whisker_left.pressed or robot.whisker_right.pressed
        intensity = self._intensity.advance(1.0 if touched else 0.0, now - self._time)
        self._time = now
        if touched and intensity >= self.least and now >= self._until - 1e-9:
            reflex.intensity = intensity
            self._until = now + reflex.duration
        self.kick(reflex, HOLD if now < self._until - 1e-9 else -HOLD)
