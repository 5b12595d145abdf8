"""An untouched image measured in the emulator: what a seed stands for, maxima seen again, faults with their place."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from boebot.errors import BoardError
from boebot.link.messages import Counters, Event, EventKind
from boebot_timing.emulated.loads import TICK_CYCLES
from boebot_timing.emulated.losses import COUNTERS_TICKS, MASKED
from boebot_timing.emulated.measure import robot_of, run
from boebot_timing.emulated.scenarios import RANGES, load, numbers_of, prepare
from boebot_timing.emulated.watched import Run
from boebot_timing.measured import as_json, merged, statistics
from sim_bridge.bench.bench import Bench
from sim_bridge.boards import avr
from sim_bridge.boards.avr import Watch
from sim_bridge.boards.emulated import avr_image
from sim_bridge.tests.boards.access import BoardAccess

IMAGE = avr_image("shieldbot")
SECONDS = 0.4


@pytest.fixture(scope="module")
def figures() -> Run:
    return run(IMAGE, robot_of(IMAGE), "figures", SECONDS, 1)


def test_seeds_stand_for_numbers_that_differ() -> None:
    for seed in range(40):
        assert all(0 <= getattr(numbers_of(seed), name) < size for name, size in RANGES.items())
    assert len({numbers_of(seed).line for seed in range(1, 20)}) > 15  # neighbours differ


def test_an_image_says_for_which_robot_it_is() -> None:
    assert robot_of(IMAGE).name == "shieldbot"


def test_every_task_runs_as_often_as_its_period_says(figures: Run) -> None:
    tasks = figures.measurement().tasks
    whole = figures.spans[figures.spans["id"] == 12]  # slots
    for name, period in {"whisker": 1, "safety": 1, "telemetry": 4, "session": 4, "turret": 8}.items():
        assert abs(len(tasks[name].net) - len(whole) / period) <= 1


def test_net_and_gross_differ_by_the_interrupts_in_between(figures: Run) -> None:
    """Computed here from begin and end of each span, by nothing else."""
    spans = figures.spans
    interrupts = spans[spans["id"] < 64]
    begin, gross = interrupts["begin"].astype(np.int64), interrupts["gross"].astype(np.int64)
    checked = 0
    for span in spans[(spans["id"] >= 64) & (spans["net"] != spans["gross"])][:300]:
        within = (begin >= span["begin"]) & (begin < span["begin"] + span["gross"])
        outermost = within & (interrupts["depth"] == span["depth"] + 1)
        assert span["gross"] - span["net"] == gross[outermost].sum()
        checked += 1
    assert checked > 100


def test_load_and_ticks_are_those_of_the_emulators_own_count(figures: Run) -> None:
    result = figures.measurement()
    assert result.load == figures.executed / figures.cycles
    assert result.load * TICK_CYCLES <= result.busiest_tick <= TICK_CYCLES
    assert 0 < result.worst_tick <= result.busiest_tick
    assert 0x100 < result.lowest_stack < 0x8FF


def test_a_run_is_repeated_to_the_cycle_so_that_a_maximum_is_seen_again(figures: Run) -> None:
    worst = figures.measurement().tasks["telemetry"].worst
    assert (worst.scenario, worst.seed) == ("figures", 1)
    assert np.array_equal(run(IMAGE, robot_of(IMAGE), worst.scenario, SECONDS, worst.seed).spans, figures.spans)


def test_nothing_is_lost_in_the_figures(figures: Run) -> None:
    assert set(figures.lost.values()) == {0}


def test_an_overload_fills_the_line_and_masks_the_noise_without_a_late_tick() -> None:
    """50,000 bytes/s come; noise is reported from the tick on in which it began."""
    image, ticks = avr_image("shieldbot-quad"), 50
    found = run(image, robot_of(image), "overload", ticks / 100, 1)
    assert found.sent > ticks / 100 * 50_000 * 0.95  # the first tick is a phase
    assert ticks - 3 <= found.lost["masked"] <= ticks + 4
    assert {name: found.lost[name] for name in ("ticks", "late_ticks", "resets")} == dict.fromkeys(
        ("ticks", "late_ticks", "resets"), 0
    )
    counted = found.spans[found.spans["id"] == 4]  # pin changes of the encoders' port
    assert len(counted) < ticks * (3 * 40 + 16), "the noisy line still interrupts"


def test_faults_overflow_the_queue_of_events_and_mask_both_wheels() -> None:
    """The queue holds 4 (PROTOCOL.md); what comes then waits, one of a kind."""
    robot = robot_of(IMAGE)
    with Bench(IMAGE, record=False) as bench:
        line = prepare(bench, robot, "faults")
        since = len(line.heard)
        load(bench, line, robot, "faults", numbers_of(1), TICK_CYCLES)
        bench.run(40 * TICK_CYCLES)
        line.acknowledges = True
        bench.sources.clear()
        after = len(line.heard)
        bench.run(COUNTERS_TICKS * TICK_CYCLES)
        seen = {heard.message.status & MASKED for heard in line.telemetry}
        events = {
            heard.message.number: heard.message for heard in line.heard[since:] if isinstance(heard.message, Event)
        }
        counters = line.wait(Counters, after)
    kinds = [events[number].kind for number in sorted(events)]
    all_kinds = set(EventKind) - {EventKind.FALLBACK}  # no brain is on
    assert set(kinds[4 : 4 + len(all_kinds)]) == all_kinds, kinds
    assert counters.deferred > 3 * len(all_kinds)
    assert MASKED in seen, "noise of both wheels in one tick"


def test_runs_together() -> None:
    robot = robot_of(IMAGE)
    names = ("figures", "overload")
    one, two = (run(IMAGE, robot, name, 0.05, 1, losses=False).measurement() for name in names)
    both = merged([one, two])
    assert both.seconds == one.seconds + two.seconds and both.scenarios == names
    assert both.load == pytest.approx((one.load + two.load) / 2, rel=1e-3)
    for name, spans in both.tasks.items():
        assert spans.largest == max(one.tasks[name].largest, two.tasks[name].largest)
        assert len(spans.net) == len(one.tasks[name].net) + len(two.tasks[name].net)
    assert both.lowest_stack == min(one.lowest_stack, two.lowest_stack)
    assert as_json(both)["by_scenario"] == {"figures": as_json(one), "overload": as_json(two)}


def test_statistics() -> None:
    assert statistics(np.arange(1, 101, dtype=np.uint32)) == {
        "count": 100,
        "min": 1,
        "mean": 50.5,
        "p99": 99,
        "max": 100,
    }
    assert statistics(np.empty(0, dtype=np.uint32)) == {"count": 0}


@pytest.mark.parametrize(
    ("scenario", "seconds", "message"),
    [
        ("figure", 1.0, "expected one of figures"),
        ("overload", 0.0, "expected more than 0 s"),
        ("everything", 0.1, "0.85 s"),
    ],
)
def test_what_cannot_be_run_is_refused(scenario: str, seconds: float, message: str) -> None:
    with pytest.raises(BoardError, match=message):
        run(IMAGE, robot_of(IMAGE), scenario, seconds, 1)


FAULTY = """#include <avr/io.h>
__attribute__((noinline)) void deeper(uint8_t n) {
  volatile uint8_t room[40];
  room[n % 40] = n;
  deeper(n + 1); room[0]++;  /* line 5 */
}
__attribute__((noinline)) void invalid(void) { __asm__ volatile(".word 1"); } /* line 7 */


__attribute__((noinline)) void wild(void) {
  ((void (*)(void))0x3000)();  /* line 11 */
}
__attribute__((noinline)) void stuck(void) {
  for (;;) { PINB = 1; }  /* line 14 */
}
int main(void) { FAULT; }
"""


@pytest.mark.parametrize(
    ("fault", "what", "place"),
    [
        ("deeper(0)", "stack overflows", r"in deeper \(faulty.c:[25]\)"),
        ("invalid()", "invalid instruction 0x0001", r"in invalid \(faulty.c:7\)"),
        ("wild()", "goes to 0x6000", r"in wild \(faulty.c:11\)"),
        ("stuck()", "hangs", r"in stuck \(faulty.c:14\)"),
    ],
)
def test_a_fault_has_address_function_and_line(tmp_path: Path, fault: str, what: str, place: str) -> None:
    source, image = tmp_path / "faulty.c", tmp_path / "faulty.elf"
    source.write_text(FAULTY.replace("FAULT", fault), encoding="ascii")
    flags = ["-mmcu=atmega328p", "-Og", "-gdwarf-2", "-fno-optimize-sibling-calls"]
    subprocess.run(["avr-gcc", *flags, "-o", str(image), str(source)], check=True)
    board = avr.create(image)
    board.record(Watch(patience=50_000))
    with pytest.raises(BoardError, match=rf"{what}.* at address 0x[0-9A-F]{{4}} in cycle \d+ {place}"):
        BoardAccess(board).run(1_000_000)
