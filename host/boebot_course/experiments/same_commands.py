"""The same brain and seed on two boards: the firmware compiled for this machine, and its image on an emulated
ATmega328P (E68).

A brain is a function of its seed and of what it saw, so that it must command the same as long as telemetry agrees. That
telemetry does not agree for ever has these causes: the chip is ready some 0.16 s later after its reset, so that the
host's set-points and the board's telemetry fall differently within a tick; a brain's step sees the tick before or
after; a pulse begins a servo frame earlier or later, and a wheel is some millimetres ahead; and interrupts stamp edges
and echoes some cycles later.

Two of the brains are drawn into other ways by that, sooner or later. The third one follows walls: what it reads pulls
it back, so that the whole of two runs can be compared, and it has no chance, so that all it does is by its readings.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import boebot
from boebot.behaviors import Avoid, Wander, Withdraw
from boebot.brain import Brain, Utility
from boebot.cognition import near
from boebot.errors import BoebotError
from boebot.link.messages import Telemetry
from boebot.record.columns import BoardColumns
from boebot.result import RunResult
from boebot.robot import Command
from boebot.running.replayed import replayed
from boebot_course.experiment import Figure, Floats, Measured, Outcome, exactly, experiment
from boebot_course.experiments import wall

SECONDS = 20.0
WALLS_SECONDS = 60.0
LOOKED_AT = ("infrared", "whiskers")  # what turns both brains aside


NOT_SEEN = frozenset(("setpoint_sequence",))
"""Fields of telemetry that say what the host itself sent, and that no device shows to a brain."""


class Difference(NamedTuple):
    """Where two runs differ first."""

    step: int
    """of the brain, from 0"""
    tick: int
    """of the control ticks since the run began, in the first run"""
    what: str
    """"tick", a field of telemetry, or "command\""""
    first: object
    """there, in the first run"""
    second: object
    """and in the second"""

    def __str__(self) -> str:
        return f"step {self.step} (tick {self.tick}): {self.what} is {self.first} and {self.second}"


def telemetry_difference(one: RunResult, other: RunResult, fields: tuple[str, ...] = ()) -> Difference | None:
    """The first step at which the brains did not see the same: another tick, or other telemetry.

    Args:
        one, other: runs on boards.
        fields: of telemetry, that count, with "tick"; (): all that a brain can see.

    Raises:
        BoebotError: a run without a board, which has no telemetry.
    """
    rows = [_seen(run) for run in (one, other)]
    for step, (a, b) in enumerate(zip(*rows, strict=False)):
        for name in a._fields:
            if (name in fields or (not fields and name not in NOT_SEEN)) and getattr(a, name) != getattr(b, name):
                return Difference(step, int(one.series.steps[step]), name, getattr(a, name), getattr(b, name))
    return None


def command_difference(one: RunResult, other: RunResult) -> Difference | None:
    """The first step at which the brains did not command the same."""
    for step, (a, b) in enumerate(zip(one.record.steps, other.record.steps, strict=False)):
        if a[1:] != b[1:]:
            return Difference(step, a[0], "command", Command(*a[1:]), Command(*b[1:]))
    return None


def _seen(run: RunResult) -> list[Telemetry]:
    if run.layout is not None:
        raise BoebotError(f"robot {run.robot.name!r} has no board, and no telemetry to compare")
    assert isinstance(run.series, BoardColumns)
    return [run.series.telemetry(index) for index in run.series.steps.tolist()]


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


# The set-points of one board may take hold a step of the brain (0.05 s) later where it turns on the spot: 8.4 mm at
# 0.168 m/s, and 4.2 mm by phase. Nearness by Ping falls by 1 in 0.40 m, and is multiplied by k = 0.5 / 0.17.
APART_M = 0.0126
UNLIKE = APART_M / 0.40 * 0.5 / 0.17
TICKS = 5  # of a step of the brain
BEHIND = 3  # steps of the brain (25 mm) by which one may be behind the other along the walls, which nothing pulls back


def judge_walls(runs: list[RunResult]) -> list[Measured]:
    """What is asked of two whole runs along the walls."""
    commands = [np.array([step[2:] for step in run.record.steps], dtype=np.float64) for run in runs]
    steps = min(map(len, commands))
    a, b = (one[:steps] for one in commands)
    on_the_spot = (a[:, 0] == -a[:, 1]) & (a[:, 0] != 0)
    turns = int((~on_the_spot[:-1] & on_the_spot[1:]).sum())
    reacts = int((np.diff(a, axis=0) != 0).any(axis=1).sum())
    paths = [np.column_stack((pose.x, pose.y)) for run in runs if (pose := run.true_pose) is not None]
    return [
        exactly("walls: steps of both boards", steps, round(WALLS_SECONDS / runs[0].period)),
        *(
            exactly(f"walls: steps at which it commands otherwise on telemetry of {run.board}", wrong, 0)
            for run, wrong in ((run, disagreements(run, wall.follower())) for run in runs)
        ),
        Measured("walls: steps whose command is not that of the step before", reacts, least=0.1 * steps),
        Measured(
            f"walls: steps whose command is more than {UNLIKE:.2g} from all of the other board within {BEHIND} steps",
            max(_unlike(a, b), _unlike(b, a)),
            most=turns,
        ),
        Measured("walls: true paths apart", max(_astray(*paths), _astray(*paths[::-1])), "m", most=APART_M),
    ]


def _unlike(commands: Floats, others: Floats) -> int:
    """Steps without a like one of the other board a little sooner or later."""
    padded = np.pad(others, ((BEHIND, BEHIND), (0, 0)), mode="edge")
    shifted = (padded[shift : shift + len(commands)] for shift in range(2 * BEHIND + 1))
    return int((np.min([np.abs(commands - other).max(axis=1) for other in shifted], axis=0) > UNLIKE).sum())


def _astray(path: Floats, other: Floats) -> float:
    """How far (m) a path, shape (n, 2), goes from the nearest place of another, which may not have come to its end."""
    return max(float(np.hypot(*(other - place).T).min()) for place in path[: -BEHIND * TICKS])


@experiment("E68", robot="shieldbot (native, avr)", slow=True)
def same_commands(seed: int) -> Outcome:
    """The same brain and seed command the same on both boards, as long as telemetry agrees

    In the notes: section 3.1

    Figure: Motor signals that three brains commanded on the native board and on the emulated ATmega328P, and where
    first telemetry (grey), then infrared or whiskers (green), then their commands (red) differ; along walls
    they differ where a turn begins or ends a step sooner.

    Expected: Along walls, whole runs of 60 s: boards may begin and end a turn on the spot one step of the brain
    apart, as interrupts delay edges of an IR carrier, and an object is then seen a step sooner or later. The wall
    pulls back how far they are from it, and not how far they are along it: turn by turn one may fall behind, by up
    to three steps. But for that, places differ by 8.4 mm driven in a step and 4.2 mm by phase, and commands by that
    times nearness (1 in 0.40 m) and k = 2.9. No command may differ before telemetry does, and a fresh brain must
    command the same at each of 400 steps on the telemetry of either run. The first difference is explained by phase:
    telemetry comes within one tick (10 ms), set-points take hold within a servo frame (20 ms): at 0.14 m/s 4.2 mm,
    less than two of the encoder's steps of 3.2 mm.
    """
    measured: list[Measured] = []
    data: dict[str, list[float]] = {}
    drawn: list[tuple[str, list[RunResult], list[Difference | None]]] = []
    for name, brain in BRAINS.items():
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
    a, b = runs = [wall.lap(wall.pinger(), on, seed, wall.START, WALLS_SECONDS) for on in ("native", "avr")]
    measured += judge_walls(runs)
    for run in runs:
        data |= {f"walls_{run.board}_left": [left for *_, left, _ in run.record.steps]}
        data |= {f"walls_{run.board}_right": [right for *_, right in run.record.steps]}
    drawn.append(("walls", runs, [telemetry_difference(a, b), None, command_difference(a, b)]))
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


FIRSTS = {"first telemetry": "0.5", "infrared or whiskers": "C2", "commands differ": "red"}


def _draw(figure: Figure, drawn: list[tuple[str, list[RunResult], list[Difference | None]]]) -> None:
    grid = figure.subplots(len(drawn), 2, sharex="row", sharey=True)
    for row, (name, runs, differences) in zip(grid, drawn, strict=True):
        for side, axes in enumerate(row):
            for run, style in zip(runs, ("-", "--"), strict=True):
                times = run.series.time[run.series.steps].tolist()
                axes.step(times, [step[2 + side] for step in run.record.steps], style, where="post", label=run.board)
            axes.set(ylim=(-1.05, 1.05))
            for difference, (label, color) in zip(differences, FIRSTS.items(), strict=True):
                if difference is not None:
                    axes.axvline(difference.tick * runs[0].tick, color=color, linestyle=":", label=label)
        row[0].set(ylabel=name)
    for axes, title in zip(grid[0], ("motor signal, left", "motor signal, right"), strict=True):
        axes.set_title(title, fontsize=9)
    for axes in grid[-1]:
        axes.set(xlabel="time (s)")
    labelled = dict(zip(*reversed(grid[0, 0].get_legend_handles_labels()), strict=True))
    figure.legend(labelled.values(), labelled, loc="outside lower center", ncols=5, fontsize="small")
