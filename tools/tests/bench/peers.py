"""Other people's work, measured in the same run on the same machine."""

from __future__ import annotations

import functools
import io
import math
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from boebot import resources
from boebot.arenas import load_arena
from tools.tests.bench import scene

ROOT = Path(__file__).resolve().parents[3]
TAKES = 0.2  # s that a measurement takes, about
INFRARED = {"number": 9, "angle_range": 2 * max(scene.ANGLES) + scene.OPENING, "range_max": scene.INFRARED_RANGE}
LASER = {
    "number": scene.BEAMS,
    "angle_range": (scene.BEAMS - 1) * scene.BEAM_STEP,
    "range_max": scene.LASER_RANGE,
}


def plain_simavr(seconds: float = 10.0) -> float:
    """The firmware image in Debian's simavr, board alone (× real time)."""
    program = ROOT / "build" / "plain_simavr"
    if not program.exists():
        source = str(ROOT / "tools/tests/bench/plain_simavr.c")
        subprocess.run(
            ["cc", "-O2", "-I/usr/include/simavr", source, "-o", str(program), "-lsimavr", "-lelf"], check=True
        )
    image = resources.folder("images") / "shieldbot.hex"
    done = subprocess.run([str(program), str(image), str(seconds)], check=True, capture_output=True, text=True)
    return seconds / float(done.stdout.split()[-1])


def rate(step: Callable[[], None]) -> float:
    """Steps/s by the processor's time, of as many as take long enough."""
    done, wanted = 0, 1
    started = time.process_time()
    while (took := time.process_time() - started) < TAKES:
        for _ in range(wanted):
            step()
        done += wanted
        wanted = min(2 * wanted, 1000)
    return done / took


def ir_sim_world(
    outline: scene.Corners, obstacles: list[scene.Corners], start: tuple[float, float, float], radius: float, lidar: Any
) -> Callable[[], None]:
    """A step of 10 ms in ir-sim: a disc on two wheels and its lidar with noise, driven without a brain."""
    low, high = np.min(outline, axis=0), np.max(outline, axis=0)
    shapes = [("linestring", [*outline, outline[0]]), *(("polygon", corners) for corners in obstacles)]
    sensor = ", ".join(f"{key}: {value}" for key, value in lidar.items())
    lines = [
        "world:",
        f"  {{width: {high[0] - low[0]}, height: {high[1] - low[1]}, offset: [{low[0]}, {low[1]}],"
        " step_time: 0.01, sample_time: 0.01}",
        "robot:",
        "  - kinematics: {name: diff}",
        f"    shape: {{name: circle, radius: {radius}}}",
        f"    state: {list(start)}",
        f"    sensors: [{{type: lidar2d, {sensor}, noise: true, std: 0.01}}]",
        "obstacle:",
    ]
    for name, corners in shapes:
        points = ", ".join(f"[{x}, {y}]" for x, y in corners)
        lines.append(f"  - {{shape: {{name: {name}, vertices: [{points}]}}, state: [0, 0, 0]}}")
    os.environ.setdefault("MPLBACKEND", "Agg")
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        import irsim

        file = Path(folder) / "scene.yaml"
        file.write_text("\n".join(lines) + "\n")
        world = irsim.make(str(file), display=False, log_level="ERROR")
    twist = np.array([[0.05], [0.5]])

    def step() -> None:
        world.step(twist)
        world.get_lidar_scan()

    return step


@functools.cache
def _room_in_ir_sim() -> Callable[[], None]:
    room = load_arena("room").description
    obstacles = [list(polygon.corners_m) for polygon in room.obstacle]
    start = (room.start.x_m, room.start.y_m, room.start.heading_rad)
    return ir_sim_world(list(room.outline[0].corners_m), obstacles, start, 0.07, INFRARED)


def ir_sim_room() -> float:
    """ir-sim in the kit's room, a body of the same size and nine rays, without a brain (× real time)."""
    return 0.01 * quiet(_room_in_ir_sim())


def quiet(step: Callable[[], None]) -> float:
    """The rate of what prints."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        return rate(step)


@functools.cache
def _scene_in_ir_sim(edges: int, laser: bool) -> Callable[[], None]:
    return ir_sim_world(*scene.shapes(edges), (0.0, 0.0, 0.0), scene.RADIUS, LASER if laser else INFRARED)


def ir_sim(edges: int, laser: bool = False) -> float:
    """Robot-steps/s of ir-sim on the scene: motion, nine rays or a laser's, noise; neither motors nor a brain."""
    return quiet(_scene_in_ir_sim(edges, laser))


@functools.cache
def _scene_in_pymunk(edges: int, laser: bool) -> Callable[[], None]:
    import pymunk

    outline, pillars = scene.shapes(edges)
    space = pymunk.Space()
    for corners in [outline, *pillars]:
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            space.add(pymunk.Segment(space.static_body, a, b, 0.0))
    body = pymunk.Body(3.0, 0.2)
    disc = pymunk.Circle(body, scene.RADIUS)
    disc.filter = pymunk.ShapeFilter(categories=2)
    space.add(body, disc)
    others = pymunk.ShapeFilter(mask=pymunk.ShapeFilter.ALL_MASKS() ^ 2)
    nine = [angle + beam for angle in scene.ANGLES for beam in (-scene.OPENING / 2, 0.0, scene.OPENING / 2)]
    fan = [(i - scene.BEAMS // 2) * scene.BEAM_STEP for i in range(scene.BEAMS)]
    directions, reach = (fan, scene.LASER_RANGE) if laser else (nine, scene.INFRARED_RANGE)

    def step() -> None:
        body.apply_force_at_local_point((0.5, 0.0), (0.0, 0.2))
        body.apply_force_at_local_point((0.6, 0.0), (0.0, -0.2))
        space.step(0.01)
        (x, y), heading = body.position, body.angle
        for direction in directions:
            end = (x + reach * math.cos(heading + direction), y + reach * math.sin(heading + direction))
            space.segment_query_first((x, y), end, 0.0, others)

    return step


def pymunk(edges: int, laser: bool = False) -> float:
    """Robot-steps/s of pymunk on the scene: a disc pushed by two forces, a segment query a ray; no noise, no brain."""
    return rate(_scene_in_pymunk(edges, laser))
