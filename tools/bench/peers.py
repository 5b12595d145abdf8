"""Other people's work, measured in the same run on the same machine."""

from __future__ import annotations

import io
import os
import subprocess
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from boebot import resources
from sim_bridge.arena import load_arena
from sim_bridge.boards.avr import build_avr

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = ("run_avr", "sim_dwarf")  # simavr's command line


def plain_simavr(seconds: float = 10.0) -> float:
    """The firmware image in simavr as published, board alone (× real time)."""
    simavr = ROOT / build_avr.simavr_folder()
    program = ROOT / "build" / "plain_simavr"
    if not program.exists():
        sources = [path for path in (simavr / "sim").glob("*.c") if path.stem not in LEFT_OUT]
        sources += [simavr / build_avr.CHIP_SOURCE, simavr / "cores/sim_megax8.c"]
        includes = [f"-I{folder}" for folder in (simavr / "sim", simavr / "cores", ROOT / build_avr.CONFIGURATION)]
        command = ["cc", "-O2", "-w", *includes, str(ROOT / "tools/bench/plain_simavr.c")]
        command += [*map(str, sources), "-o", str(program), "-lutil", "-lpthread"]
        subprocess.run(command, check=True)
    image = resources.folder("images") / "shieldbot.hex"
    done = subprocess.run([str(program), str(image), str(seconds)], check=True, capture_output=True, text=True)
    return seconds / float(done.stdout.split()[-1])


def ir_sim(steps: int = 1500, step_s: float = 0.01) -> float:
    """ir-sim with the same room, a body of the same size and nine rays, driven without a brain (× real time)."""
    room = load_arena("room").description
    start = room.start
    polygons = [polygon.corners_m for polygon in room.obstacle]
    outline = [*room.outline[0].corners_m, room.outline[0].corners_m[0]]
    shapes = [("linestring", outline), *(("polygon", corners) for corners in polygons)]
    lines = [
        "world:",
        f"  {{height: 3, width: 3, offset: [-1.5, -1.5], step_time: {step_s:g}, sample_time: {step_s:g}}}",
        "robot:",
        "  - kinematics: {name: diff}",
        "    shape: {name: circle, radius: 0.07}",
        f"    state: [{start.x_m}, {start.y_m}, {start.heading_rad}]",
        "    sensors: [{type: lidar2d, range_max: 3, angle_range: 1.3, number: 9, noise: true, std: 0.01}]",
        "obstacle:",
    ]
    for name, corners in shapes:
        points = ", ".join(f"[{x}, {y}]" for x, y in corners)
        lines.append(f"  - {{shape: {{name: {name}, vertices: [{points}]}}, state: [0, 0, 0]}}")
    os.environ.setdefault("MPLBACKEND", "Agg")
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        import irsim

        scene = Path(folder) / "room.yaml"
        scene.write_text("\n".join(lines) + "\n")
        world = irsim.make(str(scene), display=False, log_level="ERROR")
        twist = np.array([[0.05], [0.5]])
        started = time.perf_counter()
        for _ in range(steps):
            world.step(twist)
            world.get_lidar_scan()
        elapsed = time.perf_counter() - started
    return steps * step_s / elapsed
