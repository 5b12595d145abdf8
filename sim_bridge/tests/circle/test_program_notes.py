"""`--notes` and `--strict`: what a program does on a robot that a bench does not show, with its cycle and line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import boebot
from boebot.cli.app import app
from boebot.record.run_folder import locked
from boebot.result import RunResult, read_run
from boebot.running.again import again, recorded
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.tests.boards.avr.avr_program import compiled

pytestmark = pytest.mark.unsanitized

# On a shieldbot: A2 is the left encoder's, 7 the right whisker's (10 kOhm to 5 V, not pressed); A4 and A5 are free.
SOURCE = """
#include <avr/io.h>
unsigned char kept __attribute__((section(".noinit")));
int main(void) {
  DDRD = 1 << 7;
  PORTD = 1 << 7;
  for (int i = 0; i < 3; i++) {
    if (PIND & 1 << 5) GPIOR0++;
  }
  ADMUX = 0x45;
  ADCSRA = 0xC7; /* line 11 */
  while (ADCSRA & 1 << ADSC) {}
  if (bit_is_set(PINC, 4)) GPIOR0++; /* line 13 */
  GPIOR0 = kept; /* line 14 */
  DDRC = 1 << 2, PORTC ^= 1 << 2; /* line 15: low, then high, against whatever the encoder does */
  for (;;) {}
}
"""


# On a rover: a button from 12 to ground; its pull-up is off.
BUTTON = """
#include <avr/io.h>
#include <util/delay.h>
int main(void) {
  for (;;) {
    _delay_ms(100);
    if (bit_is_set(PINB, 4)) GPIOR0++;
  }
}
"""


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SOURCE, tmp_path_factory.mktemp("program") / "fights.elf")


NOTES = [
    ("converts the voltage at A5", "11"),
    ("decides by A4", "13"),
    ("reads RAM that was never written", "14"),
    ("drives A2", "15"),
]


# Looks at every pin but the serial line's.
LOOKS = "".join(
    f"if (PIN{port} & 1 << {bit}) GPIOR0++;"
    for port, bits in {"D": range(2, 8), "B": range(6), "C": range(6)}.items()
    for bit in bits
)
ALL_PINS = f"#include <avr/io.h>\nint main(void) {{ {LOOKS} for (;;) {{}} }}"


def run(image: Path, *options: str) -> tuple[int, str]:
    shown = CliRunner().invoke(app, ["run", str(image), "--seconds", "0.15", *options])
    return getattr(shown.exception, "exit_code", shown.exit_code), f"{shown.output}\n{shown.exception}"


def test_notes_have_cycle_and_line_and_are_in_the_record(image: Path, tmp_path: Path) -> None:
    code, said = run(image, "--notes")
    assert code == 0
    flat = " ".join(said.split())
    found = re.findall(r"the program ([^:]*?) at address 0x\w+ in cycle \d+ in main \(fights.c:(\d+)\): ", flat)
    assert found == NOTES
    with locked(tmp_path) as folder:
        execute(Request.single(brain=str(image), seconds=0.1, notes=True), None, folder)
    result = read_run(tmp_path)
    assert isinstance(result, RunResult)
    assert [one for one in result.notices if "fights.c" in one and one in flat] == result.notices != []
    repeated = again(recorded(tmp_path))
    assert repeated.is_equal


def test_strict_makes_the_first_one_a_fault(image: Path, tmp_path: Path) -> None:
    code, said = run(image, "--strict")
    assert code == 1
    fault = r"stopped at 0\.000 s: the program converts the voltage at A5 \(nothing .*\) at .* in main \(fights.c:11\)"
    assert re.search(fault, said)
    with locked(tmp_path) as folder:
        execute(Request.single(brain=str(image), seconds=0.1, strict=True), None, folder)
    result = read_run(tmp_path)
    assert isinstance(result, RunResult) and re.search(fault, str(result.error))
    assert again(recorded(tmp_path)).is_equal


def test_what_only_hears_decides_nothing(tmp_path: Path) -> None:
    """Of a rover's pins only what line sensors (2, 4, 10) and echo (A4) drive is no input that floats: servo, bridge,
    LEDs and trigger hear, the button is open. Asked for by the library's call. A voltage (A0) reads low."""
    file = tmp_path / "mine.toml"
    grey = 'type = "line_module"\npin = "A0"\noutput = "analog"\nposition_m = [0.06, 0.03]'
    file.write_text(f'extends = "rover"\n[device.grey]\n{grey}\n')
    result = boebot.run(compiled(ALL_PINS, tmp_path / "all.elf"), file, "empty", seconds=0.01, notes=True)
    found = [re.search(r"decides by (?:pin )?(\w+) .*: (nothing drives|a voltage)", one) for one in result.notices]
    floats = {one[1]: one[2] for one in found if one}
    assert floats.keys() == {"3", "5", "6", "7", "8", "9", "11", "12", "13", "A0", "A1", "A2", "A3", "A5"}
    assert {pin for pin, why in floats.items() if why == "a voltage"} == {"A0"}


def test_nothing_to_note_is_said(tmp_path: Path) -> None:
    quiet = compiled("int main(void) { for (;;) ; }", tmp_path / "quiet.elf")
    assert boebot.run(quiet, "rover", "empty", seconds=0.01, notes=True).notices == [
        "--notes: there is nothing to note"
    ]


def test_nothing_is_noted_unasked(image: Path) -> None:
    result = execute(Request.single(brain=str(image), seconds=0.1), None, None)
    assert isinstance(result, RunResult) and result.notices == []


def test_a_button_decides_only_while_it_is_closed(tmp_path: Path) -> None:
    open_later = compiled(BUTTON, tmp_path / "button.elf"), "--robot", "rover", "--arena", "empty", "--notes"
    noted = [
        "decides by pin 12" in run(*open_later, "--input", "button=1@0.02", *more)[1]
        for more in ([], ["--input", "button=0@0.05"])
    ]
    assert noted == [False, True]
