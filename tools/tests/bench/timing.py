"""What proving and measuring the times of an image takes."""

from __future__ import annotations

import functools
import time

from boebot.description.robots import load_robot
from boebot_timing import budget, loads
from boebot_timing.emulated.measure import run
from boebot_timing.emulated.scenarios import load, numbers_of, prepare
from boebot_timing.emulated.watched import Run
from boebot_timing.realisable import CLOCK_HZ
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.emulated import avr_image
from tools.tests.bench.figures import Peer, figure, loop

SECONDS = 1.0  # of the board's time


def _recorded(pin_map: str, scenario: str) -> Run:
    return run(avr_image(pin_map), load_robot(pin_map), scenario, SECONDS, 1, losses=False)


def _speed(scenario: str) -> float:
    """Of a run with all its tasks and interrupts recorded, and its evaluation, by the processor's time."""
    started = time.process_time()
    result = _recorded("shieldbot", scenario)
    result.measurement()
    return (result.loaded_from + result.cycles) / CLOCK_HZ / (time.process_time() - started)


def _unrecorded(scenario: str) -> float:
    """Of the same run without a recorder."""
    robot, started = load_robot("shieldbot"), time.process_time()
    with Bench(avr_image("shieldbot"), record=False) as bench:
        line = prepare(bench, robot, scenario)
        load(bench, line, robot, scenario, numbers_of(1), round(SECONDS * CLOCK_HZ))
        bench.run(round(SECONDS * CLOCK_HZ))
        return bench.now / CLOCK_HZ / (time.process_time() - started)


@figure("timing: static bounds of the Shield-Bot's image, all of them", "s", times_at_most=3, peers=[loop(10_000_000)])
def bounds() -> float:
    started = time.process_time()
    budget.prove(avr_image("shieldbot"), loads.load_named("figures"))
    return time.process_time() - started


for _scenario, _when in (("figures", " at the figures' load"), ("overload", ", overloaded")):
    figure(
        f"timing: untouched image recorded{_when}",
        "× real time",
        times_at_least=0.5,
        peers=[Peer("the same, not recorded", functools.partial(_unrecorded, _scenario))],
        rounds=3,
    )(functools.partial(_speed, _scenario))
