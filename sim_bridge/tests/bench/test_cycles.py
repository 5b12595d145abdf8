"""Cycles of functions: programs whose calls take what the instruction set manual says, instruction by instruction; the
list of all spans as the witness; bounds beside them; a baseline's file."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import MappingProxyType

import pytest

from boebot.errors import AnalysisError, BoardError, CallError
from boebot.guests import BOUNDS
from sim_bridge.bench import cycles
from sim_bridge.bench.cycles import Baseline, Cycles, FunctionCycles, table_of
from sim_bridge.boards.avr import FUNCTION_IDS, Watch, create
from sim_bridge.boards.board import Level, ResetCause
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import assemble, compiled
from sim_bridge.tests.boards.symbols import entry_of

RETURN, CALL = 4, 4
# work: 1 (cpi) + either 2 (breq taken) or 1 + 5 (not taken, five nops) + 4 (ret); it alternates, the short one first.
SHORT, LONG = 1 + 2 + RETURN, 1 + 1 + 5 + RETURN
PROGRAM = """
  work: cpi r24, 1
    breq 1f
    .rept 5
    nop
    .endr
  1: ret
  outer: ldi r24, 1
    call work
    ldi r24, 2
    call work
    ret
  unused: ret
  .global __vector_16
  __vector_16: reti
  main: ldi r24, 1
    out TCCR0B, r24
    sts TIMSK0, r24
    sei
  2: call outer
    rjmp 2b
"""
KEPT = "expected one that the compiler keeps whole and apart: __attribute__((noinline))"
C_PROGRAM = """
#include <avr/io.h>
#include <stdint.h>
volatile uint8_t got;
__attribute__((noinline)) static uint8_t scale(uint8_t by) {
  if (by > 9) {
    __asm__ volatile("nop\\n nop\\n nop\\n nop");
    return got;
  }
  return 0;
}
__attribute__((noinline)) static void wait_for_pin(void) { while (!(PINB & 1)) {} }
int main(void) {
  for (uint8_t by = 0; by < 20; by++) got = scale(by);
  wait_for_pin();
  for (;;) {}
}
"""


def image_of(folder: Path, source: str) -> Path:
    image = folder / "own.elf"
    image.write_bytes(assemble(source))
    return image


def test_the_shortest_and_the_longest_call_whatever_interrupts_them(tmp_path: Path) -> None:
    image = image_of(tmp_path, PROGRAM)
    board = create(image)
    seen = Cycles(board, image, ("work", "outer", "unused"))
    BoardAccess(board).run(100_000)
    work, outer = seen["work"], seen["outer"]
    assert (work.shortest, work.longest) == (SHORT, LONG)
    assert outer.shortest == outer.longest == 1 + CALL + SHORT + 1 + CALL + LONG + RETURN
    assert work.calls in (2 * outer.calls, 2 * outer.calls + 1)
    assert work.longest_at - work.shortest_at == SHORT + 1 + CALL  # no interrupt yet
    assert board.handle.op.now(board.handle) > 256 * 20  # but since
    assert [one.calls > 0 for one in seen.seen()] == [True, True, False]
    assert re.search(r"^unused +0 +- +- +- ", table_of({"test": seen.seen()}), re.MULTILINE)
    with pytest.raises(BoardError, match=r"no call of unused has ended by 0.00625\d s; expected one"):
        seen["unused"]
    with pytest.raises(CallError, match=r"cycles of main are not recorded; expected cycles=\('main',\) in the mark"):
        seen["main"]


def test_extremes_are_those_of_all_spans(tmp_path: Path) -> None:
    image, names = image_of(tmp_path, PROGRAM), ("work", "outer", "__vector_16")
    entries = [entry_of(image, name) for name in names]
    listed, kept = create(image), create(image)
    listed.record(Watch(entries))
    kept.record(Watch(entries, only_extremes=True))
    for board in (listed, kept):
        access = BoardAccess(board)
        access.run(40_000)
        access.reset(ResetCause.EXTERNAL)
        access.run(40_000)
    spans, extremes = listed.spans(), kept.extremes()
    assert len(kept.spans()) == 0
    for number, found in enumerate(extremes):
        own = spans[spans["id"] == FUNCTION_IDS + number]
        shortest, longest = own[own["net"].argmin()], own[own["net"].argmax()]
        assert found["calls"] == len(own) > 100
        assert (found["shortest"], found["shortest_at"]) == (shortest["net"], shortest["begin"])
        assert (found["longest"], found["longest_at"]) == (longest["net"], longest["begin"])


def test_a_bound_stands_beside_what_was_seen_where_there_is_one(tmp_path: Path) -> None:
    image = compiled(C_PROGRAM, tmp_path / "own.elf")
    board = create(image)
    seen = Cycles(board, image, ("scale", "wait_for_pin"))
    access = BoardAccess(board)
    access.run(2_000)
    access.drive(8, Level.HIGH)
    access.run(2_000)
    scale, waits = seen.seen()
    assert scale.bound == scale.longest > scale.shortest
    assert waits.bound is None and "has no bound" in waits.why and "own.c:12" in waits.why
    lines = table_of({"test_own.py::test": [scale, waits]}).splitlines()
    assert lines[0].split() == ["function", "calls", "shortest", "longest", "bound", "test"]
    assert lines[1].split() == [
        "scale",
        "20",
        *map(str, (scale.shortest, scale.longest, scale.bound)),
        "test_own.py::test",
    ]
    assert lines[2].split()[-2:] == ["-", "test_own.py::test"]


def test_where_nothing_is_installed_that_bounds_there_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cycles, "guests", {BOUNDS: MappingProxyType({})}.__getitem__)
    image = image_of(tmp_path, PROGRAM)
    board = create(image)
    seen = Cycles(board, image, ("work",))
    BoardAccess(board).run(1000)
    assert seen["work"].bound is None and seen["work"].why == "no package is installed that works bounds out"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("wrok", f"has no function wrok; {KEPT}; did you mean 'work'"),
        ("split", f"has split as split.part.0; {KEPT}"),
        ("twice", f"has twice as twice, twice; {KEPT}"),
        ("over", f"has over as _Z4overi, _Z4overv; {KEPT}"),
        ("copied", f"has copied as copied, copied.constprop.1; {KEPT}"),
    ],
)
def test_functions_that_cannot_be_measured(tmp_path: Path, name: str, words: str) -> None:
    source = """
    .type split.part.0, @function
    split.part.0: ret
    work: ret
    copied: ret
    copied.constprop.1: ret
    _Z4overi: ret
    _Z4overv: ret
    main: rjmp main
    """
    image = image_of(tmp_path, source)
    if name == "twice":
        two = 'static __attribute__((noinline)) void twice(void) { __asm__ volatile(""); } void %s(void) { twice(); }'
        (tmp_path / "two.c").write_text(two % "other", encoding="ascii")
        text = two % "own" + "void other(void); int main(void) { own(); other(); }"
        image = compiled(text, tmp_path / "own.elf", str(tmp_path / "two.c"))
    with pytest.raises(CallError, match=re.escape(words)):
        Cycles(create(image), image, (name,))


def test_names_as_compilers_change_them(tmp_path: Path) -> None:
    source = """
    _Z5pulsei: nop
      ret
    _ZN5Servo5writeEi: ret
    scale.constprop.1: nop
      nop
      ret
    main: rcall _Z5pulsei
      rcall _ZN5Servo5writeEi
      rcall scale.constprop.1
    1: rjmp 1b
    """
    image = image_of(tmp_path, source)
    board = create(image)
    seen = Cycles(board, image, ("pulse", "Servo::write", "scale"))
    BoardAccess(board).run(200)
    assert {each.name: each.longest for each in seen.seen()} == {
        "pulse": 1 + RETURN,
        "Servo::write": RETURN,
        "scale": 2 + RETURN,
    }


def test_a_hex_file_has_no_functions(tmp_path: Path) -> None:
    image = image_of(tmp_path, PROGRAM)
    (tmp_path / "own.hex").write_text(":00000001FF\n", encoding="ascii")
    with pytest.raises(AnalysisError, match=r"own\.hex is not an ELF file"):
        Cycles(create(image), tmp_path / "own.hex", ("work",))


def took(**functions: tuple[int, int]) -> list[FunctionCycles]:
    """Shortest and longest call of some functions, as they were seen, and one that was not called."""
    found = [FunctionCycles(name, 2, *spans, 0, 0, None, "") for name, spans in functions.items()]
    return [*found, FunctionCycles("unused", 0, 0, 0, 0, 0, None, "")]


def test_a_baseline_names_each_change(tmp_path: Path) -> None:
    path, test = tmp_path / "cycles.json", "test_own.py::test_servo[1700]"
    written = Baseline(path, updates=True)
    written.put(test, took(work=(7, 11), outer=(32, 32)))
    written.put("test_own.py::test_other", took(work=(7, 7)))
    assert written.functions(test) == [] and written.changes(test, took(work=(8, 9))) == []
    written.write()
    assert json.loads(path.read_text(encoding="utf-8"))["cycles"][test] == {"outer": [32, 32], "work": [7, 11]}
    baseline = Baseline(path)
    assert baseline.functions(test) == ["outer", "work"] and baseline.functions("test_new") == []
    assert baseline.changes(test, took(work=(7, 11), outer=(32, 32))) == []
    assert baseline.changes(test, took(work=(7, 12), new=(1200, 1200))) == [
        f"new took 1,200 cycles, and is not in {path}",
        f"no call of outer has ended; in {path} it took 32 cycles",
        f"work took 7 to 12 cycles; in {path} 7 to 11 cycles",
    ]
    baseline.put(test, took(work=(7, 12)))
    baseline.write()
    assert Baseline(path).changes(test, took(work=(7, 12))) == []
    assert Baseline(path).functions("test_own.py::test_other") == ["work"]


@pytest.mark.parametrize(
    "text", [None, "", "[]", '{"cycles": {"t": {"f": [1]}}}', '{"cycles": {"t": {"f": ["a", 2]}}}', "{"]
)
def test_a_file_that_is_no_baseline_is_one_sentence(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "cycles.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(
        CallError, match=r"cycles\.json is no baseline of cycles: .*; expected a file as an update writes it"
    ):
        Baseline(path)
