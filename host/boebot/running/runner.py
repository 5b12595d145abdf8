"""Runs brains on robots: `boebot.run(...)` and `boebot.run_together(...)` do from a script or a notebook what the
command `boebot run` does. The loop of a run is in boebot.running.loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from boebot.description.robots import RobotDescription
from boebot.errors import BoebotError
from boebot.record.interventions import Fault
from boebot.record.run_folder import RunFolder, locked
from boebot.result import Result, RunResult, TogetherResult
from boebot.running.loop import Progress, execute
from boebot.running.tasks import Member, Request, expect

__all__ = ["Member", "run", "run_together"]


def run(
    brain: object = "wander",
    robot: str | Path | RobotDescription | None = None,
    arena: str | Path | None = None,
    on: str | None = None,
    seconds: float = 60.0,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    period: float | None = None,
    progress: Progress | None = None,
    without: Sequence[str] = (),
    imperfections: Mapping[str, float] | None = None,
    pose: tuple[float, float, float] | None = None,
    step_timeout: float | None = None,
    force_timing: bool = False,
    record: bool = True,
    pins: bool = False,
    notes: bool = False,
    strict: bool = False,
    gdb: int | None = None,
    view: bool = False,
    parameters: Mapping[str, Any] | None = None,
    expect_text: str = "",
    fail_text: str = "",
    typed: Sequence[tuple[str, float]] = (),
    inputs: Sequence[tuple[str, float, float]] = (),
    faults: Sequence[str | Fault] = (),
) -> RunResult:
    """Runs a brain and returns what happened.

    Args:
        brain: bundled name ("wander"), Python or TOML file, a `boebot.brain.Brain`, function `step(robot)` or
            `main(robot)`, or object or class with `step(robot)`; or the ELF or HEX file of a program for the Uno, which
            drives the emulated robot by itself: what it prints is printed, each line with its time.
        robot: bundled name, .toml file, or a description; with a board or without. None: the brain's ROBOT, or
            "shieldbot".
        pose: where it starts: x (m), y (m), heading (rad). None: the arena's start.
        period: s from step to step of the brain. None: the brain's PERIOD, or 0.05.
        without: imperfections of the simulated robot that are switched off, such as ("slip", "bounce");
            docs/reference/imperfections.md names them.
        imperfections: magnitudes of others by name, such as {"servo_lag_s": 0.08}; that page has names and units.
        arena: bundled name or .toml file. None: the brain's ARENA where no robot is named either, or the simulator's
            own choice. Of no meaning on a real robot.
        on: what robots with boards run on: "native", "avr", or, for a single one, a port: "/dev/ttyACM0",
            "serial:PORT", "socket://HOST:PORT"; "direct" where no robot has a board. None: native or direct.
        seconds: length of the run by the robots' clocks (s); may be infinite.
        seed: of the simulated world's noise, of the robots' imperfections, and of the first brain's chance.
        realtime: slow a simulated run down to the wall clock.
        step_timeout: s by the wall clock after which a step of a brain that has not ended is an error, which ends the
            run; may be infinite. None: 10 s; in real time, on a board, the time to live of its set-points, after which
            its dead-man stops the motors.
        force_timing: run it even if sensors, period and line are not realisable in time; the record then says so.
        pins: what happens at the pins of emulated boards is recorded, too.
        notes: of a program: `notices` of the result say what a bench does not show, such as an input that floats
            (docs/reference/link.md); only with on="avr" of the kit's own firmware.
        strict: the first such is an error.
        gdb: TCP port for avr-gdb at the one emulated ATmega328P, which waits for it (docs/how-to/debug-a-program.md).
        out: folder for the record, and the files that are made from it (boebot.view).
        record: False: nothing is recorded; a result then has few figures, and `out` is refused.
        view: shows the run in the browser while it goes on, at real time at first; a person may interfere there, or
            begin it afresh: the result is that of the last run (docs/how-to/watch-a-run.md).
        parameters: of a brain of processes, by name, for this run, such as {"avoid.turn": 0.4, "avoid.utility.b": -1.0}
            (docs/how-to/several-behaviors.md).
        expect_text: of a program: the run is over once this was printed; not printed in time is an error.
        fail_text: of a program: that this was printed is an error.
        typed: to a program, by its board's serial line: texts, each with its time (s), as in [("go\\n", 0.5)].
        inputs: of the robot of a program: its buttons, switches and knobs, each with a value and its time (s), as in
            [("start", 1, 0.5), ("start", 0, 0.7), ("dial", 0.3, 2.0)].
        faults: what fails, by name, time of the run and value, as in ["ping.missing@3s..5s", "serial.flipped=1e-3@2"]
            (docs/reference/faults.md). One that changes nothing is an error.
        progress: called with the run's time so far (s), about ten times a second.

    Raises:
        BoebotError: whatever the user can mend: bad input, an error in the brain (with its place), a board that is not
            there or that vanishes. The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; motors stopped and record written.
    """
    request = Request.single(**_asked(locals()))
    return cast(RunResult, _kept(request, progress, out, view=view))


def run_together(
    members: Sequence[Member],
    arena: str | Path | None = None,
    seconds: float = 60.0,
    on: str | None = None,
    seed: int = 1,
    realtime: bool = False,
    out: str | Path | None = None,
    progress: Progress | None = None,
    step_timeout: float | None = None,
    force_timing: bool = False,
    pins: bool = False,
    notes: bool = False,
    strict: bool = False,
    view: bool = False,
    faults: Sequence[str | Fault] = (),
) -> TogetherResult:
    """Runs several robots, each with its own brain, and with its own board if it has one, in one simulated world.

        boebot.run_together([Member(brain="wander"), Member(brain="chase.py", pose=(0.5, 0.5, 0))], seconds=30)

    Args:
        members: the robots.
        arena, seconds, on, seed, realtime, step_timeout, force_timing, pins, notes, strict, view: as of
            `boebot.run`.
        faults: as of `boebot.run`, of all robots, or of one: ["2:cable.out@3s..3.5s"].
        out: folder for a picture and a page of all robots, and for a folder of files per robot.
        progress: called with the run's time so far (s), about ten times a second.

    Returns:
        A result per robot, and the figures common to them.

    Raises:
        BoebotError: whatever the user can mend: bad input, no free place, an error in a brain (with its robot and
            place). The record up to there is written to `out` all the same.
        KeyboardInterrupt: Ctrl-C; all motors stopped and the record written.
    """
    request = Request(**_asked(locals()))
    result = _kept(request, progress, out, view=view, together=True)
    return cast(TogetherResult, result)


def _asked(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Those that a `Request` has, by the same names."""
    return {name: value for name, value in arguments.items() if name not in ("progress", "out", "view")}


def _kept(
    request: Request, progress: Progress | None, out: str | Path | None, *, view: bool, together: bool = False
) -> Result:
    """Does the whole of a run, and writes what came of it to the folder `out`, if there is one. `together`: the result
    is that of several robots, also where there is one.

    Raises:
        BoebotError: the folder cannot be written to; else whatever ended the run before its time, once that is written.
    """
    expect("out", out, "a folder or None", str, Path, type(None))
    if not isinstance(view, bool):
        raise BoebotError(f"view is {view!r}; expected True or False")
    if view and not request.record:
        raise BoebotError("a run that is not recorded cannot be viewed; expected record=True with view=True")
    with locked(None if out is None else Path(out)) as folder:
        result: Result = _viewed(request, progress, folder) if view else execute(request, progress, folder)
        if together and isinstance(result, RunResult):
            result = TogetherResult(robots=[result], error=result.error)
        if folder is not None:
            try:
                result.save(folder.path)
            except BoebotError as unsaved:
                if result.error is None:
                    raise
                result.error.add_note(str(unsaved))
    if result.error is not None:
        raise result.error
    return result


def _viewed(request: Request, progress: Progress | None, folder: RunFolder | None) -> Any:
    from boebot.live.session import opened, run_viewed

    with opened() as page:
        return run_viewed(page, request, progress, folder, waits=False)
