"""What several tests of the simulator need: robots on script boards, torques on bodies."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from cffi import FFI
from numpy.typing import NDArray

from boebot.arenas import Arena, ArenaDescription, Polygon, Start
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import Truth
from boebot.description.robots import RobotDescription, Supply, load_robot
from boebot.record.truth import as_truth
from sim_bridge.boards.board import CLOCK_HZ, EmulatedBoard
from sim_bridge.compiled import ffi, lib
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Sim, SimRobot

MS = CLOCK_HZ // 1000
SUPPLY = Supply(7.75, 5.0, 7200.0, 0.6, 0.5, "regulated", 4.2)  # full, empty, A s, ohm, drop-out, servos, minimum
US = CLOCK_HZ // 1_000_000


def _scripts() -> Any:
    """script_board.c, compiled; the tests may lie in a copy of the package below the checkout."""
    here = Path(__file__).parent
    core = next(folder / "sim_bridge" for folder in here.parents if (folder / "sim_bridge/boards/board.h").exists())
    own = FFI()
    own.cdef("".join(re.findall(r"python: begin \*/(.*?)/\* python: end", (here / "script_board.h").read_text(), re.S)))
    with tempfile.NamedTemporaryFile(suffix=".so") as library:
        command = ["cc", "-std=gnu11", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", f"-I{core}"]
        subprocess.run([*command, "-o", library.name, str(here / "script_board.c")], check=True)
        return own.dlopen(library.name)


scripts = _scripts()


def square(x: float, y: float, side: float) -> list[tuple[float, float]]:
    """Corners of a square around (x, y)."""
    h = side / 2
    return [(x - h, y - h), (x + h, y - h), (x + h, y + h), (x - h, y + h)]


def shortest_ray(half: float, x: float, y: float, heading: float, opening: float = 0.7, rays: int = 7) -> float:
    """To the walls of a square room about the origin, of the rays of a beam (m)."""
    ways = []
    for angle in heading + np.linspace(-opening / 2, opening / 2, rays):
        places = ((x, math.cos(angle)), (y, math.sin(angle)))
        ways.append(min((math.copysign(half, way) - at) / way for at, way in places if way != 0.0))
    return min(ways)


def tones(log: NDArray[Any], pin: int) -> NDArray[np.float64]:
    """What a buzzer at a pin has sounded, by the board's edges: a row for each tone, time (s), duration (s), frequency
    (Hz). Between two of them there is silence for 50 ms."""
    found = []
    edges = log[log["pin"] == pin]
    high = edges["level"] == 1
    rises, falls = (edges["cycle"][which].astype(np.int64) / CLOCK_HZ for which in (high, ~high))
    for tone in np.split(rises, np.flatnonzero(np.diff(rises) > 0.05) + 1) if len(rises) else ():
        end = falls[np.searchsorted(falls, tone[-1])]
        found.append((tone[0], end - tone[0], (len(tone) - 1) / (tone[-1] - tone[0])))
    return np.array(found).reshape(-1, 3)


def arena_of(
    *obstacles: list[tuple[float, float]],
    outline: list[tuple[float, float]] | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Arena:
    """An arena of those obstacles, named "0", "1" and so on."""
    return Arena(
        ArenaDescription(
            name="test",
            start=Start(*start),
            outline=[] if outline is None else [Polygon(outline, "outline")],
            obstacle=[Polygon(corners, str(index)) for index, corners in enumerate(obstacles)],
        )
    )


@dataclasses.dataclass
class Scripted:
    """A simulated robot whose board plays a script."""

    robot: SimRobot
    script: Any

    @property
    def sim(self) -> Sim:
        return self.robot.sim

    @property
    def pins(self) -> BoardPins:
        return BoardPins(self.robot)

    def run(self, seconds: float) -> None:
        cycles = round(seconds * CLOCK_HZ)
        self.sim.run(cycles)

    def edge(self, cycle: int, pin: int, level: int) -> None:
        """The board will do `level` to `pin` at `cycle`; call in order of time."""
        assert scripts.script_board_edge(self.script, cycle, pin, level) == 0

    def pulses(self, seconds: float, widths: dict[int, float], start: float = 0.0) -> None:
        """Servo pulses of those widths (us) by pin every 20 ms."""
        edges = []
        for frame in range(round(seconds / 0.02)):
            rise = round((start + 0.02 * frame) * CLOCK_HZ) + 100
            for pin, width in widths.items():
                edges += [(rise, pin, 1), (rise + round(width * US), pin, 0)]
        for edge in sorted(edges):
            self.edge(*edge)

    def burst(self, start: int, pin: int, period: int = 421, cycles: int = 38) -> None:
        """An infra-red burst."""
        for i in range(cycles):
            self.edge(start + i * period, pin, 1)
            self.edge(start + i * period + period // 2, pin, 0)

    def inputs(self, pin: int) -> list[tuple[int, int]]:
        """(cycle, level) of the changes that were driven on a pin so far."""
        count = scripts.script_board_inputs(self.script, pin, ffi.NULL, ffi.NULL, 0)
        cycles, levels = ffi.new("uint64_t[]", count + 1), ffi.new("uint8_t[]", count + 1)
        scripts.script_board_inputs(self.script, pin, cycles, levels, count)
        return [(int(cycles[i]), int(levels[i])) for i in range(count) if i == 0 or levels[i] != levels[i - 1]]


def pack_voltage(robot: SimRobot) -> float:
    """Of the battery, V."""
    return float(robot.handle.battery.supply.pack_v)


def turret_angle(robot: SimRobot, pin: int) -> float:
    """Of the turret on that pin, rad, counter-clockwise from straight ahead."""
    turret = lib.robot_turret(robot.handle, pin)
    return float(turret.motor.angle) if turret else 0.0


def script_board() -> tuple[Any, EmulatedBoard]:
    """A board that plays a script, and its place in a simulation."""
    script = scripts.script_board_new()
    board = ffi.cast("board *", int(scripts.script_board_address(script)))
    return script, EmulatedBoard((ffi, lib), board, "script")


def scripted(
    arena: Arena | None = None,
    robot: RobotDescription | None = None,
    pose: tuple[float, float, float] | None = None,
    noise: bool = False,
    seed: int = 1,
    step_cycles: int = 16_000,
    without: Sequence[str] = (),
    imperfections: Mapping[str, float] | None = None,
) -> Scripted:
    """A robot on a script board, in an empty field if no arena is given."""
    sim = Sim(arena_of() if arena is None else arena, noise=noise, seed=seed, step_cycles=step_cycles)
    return add_scripted(sim, robot, pose, without=without, imperfections=imperfections)


def add_scripted(
    sim: Sim,
    robot: RobotDescription | None = None,
    pose: tuple[float, float, float] | None = None,
    number: int | None = None,
    without: Sequence[str] = (),
    imperfections: Mapping[str, float] | None = None,
) -> Scripted:
    """One more robot, on another script board."""
    script, board = script_board()
    description = load_robot("shieldbot") if robot is None else robot
    added = sim.add(board, description, pose=pose, number=number, without=without, imperfections=imperfections)
    return Scripted(added, script)


def happened(robot: SimRobot) -> Truth | None:
    """What happened so far; None without recording."""
    sim = robot.sim
    columns = robot.truth() if robot.description.has_board else robot.truth_to_now()
    if not len(columns["time"]):
        return None
    begin, end = float(columns["time"][0]), float(columns["time"][-1])
    return as_truth(columns["time"], columns, floor_plan(sim.arena, begin, end, sim.lateness(), sim.shifts()))


def distance_to_segments(arena: Arena, x: float, y: float) -> float:
    """Distance from a point to the arena's polygons, computed without the simulator."""
    best = math.inf
    for corners in arena.outlines:
        a, b = corners, np.roll(corners, -1, axis=0)
        along = np.clip(((np.array([x, y]) - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1), 0, 1)
        nearest = a + along[:, None] * (b - a)
        best = min(best, float(np.hypot(*(nearest - (x, y)).T).min()))
    return best
