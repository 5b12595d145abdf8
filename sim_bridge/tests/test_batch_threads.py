"""A batch's threads end with it; Ctrl-C ends a long call soon and leaves worlds that can be used."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boebot.arenas import load_arena
from boebot.errors import RobotError
from sim_bridge.batch import WANDER, Batch
from sim_bridge.vehicle import STAGES, Vehicle, arsim

TASKS = Path("/proc/self/task")
FOREVER = 10**12  # steps
LONG_S = 60  # what no machine needs to hear Ctrl-C


def batch_of(threads: int, count: int = 8) -> Batch:
    model = arsim(ends_at_collision=False)
    return Batch(model, load_arena("arsim"), np.zeros((count, 3)), np.arange(count), threads=threads)


def threads_now() -> set[int]:
    """The process's threads, by the system's numbers; those that a library made are among them."""
    return {int(task.name) for task in TASKS.iterdir()}


def threads_end(before: set[int]) -> bool:
    """Whether all threads end soon that began since; those of earlier tests may end meanwhile."""
    end = time.perf_counter() + LONG_S
    while threads_now() - before and time.perf_counter() < end:
        time.sleep(0.01)
    return not threads_now() - before


@contextmanager
def ctrl_c(seconds: float = 0.3) -> Iterator[list[float]]:
    """Ctrl-C after that time; gives when it came. The block has to end by it."""
    sent: list[float] = []

    def send() -> None:
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(seconds, send)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            yield sent
    finally:
        timer.cancel()
        timer.join()
        signal.signal(signal.SIGINT, before)


@pytest.mark.unsanitized
def test_threads_end_with_close_with_the_block_and_with_the_batch() -> None:
    before = threads_now()
    signals = np.full((8, 2), 0.3)
    batch = batch_of(4)
    batch.step(signals, 100)
    assert threads_now() - before
    readings, steps = batch.readings.copy(), batch.steps
    for _ in range(2):
        batch.close()
    assert threads_end(before)
    with pytest.raises(RobotError, match="batch: it is closed; expected no steps after"):
        batch.step(signals)
    with pytest.raises(RobotError, match="batch: it is closed; expected no steps after"):
        batch.run(WANDER, 1)
    assert np.array_equal(batch.readings, readings) and np.array_equal(batch.steps, steps) and batch.hashes()[3]
    with batch_of(3) as other:
        other.step(signals, 100)
    assert threads_end(before)
    third = batch_of(3)
    third.step(signals, 100)
    del third
    gc.collect()
    assert threads_end(before)


def test_a_process_with_an_open_batch_ends() -> None:
    code = (
        "import numpy as np; from sim_bridge.batch import Batch; from boebot.arenas import load_arena; "
        "from sim_bridge.vehicle import arsim; b = Batch(arsim(), load_arena('arsim'), np.zeros((4, 3)), range(4), "
        "threads=4); b.step(np.ones((4, 2)), 50); print('done')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout == "done\n" and done.stderr == ""


@pytest.mark.unsanitized
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("way", ["step", "run"])
def test_ctrl_c_ends_a_long_call_and_the_batch_goes_on(threads: int, way: str) -> None:
    batch, before = batch_of(threads), threads_now()
    signals = np.full((8, 2), (0.4, 0.3))
    with ctrl_c() as sent:
        if way == "step":
            batch.step(signals, FOREVER)
        else:
            batch.run(WANDER, FOREVER)
    assert time.perf_counter() - sent[0] < LONG_S
    done = batch.steps
    assert done.min() > 0
    assert np.array_equal(batch.steps, done), "nothing runs on"
    for index in (0, 7):  # each is a world that was asked for this many steps
        other = Batch(batch.model, batch.arenas[index], np.zeros((1, 3)), [index])
        if way == "step":
            other.step(signals[:1], int(done[index]))
        else:
            other.run(WANDER, int(done[index]))
        assert other.hashes()[0] == batch.hashes()[index]
    batch.step(signals, 10)
    assert np.array_equal(batch.steps, done + 10)
    batch.close()
    assert threads_end(before)


def test_portions_change_no_bit() -> None:
    """A long call is made in portions that depend on the clock; its worlds do not."""
    whole, single = batch_of(2), batch_of(1)
    whole.run(WANDER, 30_000)
    for _ in range(300):
        single.run(WANDER, 100)
    assert whole.hashes().tolist() == single.hashes().tolist()


@pytest.mark.unsanitized
@pytest.mark.parametrize("staged", [False, True])
def test_ctrl_c_ends_a_vehicles_run_after_whole_steps(staged: bool) -> None:
    vehicle, same = (Vehicle(arsim(ends_at_collision=False), load_arena("arsim"), seed=3) for _ in range(2))
    with ctrl_c():
        vehicle.run(lambda _: (0.4, 0.3), FOREVER, stage=(lambda name, _: None) if staged else None)
    steps = round(vehicle.time / 0.01)
    assert steps > 0
    same.run(lambda _: (0.4, 0.3), steps)
    assert list(same.readings) == list(vehicle.readings) and same.true_pose == vehicle.true_pose
    for one in (vehicle, same):
        one.run(lambda _: (0.1, 0.5), 50)
    assert vehicle.hash() == same.hash()


@pytest.mark.parametrize("where", STAGES)
def test_a_stage_that_raises_leaves_a_whole_step(where: str) -> None:
    model = arsim(ends_at_collision=False)
    model.battery("battery", idle_per_s=0.5)
    vehicle, same = (Vehicle(model, load_arena("showcase"), seed=3) for _ in range(2))

    def stage(name: str, which: Any) -> None:
        if name == where and which.time > 0.2:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        vehicle.run(lambda _: (0.4, 0.3), 100, stage=stage)
    same.run(lambda _: (0.4, 0.3), round(vehicle.time / 0.01))
    assert vehicle.hash() == same.hash() and vehicle.time > 0.2
