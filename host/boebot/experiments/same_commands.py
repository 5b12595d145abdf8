"""The same brain and seed on two boards: the firmware compiled for this machine, and its image on an emulated
ATmega328P (E68).

A brain is a function of its seed and of what it saw, so that it must command the same as long as telemetry agrees. That
telemetry does not agree for ever has these causes: the chip is ready some 0.16 s later after its reset, so that the
host's set-points and the board's telemetry fall differently within a tick; a brain's step sees the tick before or
after; a pulse begins a servo frame earlier or later, and a wheel is some millimetres ahead; and interrupts stamp edges
and echoes some cycles later.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

import boebot
from boebot.behaviors import Avoid, Wander, Withdraw
from boebot.brain import Brain, Utility
from boebot.cognition import near
from boebot.experiments.experiment import Measured, Outcome, Progress, exactly, experiment, with_progress
from boebot.record.compare import Difference, command_difference, replayed, telemetry_difference

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from boebot.record.result import RunResult

SECONDS = 20.0
LOOKED_AT = ("infrared", "whiskers")  # what turns both brains aside


def composed() -> Brain:
    """Wander, Avoid and Withdraw by utility."""
    return Brain(
        [
            Wander(turn_probability=0.002, utility=Utility(b=0.5)),
            Avoid(utility=Utility(b=-1.0, w={"near": 3.0})),
            Withdraw(utility=Utility(b=-1.0)),
        ],
        [near()],
    )


BRAINS: dict[str, Callable[[], object]] = {"wander": lambda: "wander", "composed": composed}


def disagreements(run: RunResult, brain: object) -> int:
    """Steps at which a fresh brain commands something else on the same telemetry."""
    pairs = zip(replayed(run, brain), run.record.steps, strict=True)
    return sum(tuple(command) != step[1:] for command, step in pairs)


@experiment(
    "E68",
    title="The same brain and seed command the same on both boards, as long as telemetry agrees",
    source="section 3.1",
    caption="Motor signals that two brains commanded on the native board and on the emulated ATmega328P, and where "
    "first telemetry, then infrared or whiskers, then their commands differ.",
    robot="shieldbot (native, avr)",
    criterion="A brain is a function of its seed and of what it sees: no command may differ before telemetry does, "
    "and a fresh brain must command the same at each of the 400 steps when it is given the telemetry of either run. "
    "The first difference is explained by phase: telemetry comes within one tick (10 ms) of the other board's, "
    "set-points take hold within a servo frame (20 ms): at 0.14 m/s 4.2 mm, less than two of the encoder's steps of "
    "3.2 mm.",
    slow=True,
)
def same_commands(seed: int, progress: Progress) -> Outcome:
    measured: list[Measured] = []
    data: dict[str, list[float]] = {}
    drawn: list[tuple[str, list[RunResult], list[Difference | None]]] = []
    for name, brain in with_progress(list(BRAINS.items()), progress):
        runs = [boebot.run(brain(), robot="shieldbot", on=on, seconds=SECONDS, seed=seed) for on in ("native", "avr")]
        a, b = runs
        seen, looked_at = telemetry_difference(a, b), telemetry_difference(a, b, LOOKED_AT)
        commanded = command_difference(a, b)
        steps = min(len(run.record.steps) for run in runs)
        first, last = (steps if one is None else one.step for one in (seen, commanded))
        measured += [
            exactly(f"{name}: steps whose commands differ before telemetry does", max(0, first - last), 0),
            *(
                exactly(f"{name}: steps at which it commands otherwise on telemetry of {run.board}", wrong, 0)
                for run, wrong in ((run, disagreements(run, brain())) for run in runs)
            ),
            Measured(f"{name}: first step at which telemetry differs{_which(seen)}", first),
            Measured(
                f"{name}: first step at which infrared or whiskers differ{_which(looked_at)}", _step(looked_at, steps)
            ),
            Measured(f"{name}: first step at which commands differ", last),
            Measured(f"{name}: ticks between the same steps at most", _apart(runs), most=1),
            Measured(f"{name}: encoder counts apart in the first second", _counts_apart(runs), most=2),
        ]
        for run in runs:
            data |= {f"{name}_{run.board}_left": [left for *_, left, _ in run.record.steps][:steps]}
            data |= {f"{name}_{run.board}_right": [right for *_, right in run.record.steps][:steps]}
        drawn.append((name, runs, [seen, looked_at, commanded]))
    shortest = min(len(column) for column in data.values())
    return Outcome(
        measured, {key: column[:shortest] for key, column in data.items()}, lambda figure: _draw(figure, drawn)
    )


def _which(difference: Difference | None) -> str:
    return "" if difference is None else f" ({difference.what} {difference.first} and {difference.second})"


def _step(difference: Difference | None, steps: int) -> int:
    return steps if difference is None else difference.step


def _apart(runs: list[RunResult]) -> int:
    return max(abs(int(a[0] - b[0])) for a, b in zip(*(run.record.steps for run in runs), strict=False))


def _counts_apart(runs: list[RunResult]) -> int:
    counts = [np.stack((run.series.raw["encoder_left"], run.series.raw["encoder_right"])).astype(int) for run in runs]
    ticks = round(1.0 / runs[0].tick)
    return int(np.abs(counts[0][:, :ticks] - counts[1][:, :ticks]).max())


def _draw(figure: Figure, drawn: list[tuple[str, list[RunResult], list[Difference | None]]]) -> None:
    rows = figure.subplots(2 * len(drawn), sharex=True)
    for index, (name, runs, differences) in enumerate(drawn):
        for side in (0, 1):
            axes = rows[2 * index + side]
            for run, style in zip(runs, ("-", "--"), strict=True):
                times = [run.record.times[step[0]] for step in run.record.steps]
                axes.step(times, [step[2 + side] for step in run.record.steps], style, where="post", label=run.board)
            axes.set(ylabel=f"{name},\n{('left', 'right')[side]}", ylim=(-1.05, 1.05))
            for difference, color in zip(differences, ("0.8", "C2", "red"), strict=True):
                if difference is not None:
                    axes.axvline(difference.tick * runs[0].tick, color=color, linestyle=":")
    rows[0].set_title(
        "first difference: grey telemetry, green infrared or whiskers, red commands", loc="left", fontsize=9
    )
    rows[0].legend(loc="lower right", bbox_to_anchor=(1.0, 0.95), ncols=2, fontsize="x-small")
    rows[-1].set(xlabel="time (s)")
