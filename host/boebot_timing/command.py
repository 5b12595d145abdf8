"""`boebot timing`: what a firmware image takes at most, what was measured, and whether both fit the budgets; and
whether a robot, a brain and a line are realisable in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from boebot import missing, resources
from boebot.cli import options, output, streams
from boebot.errors import BoebotError, TimingError

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription
    from boebot_timing.budget import Report
    from boebot_timing.measured import Measurement
    from boebot_timing.realisable import Verdict

EXIT_BROKEN, EXIT_INPUT = 1, 2
_SHORTEST_S, _LONGEST_S = 0.1, 3600.0  # of a scenario


def timing(
    elf: Annotated[
        Path | None, typer.Option("--elf", metavar="F", help="Image to judge. Else that of the robot's pin map.")
    ] = None,
    robot: options.RobotName = "shieldbot",
    load: Annotated[
        str, typer.Option("--load", metavar="L", help="How often interrupts come: figures, overload or everything.")
    ] = "figures",
    measure: Annotated[
        bool, typer.Option("--measure/--no-measure", help="Run the image in the emulator too, where there is one.")
    ] = True,
    seconds: Annotated[float, options.time("Of the board's time, for each that is measured: 0.1 to 3600.")] = 1.0,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the scenarios, 0 or more.")] = 1,
    port: Annotated[
        str | None,
        typer.Option(
            "--port", metavar="P", help="Board whose own maxima are read: a port, or avr. It must run this image."
        ),
    ] = None,
    brain: Annotated[str | None, options.brain("Measure the steps of this brain in a simulated run.")] = None,
    step: Annotated[float | None, options.time("What a step of the brain takes, as in 4ms.")] = None,
    period: options.Period = None,
    baud: Annotated[
        int | None, typer.Option("--baud", metavar="RATE", help="Of the line (bit/s). Else as the robot says.")
    ] = None,
    where: Annotated[
        str | None,
        typer.Option("--where", metavar="NAME", help="Only this: where the bound of a task or an interrupt goes."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where to write the timing diagram and timing.json.")
    ] = None,
    json: options.Json = False,
) -> None:
    """What the firmware may take, what it took, and whether that fits its budgets (notes, section 3.2, Fig. 3.2).

      boebot timing                         the bundled image, emulator too

      boebot timing --elf F --no-measure    an image, by its machine code

      boebot timing --port /dev/ttyACM0     with what a board measures itself

      boebot timing --where NAME            the worst path of a task or interrupt

      boebot timing --robot R --brain B     do sensors, brain and line fit?

    Times are cycles of 1/16 us. bound: the most that the machine code can take; emulator, board: the longest that was
    measured; slack: what the bound leaves of the budget; response: the latest end after a slot begins, interrupts
    included.

    --out DIR writes the timing diagram, timing.png and timing.svg, and timing.json.

    Exit code: 0 all is well; 1 a budget or a limit is broken, or the robot is not realisable; 2 bad input, or an image
    whose timing is not known; 130 after Ctrl-C.
    """
    from boebot.description.robots import load_robot
    from boebot.record.run_folder import make_folder
    from boebot.running.tasks import DEFAULT_PERIOD
    from boebot_timing import board, budget, loads, realisable

    try:
        if where is not None:
            _show_where(elf, robot, where, json)
            return
        if not _SHORTEST_S <= seconds <= _LONGEST_S:
            raise TimingError(f"{seconds:g} s cannot be measured; expected --seconds {_SHORTEST_S:g} to {_LONGEST_S:g}")
        if seed < 0:
            raise TimingError(f"{seed} is no seed; expected --seed 0 or more")
        description = load_robot(robot)
        description.expect_kit()
        asked = loads.load_named(load)
        if out is not None:
            make_folder(out)
        image = _image(elf, description)
        found = None
        if image is not None:
            maxima = {} if port is None else board.maxima(port, description, image, seconds, elf)
            measured = _measured(image, seconds, seed) if measure else None
            with output.progress_bar(f"bounds of {image.name}", 100, unit=" %") as watch:
                found = budget.prove(image, asked, measured, maxima, progress=lambda share: watch(100 * share))
        brain_s, own_period = _brain(brain, step, description, seed)
        period_s = period if period is not None else own_period or DEFAULT_PERIOD
        times = None if found is None else found.board_times
        verdict = realisable.judge(description, period_s, board=times, brain_s=brain_s, baud=baud)
        answer = Answer(found, verdict)
        if out is not None:
            answer.files = _write(answer, out)
    except BoebotError as error:
        output.say(str(error))
        raise typer.Exit(EXIT_INPUT) from None
    if json:
        output.print_json(answer.as_dict())
    else:
        answer.show()
    if answer.is_broken:
        raise typer.Exit(EXIT_BROKEN)


@dataclass
class Answer:
    """All that was found out."""

    report: Report | None
    verdict: Verdict
    files: Sequence[Path] = ()

    @property
    def is_broken(self) -> bool:
        """A budget is broken, or the robot is not realisable."""
        return bool(self.report and self.report.faults) or not self.verdict.is_realisable

    def as_dict(self) -> dict[str, Any]:
        """For programs."""
        return {
            "image": None if self.report is None else self.report.as_dict(),
            "realisable": self.verdict.as_dict(),
            "files": [str(path) for path in self.files],
        }

    def show(self) -> None:
        """For people."""
        from boebot_timing import shown

        if self.report is not None:
            shown.show_report(self.report)
        shown.show_verdict(self.verdict)
        if self.files:
            output.line(f"files in {self.files[0].parent}: {', '.join(path.name for path in self.files)}")


def _show_where(elf: Path | None, robot: str, name: str, json: bool) -> None:
    """The worst path of a task or an interrupt. Raises BoebotError or AnalysisError where there is none."""
    from boebot.description.robots import load_robot
    from boebot_timing import shown
    from boebot_timing.firmware import load_firmware
    from boebot_timing.worst_path import worst_path

    image = _image(elf, load_robot(robot))
    if image is None:
        raise TimingError(f"robot {robot!r} has no board, and so no image; expected --elf F")
    firmware = load_firmware(image)
    path = worst_path(firmware, name)
    if firmware.image.assumed_chip:
        output.say(firmware.image.assumed_chip)
    if json:
        output.print_json({"elf": str(image)} | path.as_dict())
    else:
        shown.show_path(path)


def _image(elf: Path | None, robot: RobotDescription) -> Path | None:
    """The image that is meant; None: the robot has no board.

    Raises:
        TimingError: it has not been built.
    """
    if elf is not None or not robot.has_board:
        return elf
    robot.expect_kit()
    image = resources.folder("images") / f"{robot.pin_map}.elf"
    if not image.is_file():
        raise TimingError(f"there is no image {image}; {missing.built('firmware')}, or name one by --elf F")
    return image


def _measured(image: Path, seconds: float, seed: int) -> Measurement:
    """What the emulator shows of the image."""
    try:
        from boebot_timing.emulated.measure import measure_image
    except ImportError as error:
        raise TimingError(f"the image cannot be measured here: {error}") from None
    with output.progress_bar(f"measuring {image.name}", 100, unit=" %") as watch:
        return measure_image(image, seconds=seconds, seed=seed, progress=lambda share: watch(100 * share))


@streams.kept()
def _brain(brain: str | None, step_s: float | None, robot: RobotDescription, seed: int) -> tuple[float, float | None]:
    """What a step of the brain takes at most (s; 0: not known), as given or as measured, and the brain's own period."""
    if brain is None:
        return step_s or 0.0, None
    from boebot.brains import load_brain
    from boebot.running.loop import execute
    from boebot.running.tasks import Request

    loaded = load_brain(brain)
    if step_s is not None:
        return step_s, loaded.period
    result = execute(Request.single(loaded, robot=robot, seconds=5.0, seed=seed, force_timing=True))
    if result.error is not None:
        raise result.error
    return result.longest_step or 0.0, loaded.period


def _write(answer: Answer, out: Path) -> list[Path]:
    import json

    from boebot.record.run_folder import write_files

    found: dict[str, bytes] = {}
    if answer.report is not None:
        from boebot_timing import diagram

        found |= diagram.files(answer.report, answer.verdict)
    found["timing.json"] = (json.dumps(answer.as_dict(), indent=1) + "\n").encode()
    return write_files(out, found)
