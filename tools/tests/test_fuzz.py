"""The fuzzers run for a while and find nothing; in a decoder without one of its checks they find that at once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools import fuzz

# What is taken from frame.c, what stands there then, and the assertion that the fuzzer breaks.
PROTECTIONS = {
    "checksum": ("memcmp(check, &decoder->bytes[size], CHECK_BYTES) == 0", "true", r"memcmp\(again \+ 1"),
    "length": ("frame_accepted_length(id) != (int16_t)(size - 3)", "frame_accepted_length(id) < 0", "came->count =="),
    "stuffing": ("&& unstuff(decoder->bytes, size)", "&& (unstuff(decoder->bytes, size), true)", r"memcmp\(again \+ 1"),
    "delimiter": (
        "  decoder->count = 0;\n",
        "  decoder->count = accepted ? 0 : decoder->count;\n",
        "accepted == 1|pieces",
    ),
}


@pytest.mark.parametrize("name", fuzz.FUZZERS)
def test_fuzzer_finds_nothing(name: str, tmp_path: Path) -> None:
    done = fuzz.run(fuzz.build(name, tmp_path), tmp_path, ["-seed=1", "-max_total_time=4"])
    assert done.returncode == 0, done.stderr[-4000:]
    runs = re.search(r"Done (\d+) runs", done.stderr)
    assert runs and int(runs[1]) > 1000, "it has tried something"


@pytest.mark.parametrize("protection", PROTECTIONS)
def test_fuzzer_finds_a_missing_check(protection: str, tmp_path: Path) -> None:
    before, after, broken = PROTECTIONS[protection]
    text = fuzz.FRAME.read_text(encoding="utf-8")
    assert text.count(before) == 1, "frame.c holds what the test takes away"
    mutant = tmp_path / "frame.c"
    mutant.write_text(text.replace(before, after), encoding="utf-8")
    done = fuzz.run(fuzz.build("frame-board", tmp_path, mutant), tmp_path, ["-seed=1", "-runs=300000"])
    assert done.returncode != 0, "the fuzzer did not miss the check"
    assert re.search(broken, done.stderr), done.stderr[-2000:]
