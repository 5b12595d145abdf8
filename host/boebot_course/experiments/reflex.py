"""Reflexes that warm up and tire: section 4.4.1 of the notes, E25 and E26. The model is the kit's own:

τ_w dW/dt = S - W,   τ_f dF/dt = W - F,   ρ = max(0, W - g F)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from boebot.behaviors.withdraw import ReflexIntensity
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, experiment

STEP = 0.01  # s


def intensity_under_a_step(reflex: ReflexIntensity, seconds: float) -> tuple[Floats, Floats]:
    """Times (s) after a stimulus of 1 has begun that lasts, and ρ at each."""
    times = np.arange(round(seconds / STEP) + 1, dtype=np.float64) * STEP
    values = [0.0, *(reflex.advance(1.0, STEP) for _ in times[1:])]
    return times, np.array(values, dtype=np.float64)


def judge_step(times: Floats, values: Floats) -> list[Measured]:
    """What is expected of ρ under a step."""
    at_nine = float(values[np.searchsorted(times, 9.0 - STEP / 2)])
    return [
        about("greatest intensity", values.max(), 0.73, 0.02),
        about("reached at", times[values.argmax()], 0.70, 0.05, "s"),
        Measured("intensity after 9 s", at_nine, most=0.13),
    ]


@experiment("E25")
def step_response(seed: int) -> Outcome:
    """A reflex warms up and tires

    In the notes: section 4.4.1, reflexes

    Figure: Intensity of a reflex under a stimulus that begins at 0 s and lasts; dashed: what is left in the end.

    Expected: By its equations: at most 0.73 ± 0.02, at 0.70 s ± 0.05 s; below 0.13 after 9 s, for it tends to 0.1.
    """
    times, values = intensity_under_a_step(ReflexIntensity(), 15.0)
    measured = judge_step(times, values)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot([-1, 0, 0, 15], [0, 0, 1, 1], color="0.6", label="stimulus S")
        axes.plot(times, values, color="#0072b2", label="intensity ρ")
        axes.axhline(0.1, linestyle="--", color="0.6", linewidth=0.8, label="left in the end")
        axes.set(xlabel="time (s)", ylabel="stimulus, intensity", xlim=(-1, 15), ylim=(0, 1.1))
        axes.legend(loc="center right", frameon=False)

    return Outcome(measured, {"time_s": times, "rho": values}, draw)


# ---- the larva in the tunnel -----------------------------------------------------------------------------------

TUNNEL, SPEED = 0.2, 0.01  # m, m/s
BEGIN = 0.03  # m from the mouth, where it is put with its head to the light
TIRED = 0.15  # ρ below which the turn away loses to forward motion
TURN = 2 * math.pi  # rad/s of turning away at full intensity


@dataclass(frozen=True)
class Larva:
    """Its path and intensity, step by step."""

    times: Floats
    place: Floats
    """m from the lit mouth"""
    heading: Floats
    """rad; 0: to the light, π: to the dead end"""
    intensity: Floats
    """ρ of turning away"""

    @property
    def at_end(self) -> float:
        """When it came to the dead end (s); infinite if never."""
        return _first(self.times, self.place >= TUNNEL - 1e-9)

    @property
    def tired(self) -> float:
        """When its intensity fell below `TIRED` after it had been above (s); infinite if never."""
        warm = np.maximum.accumulate(self.intensity) >= TIRED
        return _first(self.times, warm & (self.intensity < TIRED))

    @property
    def out(self) -> float:
        """When it left through the mouth (s); infinite if never."""
        return _first(self.times, self.place <= 0)

    @property
    def stayed(self) -> float:
        """m that it left the end by, between reaching it and being tired."""
        between = (self.times >= self.at_end) & (self.times < self.tired)
        return float(TUNNEL - self.place[between].min()) if between.any() else math.inf


def larva(reflex: ReflexIntensity, seconds: float = 70.0) -> Larva:
    """One larva that shuns light, in a dead-end tunnel that is lit at its mouth.

    It always crawls; two reflexes share its muscles: it turns away from the light, as strongly as ρ says, and it turns
    round where it has bumped into the end. While ρ > 0.15 the former wins, and holds it there.
    """
    place, heading, bumped, steps = BEGIN, 0.0, False, round(seconds / STEP)
    rows = [(0.0, place, heading, 0.0)]
    for index in range(1, steps + 1):
        intensity = reflex.advance(1.0, STEP)  # it is light throughout the tunnel
        if intensity > TIRED:
            heading = min(math.pi, heading + TURN * intensity * STEP)
        elif bumped:
            heading = max(0.0, heading - TURN * STEP)
        place = min(max(place - SPEED * math.cos(heading) * STEP, 0.0), TUNNEL)
        bumped = bumped or place >= TUNNEL - 1e-9
        rows.append((index * STEP, place, heading, intensity))
        if place <= 0:
            break
    return Larva(*np.array(rows).T)


def judge(one: Larva) -> list[Measured]:
    """What is expected of it: to the end, there while ρ > 0.15, and then out."""
    # 0.15 = 1 - g (1 - C e^(-t/τ_f)) with C = τ_f / (τ_f - τ_w): t = 30.6 s; with C = 1, a reflex warm at once, 30.3 s
    return [
        about("at the dead end", one.at_end, 17.9, 1.0, "s"),
        about("tired, ρ < 0.15", one.tired, 30.3, 0.5, "s"),
        Measured("meanwhile it leaves the end by", one.stayed, "m", most=0.001),
        about("out of the tunnel", one.out, 50.6, 2.0, "s"),
    ]


@experiment("E26")
def tunnel(seed: int) -> Outcome:
    """A larva that shuns light crawls into it

    In the notes: section 4.4.1, reflexes

    Figure: Place of a fly larva in a dead-end tunnel that is lit at its mouth, and the intensity with which it
    turns away from the light; dashed: the intensity below which forward motion wins.

    Expected: By its equations: at the end at 17.9 s ± 1 s, tired at 30.3 s ± 0.5 s, out at 50.6 s ± 2 s.
    """
    one = larva(ReflexIntensity(0.3, 15.0, 0.98))

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True)
        upper.axhspan(0, TUNNEL * 100, color="#f1ead9", label="tunnel")
        upper.plot(one.times, one.place * 100, color="#0072b2", label="larva")
        upper.set(ylabel="way from the mouth (cm)", ylim=(-1, 23))
        upper.legend(loc="upper right", fontsize=9, ncols=2)
        lower.plot(one.times, one.intensity, color="#d55e00")
        lower.axhline(TIRED, linestyle="--", color="0.6", label="below this forward motion wins")
        lower.legend(fontsize=9)
        lower.set(xlabel="time (s)", ylabel="intensity ρ", ylim=(0, 1.05))

    data = {"time_s": one.times, "place_m": one.place, "heading_rad": one.heading, "rho": one.intensity}
    return Outcome(judge(one), data, draw)


def _first(times: Floats, holds: NDArray[np.bool_]) -> float:
    found = np.flatnonzero(holds)
    return float(times[found[0]]) if len(found) else math.inf
