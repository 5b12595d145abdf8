"""Parts that a robot's file wires to a board, and programs on the emulated chip that drive and read them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.result import RunResult, read_run

pytestmark = pytest.mark.emulated

WIRING = """
extends = "shieldbot"
name = "mine"
firmware = "none"
remove = ["uart", "whisker_left", "ping"]

[device.lamp]
type = "led"
pin = 6
position_m = [0.02, 0.02]

[device.board_led]
type = "led"
pin = 13
colour = "yellow"
position_m = [-0.03, 0.0]
"""

# Dims the lamp to 64 of 256 by Timer0 for half a second, and lights pin 13 after it: a servo's pin, as well.
SOURCE = """
#include <avr/io.h>
#include <util/delay.h>
int main(void) {
  DDRD = 1 << PD6;
  DDRB = 1 << PB5;
  OCR0A = 63;
  TCCR0A = 1 << COM0A1 | 1 << WGM01 | 1 << WGM00;
  TCCR0B = 1 << CS01 | 1 << CS00;
  _delay_ms(500);
  TCCR0A = 0;
  PORTB = 1 << PB5;
  for (;;) {}
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the program and the robot's file."""
    made = tmp_path_factory.mktemp("wired")
    (made / "wired.c").write_text(SOURCE)
    (made / "mine.toml").write_text(WIRING)
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-g", "-Wall"]
    subprocess.run(["avr-gcc", *flags, "-o", made / "wired.elf", made / "wired.c"], check=True)
    return made


@pytest.fixture(scope="module")
def result(folder: Path) -> RunResult:
    return boebot.run(
        folder / "wired.elf",
        robot=folder / "mine.toml",
        arena="empty",
        seconds=1,
        without=["led_spread"],
        out=folder / "run",
    )


def test_leds_are_seen_as_bright_as_the_program_makes_them(result: RunResult) -> None:
    """Fast PWM at 16 MHz / 64, high for 64 of 256 counts: in a tick are nine to ten such pulses of 0.256 ms."""
    series = result.series
    lamp, led = series.number("lamp", "brightness"), series.number("board_led", "brightness")
    half = np.searchsorted(series.time, 0.5)
    assert lamp[2:half].min() > 9 * 0.0256 and lamp[2:half].max() < 10 * 0.0256 + 1e-6
    assert lamp[2:half].mean() == pytest.approx(0.25, abs=0.002)
    assert lamp[half + 1 :].max() == 0.0
    assert not series.flag("board_led", "lit")[: half - 1].any()
    assert led[half + 2 :] == pytest.approx(1.0)
    assert {name for name, *_ in series.signs()} == {"lamp", "board_led"}


def test_a_record_and_its_page_have_them(result: RunResult, folder: Path) -> None:
    again = read_run(folder / "run")
    assert isinstance(again, RunResult)
    assert np.array_equal(again.series.number("lamp", "brightness"), result.series.number("lamp", "brightness"))
    assert {"lamp_brightness", "lamp_lit"} <= again.series.columns().keys()
    assert '"lamp"' in (folder / "run" / "replay.html").read_text()
