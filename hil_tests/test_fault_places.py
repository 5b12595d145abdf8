"""What people are told of an image that goes wrong in the emulator: where, by address, function and source line. The
faults are planted in the firmware's own image."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from boebot import resources
from boebot.cli import main
from boebot.errors import BoardError
from boebot.robots import load_robot
from sim_bridge.tests.symbols import entry_of
from sim_bridge.timing.measure import run
from tools.bench.avr_program import build

pytestmark = pytest.mark.emulated

MAIN = """#include "firmware.h"
#include "hal/hal.h"
__attribute__((noinline)) void planted(void) { cli(); for (;;) __asm__ volatile("nop"); } /* line 3 */
int main(void) {
  firmware_start();
  uint16_t polls = 0;
  for (;;) {
    firmware_poll();
    if (++polls == 500) planted();
    hal_sleep_until(firmware_due);
  }
}
"""
INVALID = bytes((0x01, 0x00))  # 0000 0000 0000 0001, reserved (instruction set manual)


@pytest.fixture(scope="module")
def hanging(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The firmware, which hangs after about a second."""
    folder = tmp_path_factory.mktemp("hanging")
    (folder / "main.c").write_text(MAIN, encoding="ascii")
    return build(folder / "shieldbot.elf", folder / "main.c")


@pytest.fixture(scope="module")
def crashing(hanging: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with an invalid instruction in place of the first one of `planted`."""
    address = entry_of(hanging, "planted")
    image = bytearray(hanging.read_bytes())
    with hanging.open("rb") as file:
        segments = [segment.header for segment in ELFFile(file).iter_segments() if segment["p_type"] == "PT_LOAD"]
    (code,) = (one for one in segments if one["p_vaddr"] <= address < one["p_vaddr"] + one["p_filesz"])
    place = code["p_offset"] + address - code["p_vaddr"]
    image[place : place + 2] = INVALID
    elf = tmp_path_factory.mktemp("crashing") / "shieldbot.elf"
    elf.write_bytes(image)
    return elf


def told(image: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> tuple[object, str]:
    """Exit code and standard error of `boebot run` with that image in place of the bundled one."""
    bundled = resources.folder
    monkeypatch.setattr(resources, "folder", lambda kind: image.parent if kind == "images" else bundled(kind))
    monkeypatch.setattr(sys, "argv", ["boebot", "run", "wander", "--on", "avr", "--arena", "room", "--seconds", "3"])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, capsys.readouterr().err


def test_a_crash_ends_a_run_with_its_place(
    crashing: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, error = told(crashing, monkeypatch, capsys)
    assert code == 1
    address = entry_of(crashing, "planted")
    place = rf"invalid instruction 0x0001 at address 0x{address:04X} in cycle \d+ in planted \(main\.c:3\)"
    assert re.search(place, " ".join(error.split())), error
    assert "Traceback" not in error


def test_a_hang_is_told_as_the_watchdog_sees_it(
    hanging: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As on the robot, where the run goes on after the reset."""
    code, error = told(hanging, monkeypatch, capsys)
    assert code == 0
    assert "was by its watchdog, outside of its tasks: the firmware hung there" in error


def test_a_hang_has_its_place_where_the_image_is_measured(hanging: Path) -> None:
    with pytest.raises(
        BoardError, match=r"watchdog reset the program at address 0x[0-9A-F]{4} .* in planted \(main\.c:3\)"
    ):
        run(hanging, load_robot("shieldbot"), "figures", 2.0, 1)
