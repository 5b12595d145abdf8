"""A character display, initialised and written by a program as its data sheet has it: its text in record, replay, page
and run.csv."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

import boebot
from boebot.record.run_folder import locked
from boebot.result import read_run
from boebot.running.again import again, recorded
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot.view import tables
from boebot.view.replay import content
from sim_bridge.bench.uno import Wanted, open_uno
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

WIRING = """
extends = "shieldbot"
name = "mine"
firmware = "none"
remove = ["uart", "ping", "whisker_left", "whisker_right", "infrared_left", "infrared_right"]

[device.lcd]
type = "display"
rs_pin = 7
enable_pin = 8
d4_pin = 2
d5_pin = 3
d6_pin = 4
d7_pin = 5
"""
# Figure 24 of the HD44780U's data sheet; DB4 to DB7 at PD2 to PD5, RS at PD7, E at PB0. Then a count at each 50 ms.
SOURCE = """
#include <avr/io.h>
#include <stdio.h>
#include <util/delay.h>
static void half(unsigned char value) {
  PORTD = (PORTD & ~0x3C) | (value & 15) << 2;
  PORTB |= 1;
  _delay_us(1);
  PORTB &= ~1;
  _delay_us(1);
}
static void put(unsigned char byte, char rs) {
  if (rs) PORTD |= 0x80; else PORTD &= ~0x80;
  half(byte >> 4);
  half(byte);
  _delay_us(53);
}
static void text(const char *c) { while (*c) put(*c++, 1); }
int main(void) {
  DDRD = 0xBC;
  DDRB = 1;
  _delay_ms(15);
  half(3);
  _delay_ms(4.1);
  half(3);
  _delay_us(100);
  half(3);
  _delay_us(53);
  half(2);
  _delay_us(53);
  put(0x28, 0);
  put(0x08, 0);
  put(0x01, 0);
  _delay_ms(2.16);
  put(0x06, 0);
  put(0x0C, 0);
  for (int n = 0;; n++) {
    char line[17];
    put(0x80, 0);
    text("Distance:");
    put(0xC0, 0);
    sprintf(line, "%4d cm \\xdf", n);
    text(line);
    _delay_ms(50);
  }
}
"""


def test_text_of_a_display_is_in_all_that_a_run_leaves(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(WIRING)
    compiled(SOURCE, tmp_path / "lcd.elf", "-Wno-unused-parameter")
    request = Request.single(brain=tmp_path / "lcd.elf", robot=tmp_path / "mine.toml", seconds=0.2)
    with locked(tmp_path / "run") as kept:
        execute(request, None, kept)
    (result,) = read_run(tmp_path / "run").robots
    shown = result.shown.texts
    assert set(shown["lcd_1"]) == {"", "Distance:"} and shown["lcd_2"][-1] == "   3 cm °"
    assert next(text for text in shown["lcd_2"] if text.endswith("°")) == "   0 cm °"
    assert again(recorded(tmp_path / "run")).is_equal
    on_page = {one["name"]: one["words"] for one in content([result])["runs"][0]["rows"]["shown"]["texts"]}
    assert "   2 cm °" in on_page["lcd_2"]
    tables.write_run(result, tmp_path / "run.csv")
    *_, last = csv.DictReader((tmp_path / "run.csv").open(encoding="utf-8"))
    assert (last["shown_lcd_1"], last["shown_lcd_2"]) == ("Distance:", "   3 cm °")
    with open_uno("avr", Wanted(image=tmp_path / "lcd.elf", robot=str(tmp_path / "mine.toml"))) as uno:
        uno.run(0.2)
        uno.save_record(tmp_path / "kept")
    (kept_of_a_test,) = read_run(tmp_path / "kept").robots
    assert kept_of_a_test.shown.texts["lcd_2"][-1] == "   3 cm °"


def test_a_robot_of_the_kits_firmware_has_no_display(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(WIRING.replace('firmware = "none"', "").replace('"uart", ', ""))
    with pytest.raises(boebot.BoebotError, match=r'lcd.*firmware = "none"'):
        boebot.run("stop", robot=tmp_path / "mine.toml")
