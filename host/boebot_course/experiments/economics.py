"""What performance is, and what utility: the opening of chapter 8 of the notes.

A robot that is to sweep the floor is paid for the way that it drives, and for nothing else. It has a charging station,
which pays nothing. Three brains of the kit's behaviors, which differ in the utility of going there: one never does, one
always, and one does by the demonstration brain's utility, 1.5 - 3.2 E + 1.9 on the charger.

shieldbot-charging has capacitors in place of cells, and its own board switches the motors off where they have run down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.brain import Brain, Utility
from boebot.brains import load_brain
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoardError
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, exactly, experiment
from boebot_course.trials import Trial, decisions

SECONDS = 300.0
FARADS = 25.0 / 3  # three capacitors in a row
FULL_V = 7.8  # where the battery's level E is 1; it is 0 at 5 V, and below there is some way left to 4.73 V
BEGIN_V, LOWEST_V = 6.68, 3.5  # as a run begins; as low as the world lets the capacitors run

NEVER = Utility(b=-9.0)
CHARGING = {"never": NEVER, "always": Utility(b=9.0), "by utility": None}


def sweeper(charge: Utility | None = None) -> Brain:
    """The demonstration brain; with that utility of charging, if one is given."""
    brain = load_brain("demo").brain
    assert brain is not None
    if charge is not None:
        (own,) = [one for one in brain.given if one.name == "charge"]
        brain.change(own, {"utility": charge})
    return brain


def robot(*, contacts: bool = True) -> RobotDescription:
    """shieldbot-charging whose capacitors run down to where its board gives up. Without `contacts` no station charges
    it, not even one that it comes by."""
    described = load_robot("shieldbot-charging")
    assert described.supply is not None
    supply = msgspec.structs.replace(
        described.supply,
        empty_v=LOWEST_V,
        capacity_as=FARADS * (FULL_V - LOWEST_V),
        charge=(BEGIN_V - LOWEST_V) / (FULL_V - LOWEST_V),
        charger_a=described.supply.charger_a if contacts else 0.0,
    )
    return msgspec.structs.replace(described, name="sweeper", supply=supply)


@dataclass(frozen=True)
class Life:
    """One robot's run, at each control tick."""

    times: Floats
    """s"""
    work: Floats
    """performance so far: the true way driven (m)"""
    level: Floats
    """E, as its brain sees it, at each step of the brain"""
    level_times: Floats
    stands: NDArray[np.bool_]
    """it is on the charger, and charging is what it does"""
    low_after: float
    """s after which its board switched the motors off for want of supply; infinite: never"""

    def worked(self, time: float) -> float:
        """Performance until then (m)."""
        return float(np.interp(time, self.times, self.work))


def until_low(
    brain: Brain,
    described: RobotDescription,
    seed: int,
    seconds: float = SECONDS,
    pose: tuple[float, float, float] | None = None,
) -> tuple[Trial, float]:
    """A run until the end, or until the board's supply is low: after how many seconds; infinite: never.

    Raises:
        BoebotError: something else ended it.
    """
    result = execute(
        Request.single(brain, described, arena="station", on="native", seconds=seconds, seed=seed, pose=pose)
    )
    is_low = isinstance(result.error, BoardError) and "supply is low" in str(result.error)
    if result.error is not None and not is_low:
        raise result.error
    return Trial(result, brain), result.run_time if is_low else math.inf


def live(charge: Utility | None, seed: int) -> Life:
    """A sweeper's run. Raises as `until_low`."""
    trial, low_after = until_low(sweeper(charge), robot(contacts=charge is not NEVER), seed)
    record = decisions(trial.result)
    names = record.names
    charging = record.values[:, names.variables.index("charging")] > 0
    last = np.clip(np.searchsorted(record.time, trial.time, side="right") - 1, 0, len(record) - 1)
    return Life(
        trial.time,
        np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(trial.path, axis=0).T)))),
        1 - record.values[:, names.variables.index("low")],
        record.time,
        trial.when_active("charge") & charging[last],
        low_after,
    )


@experiment("robot-economics", robot="shieldbot-charging (native)")
def economics(seed: int) -> Outcome:
    """Charging earns nothing, and yet who charges earns most

    In the notes: chapter 8, opening

    Figure: Performance (way driven) of three robots: one that never charges, until its board switches its motors
    off, one that always does, and one that schedules it by utility; grey: when that one stands and charges. Below:
    battery level E.

    Expected: At motor signal 0.5, 0.152 m/s, board and servos draw 0.08 A + 2 (0.015 A + 0.74 A s/m · 0.152 m/s) =
    0.335 A; from 6.68 V to 4.73 V, where the regulator gives 4.2 V, 25/3 F last for 48.5 s, within a tenth for
    turns and unlike servos. The station is 1.77 m away, by arcs less than half as far again. By utility: standing,
    it gains 2.4 A - 0.08 A, so that it stands 0.335 / (2.32 + 0.335) = 0.126 of the time, of which its brain
    notices all but the first second of some 7.5 s: 0.109 ± 0.02. The other 262 s it works, 5.4 times 48.5 s: with a
    quarter off for turns and searches 4 times. Standing earns nothing but some millimetres.
    """
    never, always, utility = (live(charge, seed) for charge in CHARGING.values())
    stands = utility.stands
    earned = float(np.diff(utility.work, prepend=0.0)[stands].sum())
    measured = [
        about("never charging: supply is low after", never.low_after, 48.5, 4.85, "s"),
        Measured("never charging: performance", never.work[-1], "m", most=1.1 * 48.5 * 0.152),
        Measured("always charging: performance", always.work[-1], "m", 0.0, 1.5 * 1.77),
        exactly("by utility: motors on until the end (1: yes)", utility.low_after == math.inf, 1),
        about("by utility: share of the time it stands and charges", float(stands.mean()), 0.109, 0.02),
        Measured("by utility: earned meanwhile, share of all", earned / utility.work[-1], "", 0.0, 0.02),
        Measured("by utility: performance, times never charging", utility.work[-1] / never.work[-1], least=4.0),
        Measured(
            "by utility: performance, times always charging", utility.work[-1] / max(always.work[-1], 0.01), least=4.0
        ),
        Measured(
            "when its supply is low never charging is ahead by",
            never.work[-1] - utility.worked(float(never.times[-1])),
            "m",
        ),
    ]
    lives = dict(zip(CHARGING, (never, always, utility), strict=True))

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(3, 1))
        for name, one in lives.items():
            upper.plot(one.times, one.work, label=name)
            lower.plot(one.level_times, one.level)
        upper.plot(never.times[-1], never.work[-1], "x", color="C0")
        for axes in (upper, lower):
            axes.fill_between(
                utility.times, 0, 1, where=list(stands), color="0.9", transform=axes.get_xaxis_transform()
            )
        upper.set(ylabel="performance (m driven)")
        upper.legend()
        lower.set(xlabel="time (s)", ylabel="battery E", xlim=(0, SECONDS), ylim=(0, 1.05))

    grid = np.arange(0.0, SECONDS, 0.1)
    data = {"time_s": grid} | {
        f"work_{name.replace(' ', '_')}_m": np.interp(grid, one.times, one.work) for name, one in lives.items()
    }
    return Outcome(measured, data, draw)
