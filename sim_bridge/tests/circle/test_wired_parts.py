"""Parts that a robot's file wires to a board, and programs on the emulated chip that drive and read them."""

from __future__ import annotations

import base64
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live.test_live_view import Page, Run

import boebot
import copied_process
from boebot.result import RunResult, read_run
from boebot.running.again import again as repeated
from boebot.running.again import recorded
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

WIRING = """
extends = "shieldbot"
name = "mine"
firmware = "none"
remove = ["uart", "whisker_left", "ping", "battery", "infrared_right"]

[device.start]
type = "button"
pin = 2
position_m = [-0.02, 0.03]

[device.dial]
type = "potentiometer"
pin = "A0"
position = 0.25
position_m = [-0.02, -0.03]

[device.sonar]
type = "ultrasonic"
trigger_pin = 8
echo_pin = 4
position_m = [0.06, 0.0]

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

ARENA = """
name = "wall"

[[wall]]
points_m = [[0.56, -1.0], [0.56, 1.0]]
"""

# Dims the lamp by the dial, lights pin 13, a servo's as well, while the button is pressed, and prints the length of the
# echo in us after each trigger.
SOURCE = """
#include <avr/io.h>
#include <stdio.h>
#include <util/delay.h>
static int put(char byte, FILE *out) {
  while (!(UCSR0A & 1 << UDRE0)) {}
  UDR0 = byte;
  return 0;
}
static FILE serial = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);
static unsigned echo_us(void) {
  PORTB |= 1 << PB0;
  _delay_us(10);
  PORTB &= ~(1 << PB0);
  while (!(PIND & 1 << PD4)) {}
  TCNT1 = 0;
  while (PIND & 1 << PD4) {}
  return TCNT1 / 2;
}
int main(void) {
  UCSR0B = 1 << TXEN0;
  UBRR0 = 103;
  TCCR1B = 1 << CS11;
  DDRD = 1 << PD6;
  PORTD = 1 << PD2;
  DDRB = 1 << PB5 | 1 << PB0;
  TCCR0A = 1 << COM0A1 | 1 << WGM01 | 1 << WGM00;
  TCCR0B = 1 << CS01;
  ADMUX = 1 << REFS0;
  ADCSRA = 1 << ADEN | 1 << ADSC | 1 << ADATE | 7;
  for (;;) {
    OCR0A = ADC >> 2;
    PORTB = PIND & 1 << PD2 ? 0 : 1 << PB5;
    if (TCNT1 > 20000) fprintf(&serial, "%u us\\n", echo_us());
  }
}
"""
IDEAL = ["led_spread", "bounce", "potentiometer_noise", "ping_misses", "ping_noise"]
INPUTS = [("start", 1, 0.3), ("dial", 0.75, 0.5), ("start", 0, 0.6)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the program and the robot's file."""
    made = tmp_path_factory.mktemp("wired")
    (made / "mine.toml").write_text(WIRING)
    (made / "wall.toml").write_text(ARENA)
    compiled(SOURCE, made / "wired.elf")
    return made


@pytest.fixture(scope="module")
def result(folder: Path) -> RunResult:
    program, robot, out = folder / "wired.elf", folder / "mine.toml", folder / "run"
    return boebot.run(
        program, robot=robot, arena=folder / "wall.toml", seconds=1, without=IDEAL, inputs=INPUTS, out=out
    )


def test_the_program_reads_button_and_dial_and_leds_are_as_bright_as_it_makes_them(result: RunResult) -> None:
    """Fast PWM at 16 MHz / 8, high for n + 1 of 256 counts, n = 256 times the dial's position: 78 periods in a tick."""
    series = result.series
    lamp, led, time = series.number("lamp", "brightness"), series.number("board_led", "brightness"), series.time
    for low, high, position in ((0.02, 0.5, 0.25), (0.52, 1.0, 0.75)):
        seen = lamp[(time > low) & (time <= high)]
        assert seen == pytest.approx(position + 1 / 256, abs=1 / 78)
        assert seen.mean() == pytest.approx(position + 1 / 256, abs=1e-3)
    assert led[(time <= 0.3) | (time > 0.615)].max() == 0.0
    assert led[(time > 0.315) & (time <= 0.6)] == pytest.approx(1.0)
    assert {name for name, *_ in series.signs()} == {"lamp", "board_led", "start", "whisker_right"}
    assert np.array_equal(series.flag("start", "pressed"), (time > 0.3 + 1e-9) & (time < 0.6 + 1e-9))
    assert series.number("dial", "position")[-1] == 0.75


def test_the_program_measures_the_wall_by_the_echo_as_long_as_sound_takes_there_and_back(result: RunResult) -> None:
    """0.5 m ahead of the sensor at 20 °C; the program sees the pulse's ends with a few instructions between."""
    printed = b"".join(data for _, data in result.record.rows("to_host")).decode().splitlines()
    seen = [int(line.removesuffix(" us")) for line in printed[:-1]]
    assert len(seen) > 20 and seen == pytest.approx([2 * 0.5 / 343.5 * 1e6] * len(seen), abs=2)
    distance = result.series.number("sonar", "distance")
    assert np.isnan(distance[0]) and distance[10:] == pytest.approx(0.5, abs=1e-9)


def test_a_record_its_page_and_a_repetition_have_them(result: RunResult, folder: Path) -> None:
    again = read_run(folder / "run")
    assert isinstance(again, RunResult) and again.touched == 0, "a script touched it, not a person"
    assert np.array_equal(again.series.number("lamp", "brightness"), result.series.number("lamp", "brightness"))
    assert {"lamp_brightness", "lamp_lit", "start_pressed", "dial_position"} <= again.series.columns().keys()
    assert '"lamp"' in (folder / "run" / "replay.html").read_text()
    assert repeated(recorded(folder / "run")).is_equal


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--input", "button=1@0.5"],
            "button of robot 'mine' is no button, switch or knob; expected one of start, dial",
        ),
        (["--input", "start=0.5@1"], "start cannot be set to 0.5; expected 0 or 1"),
        (["--input", "dial=2@1"], "dial cannot be set to 2; expected 0 to 1"),
        (["--input", "start@1"], "--input 'start@1': there is no name, = or @; expected NAME=VALUE@TIME"),
        (["--input", "start=1@late"], "--input 'start=1@late': 'late' is no time"),
        (["--input", "start=1@-1"], "'start' at -1 s is never; expected a time from 0 s on"),
    ],
)
def test_inputs_that_are_none_get_one_sentence(folder: Path, words: list[str], sentence: str) -> None:
    done = copied_process.command(["run", "wired.elf", "--robot", "mine.toml", *words], folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"boebot: {sentence}"), done.stderr


def test_a_page_works_them(folder: Path) -> None:
    """And they show in the newest rows that come to it; what cannot be set gets a sentence."""
    words = [folder / "wired.elf", "--robot", folder / "mine.toml", "--arena", "empty", "--seconds", "inf"]
    run = Run("run", *map(str, words), "--view", "--speed", "1")
    try:
        with run.stream() as stream:
            page = Page(stream)
            shown = page.until("run")
            assert "set" in shown["live"]["can"] and "hand" not in shown["live"]["can"]
            assert shown["live"]["robots"][0]["inputs"] == [
                {"name": "start", "kind": "button"},
                {"name": "dial", "kind": "slider"},
            ]
            names = [sign["device"] for sign in shown["runs"][0]["signs"]]
            page.do("set", part="start", value=1)
            page.until("chunk", where=lambda chunk: any(chunk_bytes(chunk, "signs", names.index("board_led"))))
            page.do("set", part="dial", value=0.8)
            assert page.state(lambda state: state["touched"] == 2)
            page.do("set", part="start", value=0.5)
            assert page.until("refused")["sentence"] == "start cannot be set to 0.5; expected 0 or 1"
            page.do("set", part="lamp", value=1)
            refused = "lamp of robot 'mine' is no button, switch or knob; expected one of start, dial"
            assert page.until("refused")["sentence"] == refused
    finally:
        run.process.send_signal(signal.SIGINT)
        assert run.end()[0] == 130


def chunk_bytes(chunk: Any, name: str, index: int) -> bytes:
    return base64.b64decode(chunk["runs"][0][name][index])
