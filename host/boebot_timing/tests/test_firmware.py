"""Images that are unusual, or damaged, or not this firmware's: each is proved, or refused in one clear sentence."""

from __future__ import annotations

import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from elftools.elf.elffile import ELFFile
from hypothesis import given
from hypothesis import strategies as st

from boebot.errors import AnalysisError, TimingError
from boebot_timing import budget
from boebot_timing.loads import LOADS
from boebot_timing.measured import Measurement, Spans, Worst
from boebot_timing.table import read_table
from boebot_timing.tests import timing_program

REFUSED = (AnalysisError, TimingError)
FIGURES = LOADS["figures"]
TASK = "__attribute__((noinline)) void first_task(void) { NOPS(100); }"
LONG_JUMP = "#include <setjmp.h>\nstatic jmp_buf env;"
POINTER = "static void one(void) { PORTB = 1; }\nvoid (*volatile pointer)(void) = one;"
RECURSION = "volatile int v;\n__attribute__((noinline)) static int f(int n) { return n <= 1 ? 1 : n * f(n - 1) + v; }"
PRINTED = "#include <stdio.h>\nstatic char text[9];\nvolatile int number;"
ROOTS = "#include <math.h>\nvolatile float root;"
GOTO = "static void *const places[] = {&&x, &&y}; goto *places[number]; x: PORTB = 1; return; y: PORTB = 2;"
NUMBER = "volatile unsigned char number;"
NO_BOUND = r"the loop at 0x[0-9A-F]{4} \(program\.c:\d+\) has no bound"


def program(folder: Path, head: str, body: str, **changes: str) -> Path:
    """The small program with another first task."""
    source = timing_program.text().replace(
        TASK, f"{head}\n__attribute__((noinline)) void first_task(void) {{ {body} }}"
    )
    for old, new in changes.items():
        source = source.replace(old, new)
    return timing_program.compiled(folder, source, "-gdwarf-2")


@pytest.mark.parametrize(
    ("head", "body", "words"),
    [
        (LONG_JUMP, "if (setjmp(env) == 0) { longjmp(env, 1); }", r"\(in setjmp.*\): where `ijmp` leads cannot be"),
        ("", "for (;;) {}", NO_BOUND),
        ("", '__asm__("jmp 0x7FFE");', r"\(program\.c:\d+\): leads out of the code, to 0x7FFE"),
        ("", '__asm__("sts 0x5E, r1");', r"\(program\.c:\d+\): `sts` writes the stack pointer"),
        ("", '__asm__("sts 0x1C, r1");', r"\(program\.c:\d+\): `sts` writes register r28"),
        ("ISR(TIMER0_OVF_vect) { PORTB++; }", "", r"uses interrupt 16 at 0x0040 .* expected an INTERRUPT row"),
        ("", "PORTB++;", r"where `icall` leads cannot be proven"),
    ],
    ids=[
        "setjmp",
        "endless",
        "wild jump",
        "writes SP",
        "writes a register",
        "interrupt not in the table",
        "interrupt by a pointer",
    ],
)
def test_refused_in_a_sentence(tmp_path: Path, head: str, body: str, words: str) -> None:
    changes = {}
    if "icall" in words:  # a row more, and its interrupt
        changes['ROW("SENSOR'] = 'ROW("INTERRUPT other 16 90 1000 40000");\nROW("SENSOR'
        head = POINTER + "\nISR(TIMER0_OVF_vect) { pointer(); }"
    with pytest.raises(REFUSED, match=words) as caught:
        budget.prove(program(tmp_path, head, body, **changes), FIGURES)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("head", "body", "words", "is_deep"),
    [
        (RECURSION, "v = f(v);", r"recursion at 0x[0-9A-F]{4} \(program\.c:\d+\): f calls itself", True),
        (POINTER, "pointer();", r"\(program\.c:\d+\): where `icall` leads cannot be proven", True),
        (NUMBER, GOTO, r"\(program\.c:\d+\): where `ijmp` leads cannot be proven", True),
        ("", "while (PINB != 0) {}", NO_BOUND, False),
        (PRINTED, 'sprintf(text, "%d", number);', r"0x[0-9A-F]{4} .*: where `icall` leads cannot be proven", True),
        ("", '__asm__("sleep");', r"first_task waits asleep at 0x[0-9A-F]{4} \(program\.c:\d+\)", False),
        (ROOTS, "root = sqrt(root);", r"the loop at 0x[0-9A-F]{4} .* has no bound", False),
    ],
    ids=["recursion", "pointer", "computed goto", "waits", "printf", "waits asleep", "square root"],
)
def test_task_without_a_bound_is_named_and_counts_with_its_budget(
    tmp_path: Path, head: str, body: str, words: str, is_deep: bool
) -> None:
    """Its budget is 150 cycles; of a stack that is not known what was measured counts, 33 bytes here."""
    image = program(tmp_path, head, body)
    report = budget.prove(image, FIGURES)
    (row,) = (row for row in report.rows if row.unbounded is not None)
    assert (row.name, row.bound, row.ratio) == ("first", 150, None) and re.search(words, row.unbounded or "")
    assert report.tick_work == 4 * 150 + 204 + 4 * report.costs.round and report.faults == []
    assert report.notes[0].endswith("its budget of 150 cycles counts, and nothing was measured")
    assert len(report.notes) == 1 + is_deep and report.memory.unknown == ("first",) * is_deep
    kept, broken = (budget.prove(image, FIGURES, ran(first, 0x8FF - 33)) for first in (150, 151))
    assert kept.faults == [] if is_deep else len(kept.faults) == 1  # else 33 bytes are more than the bound
    assert kept.memory.stack == (33 if is_deep else report.memory.stack)
    assert "task first took 151 cycles in the emulator, 1 above its budget of 150" in broken.faults


def ran(cycles: int, lowest_stack: int) -> Measurement:
    one = Spans(
        "first", np.array([cycles], dtype=np.uint32), np.array([cycles], dtype=np.uint32), Worst("figures", 1, 0)
    )
    return Measurement({"first": one}, {}, lowest_stack, 1.0, 0.1, scenarios=("figures",))


def test_stripped_image_is_refused(tmp_path: Path) -> None:
    image = timing_program.build(tmp_path)
    subprocess.run(["avr-strip", image], check=True)
    with pytest.raises(REFUSED, match="has no function main; expected an image with its symbols"):
        budget.prove(image, FIGURES)


MAIN = "    schedule_poll();\n"
ROW = '__asm__ volatile(".Lrow: .pushsection .boebot.loops,\\"\\",@progbits\\n .long .Lrow, 5, -1\\n .popsection");'


def test_pass_of_the_main_loop_counts_all_that_is_in_it(tmp_path: Path) -> None:
    def round_of(more: str) -> int:
        source = timing_program.text().replace(MAIN, MAIN + more)
        return budget.prove(timing_program.compiled(tmp_path, source, "-gdwarf-2"), FIGURES).costs.round

    plain = round_of("")
    assert round_of("NOPS(50);") == plain + 50
    five = round_of(f"while (PINB != 0) {{ {ROW} NOPS(50); }}")
    assert 5 * 50 + 5 * (1 + 1 + 2) <= five - plain <= 6 * (50 + 1 + 1 + 2)  # in, a test, a branch; once more the test
    assert round_of('while (PINB != 0) { __asm__ volatile("sleep"); }') < plain + 20  # waits for work
    with pytest.raises(REFUSED, match=NO_BOUND):
        round_of("while (PINB != 0) { NOPS(50); }")


def test_slots_of_another_length_are_refused(tmp_path: Path) -> None:
    source = timing_program.text().replace("1000 40000", "1000 20000")
    with pytest.raises(REFUSED, match="a slot has 20000 cycles; expected 40000, as its constants say"):
        budget.prove(timing_program.compiled(tmp_path, source), FIGURES)


def constants(old: str, new: str) -> str:
    """The small program with other CONSTANT rows."""
    text = timing_program.text()
    assert old in text
    return text.replace(old, new)


def test_slots_are_those_that_the_image_says(tmp_path: Path) -> None:
    """Twice as many of half the length; the second task, each fourth slot, then runs twice in a tick."""
    text = constants("CONSTANT slot_cycles 40000", "CONSTANT slot_cycles 20000").replace("1000 40000", "1000 20000")
    twice = timing_program.compiled(tmp_path, text.replace("slots_per_tick 4", "slots_per_tick 8"))
    found = budget.prove(twice, FIGURES)
    assert (found.schedule.slot_cycles, found.schedule.slots_per_tick, len(found.schedule.slots)) == (20_000, 8, 8)
    once = budget.prove(timing_program.build(tmp_path), FIGURES)
    assert found.tick_work - once.tick_work >= once.costs.tasks["second"] + 4 * once.costs.tasks["first"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "CONSTANT slot_cycles 40000",
            "CONSTANT slot_cycles 30000",
            "a tick is 4 slots of 30000 cycles; expected 160000",
        ),
        (
            'ROW("CONSTANT poll_bytes 17");',
            "",
            "constants of its timing table 'poll_bytes' is missing; expected slot_cycles",
        ),
        ("CONSTANT poll_bytes 17", "CONSTANT patience 64", "constants of its timing table 'poll_bytes' is missing"),
    ],
)
def test_constants_that_are_not_all_there_or_contradict_are_refused(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(REFUSED, match=words):
        budget.prove(timing_program.compiled(tmp_path, constants(old, new)), FIGURES)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("slot 12 40 1000 40000", "slot 12 40001 1000 40000", "row 'slot' .* budget of 40001 cycles .* due each 40000"),
        ("first 1 0 150", "first 1 0 40001", "row 'first' .* budget of 40001 cycles .* due each 40000"),
        ("second 4 1 300", "second 4 1 160001", "row 'second' .* budget of 160001 cycles .* due each 160000"),
        ("slot 12 40 1000", "first 12 40 1000", "its timing table has two rows of the name 'first'; expected one"),
        ("ping 18500 5 20000", "ping 18500 5 18499", "row 'ping' .* reading of 18500 us is at most 18499 us old"),
    ],
)
def test_table_that_promises_the_impossible_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(REFUSED, match=words):
        budget.prove(timing_program.compiled(tmp_path, constants(old, new)), FIGURES)


def test_image_without_constants_is_refused(tmp_path: Path) -> None:
    lines = [line for line in timing_program.text().splitlines() if "CONSTANT" not in line]
    image = timing_program.compiled(tmp_path, "\n".join(lines))
    with pytest.raises(REFUSED, match=r"program\.elf carries no constants; expected CONSTANT rows in its section"):
        budget.prove(image, FIGURES)


def test_row_of_an_interrupt_that_is_not_used_is_refused(tmp_path: Path) -> None:
    source = timing_program.text().replace("INTERRUPT slot 12", "INTERRUPT slot 13")
    with pytest.raises(REFUSED, match="row 'slot' of its timing table is of interrupt 13; expected one that is used"):
        budget.prove(timing_program.compiled(tmp_path, source), FIGURES)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, list[range]]:
    """Where mutants go, the image that they are of, and its parts: headers and the sections that are read."""
    folder = tmp_path_factory.mktemp("mutants")
    source = timing_program.text().replace(TASK, '#include "bounds.h"\n' + TASK.replace("NOPS(100);", LOOPS))
    image = timing_program.compiled(folder, source, "-gdwarf-2", f"-I{timing_program.FIRMWARE}")
    with image.open("rb") as stream:
        elf = ELFFile(stream)
        header = elf.header
        parts = [range(52)]
        parts.append(range(header["e_phoff"], header["e_phoff"] + header["e_phnum"] * header["e_phentsize"]))
        parts.append(range(header["e_shoff"], header["e_shoff"] + header["e_shnum"] * header["e_shentsize"]))
        for name in (".boebot.timing", ".boebot.loops", ".symtab", ".strtab", ".text", ".debug_line", ".debug_info"):
            section = elf.get_section_by_name(name)
            assert section is not None and section["sh_size"] > 0
            parts.append(range(section["sh_offset"], section["sh_offset"] + section["sh_size"]))
    return folder / "mutant.elf", image.read_bytes(), parts


LOOPS = "while (PINB != 0) { LOOP_BOUND(5); PORTB = 1; }"


@pytest.mark.hypothesis
@given(data=st.data())
def test_damaged_images_end_in_a_report_or_in_a_sentence(
    whole: tuple[Path, bytes, list[range]], data: st.DataObject
) -> None:
    path, image, parts = whole
    mutant = bytearray(image)
    part = data.draw(st.sampled_from(parts))
    for _ in range(data.draw(st.integers(1, 8))):
        mutant[data.draw(st.sampled_from(part))] = data.draw(st.integers(0, 255))
    path.write_bytes(mutant)
    begun = time.process_time()
    for judge in (lambda: read_table(path), lambda: budget.prove(path, FIGURES).as_dict()):
        sentence = ""
        try:
            judge()
        except REFUSED as error:  # anything else fails the test
            sentence = str(error)
        assert "\n" not in sentence
    assert time.process_time() - begun < 60
