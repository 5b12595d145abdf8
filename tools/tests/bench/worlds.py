"""How fast worlds go: robot-steps and rays a second, by the processor's time where one thread works. Worlds are made
once and go on where they were."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from sim_bridge.batch import Batch, CompiledBrain
    from sim_bridge.vehicle import Vehicle

TAKES = 0.2  # s that a measurement takes, about


def placed(worlds: int, threads: int, edges: int, laser: str | None) -> Batch:
    """Worlds in the room, each with another seed. Robots with a laser stand between pillars and turn there."""
    from sim_bridge.batch import Batch
    from tools.tests.bench import scene

    number = np.arange(worlds)
    poses = np.zeros((worlds, 3))
    poses[:, 2] = 0.7 * (number % 9)
    if laser is not None:
        poses[:, 0], poses[:, 1] = number % 3 - 0.5, number // 3 % 3 - 0.5
    model = scene.robot() if laser is None else scene.laser_robot(laser == "noise")
    batch = Batch(model, scene.room(edges), poses, number, threads=threads)
    for i in range(worlds):
        batch.state(i, "vehicle_wander_state *").seed = i
    return batch


@functools.cache
def wander() -> CompiledBrain:
    """The compiled brain, for whatever the first two readings of the scene's robots are."""
    from sim_bridge import batch
    from sim_bridge.compiled import ffi, lib

    size = ffi.sizeof("vehicle_wander_state")
    return batch.CompiledBrain(ffi.addressof(lib, "vehicle_wander"), readings=(), state_bytes=size, name="wander")


@functools.cache
def runner(worlds: int, threads: int, edges: int, laser: str | None) -> tuple[Callable[[int], Any], int]:
    """A function that runs a number of steps of all worlds with the compiled brain; and how many take long enough."""
    batch = placed(worlds, threads, edges, laser)
    run = functools.partial(batch.run, wander())
    steps = 1
    while True:  # caches and lists are made on the way
        started = time.perf_counter()
        run(steps)
        took = time.perf_counter() - started
        if took > 0.5 * TAKES:
            return run, max(1, round(steps * TAKES / took))
        steps *= 2


def compiled(edges: int, worlds: int = 1, threads: int = 1, laser: str | None = None) -> float:
    """Robot-steps/s of worlds with a compiled brain; by the clock on the wall with several threads."""
    run, steps = runner(worlds, threads, edges, laser)
    clock = time.process_time if threads == 1 else time.perf_counter
    started = clock()
    run(steps)
    return steps * worlds / (clock() - started)


def scan(edges: int, noise: bool) -> float:
    """Rays/s of robots that make a scan of 683 in each step."""
    from tools.tests.bench.scene import BEAMS

    return BEAMS * compiled(edges, worlds=16, laser="noise" if noise else "exact")


@functools.cache
def driven(edges: int) -> Vehicle:
    from sim_bridge.vehicle import Vehicle
    from tools.tests.bench import scene

    return Vehicle(scene.robot(), scene.room(edges), pose=(0.0, 0.0, 0.0))


def python(edges: int, steps: int = 100_000) -> float:
    """Robot-steps/s with a brain in Python that is asked in each step."""
    from tools.tests.bench.scene import wander

    vehicle = driven(edges)
    started = time.process_time()
    done = vehicle.run(wander, steps)
    return done / (time.process_time() - started)
