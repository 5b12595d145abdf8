"""Robot-steps per second of worlds without boards, beside ir-sim and pymunk on the same scene.

One thread, steps of 10 ms, nine rays, motors and noise on. The scene: a square room with pillars a metre apart
(world_steps.c); the robot: the notes' default with a third IR sensor. It wanders on its own motors, turns away from
what its IR sensors see, and slides on where it bumps into something all the same: a sixth of the work is contacts.
The brain decides in every step. ir-sim and pymunk get neither brain nor sensor model, only motion and rays (less).
"portable" is the build that gives the same bits
everywhere; "native" (BOEBOT_NATIVE=1 at build) is for the machine at hand and may contract operations: the ratio of the
two is what bit-equality costs.
"""

from __future__ import annotations

import functools
import io
import math
import os
import subprocess
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from sim_bridge.arena import Arena, ArenaDescription, Polygon
from sim_bridge.batch import Batch
from sim_bridge.build_core import COMPILE_NATIVE, COMPILE_PORTABLE
from sim_bridge.vehicle import Vehicle, VehicleModel, arsim
from tools.bench.figures import Peer, figure

ROOT = Path(__file__).resolve().parents[2]
RADIUS = 0.2
ANGLES = (0.7854, 0.0, -0.7854)  # of the IR sensors
Corners = list[tuple[float, float]]


@functools.cache
def program(native: bool) -> Path:
    """world_steps.c with the whole world, built with the options of that build."""
    built = ROOT / "build" / f"world_steps_{'native' if native else 'portable'}"
    core = ROOT / "sim_bridge"
    sources = [ROOT / "tools/bench/world_steps.c"]
    sources += [path for room in ("vehicles", "world", "world/sensors") for path in sorted((core / room).glob("*.c"))]
    options = COMPILE_NATIVE if native else COMPILE_PORTABLE
    command = ["cc", *options, f"-I{core}", *map(str, sources), "-lm", "-o", str(built)]
    subprocess.run(command, check=True)
    return built


@functools.cache
def compiled(edges: int, worlds: int, native: bool) -> float:
    """Robot-steps/s with a compiled brain."""
    command = [str(program(native)), str(edges), str(worlds)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[-1])


def square(x: float, y: float, half: float) -> Corners:
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def scene() -> tuple[Corners, list[Corners]]:
    """Outline and pillars of world_steps.c with 48 edges."""
    side = math.ceil(math.sqrt(12))
    centres = [(-1.5 + i // side, -1.5 + i % side) for i in range(side * side)]
    return square(0.5, 0.5, 2.5), [square(x, y, 0.06) for x, y in centres[:11]]


def room() -> Arena:
    outline, pillars = scene()
    obstacles = [Polygon(corners) for corners in pillars]
    return Arena(ArenaDescription(name="bench", outline=[Polygon(outline)], obstacle=obstacles))


def robot() -> VehicleModel:
    return arsim(infrared_rad=ANGLES, odometer_sigma=1e-4, ends_at_collision=False)


def wander(vehicle: Vehicle) -> tuple[float, float]:
    """As much of a brain as a line holds."""
    readings = vehicle.readings
    return (0.7, -0.7) if readings[0] + readings[1] + readings[2] > 0.5 else (0.5, 0.5)


@functools.cache
def ir_sim(steps: int = 300) -> float:
    """ir-sim on the scene with three lidars of three rays in one, without a brain."""
    outline, pillars = scene()
    shapes = [("linestring", [*outline, outline[0]]), *(("polygon", corners) for corners in pillars)]
    lines = [
        "world:",
        "  {height: 6, width: 6, offset: [-3, -3], step_time: 0.01, sample_time: 0.01}",
        "robot:",
        "  - kinematics: {name: diff}",
        f"    shape: {{name: circle, radius: {RADIUS}}}",
        "    state: [0, 0, 0]",
        "    sensors: [{type: lidar2d, range_max: 1, angle_range: 2.07, number: 9, noise: true, std: 0.01}]",
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
        started = time.process_time()
        for _ in range(steps):
            world.step(twist)
            world.get_lidar_scan()
        return steps / (time.process_time() - started)


@functools.cache
def pymunk(steps: int = 20_000) -> float:
    """pymunk on the scene: a dynamic disc pushed by two wheels' forces, nine segment queries a step."""
    import pymunk as munk

    outline, pillars = scene()
    space = munk.Space()
    for corners in [outline, *pillars]:
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            space.add(munk.Segment(space.static_body, a, b, 0.0))
    body = munk.Body(3.0, 0.2)
    disc = munk.Circle(body, RADIUS)
    disc.filter = munk.ShapeFilter(categories=2)
    space.add(body, disc)
    others = munk.ShapeFilter(mask=munk.ShapeFilter.ALL_MASKS() ^ 2)
    directions = [angle + beam for angle in ANGLES for beam in (-0.25, 0.0, 0.25)]
    started = time.process_time()
    for _ in range(steps):
        body.apply_force_at_local_point((0.5, 0.0), (0.0, 0.2))
        body.apply_force_at_local_point((0.6, 0.0), (0.0, -0.2))
        space.step(0.01)
        (x, y), heading = body.position, body.angle
        for direction in directions:
            end = (x + math.cos(heading + direction), y + math.sin(heading + direction))
            space.segment_query_first((x, y), end, 0.0, others)
    return steps / (time.process_time() - started)


IR_SIM = Peer("ir-sim, same scene, no motors", ir_sim)
PYMUNK = Peer("pymunk, same scene, no noise", pymunk)
STEPS = "robot-steps/s"


@figure("world: compiled brain, 48 edges, portable", STEPS, at_least=1.5e6, peer=IR_SIM)
def compiled_portable() -> float:
    return compiled(48, 1, False)


@figure("world: compiled brain, 48 edges, native", STEPS, at_least=2.5e6, peer=PYMUNK)
def compiled_native() -> float:
    return compiled(48, 1, True)


@figure("world: cost of bit-equality, native / portable", "×", at_most=2.0)
def cost_of_equality() -> float:
    return compiled(48, 1, True) / compiled(48, 1, False)


@figure("world: Python brain at each step, 48 edges, portable", STEPS, at_least=500e3, peer=PYMUNK)
def python_brain() -> float:
    steps, rates = 50_000, []
    for _ in range(5):
        vehicle = Vehicle(robot(), room())
        started = time.process_time()
        done = vehicle.run(wander, steps)
        rates.append(done / (time.process_time() - started))
    return max(rates)


@figure("world: compiled brain, 1,000 edges, portable", STEPS, at_least=0.8e6)
def thousand_edges() -> float:
    return compiled(1000, 1, False)


@figure("world: compiled brain, 1,000 edges, native", STEPS, at_least=1.2e6)
def thousand_edges_native() -> float:
    return compiled(1000, 1, True)


@figure("world: 4,000 edges against 48, portable", "× slower", at_most=2.5)
def four_thousand_edges() -> float:
    return compiled(48, 1, False) / compiled(4000, 1, False)


@figure("world: batch of 1,000, compiled brain, portable", STEPS, at_least=3e6)
def batch() -> float:
    return compiled(48, 1000, False)


@figure("world: batch of 1,000, compiled brain, native", STEPS, at_least=5e6)
def batch_native() -> float:
    return compiled(48, 1000, True)


@figure("world: memory per world of a batch", "bytes", at_most=4096)
def memory() -> float:
    return Batch(robot(), room(), np.zeros((100, 3)), np.arange(100)).bytes_per_world
