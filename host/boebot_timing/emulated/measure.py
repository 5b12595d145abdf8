"""Measures an image in the emulator, the image untouched.

A run is a function of image, scenario, seed and length. What goes wrong in it is an error that names the place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import msgspec

from boebot.description import robots
from boebot.description.robots import RobotDescription
from boebot.errors import BoardError
from boebot.link import messages
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import TICK_CYCLES, Ping, PulseTrain
from boebot_timing.emulated.losses import losses as losses_of
from boebot_timing.emulated.scenarios import SILENCE, load, numbers_of, prepare
from boebot_timing.emulated.watched import Run, watched
from boebot_timing.measured import Measurement, merged
from boebot_timing.realisable import CLOCK_HZ
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.avr import AvrBoard
from sim_bridge.boards.board import watchdog_resets

GUARD_CYCLES = 64
SCENARIOS = ("figures", "overload", "faults", "everything")
DRAIN_TICKS = 3  # after a run, for what is under way

Progress = Callable[[float], None]


def with_all_devices(robot: RobotDescription) -> RobotDescription:
    """The robot with every device of its pin map built and on."""
    device = {name: msgspec.structs.replace(one, on=True) for name, one in robot.device.items()}
    return msgspec.structs.replace(robot, device=device)


class WorldBench(Bench):
    """A board whose host lives by the world's clock: its bytes begin BOARD_GUARD_CYCLES after they are written."""

    @property
    def now(self) -> int:
        """The cycle up to which the world has run."""
        return self.session.sim.cycle

    def send(self, data: bytes, at: int = 0) -> None:
        """See Bench."""
        super().send(data, at + GUARD_CYCLES)


def everything(image: Path, robot: RobotDescription) -> Bench:
    """An image on a robot with all that it can have, in a room."""
    return WorldBench(image, robot=with_all_devices(robot), arena="room", record=False)


def robot_of(image: Path) -> RobotDescription:
    """The robot that an image was built for, as it says itself.

    Raises:
        BoardError: it does not run, or says nothing.
        RobotError: there is no such robot.
    """
    with Bench(image, record=False) as bench:
        hello = Line(bench).wait(messages.Hello, 0)
    return robots.load_robot(hello.robot.rstrip(b"\0").decode("ascii", "replace"))


def run(image: Path, robot: RobotDescription, scenario: str, seconds: float, seed: int, *, losses: bool = True) -> Run:
    """One run of a scenario for that long, of the board's time, after its preparations.

    Args:
        losses: afterwards the board is asked what it lost; else only the bytes are known.

    Raises:
        BoardError: there is no such scenario or length; the program crashed, hung or was reset by the watchdog, or its
            stack overflowed: the error names cycle, address, function and line.
        AnalysisError: the image is no ELF file of a program.
    """
    if scenario not in SCENARIOS:
        raise BoardError(f"there is no scenario {scenario!r}; expected one of {', '.join(SCENARIOS)}")
    least = SILENCE / CLOCK_HZ if scenario == "everything" else 0.0
    if not least < seconds <= 3600:
        raise BoardError(f"scenario {scenario} for {seconds:g} s; expected more than {least:g} s and at most 3600 s")
    what = watched(image)
    with everything(image, robot) if scenario == "everything" else Bench(image, record=False) as bench:
        board = bench.board
        assert isinstance(board, AvrBoard)
        board.record(what.watch)
        line = prepare(bench, robot, scenario)
        loaded_from, before = bench.now, bench.pins.counters()
        wheels = load(bench, line, robot, scenario, numbers_of(seed), round(seconds * CLOCK_HZ))
        bench.run(round(seconds * CLOCK_HZ))
        after = bench.pins.counters()
        if resets := watchdog_resets(bench.pins.watchdog_log(), image):
            raise BoardError(f"{image.name}, {scenario}, seed {seed}: {resets[0]}")
        record = board.spans()
        lowest_stack = board.lowest_stack
        board.stop_recording()
        cycles = bench.now - loaded_from
        return Run(
            what=what,
            scenario=scenario,
            seed=seed,
            spans=record,
            cycles=cycles,
            executed=after["executed_cycles"] - before["executed_cycles"],
            lowest_stack=lowest_stack,
            loaded_from=loaded_from,
            lost=_lost(line, wheels, scenario, after) if losses else {"bytes": after["overruns"]},
            sent=after["bytes_in"] - before["bytes_in"],
            received=after["bytes_out"] - before["bytes_out"],
        )


def _lost(line: Line, wheels: list[list[PulseTrain]], scenario: str, after: dict[str, int]) -> dict[str, int]:
    """Of "everything", which damages frames, turns parameters of the encoders and holds the bus, only what no host and
    no pin may bring about."""
    if scenario == "everything":
        return {"bytes": after["overruns"], "resets": after["resets"]}
    line.bench.sources[:] = [source for source in line.bench.sources if isinstance(source, Ping)]
    line.bench.run(DRAIN_TICKS * TICK_CYCLES)
    return asdict(losses_of(line, wheels))


def measure(image: Path, robot: RobotDescription, scenario: str, seconds: float, seed: int = 1) -> Measurement:
    """What one run of a scenario amounts to; see `run`."""
    return run(image, robot, scenario, seconds, seed).measurement()


def measure_image(elf: Path, *, seconds: float, seed: int, progress: Progress | None = None) -> Measurement:
    """All scenarios of the robot that an image was built for, `seconds` of the board's time each.

    Args:
        progress: called with the share that is done, 0 to 1.

    Raises:
        BoardError, AnalysisError, RobotError: see `run` and `robot_of`.
    """
    robot = robot_of(elf)
    found = []
    for number, scenario in enumerate(SCENARIOS):
        least = 2 * SILENCE / CLOCK_HZ if scenario == "everything" else 0.0
        found.append(measure(elf, robot, scenario, max(seconds, least), seed))
        if progress:
            progress((number + 1) / len(SCENARIOS))
    return merged(found)
