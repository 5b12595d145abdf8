"""`boebot replay DIR`: a brain on what was sensed in a run, and the first command that differs; or with --again the
whole simulated run once more, and where it differs. In place of a run's folder it takes a record that others have made.

Exit codes: 0 all is the same; 1 something differs, or a record lacks a part inside; 2 it cannot be replayed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import ending, options, output, streams
from boebot.errors import BoebotError
from boebot.guests import RECORDS, Guest, ReadRecord, guests
from boebot.record.reading import CutError
from boebot.record.run import Run
from boebot.result import read_run, robots_of
from boebot.robot import Command
from boebot.running.again import Recorded, Repetition, again, recorded
from boebot.running.replayed import replayed

EXIT_DIFFERS, EXIT_USAGE = 1, 2
_PER_UNIT = 10_000  # counts of a set-point per unit
_SUFFIXES = ", ".join(f".{suffix}" for suffix in guests(RECORDS))


@ending.of_sensible_rows()
def replay(
    context: typer.Context,
    run: Annotated[
        Path,
        typer.Argument(metavar="DIR|FILE", help=f"Folder of a run, or a record of other programs' ({_SUFFIXES})."),
    ],
    brain: Annotated[str | None, options.brain("Bundled brain, or a Python or TOML file, as of boebot run.")] = None,
    robot: options.RobotNumber = None,
    kind: Annotated[
        str | None, options.robot("Of a FILE: bundled robot or .toml file; else the one that its board names.")
    ] = None,
    node: Annotated[
        str | None, typer.Option("--node", metavar="[BUS:]N", help="Of a FILE: which board, if several.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="N", help="Of a FILE: seed of the brain's chance; else 1.")
    ] = None,
    repeats: Annotated[
        bool, typer.Option("--again", help="Repeat a simulated run with its own brain, and say where it differs.")
    ] = False,
    trust: Annotated[
        bool, typer.Option("--trust", help="With --again: run a brain that came with the record.")
    ] = False,
) -> None:
    """Run a brain on what was sensed in a run, and name the first command that differs; or repeat the run."""
    _check(context, run, repeats, brain)
    try:
        if repeats:
            _repeat(run, trust)
        else:
            _replay(run, brain or "", robot, kind, node, seed)
    except BoebotError as error:
        output.say(str(error))
        raise typer.Exit(EXIT_DIFFERS if isinstance(error, CutError) else EXIT_USAGE) from None


def _foreign(run: Path) -> Guest | None:
    """Who reads the file, where others than boebot have made it."""
    return None if run.is_dir() else guests(RECORDS).get(run.suffix[1:].lower())


def _check(context: typer.Context, run: Path, repeats: bool, brain: str | None) -> None:
    """Raises a usage error where options of one way stand beside those of the other."""
    if not repeats and brain is None:
        raise typer.BadParameter(f"expected --brain BRAIN{', or --again' if _foreign(run) is None else ''}", context)
    others = ("brain", "robot", "kind", "node", "seed") if repeats else ("trust",)
    for name in others:
        if context.params[name] not in (None, False):
            way = "--again repeats a run as it was; expected no" if repeats else "expected --again with"
            raise typer.BadParameter(f"{way} --{name}", context)


# ---- a brain on what was sensed --------------------------------------------------------------------------------------


def _replay(run: Path, brain: str, robot: int | None, kind: str | None, node: str | None, seed: int | None) -> None:
    if (foreign := _foreign(run)) is not None:
        if robot is not None:
            raise BoebotError(f"{run} is no record of boebot's; expected --node in place of --robot")
        read: ReadRecord = foreign.load()
        result = read(run, kind, node, 1 if seed is None else seed)
    elif (kind, node, seed) != (None, None, None):
        raise BoebotError(f"{run} is the record of a run; expected no --kind, --node or --seed")
    else:
        result = _recorded(run, robot)
    with streams.kept():
        commands = replayed(result, brain)
    with ending.of_record(result):
        _compare(result, commands if foreign is None else [_as_on_the_wire(command) for command in commands])


def _as_on_the_wire(command: Command) -> Command:
    """A command as its set-point carries it."""
    return Command(command.kind, *(round(value * _PER_UNIT) / _PER_UNIT for value in command[1:]))


def _compare(result: Run, commands: list[Command]) -> None:
    """Prints what came of it; where something differs, it ends the command with its exit code."""
    steps = result.record.steps
    for number, (step, command) in enumerate(zip(steps, commands, strict=False)):
        recorded = Command(*step[1:])
        if recorded != command:
            output.line(f"{_place(result, number)} differs: {recorded} in the run, {command} in the replay")
            raise typer.Exit(EXIT_DIFFERS)
    if len(commands) < len(steps):
        output.line(f"the brain was over after {len(commands)} steps; the run has {len(steps)}")
        raise typer.Exit(EXIT_DIFFERS)
    part = ", as far as it goes" if isinstance(result.error, CutError) else ""
    output.line(f"all {len(steps)} commands are the same{part}")


def _recorded(run: Path, number: int | None) -> Run:
    """The run in a folder, of one robot; what a brain did after something that is lost cannot be replayed."""
    robots = robots_of(read_run(run, up_to_damage=True), number)
    if len(robots) > 1:
        raise BoebotError(f"{run} is a run of {len(robots)} robots; expected --robot 1 to {len(robots)}")
    (result,) = robots.values()
    if isinstance(result.error, CutError) and result.error.lost and not result.record.count("command"):
        raise result.error
    return result


def _place(result: Run, step: int) -> str:
    """A step of the brain in words, with the board's tick that it answered, if there is a board."""
    series, index = result.series, result.series.steps[step]
    tick = f"tick {series.raw['tick'][index]}, " if result.layout is None else ""
    return f"step {step} ({tick}{series.time[index]:.2f} s)"


# ---- the run once more -----------------------------------------------------------------------------------------------


def _repeat(folder: Path, trust: bool) -> None:
    """`trust`: a brain that came with the record is run without asking."""
    run = recorded(folder)
    if run.needs_trust and not trust and sys.stdin is not None and sys.stdin.isatty():
        output.say(run.warning)
        trust = typer.confirm("run it?", err=True)
    with (
        streams.kept(for_the_answer=True),
        output.progress_bar(f"{folder} again", run.seconds) as progress,
    ):
        repetition = again(run, progress, trust=trust)
    if repetition.part is not None:
        output.say(repetition.part)
    output.line(_sentence(folder, run, repetition))
    if not repetition.is_equal:
        raise typer.Exit(EXIT_DIFFERS)


def _sentence(folder: Path, run: Recorded, repetition: Repetition) -> str:
    if repetition.difference is not None:
        return f"differs from {folder} first at robot {repetition.robot}, {repetition.difference}"
    if repetition.ends is not None:
        return f"differs from {folder}: robot {repetition.robot} ended by {' and by '.join(map(repr, repetition.ends))}"
    part = "" if repetition.part is None else ", as far as it goes"
    length = f"{repetition.steps} steps" if repetition.steps else f"{run.seconds:g} s"  # a program has no steps
    return f"bit-equal to {folder}{part}: {length}"
