"""Where an image goes wrong in the emulator, as people read it: by address, function and source line."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from boebot import resources
from boebot.cli import main
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.result import read_run, robots_of
from boebot_timing.emulated.measure import run
from sim_bridge.tests.boards.symbols import entry_of, find_symbol
from sim_bridge.tests.firmware.test_planted_faults import JUMP_TO_ITSELF, planted
from tools.tests import avr_program

DATA_SPACE = 0x800000

FUNCTION = "safety_accept"  # runs when a set-point comes, in the link's poll, which is no task
PLACE = r"in safety_accept \(safety\.c:\d+\)"

# The firmware's own sources with lines more; which of them goes wrong says the variable `planted`, whose first value is
# put into the image. Each is on its own line: number -> line.
FUNCTIONS = """
#include <avr/interrupt.h>
#include <avr/io.h>
volatile uint8_t planted __attribute__((used)) = 99;
static __attribute__((noinline)) void deeper(uint8_t n) { volatile uint8_t more = n; deeper(n + 1); GPIOR2 = more; }
static void (*volatile nobody)(void) = 0;
"""
DEEPER = next(i for i, line in enumerate(FUNCTIONS.splitlines(), 1) if "deeper" in line)
LINK, DEAF, STACK, INVALID, WILD, NULL, INTERRUPT = range(1, 8)
IN_MOTION = {
    LINK: "while (planted != 0) { }",
    DEAF: "cli(); while (planted != 0) { }",
    STACK: "deeper(0);",
    INVALID: 'GPIOR2 = 1; __asm__ volatile(".word 1");',
    WILD: "((void (*)(void))0x3800)();",
    NULL: "nobody();",
}
FAULTS = {
    STACK: r"the stack overflows: it reaches 0x0[3-6][0-9A-F]{2}, variables end below 0x0[3-6][0-9A-F]{2}",
    INVALID: "the program reached the invalid instruction 0x0001",
    WILD: "the program goes to 0x7000, but ends at 0x[345][0-9A-F]{3}",
}


@dataclass(frozen=True)
class Variants:
    """The firmware with all of those lines."""

    image: Path
    places: dict[int, tuple[str, int]]  # file and line of each

    def one(self, number: int, folder: Path) -> Path:
        """An image that goes wrong at one of them, in its own folder."""
        folder.mkdir(exist_ok=True)
        content = bytearray(self.image.read_bytes())
        elf = ELFFile(io.BytesIO(bytes(content)))
        data, variable = elf.get_section_by_name(".data"), find_symbol(self.image, "planted")
        assert data is not None
        at = data["sh_offset"] + variable.address + DATA_SPACE - data["sh_addr"]
        assert content[at] == 99
        content[at] = number
        path = folder / "shieldbot.elf"
        path.write_bytes(content)
        return path

    def place(self, number: int) -> str:
        """What is reported about its line."""
        file, line = self.places[number]
        return rf"in \w+ \({re.escape(file)}:{line}\)"


def _plant(source: Path, head: str, behind: str, lines: list[str]) -> list[int]:
    """Puts lines behind one of a source, and what they need at its head; returns their numbers."""
    text = [*head.splitlines(), *source.read_text("utf-8").splitlines()]
    at = text.index(behind) + 1
    text[at:at] = lines
    source.write_text("\n".join([*text, ""]), encoding="utf-8")
    return [at + i + 1 for i in range(len(lines))]


@pytest.fixture(scope="module")
def variants(tmp_path_factory: pytest.TempPathFactory) -> Variants:
    """Compiled as the image is."""
    folder = tmp_path_factory.mktemp("planted")
    shutil.copytree(avr_program.SOURCES, folder / "src")
    lines = [f"if (planted == {number}) {{ {code} }}" for number, code in IN_MOTION.items()]
    behind = "static void set(int16_t left, int16_t right, int16_t full) {"
    numbers = _plant(folder / "src" / "motion.c", FUNCTIONS, behind, lines)
    places = {number: ("motion.c", line) for number, line in zip(IN_MOTION, numbers, strict=True)}
    counted = f"static uint16_t slots; if (planted == {INTERRUPT} && ++slots == 200)"  # a session is open by then
    hang = f"{{ {counted} {{ while (planted != 0) {{ }} }} }}"
    head = "#include <avr/io.h>\nextern volatile uint8_t planted;"
    (line,) = _plant(folder / "src" / "schedule.c", head, "void schedule_on_slot(void) {", [hang])
    places[INTERRUPT] = ("schedule.c", line)
    extra = ("-Wno-error", "-Wno-infinite-recursion")
    return Variants(avr_program.build(folder / "planted.elf", folder=folder / "src", extra=extra), places)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[object, str]]:
    """`boebot run` of an image in place of the bundled one: exit code and standard error."""

    def run_it(image: Path, *options: str) -> tuple[object, str]:
        bundled = resources.folder
        monkeypatch.setattr(resources, "folder", lambda kind: image.parent if kind == "images" else bundled(kind))
        arguments = ["boebot", "run", "wander", "--on", "avr", "--arena", "room", "--seconds", "0.3", *options]
        monkeypatch.setattr(sys, "argv", arguments)
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, " ".join(capsys.readouterr().err.split())

    return run_it


def as_shieldbot(image: str) -> Path:
    path = Path(image)
    return path.rename(path.parent / "shieldbot.elf")


@pytest.mark.parametrize("number", [LINK, DEAF, INTERRUPT], ids=["", "with interrupts off", "in an interrupt"])
def test_a_hang_is_told_with_its_source_line(
    tmp_path: Path, command: Callable[..., tuple[object, str]], variants: Variants, number: int
) -> None:
    """As on the robot, where the run goes on after the reset; only the emulated board knows the place."""
    code, error = command(variants.one(number, tmp_path), "--seconds", "0.8", "--out", str(tmp_path / "out"))
    place = variants.place(number)
    reported = rf"the watchdog reset the program, which it found at address 0x([0-9A-F]{{4}}) in cycle \d+ {place}"
    found = re.search(reported, error)
    assert found is not None, error
    assert "Traceback" not in error
    assert error.count("the last reset of the board") <= 1
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert re.match(rf"0x{found[1]} {place}", summary["hung_at"])
    assert all(re.fullmatch(place, reset["place"]) for reset in summary["watchdog_resets"])
    assert summary["watchdog_resets"][0]["address"] == int(found[1], 16)
    assert len(summary["watchdog_resets"]) == summary["counters"]["resets"] >= 1
    assert code in (None, 0) and summary["ended"] == "complete"
    assert json.dumps(summary["hung_at"]) in (tmp_path / "out" / "replay.html").read_text("utf-8")


@pytest.mark.parametrize("number", FAULTS)
def test_a_fault_ends_the_run_with_its_source_line(
    tmp_path: Path, command: Callable[..., tuple[object, str]], variants: Variants, number: int
) -> None:
    code, error = command(variants.one(number, tmp_path))
    assert code == 1
    place = rf"in (__prologue_saves__ of )?deeper \(motion\.c:{DEEPER}\)" if number == STACK else variants.place(number)
    where = rf"at address 0x[0-9A-F]{{4}} in cycle \d+ {place}"
    assert re.search(rf"the emulated ATmega328P crashed at 0\.\d+ s: {FAULTS[number]} {where}", error), error
    assert "Traceback" not in error


def test_a_null_pointer_that_is_called_is_noted_with_its_source_line(
    tmp_path: Path, command: Callable[..., tuple[object, str]], variants: Variants
) -> None:
    """The program begins anew, as on the robot; the run says where that came from, and so does its record."""
    out = tmp_path / "out"
    _, error = command(variants.one(NULL, tmp_path), "--out", str(out))
    told = rf"the program jumps to its start at address 0x[0-9A-F]{{4}} in cycle \d+ {variants.place(NULL)}: no reset, "
    assert len(re.findall(told, error)) == 1, error
    result = robots_of(read_run(out))[1]
    assert [notice for notice in result.notices if re.match(told, notice)] != []


def test_a_program_that_hangs_at_each_opening_is_given_up(
    tmp_path: Path, command: Callable[..., tuple[object, str]]
) -> None:
    """The board hangs while the host configures it, in each session: the run ends, and says where."""
    image = as_shieldbot(planted(tmp_path, "parameters_get", JUMP_TO_ITSELF))
    code, error = command(image)
    assert code == 1
    assert "ended 10 sessions in a row before it was configured and armed; its last reset was by its watchdog" in error
    assert re.search(
        r"found at address 0x[0-9A-F]{4} in cycle \d+ in parameters_get \(parameters\.c:\d+\); 10 times", error
    )


def test_a_program_that_never_lets_a_session_begin_is_told_with_its_place(
    tmp_path: Path, command: Callable[..., tuple[object, str]]
) -> None:
    code, error = command(as_shieldbot(planted(tmp_path, "receive_frame", JUMP_TO_ITSELF)))
    assert code == 1
    assert "there is no session within 2 s; its last reset was by its watchdog" in error
    assert re.search(r"found at address 0x[0-9A-F]{4} in cycle \d+ in receive_frame \(\w+\.[ch]:\d+\)", error)


def test_a_hang_has_its_place_where_the_image_is_measured(tmp_path: Path) -> None:
    image = Path(planted(tmp_path, FUNCTION, JUMP_TO_ITSELF))
    address = entry_of(image, FUNCTION)
    with pytest.raises(BoardError, match=rf"found at address 0x{address:04X} .* {PLACE}"):
        run(image, load_robot("shieldbot"), "figures", 0.5, 1)
