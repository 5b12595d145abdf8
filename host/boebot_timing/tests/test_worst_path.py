"""Worst paths by lines: a task whose cycles are counted by hand, the bundled image's sums, and the command."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from avr_timing.bounds.worst_path import PathRow
from boebot import resources
from boebot_timing import budget, loads
from boebot_timing.command import EXIT_INPUT
from boebot_timing.firmware import load_firmware
from boebot_timing.tests import timing_program
from boebot_timing.worst_path import ACCEPTANCE, WorstPath, worst_path
from command import boebot as command

# Five passes of 2 nops, dec and brne (2, at last 1), a function of 10 nops; on separate lines.
LINES = [
    "__attribute__((noinline)) void helper(void) { NOPS(10); }",
    "__attribute__((noinline, naked)) void first_task(void) {",
    '  __asm__ volatile("ldi r18, 5");',
    '  __asm__ volatile("1: nop\\n nop\\n dec r18");',
    '  __asm__ volatile("brne 1b");',
    "  helper();",
    '  __asm__ volatile("ret");',
    "}",
]


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    replaced = "__attribute__((noinline)) void first_task(void) { NOPS(100); }"
    source = timing_program.text()
    assert replaced in source
    return timing_program.compiled(
        tmp_path_factory.mktemp("path"), source.replace(replaced, "\n".join(LINES)), "-gdwarf-4"
    )


def summed(path: WorstPath) -> int:
    return sum(row.cycles for row in path.rows)


def test_lines_have_the_cycles_counted_by_hand(image: Path) -> None:
    first = (
        timing_program.text().splitlines().index("__attribute__((noinline)) void first_task(void) { NOPS(100); }") + 1
    )
    path = worst_path(load_firmware(image), "first")

    def row(function: str, nth: int, cycles: int, runs: int, *passes: int) -> PathRow:
        return PathRow(function, f"program.c:{first + nth}", cycles, runs, passes)

    assert path.rows == (
        row("first_task", 2, 1, 1),
        row("first_task", 3, 5 * 3, 5, 5),
        row("first_task", 4, 4 * 2 + 1, 5),
        row("first_task", 5, 4, 1),
        row("helper", 0, 10 + 4, 1),
        row("first_task", 6, 4, 1),
    )
    assert path.cycles == summed(path) == 1 + 15 + 9 + 4 + 14 + 4


def test_interrupt_has_its_acceptance_and_its_vector(image: Path) -> None:
    """4 cycles, a jump of 3, 20 nops and the return."""
    path = worst_path(load_firmware(image), "slot")
    assert path.rows[0] == PathRow(ACCEPTANCE, None, 4, 1, ()) and path.rows[1].cycles == 3
    assert path.kind == "interrupt" and path.cycles == summed(path) == 4 + 3 + 20 + 4


def test_sums_are_the_bounds_of_a_real_image() -> None:
    """With calls in loops, constants handed over, and library routines."""
    elf = resources.folder("images") / "shieldbot.elf"
    firmware = load_firmware(elf)
    bounds = {row.name: row.bound for row in budget.prove(elf, loads.LOADS["figures"], firmware=firmware).rows}
    paths = {name: worst_path(firmware, name) for name in ("session", "devices", "telemetry", "edge", "changes")}
    assert {name: summed(path) for name, path in paths.items()} == {name: bounds[name] for name in paths}
    assert any(max(row.passes, default=0) > 1 for path in paths.values() for row in path.rows)
    assert all(row.cycles >= 0 for path in paths.values() for row in path.rows)


def test_command_shows_the_path(image: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--where", "first")
    assert code == 0 and "the worst path of task first: 47 cycles" in out
    assert [line.split()[2:] for line in out.splitlines() if line.split()[:1] == ["helper"]] == [["14", "1"]]
    bare = image.with_name("bare.elf")
    subprocess.run(["avr-objcopy", "-R", ".note.gnu.avr.deviceinfo", str(image), str(bare)], check=True)
    code, out, said = command(capsys, "timing", "--elf", str(bare), "--where", "first", "--json")
    assert said == f"boebot: {bare} does not say which chip it is for: it is taken for an ATmega328P\n"
    answer = json.loads(out)
    assert code == 0 and answer["bound_cycles"] == sum(row["cycles"] for row in answer["path"]) == 47
    assert [row["loop_passes"] for row in answer["path"] if row["loop_passes"]] == [[5]]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--where", "third"), "has no task or interrupt 'third'; expected one of first, second, slot"),
        (("--where", "first", "--robot", "arsim"), "robot 'arsim' has no board, and so no image; expected --elf F"),
    ],
)
def test_unknown_name_is_one_sentence(
    image: Path, arguments: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    elf = () if "arsim" in arguments else ("--elf", str(image))
    code, _, err = command(capsys, "timing", *elf, *arguments)
    assert code == EXIT_INPUT and sentence in err and err.count("\n") == 1
