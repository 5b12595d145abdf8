"""What proving and measuring the times of an image takes, and the load that is measured."""

from __future__ import annotations

import time
from functools import cache

from boebot.robots import load_robot
from boebot.timing import budget, loads
from sim_bridge.boards.emulated import avr_image
from sim_bridge.timing.measure import CLOCK_HZ, Run, run
from tools.bench.figures import figure

SECONDS = 1.0  # of the board's time


@cache
def _recorded(pin_map: str, scenario: str) -> tuple[Run, float]:
    """A run, and the seconds of CPU that it and its evaluation took."""
    started = time.process_time()
    result = run(avr_image(pin_map), load_robot(pin_map), scenario, SECONDS, 1, losses=False)
    result.measurement()
    return result, time.process_time() - started


def _speed(scenario: str) -> float:
    result, took = _recorded("shieldbot", scenario)
    return (result.loaded_from + result.cycles) / CLOCK_HZ / took


@figure("timing: static bounds of the Shield-Bot's image, all of them", "s")
def bounds() -> float:
    started = time.process_time()
    budget.prove(avr_image("shieldbot"), loads.load_named("figures"))
    return time.process_time() - started


@figure("timing: untouched image recorded at the figures' load", "× real time", at_least=10)
def recorded_figures() -> float:
    return _speed("figures")


@figure("timing: untouched image recorded, line full both ways", "× real time", at_least=10)
def recorded_saturated() -> float:
    return _speed("saturated")


def _load(pin_map: str) -> float:
    return 100.0 * _recorded(pin_map, "figures")[0].measurement().load


@figure("timing: CPU load at the figures, boebot", "% of its cycles", at_most=40)
def load_boebot() -> float:
    return _load("boebot")


@figure("timing: CPU load at the figures, shieldbot", "% of its cycles", at_most=40)
def load_shieldbot() -> float:
    return _load("shieldbot")


@figure("timing: CPU load at the figures, shieldbot-quad", "% of its cycles", at_most=40)
def load_quad() -> float:
    return _load("shieldbot-quad")
