"""`boebot run BRAIN`: a brain drives a robot, emulated or real, or a program drives an emulated one; or several robots
share one simulated world."""

from __future__ import annotations

import contextlib
import inspect
import math
import os
import tomllib
from pathlib import Path
from typing import Annotated, Any

import typer

from boebot.brains import LoadedBrain, bundled, load_program, names_program
from boebot.cli import options, output, quantity, streams
from boebot.cli.ending import Detail, detail, end
from boebot.errors import BoebotError, CallError, MissingTextError
from boebot.guests import Guest, folder_of
from boebot.record import run_folder
from boebot.running.tasks import Member, Request

SECONDS = 60.0
TURN = 2 * math.pi + 1e-9  # rad


def run(
    context: typer.Context,
    brain: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="BRAIN",
            autocompletion=options.complete_brains,
            help="What drives it: a bundled brain by its name, a Python file with step(robot), main(robot), a class "
            "Brain or brain = Brain([...]), a TOML file of processes, or a program for the Uno: .ino, folder, .elf, "
            ".hex; several: a robot for each.",
        ),
    ] = None,
    on: options.RunOn = None,
    robot: Annotated[
        list[str] | None,
        options.robot(
            "Bundled robot or .toml file; again for each further robot. Else the brain's ROBOT, or shieldbot."
        ),
    ] = None,
    robots: Annotated[
        int | None, typer.Option("--robots", metavar="N", min=1, help="How many robots share the world.")
    ] = None,
    pose: Annotated[
        list[str] | None,
        typer.Option(
            "--pose",
            metavar="X,Y,HEADING",
            help="Where a robot starts, as in 0.5,20cm,90deg; again for each further robot. Else at the arena's start, "
            "further ones at free places near it.",
        ),
    ] = None,
    arena: options.ArenaName = None,
    seconds: Annotated[float, options.time("Length of the run by the board's clock.")] = SECONDS,
    seed: options.Seed = 1,
    period: options.Period = None,
    without: options.Without = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A parameter of a brain of processes for this run: avoid.turn=0.4, avoid.utility.w.near=2, ... Of "
            "several robots of each, or of one: 2:avoid.turn=0.4.",
        ),
    ] = None,
    imperfection: options.Imperfections = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="Slow a simulated run down to the wall clock.")] = False,
    step_timeout: Annotated[
        float | None,
        options.time(
            "Wall time after which a step of the brain that has not ended is an error. Else 10 s; in real time the "
            "time after which the board's dead-man stops the motors."
        ),
    ] = None,
    force_timing: Annotated[
        bool,
        typer.Option(
            "--force-timing", help="Run it even if its sensors, period and line are not realisable; the record says so."
        ),
    ] = False,
    pins: Annotated[
        bool, typer.Option("--pins", help="Record the pins of emulated boards, too; boebot report --as vcd shows them.")
    ] = False,
    expect_text: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT", help="Of a program: the run ends when this was printed; if it never is, with an error."
        ),
    ] = None,
    fail_text: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="Of a program: that this was printed is an error, and ends the run."),
    ] = None,
    typed: Annotated[
        list[str] | None,
        typer.Option(
            "--type",
            metavar="TEXT@TIME",
            help=r"What a program's serial line gets at that time, as in 'go\n@0.5'; again for each further one.",
        ),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="NAME=VALUE@TIME",
            help="Work a device of a program's robot at that time: a button or a switch, as in start=1@0.5, a knob, as "
            "in dial=30%@2; again for each further one.",
        ),
    ] = None,
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="NAME[=VALUE]@START[..END]",
            help="Something fails from START to END of the run, as in ping.missing@3s..5s; again for each further one. "
            "boebot faults lists them. If it changes nothing, the exit code is 3.",
        ),
    ] = None,
    timeout: Annotated[
        int | None, typer.Option(metavar="MS", min=1, help="Length of the run in simulated ms, in place of --seconds.")
    ] = None,
    timeout_exit_code: Annotated[
        int, typer.Option(metavar="N", min=0, max=255, help="Exit code where --expect-text was not printed in time.")
    ] = 42,
    notes: Annotated[
        bool,
        typer.Option(
            "--notes",
            help="Say of a program what a bench does not show: pins driven from both sides, floating inputs that "
            "decide, RAM read before it is written.",
        ),
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="The first such note is an error, and ends the run.")
    ] = False,
    gdb: options.Gdb = None,
    sweep: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="In place of a BRAIN: one run of a sweep again, from what its folder keeps."),
    ] = None,
    row: Annotated[int | None, typer.Option(metavar="N", min=0, help="Which run of the sweep, from 0.")] = None,
    view: options.View = False,
    speed: options.Speed = None,
    view_port: options.ViewPort = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where to write record.mcap, run.png, replay.html and summary.json."),
    ] = None,
    json: options.Json = False,
    verbose: options.Verbose = False,
    quiet: options.Quiet = False,
) -> None:
    """Let a brain drive a robot, and say what happened.

    Several robots in one simulated world:

      boebot run wander --robots 3              three robots, the same brain

      boebot run wander chase.py                two robots, a brain for each

      boebot run wander --robots 2 --pose 0.5,0.5,90deg --pose 1.5,0.5,180deg

    A program for the Arduino Uno drives in place of a brain; what it prints is shown with its time:

      boebot run blink.ino --expect-text ready --timeout 2000

    It is a sketch, which PlatformIO builds, the folder of one, a folder with a platformio.ini, or an ELF or HEX file.

    What is typed at the terminal goes to it; a script types by --type 'go\\n@0.5'. With --json its text is on standard
    error, with --quiet it is left out.

    An option that is given once goes for all of them; given several times, it goes to robot 1, 2 and so on.

    Times, lengths and angles are in s, m and rad, or have a unit: 50ms, 2min, 20cm, 90deg.
    """
    wanted = detail(json=json, verbose=verbose, quiet=quiet)
    if sweep is not None or row is not None:
        request = _of_sweep(context, sweep, row)
        return _run(request, f"row {row}", None, out, wanted, view=view, speed=speed, port=view_port, quiet=quiet)
    if not brain:
        raise typer.BadParameter("there is no BRAIN; expected one, or --sweep and --row")
    ideal, imperfect = options.names(without), options.magnitudes(imperfection)
    if timeout is not None and seconds != SECONDS:
        raise CallError("--seconds and --timeout both say how long the run is; expected one of them")
    if "" in (expect_text, fail_text):
        raise CallError("--expect-text or --fail-text is empty; expected a text")
    kinds: list[Any] = robot or [None]
    poses = [_pose(text) for text in pose or []]
    count = _count(robots, len(brain), len(kinds), len(poses))
    assigned = _assigned(parameters or [], count)
    drivers = {one: _built(one, quiet) for one in dict.fromkeys(brain)}
    request = Request(
        members=[
            Member(
                brain=drivers[brain[index % len(brain)]],
                robot=kinds[index % len(kinds)],
                pose=poses[index] if index < len(poses) else None,
                period=period,
                without=ideal,
                parameters=assigned[index],
                imperfections=imperfect,
            )
            for index in range(count)
        ],
        arena=arena,
        on=on,
        seconds=seconds if timeout is None else timeout / 1000,
        seed=seed,
        realtime=realtime,
        step_timeout=step_timeout,
        force_timing=force_timing,
        pins=pins,
        expect_text=expect_text or "",
        fail_text=fail_text or "",
        typed=[_typed(text) for text in typed or []],
        inputs=[_input(text) for text in inputs or []],
        faults=faults or [],
        notes=notes,
        strict=strict,
        gdb=gdb,
    )
    name = brain[0] if len(brain) == 1 else f"{count} robots"
    try:
        _run(request, name, on, out, wanted, view=view, speed=speed, port=view_port, quiet=quiet)
    except MissingTextError as error:
        error.exit_code = timeout_exit_code
        raise


def _run(
    request: Request,
    name: str,
    on: str | None,
    out: Path | None,
    wanted: Detail,
    *,
    view: bool,
    speed: float | None,
    port: int | None,
    quiet: bool,
) -> None:
    """Runs it, and says what happened."""
    programs = [member for member in request.members if isinstance(member.brain, LoadedBrain)]
    with run_folder.locked(out) as folder:
        with contextlib.ExitStack() as shown:
            title = name if on is None else f"{name} on {on}"
            progress = shown.enter_context(output.progress_bar(title, request.seconds, quiet or view or bool(programs)))
            run_it = shown.enter_context(
                options.runner(view=view, speed=speed, port=port, waits=True, types=len(programs) == 1)
            )
            shown.enter_context(streams.kept(for_the_answer=wanted is Detail.JSON))
            if quiet and programs:
                nowhere = shown.enter_context(Path(os.devnull).open("w", encoding="utf-8"))
                shown.enter_context(contextlib.redirect_stdout(nowhere))
            result = run_it(request, progress, folder)
        end(result, out, wanted)


def _of_sweep(context: typer.Context, folder: Path | None, row: int | None) -> Request:
    """The run that the folder keeps.

    Raises:
        CallError: it keeps none, or another option is given, which would say otherwise what to run.
    """
    sources = {one: getattr(context.get_parameter_source(one), "name", "") for one in context.params}
    given = [one for one, source in sources.items() if source == "COMMANDLINE"]
    if others := set(given) - {"sweep", "row", "view", "speed", "view_port", "out", "json", "verbose", "quiet"}:
        raise CallError(f"{sorted(others)[0]} and --sweep both say what to run; expected one of them")
    if folder is None or row is None:
        raise CallError("--sweep names a folder and --row a run in it; expected both")
    if (kind := folder_of(folder)) is None:
        raise CallError(f"{folder} holds no sweep; expected a folder that boebot sweep has written")
    request: Request = Guest(folder.name, kind.request).load()(folder, row)
    return request


run.__doc__ = f"""{inspect.getdoc(run)}

Bundled brains: {", ".join(bundled())}. `boebot new NAME` writes a first one; with --main, one that runs
from top to bottom; with --brain, one of several behaviors."""


def _built(name: str, quiet: bool) -> object:
    """The program that is built of a sketch; what else drives a robot is left to be found."""
    if not names_program(name):
        return name
    with output.progress_bar(f"building {name}", math.inf, quiet) as progress:
        return load_program(name, progress)


def _assigned(texts: list[str], count: int) -> list[dict[str, Any]]:
    """Of "NAME=VALUE" or "2:NAME=VALUE" for each of `count` robots; a value is as in TOML, what is none there a text.

    Raises:
        BoebotError: one is no such thing, or comes twice.
    """
    robots: dict[str, dict[str, Any]] = {str(number): {} for number in range(1, count + 1)}
    for one in texts:
        place, sign, text = one.partition("=")
        number, _, name = place.rpartition(":")
        meant = [values for robot, values in robots.items() if number in ("", robot)]
        if not sign or not meant or any(name in values for values in meant):
            raise BoebotError(
                f"--set {one}; expected NAME=VALUE or N:NAME=VALUE, once for each robot from 1 to {count}"
            )
        for read in (lambda text: tomllib.loads(f"value = {text}")["value"], float, str):
            with contextlib.suppress(ValueError):
                value = read(text)
                break
        for values in meant:
            values[name] = value
    return list(robots.values())


def _count(robots: int | None, brains: int, kinds: int, poses: int) -> int:
    """How many robots those options mean.

    Raises:
        BoebotError: they contradict each other.
    """
    count = max(brains, kinds, poses) if robots is None else robots
    given = {f"{brains} brains": brains, f"{kinds} times --robot": kinds}
    for what, times in given.items():
        if times not in (1, count):
            raise BoebotError(f"there are {what} for {count} robots; expected 1 or {count}")
    if poses > count:
        raise BoebotError(f"there are {poses} times --pose for {count} robots; expected at most {count}")
    return count


def _typed(text: str) -> tuple[str, float]:
    r"""Of "TEXT@TIME"; in the text \n, \t, \x1b and the like are what they are in Python.

    Raises:
        CallError: it is no such thing.
    """
    what, sign, time = text.rpartition("@")
    try:
        if not sign:
            raise BoebotError("there is no @")
        return what.encode("latin-1", "backslashreplace").decode("unicode_escape"), quantity.parse(time, "s")
    except (BoebotError, UnicodeDecodeError) as error:
        raise CallError(f"--type {text!r} cannot be typed: {error}; expected TEXT@TIME, as in 'go\\n@0.5'") from None


def _input(text: str) -> tuple[str, float, float]:
    """Of "NAME=VALUE@TIME".

    Raises:
        CallError: it is no such thing.
    """
    what, _, time = text.rpartition("@")
    name, _, value = what.partition("=")
    try:
        if not name or not value:
            raise BoebotError("there is no name, = or @")
        return name, quantity.parse(value, ""), quantity.parse(time, "s")
    except BoebotError as error:
        raise CallError(f"--input {text!r}: {error}; expected NAME=VALUE@TIME, as in start=1@0.5") from None


def _pose(text: str) -> tuple[float, float, float]:
    """Of "X,Y,HEADING".

    Raises:
        BoebotError: it is no pose.
    """
    parts = text.split(",")
    if len(parts) != 3:
        raise BoebotError(f"--pose {text!r} is no pose; expected X,Y,HEADING, as in 0.5,20cm,90deg")
    try:
        x, y, heading = (quantity.parse(part, unit) for part, unit in zip(parts, ("m", "m", "rad"), strict=True))
    except BoebotError as error:
        raise BoebotError(f"--pose {text!r} is no pose: {error}") from None
    if abs(heading) > TURN:
        raise BoebotError(
            f"--pose {text!r} is no pose: its heading is {heading:g} rad; expected one turn at most, "
            f"6.28 rad or 360deg ({heading:g} degrees are {heading:g}deg)"
        )
    return x, y, heading
