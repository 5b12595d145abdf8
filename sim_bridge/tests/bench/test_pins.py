"""Pins of a bench: what drives them, what is seen at them, waits that are exact however the run is cut."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from boebot.errors import CallError
from sim_bridge.bench.bench import Bench
from sim_bridge.bench.pins import NET, Pin
from sim_bridge.bench.waiting import Cannot, WaitError
from sim_bridge.boards.board import CLOCK_HZ, Level
from sim_bridge.tests.bench import programs

SERVO, BUTTON, LED, OPEN = 9, 2, 13, 7
PERIOD, WIDTH = 320_000, 24_000  # cycles, of programs.SERVO


@pytest.fixture
def servo() -> Iterator[Bench]:
    with Bench(programs.image(programs.SERVO)) as bench:
        yield bench


@pytest.fixture
def button() -> Iterator[Bench]:
    with Bench(programs.image(programs.BUTTON)) as bench:
        bench.run(16_000)
        yield bench


def driven(pin: Pin) -> list[tuple[int, int]]:
    """Cycle and level of what the outside did."""
    return [(edge.cycle, edge.level) for edge in pin.bench.driven[pin.number]]


# ---- waits ----


def test_a_pulse_is_the_first_that_begins_behind_what_was_waited_for(servo: Bench) -> None:
    pin = Pin(servo, SERVO)
    first = pin.pulse()
    assert (first.cycles, first.us, first.level) == (WIDTH, 1500.0, 1)
    assert servo.mark == first.start + WIDTH
    again = pin.pulses(3)
    assert [pulse.start - first.start for pulse in again] == [PERIOD, 2 * PERIOD, 3 * PERIOD]
    servo.run(PERIOD)
    assert pin.pulse().start == first.start + 5 * PERIOD
    low = pin.pulse(level=0)
    assert (low.start, low.cycles) == (first.start + 5 * PERIOD + WIDTH, PERIOD - WIDTH)
    assert pin.wait(1) == (low.start + low.cycles) / CLOCK_HZ
    assert pin.pulse().start == low.start + low.cycles  # the one that was waited for


def test_frequency_and_duty(servo: Bench) -> None:
    pin = Pin(servo, "A0" if SERVO == 14 else SERVO)
    assert pin.frequency() == 50.0 and pin.duty(3) == WIDTH / PERIOD
    assert pin.frequency(200, within=5.0) == 50.0


@pytest.mark.parametrize("step", [320, 4_000, 160_000])
def test_answers_do_not_depend_on_how_far_the_board_has_run(servo: Bench, step: int) -> None:
    """What is asked later of the same mark has the same answer."""
    pin = Pin(servo, SERVO)
    start = pin.wait(1)
    for _ in range(800_000 // step):
        servo.run_until(servo.now + step)
    assert pin.wait(1) == start
    assert pin.pulse().start == round(start * CLOCK_HZ)
    assert len(pin.edges(servo.mark / CLOCK_HZ)) == 5 and pin.edges()["cycle"][-1] > 800_000


def test_a_program_answers_what_the_test_drives(button: Bench) -> None:
    """Its loop takes 7 cycles at most; a level is seen 1 cycle late (synchronizer, 14.2.4)."""
    led, contact = Pin(button, LED), Pin(button, BUTTON)
    assert (contact.level, led.level) == (Level.HIGH, Level.LOW)
    contact.drive(0)
    begun = button.now
    assert led.wait(0) == begun / CLOCK_HZ  # it is so at once
    assert 0 < led.wait(1) * CLOCK_HZ - begun < 12
    contact.release()
    assert contact.wait(1) * CLOCK_HZ - button.now < 3 and led.wait(0) > begun / CLOCK_HZ
    contact.drive(0, after=0.001)
    assert abs(led.wait(1) - button.mark / CLOCK_HZ) < 1e-9
    assert contact.level == Level.LOW


def test_a_wait_in_vain_says_what_it_waited_for_and_saw(servo: Bench, button: Bench) -> None:
    servo.run(1000)
    with pytest.raises(WaitError) as vain:
        Pin(servo, LED).wait(1, within=0.05)
    assert str(vain.value) == (
        "pin 13: waited 0.05 s to be 1; it had 0 edges meanwhile, and has been in the air since 0.000000 s; "
        "now it is 0.050063 s"
    )
    with pytest.raises(WaitError, match=r"pin 9: waited 0\.05 s for 9 high pulses; it had 5 edges meanwhile"):
        Pin(servo, SERVO).pulses(9, within=0.05)
    with pytest.raises(WaitError, match=r"pin A0: waited 0\.01 s for a low pulse"):
        Pin(servo, "A0").pulse(within=0.01, level=0)
    with pytest.raises(WaitError, match=r"pin 9: waited 0\.1 s for 20 periods"):
        Pin(servo, SERVO).frequency(20, within=0.1)
    servo.run(WIDTH)
    begun = Pin(servo, SERVO).pulse().start / CLOCK_HZ
    missed = rf"; the last one began at {begun:.6f} s, before what was last waited for or done"
    servo.run(1000)
    with pytest.raises(WaitError, match=missed):
        Pin(servo, SERVO).pulse(within=0.01)
    with pytest.raises(WaitError, match="pin 13: waited 0 s to be 1; it had 0 edges meanwhile, and has been 0 since"):
        Pin(button, LED).wait(1, within=0)


# ---- driving ----


def test_square_waves(servo: Bench) -> None:
    """Edges to the nearest cycle of k / (2 f), also where that is no whole number."""
    pin = Pin(servo, OPEN)
    pin.square(3000, count=4)
    begun = servo.now
    servo.run(30_000)
    assert driven(pin) == [(begun + round(k * 16e6 / 6000), (k + 1) % 2) for k in range(8)]
    pin.square(38_000)
    assert pin.frequency(1000) == pytest.approx(38_000, rel=1e-5) and pin.duty(1000) == pytest.approx(0.5, abs=1e-3)
    pin.drive(1)
    servo.run(10_000)
    assert driven(pin)[-1][1] == 1 and servo.now - driven(pin)[-1][0] > 9_000


def test_a_contact_bounces(button: Bench) -> None:
    led, contact = Pin(button, LED), Pin(button, BUTTON)
    contact.bounce(0, count=5, over=2e-3)
    begun = button.now
    button.run(64_000)
    edges = driven(contact)
    assert [level for _, level in edges] == [0, 1] * 5 + [0] and edges[0][0] >= begun
    assert edges[-1][0] - edges[0][0] <= 32_000 and len(led.edges(begun / CLOCK_HZ)) == 11
    other = Pin(button, OPEN)
    other.bounce(1, count=0)
    button.run(100)
    assert other.level == Level.HIGH


def test_waves_of_numbers(servo: Bench) -> None:
    pin = Pin(servo, OPEN)
    pin.wave(np.array([[0.0, 1], [0.001, 0], [0.0015, 2]]), after=0.002)
    begun = servo.now
    assert pin.pulse().cycles == 16_000 and pin.pulse(level=0).cycles == 8_000
    assert driven(pin)[0] == (begun + 32_000, 1) and pin.level == Level.RELEASED


# ---- what is seen ----


def test_what_comes_and_goes_within_a_cycle_is_no_change(servo: Bench) -> None:
    pin = Pin(servo, OPEN)
    servo.drive(OPEN, 0, at=1_000)
    servo.wave(OPEN, [2_000, 2_000, 3_000], 1)
    servo.run(10_000)
    assert pin.edges().tolist() == [(1_000, 0), (3_000, 1)] and pin.edges(0).dtype == NET
    assert len(Pin(servo, LED).edges()) == 0


def test_what_a_part_of_the_world_does_is_seen_and_its_again_after_release() -> None:
    with Bench(robot="shieldbot") as bench:
        whisker = Pin(bench, 5)
        bench.run(CLOCK_HZ // 100)
        assert whisker.level == Level.HIGH
        whisker.drive(0)
        whisker.wait(0)
        bench.run(1_000)
        whisker.release()
        assert whisker.wait(1, within=0.01) == pytest.approx(bench.now / CLOCK_HZ, abs=1e-6)


def test_the_native_board_shows_what_its_firmware_drives() -> None:
    with Bench(on="native", robot="shieldbot") as bench:
        with pytest.raises(WaitError, match=r"\(of the native board only what the firmware drives is seen\)"):
            Pin(bench, 5).wait(0, within=0.01)
        with pytest.raises(Cannot, match="pin 1 is the serial line's"):
            Pin(bench, 1).wait(0)
        whisker = Pin(bench, 5)
        whisker.drive(0)
        for look in (lambda: whisker.level, whisker.edges, lambda: whisker.wait(0)):
            with pytest.raises(Cannot, match="what a test does to pin 5 cannot be looked at"):
                look()


def test_pins_of_the_line_are_the_lines_while_it_is_on(servo: Bench) -> None:
    pin = Pin(servo, 1)
    pin.drive(1)
    assert pin.wait(1, within=0.001) >= 0
    with Bench(programs.image(programs.ECHO)) as bench:
        bench.run(1000)
        for number in (0, 1):
            with pytest.raises(CallError, match=f"pin {number} is the serial line's while the program uses that"):
                Pin(bench, number).drive(1)


@pytest.mark.parametrize("name", [20, -1, "A6", "D9", 1.5, None, True])
def test_no_such_pin(servo: Bench, name: int) -> None:
    with pytest.raises(CallError, match="there is no pin"):
        Pin(servo, name)


def test_bad_values(servo: Bench) -> None:
    pin: Any = Pin(servo, OPEN)
    servo.run(100)
    with pytest.raises(AttributeError):
        pin.levl = 1
    for call, words in (
        (lambda: pin.drive(2), "pin 7: the level is 2; expected a whole number from 0 to 1"),
        (lambda: pin.drive(1, after=-1), "pin 7: after is -1"),
        (lambda: pin.square(0), "pin 7: the frequency is 0"),
        (lambda: pin.square(9e6), "pin 7: the frequency is 9000000.0"),
        (lambda: pin.square(10, count=0), "pin 7: the count is 0"),
        (lambda: pin.bounce(1, over=1e-6, count=5), "pin 7: the count is 5; expected a whole number from 0 to 4"),
        (lambda: pin.wave(np.array([[1.0, 0], [0.5, 1]])), "pin 7: the wave has a time that is less than one before"),
        (lambda: pin.wave(np.array([[float("nan"), 0]])), "pin 7: the wave has a time"),
        (lambda: pin.wave(np.empty((0, 2))), "or no row"),
        (lambda: pin.wave(np.array([[0.0, 3]])), "a level that is not 0, 1 or 2"),
        (lambda: pin.wave([(0, 1), (1e300, 0)]), "pin 7: the wave's last time is 1e\\+300"),
        (lambda: Pin(servo, SERVO).drive(1), "pin 9: the program drives it, to [01]; expected a pin that it reads"),
        (lambda: pin.wave(np.array([1.0, 2.0, 3.0])), "expected rows of a time and a level"),
        (lambda: pin.wait(2), "pin 7: the level is 2"),
        (lambda: pin.wait(1, within=-1), "pin 7: within is -1"),
        (lambda: pin.pulses(0), "pin 7: the count is 0"),
        (lambda: pin.duty(0), "pin 7: the periods is 0"),
    ):
        with pytest.raises(CallError, match=words):
            call()
