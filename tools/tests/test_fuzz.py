"""The fuzzers run for a while and find nothing; in a decoder without one of its checks, the fuzzer finds that."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools.tests import fuzz
from tools.tests.error_rates.library import frame_source

pytestmark = pytest.mark.soak  # they take long to compile

# The protection left out of frame.c, and the assertion that the fuzzer then breaks.
MISSED = {
    "checksum": r"memcmp\(again \+ 1",
    "exact length": r"came->count ==",
    "stuffing": r"memcmp\(again \+ 1",
    "delimiter": r"decoder->good \+ decoder->bad|accepted == 1|came->count ==|memcmp",
}


@pytest.mark.parametrize("name", fuzz.FUZZERS)
def test_fuzzer_finds_nothing(name: str, tmp_path: Path) -> None:
    done = fuzz.run(fuzz.build(name, tmp_path), tmp_path, ["-seed=1", "-max_total_time=2"])
    assert done.returncode == 0, done.stderr[-4000:]
    runs = re.search(r"Done (\d+) runs", done.stderr)
    assert runs and int(runs[1]) > len(fuzz.FUZZERS[name].seeds), "it has tried something"


@pytest.mark.parametrize("protection", MISSED)
def test_fuzzer_finds_a_missing_check(protection: str, tmp_path: Path) -> None:
    mutant = tmp_path / "frame.c"
    mutant.write_text(frame_source(protection), encoding="utf-8")
    done = fuzz.run(fuzz.build("frame-board", tmp_path, {fuzz.FRAME: mutant}), tmp_path, ["-seed=1", "-runs=300000"])
    assert done.returncode != 0, "the fuzzer did not find it"
    assert re.search(MISSED[protection], done.stderr), done.stderr[-2000:]


def test_fuzzer_of_the_link_finds_a_missing_latch(tmp_path: Path) -> None:
    source, check = fuzz.FIRMWARE / "safety.c", "own.latch != LATCH_NONE || time_to_live"
    text = source.read_text(encoding="utf-8")
    assert text.count(check) == 1
    mutant = tmp_path / "safety.c"
    mutant.write_text(text.replace(check, "time_to_live"), encoding="utf-8")
    done = fuzz.run(fuzz.build("link", tmp_path, {source: mutant}), tmp_path, ["-seed=1", "-runs=2000"])
    assert done.returncode != 0
    assert "armed || pulses(bench) == 0" in done.stderr, done.stderr[-2000:]


def test_fuzzer_of_the_core_finds_an_instruction_that_is_not_decoded_anew(tmp_path: Path) -> None:
    source, line = fuzz.CORE / "avr_decode.c", "if (address >= 2u) address -= 2u;"
    text = source.read_text(encoding="utf-8")
    assert text.count(line) == 1
    mutant = tmp_path / "avr_decode.c"
    mutant.write_text(text.replace(line, ""), encoding="utf-8")
    done = fuzz.run(fuzz.build("core", tmp_path, {source: mutant}), tmp_path, ["-seed=1", "-runs=20000"])
    assert done.returncode != 0
    assert "memcmp(again.code, core->code" in done.stderr, done.stderr[-2000:]
