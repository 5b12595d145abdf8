"""Pins of a board: pins.vcd of a run, read by a parser of others, has what the program does to them, what is on the
serial line, and what the outside does; a session says what is there now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest
from vcdvcd import VCDVCD

import boebot
from boebot.boards import BoardSession
from boebot.description.robots import load_robot
from boebot.errors import BoebotError
from boebot.record.blocks import Block
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.record.run_folder import locked
from boebot.result import read_run
from boebot.running.again import again, recorded
from boebot.running.hands import Hands, Onlooker
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot.view import save_pins
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

TICKS_PER_S = 10**10

# Pin 9: high for 100 cycles, a few; pin 6: 25 % PWM at 976.6 Hz; pin 4: pulled up; pin 13: released at last. It answers
# a byte twice, at 4800 and at 38400 baud.
SOURCE = """
#include <avr/io.h>
static void put(char byte) { UCSR0A |= 1 << TXC0; UDR0 = byte; while (!(UCSR0A & 1 << TXC0)) {} }
int main(void) {
  DDRB = 1 << 1 | 1 << 5;
  PORTD = 1 << 4;
  DDRD = 1 << 6;
  OCR0A = 63;
  TCCR0A = 1 << COM0A1 | 3;
  TCCR0B = 3;
  for (char i = 0; i < 3; i++) {
    PORTB |= 1 << 1;
    __builtin_avr_delay_cycles(98);
    PORTB &= ~(1 << 1);
  }
  ADMUX = 1 << REFS0;
  ADCSRA = 1 << ADEN | 1 << ADSC | 7;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
  for (;;) {
    UBRR0 = 16000000 / 16 / 4800 - 1;
    while (!(UCSR0A & 1 << RXC0)) {}
    char byte = UDR0;
    put(byte);
    UBRR0 = 16000000 / 16 / 38400 - 1;
    put(byte);
    DDRB = 0;
  }
}
"""


def level(changes: list[tuple[int, str]], tick: float) -> str:
    return [value for time, value in changes if time <= tick][-1]


def read_uart(changes: list[tuple[int, str]], bits: tuple[float, ...], after: float) -> bytes:
    """What a logic analyser decodes: a byte at each of these bit times (ticks), one after the other."""
    found, now = [], after
    for bit in bits:
        start = next(time for time, value in changes if time >= now and value == "0")
        found.append(sum(int(level(changes, start + (1.5 + k) * bit)) << k for k in range(8)))
        assert level(changes, start + 9.5 * bit) == "1"
        now = start + 9.5 * bit
    return bytes(found)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SOURCE, tmp_path_factory.mktemp("pins") / "pins.elf")


@pytest.fixture(scope="module")
def run(program: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    request = Request.single(brain=program, seconds=0.2, pins=True, typed=[("e", 0.1)])
    with locked(folder) as kept:
        execute(request, None, kept)
    return folder


class Looking(Onlooker):
    """Looks at the pins of a robot when the run is over."""

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        self.session = cast(BoardSession, robots[0].driver.session)

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        if is_over:
            self.pins = self.session.pins_now()


@pytest.mark.parametrize("on", ["program", "avr", "native"])
def test_pins_as_the_live_page_shows_them(program: Path, on: str) -> None:
    looking = Looking()
    robot = load_robot("shieldbot-charging")
    brain, board = (program, None) if on == "program" else ("wander", on)
    execute(Request.single(brain=brain, robot=robot, seconds=0.2, on=board), onlooker=looking)
    if on == "native":
        assert not looking.pins
        return
    left, right = looking.pins[13], looking.pins[12]
    battery = looking.pins[14].volts
    assert robot.supply is not None and battery is not None
    at_rest = robot.supply.empty_v + robot.supply.charge * (robot.supply.full_v - robot.supply.empty_v)
    assert battery == pytest.approx(at_rest / 2, rel=0.1)  # behind a divider by 2; the motors load it
    if on == "avr":  # pulses of 1.3 to 1.7 ms each 20 ms
        assert left.rate == pytest.approx(50, rel=1e-3) and left.share == pytest.approx(0.075, abs=0.01)
        assert right.does < 2 and looking.pins[9].volts is None
        return
    assert looking.pins[6].share == pytest.approx(0.25) and looking.pins[6].rate == pytest.approx(16e6 / 64 / 256)
    assert looking.pins[4] == (3, 1, None, None, None) and looking.pins[11] == (2, 0, None, None, None)
    assert (left.does, left.level, left.share) == (0, 0, None) and looking.pins[5].level == 1


def test_a_parser_of_others_reads_pins_line_and_inputs(run: Path) -> None:
    found = VCDVCD(str(save_pins(read_run(run).robots, run)))
    assert float(found.timescale["timescale"]) == pytest.approx(1e-10)
    signal = {name.split(".")[1]: found[name].tv for name in found.references_to_ids}
    assert len(signal) == 20 and {"D9_infrared_left", "D13_servo_left_L", "A2_encoder_left", "D4"} <= signal.keys()
    nine = signal["D9_infrared_left"]
    rises = [time for time, value in nine if value == "1"]
    widths = [min(time for time, value in nine if time > rise) - rise for rise in rises]
    assert widths == [100 * 625] * 3  # SBI and CBI take 2 cycles each
    six = signal["D6"]
    times = [time for time, _ in six][-5:]
    assert {times[2] - times[0], times[3] - times[1]} == {64 * 256 * 625}  # a period of Timer0 at clk/64
    assert level(signal["D4"], 1e8) == "1" and level(signal["D13_servo_left_L"], 0) == "z"
    assert level(signal["D13_servo_left_L"], 0.15 * TICKS_PER_S) == "z"  # let go
    assert level(signal["D5_whisker_left"], 1e8) == "1"  # by the part's resistor
    slow, fast = 16 * 208 * 625, 16 * 26 * 625
    assert read_uart(signal["D0_uart"], (slow,), 0.1 * TICKS_PER_S) == b"e"
    assert read_uart(signal["D1_uart"], (slow, fast), 0.1 * TICKS_PER_S) == b"ee"


def test_inputs_are_in_the_record_and_are_repeated(run: Path) -> None:
    (result,) = read_run(run).robots
    assert {"inputs", "line_in", "line_out"} <= result.record.streams()
    assert again(recorded(run)).is_equal


def test_times_that_no_board_has_are_refused(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    block = Record.block

    def early(record: Record, stream: str) -> Block:
        return replace(found := block(record, stream), times=found.times - 1)

    monkeypatch.setattr(Record, "block", early)
    with pytest.raises(ValueError, match="a pin changes at -"):
        save_pins(read_run(run).robots, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_run_without_pins_is_one_sentence(tmp_path: Path) -> None:
    result = boebot.run(seconds=0.1)
    assert not {"pins", "inputs", "line_in", "line_out"} & result.record.streams()
    with pytest.raises(BoebotError, match="the run has no pins to write; expected one with --pins"):
        save_pins([result], tmp_path)
    assert not any(tmp_path.iterdir())
