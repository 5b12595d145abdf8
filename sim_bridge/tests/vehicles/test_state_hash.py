"""The hash of a world's state covers every number of it."""

from __future__ import annotations

import numpy as np

from boebot.arenas import load_arena
from sim_bridge.batch import WANDER, Batch
from sim_bridge.compiled import ffi
from sim_bridge.vehicle import Vehicle, VehicleModel, arsim, beam


def model() -> VehicleModel:
    built = arsim(odometer_sigma=1e-3, ends_at_collision=False)
    built.sensor(
        "sharp_infrared", "sharp", beam=beam(x=0.2), reach=1.5, gain=1.0, period=0.0383, late=0.0076, sigma=0.01
    )
    built.sensor("accelerometer", "acceleration", mass=1e-3, stiffness=1.0, damping=0.01, range=50.0, sigma=0.01)
    built.sensor("sonar", "sonar", period=0.05, beam=beam(rays=3, opening=0.3), range_maximum=3.0, miss=0.1, sigma=0.01)
    built.battery("battery", empty=5.0, full=8.0, idle_per_s=0.01)
    return built


def driven(steps: int = 137, seed: int = 3) -> Vehicle:
    vehicle = Vehicle(model(), load_arena("arsim"), seed=seed)
    vehicle.run(lambda v: (0.6, 0.5 + 0.1 * v["compass"]), steps)
    return vehicle


def test_every_number_of_the_body_is_in_the_hash() -> None:
    for name, _ in ffi.typeof("body_state").fields:
        vehicle = driven()
        before, value = vehicle.hash(), getattr(vehicle.body, name)
        setattr(vehicle.body, name, 1 - value if isinstance(value, int) else value + 0.015625)
        assert vehicle.hash() != before, name
        setattr(vehicle.body, name, value)
        assert vehicle.hash() == before, name


def test_a_brains_memory_is_in_the_hash() -> None:
    batch = Batch(model(), load_arena("arsim"), np.zeros((2, 3)), [7, 7])
    one, other = batch.hashes()
    assert one == other
    batch.state(1)[63] = 1
    assert batch.hashes()[0] == one != batch.hashes()[1]


def test_the_hash_of_a_world_of_a_batch_is_that_of_a_vehicle() -> None:
    batch = Batch(model(), load_arena("arsim"), np.zeros((3, 3)), [1, 2, 3])
    alone = Vehicle(model(), load_arena("arsim"), seed=2)
    batch.step(np.full((3, 2), 0.4), 50)
    for _ in range(50):
        alone.step(0.4, 0.4)
    assert alone.hash() == batch.hashes()[1]
    batch.run(WANDER, 20)
    assert alone.hash() != batch.hashes()[1]
