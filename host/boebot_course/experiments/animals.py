"""Two needs and one animal: the isocline and the lethal boundary of Fig. 7.2 of the notes (section 7.2).

An animal's state is a point: how well it is off for water and for nutrients, 1 all it can hold. Living uses both up;
beyond the lethal boundary it dies. The rule, after McFarland:

    deficit_i = 1 - level_i,   tendency_i = deficit_i × cue_i,   and it does what the larger tendency asks for,

where cue_i says how much of it is to be had here: utility functions of the kit, tanh(cue_i - cue_i level_i), almost
without lag. The motivational isocline is where both tendencies are equal, a
straight line through (1, 1):   (1 - nutrients) / (1 - water) = cue_water / cue_nutrients. The cost of a state is
Σ deficit_i², and the boundary the quarter of a circle at which this cost is 1 or a level is 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from boebot.brain import Utility
from boebot.brain.utility import Utilities
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, exactly, experiment

USE = 0.02  # 1/s, of each
INTAKE = 0.10  # 1/s at cue 1, of what it takes in, times its cue
STEP = 0.05  # s
LAG = 1e-3  # s, of its utilities
LETHAL = 1.0  # cost
TIE = 1e-9  # tendencies that differ by less are equal


@dataclass(frozen=True)
class Life:
    """What an animal did."""

    times: Floats
    levels: Floats
    """water and nutrients, shape (times, 2)"""
    drinks: NDArray[np.bool_]
    """at each time; otherwise it eats"""
    dead: bool

    @property
    def cost(self) -> Floats:
        """Σ deficit²"""
        return np.asarray(((1 - self.levels) ** 2).sum(axis=1))

    def steadied(self, cues: tuple[float, float]) -> float:
        """When the animal first was on the isocline (s); NaN: never."""
        tendency = (1 - self.levels) * cues
        crossed = np.flatnonzero(np.diff(np.sign(tendency[:, 0] - tendency[:, 1])))
        return float(self.times[crossed[0]]) if len(crossed) else math.nan


def live(
    start: tuple[float, float], cues: tuple[float, float], *, rule: str = "larger", seconds: float = 120.0
) -> Life:
    """An animal at those levels, where cues say how much of each there is.

    Args:
        start, cues: of water and nutrients.
        rule: "larger" tendency, or "water": only ever drinks.
    """
    levels, times, drinks = [np.array(start)], [0.0], []
    names = ("water", "nutrients")
    functions = [Utility(b=cue, w={name: -cue}, tau=LAG) for name, cue in zip(names, cues, strict=True)]
    if rule == "water":
        functions[0] = Utility(b=9.0)
    tendencies = Utilities(functions, names)
    tendencies.start(start)
    for index in range(round(seconds / STEP)):
        tendencies.advance(levels[-1].tolist(), STEP)
        drinks.append(tendencies.values[0] >= tendencies.values[1])
        gain = np.array([INTAKE * cues[0], 0.0] if drinks[-1] else [0.0, INTAKE * cues[1]])
        levels.append(np.clip(levels[-1] + STEP * (gain - USE), 0.0, 1.0))
        times.append((index + 1) * STEP)
        if is_lethal(levels[-1]):
            break
    drinks.append(drinks[-1])
    return Life(np.array(times), np.array(levels), np.array(drinks), is_lethal(levels[-1]))


def is_lethal(levels: Floats) -> bool:
    """On the boundary or beyond."""
    return bool(((1 - levels) ** 2).sum() >= LETHAL or levels.min() <= 0)


STARTS = ((0.9, 0.35), (0.35, 0.6), (0.55, 0.3), (0.3, 0.45))
CUES = (1.0, 0.6)  # of water and nutrients


@experiment("isocline")
def isocline(seed: int) -> Outcome:
    """An animal with two needs keeps away from the lethal boundary

    In the notes: section 7.2, Fig. 7.2

    Figure: Water availability and nutrient level: the motivational isocline (dashed), the lethal boundary (grey
    beyond it), and animals that do what the larger tendency asks for. Red: one that only ever drinks.

    Expected: Derived from the rule: beside the isocline the animal does one thing until it is there, after a time
    that follows from its rates; then it flips at each crossing, and stays within two steps' gain of it. It must
    take in there as much as it uses: 0.02 / 0.1 + 0.02 / 0.06 < 1. Only drinking it starves after nutrients / 0.02
    per s at the latest.
    """
    lives = [live(start, CUES) for start in STARTS]
    single = live(STARTS[0], CUES, rule="water")
    cues = np.array(CUES)
    step_gain = STEP * INTAKE * float((cues * cues).max())
    wrong = flips_off = late = 0
    distances, arrivals, expected = [], [], []
    for one, start in zip(lives, STARTS, strict=True):
        tendency = (1 - one.levels) * cues
        difference = tendency[:, 0] - tendency[:, 1]
        larger = np.where(np.abs(difference) < TIE, 0.0, np.sign(difference))[:-1]
        wrong += int((np.where(one.drinks[:-1], 1, -1) == -larger).sum())
        flips = np.flatnonzero(np.diff(one.drinks[:-1].astype(int)))
        flips_off += int((larger[flips] * larger[flips + 1] > 0).sum())
        arrived = one.steadied(CUES)
        arrivals.append(arrived)
        expected.append(time_to_isocline(start, CUES))
        distances.append(float(np.abs(difference[one.times > arrived + 2 * STEP]).max()))
        late += bool(one.cost[-1] > one.cost[0])
    measured = [
        exactly("animals that die", sum(one.dead for one in lives), 0),
        Measured("largest cost (lethal: 1)", max(float(one.cost.max()) for one in lives), most=0.999),
        exactly("choices against the larger tendency", wrong, 0),
        exactly("flips that are not on the isocline", flips_off, 0),
        Measured("largest |tendency difference| once there", max(distances), most=2 * step_gain),
        *(
            about(f"animal {number}: on the isocline after", arrived, aim, 2 * STEP, "s")
            for number, (arrived, aim) in enumerate(zip(arrivals, expected, strict=True), 1)
        ),
        exactly("animals that end worse off than they began", late, 0),
        exactly("one that only drinks dies (1: yes)", single.dead, 1),
        Measured("and does so after", float(single.times[-1]), "s", most=STARTS[0][1] / USE + STEP),
    ]
    return Outcome(measured, _data(lives), lambda figure: _draw(figure, lives, single))


def time_to_isocline(start: tuple[float, float], cues: tuple[float, float]) -> float:
    """Seconds of only one activity until both tendencies are equal: each is a straight line in time."""
    tendency = [(1 - level) * cue for level, cue in zip(start, cues, strict=True)]
    active = 0 if tendency[0] >= tendency[1] else 1
    falls = cues[active] * (INTAKE * cues[active] - USE)
    rises = cues[1 - active] * USE
    return abs(tendency[0] - tendency[1]) / (falls + rises)


def _data(lives: list[Life]) -> dict[str, Floats]:
    return {
        "animal": np.concatenate([np.full(len(one.times), float(number)) for number, one in enumerate(lives, 1)]),
        "time_s": np.concatenate([one.times for one in lives]),
        "water": np.concatenate([one.levels[:, 0] for one in lives]),
        "nutrients": np.concatenate([one.levels[:, 1] for one in lives]),
        "drinks": np.concatenate([one.drinks for one in lives]).astype(float),
    }


def _draw(figure: Figure, lives: list[Life], single: Life) -> None:
    axes = figure.subplots()
    turn = np.linspace(0, np.pi / 2, 100)
    boundary = 1 - math.sqrt(LETHAL) * np.cos(turn), 1 - math.sqrt(LETHAL) * np.sin(turn)
    axes.fill_between(*boundary, 0, color="0.75", label="lethal")
    axes.plot(*boundary, color="black", label="lethal boundary")
    ratio = CUES[0] / CUES[1]
    water = np.linspace(max(0.0, 1 - 1 / ratio), 1, 2)
    axes.plot(water, 1 - ratio * (1 - water), "--", color="black", label="motivational isocline")
    for number, one in enumerate(lives, 1):
        axes.plot(*one.levels.T, color=f"C{number - 1}", lw=5.5 - 1.2 * number, label=f"animal {number}")
        axes.plot(*one.levels[0], "o", color=f"C{number - 1}")
    axes.plot(*single.levels.T, color="red", linestyle="-.", label="only drinks")
    axes.plot(*single.levels[-1], "x", color="red")
    axes.set(xlabel="water availability (1: all it can hold)", ylabel="nutrient level (1: all it can hold)")
    axes.set(xlim=(0, 1.02), ylim=(0, 1.02), aspect="equal")
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize="small")
