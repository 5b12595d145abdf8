"""The fuzzers run for a while and find nothing; in code without one of its checks, the fuzzer finds that."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from tools.tests import fuzz
from tools.tests.error_rates.library import ABLATIONS
from tools.tests.planted import changed_text

pytestmark = pytest.mark.soak  # they take long to compile


class Fault(NamedTuple):
    """What a fuzzer finds.

    Attributes:
        fuzzer: which one.
        source: file that has the fault.
        changes: texts of the file and what replaces them.
        runs: within how many.
        broken: pattern of the assertion that breaks.
    """

    fuzzer: str
    source: Path
    changes: dict[str, str]
    runs: int
    broken: str


def without(protection: str, broken: str) -> Fault:
    """A frame's decoder without one of its protections."""
    return Fault("frame-board", fuzz.FRAME, ABLATIONS[protection], 300_000, broken)


FAULTS = {
    "checksum": without("checksum", r"memcmp\(again \+ 1"),
    "exact length": without("exact length", r"came->count =="),
    "stuffing": without("stuffing", r"memcmp\(again \+ 1"),
    "delimiter": without("delimiter", r"decoder->good \+ decoder->bad|accepted == 1|came->count ==|memcmp"),
    "latch": Fault(
        "link",
        fuzz.FIRMWARE / "safety.c",
        {"own.latch != LATCH_NONE || time_to_live": "time_to_live"},
        2_000,
        r"armed \|\| pulses\(bench\) == 0",
    ),
    "second word decoded anew": Fault(
        "core",
        fuzz.CORE / "avr_decode.c",
        {"if (address >= 2u) address -= 2u;": ""},
        20_000,
        r"memcmp\(again\.code, core->code",
    ),
}


@pytest.mark.parametrize("name", fuzz.FUZZERS)
def test_fuzzer_finds_nothing(name: str, tmp_path: Path) -> None:
    done = fuzz.run(fuzz.build(name, tmp_path), tmp_path, ["-seed=1", "-max_total_time=2"])
    assert done.returncode == 0, done.stderr[-4000:]
    runs = re.search(r"Done (\d+) runs", done.stderr)
    assert runs and int(runs[1]) > len(fuzz.FUZZERS[name].seeds), "it has tried something"


@pytest.mark.parametrize("missing", FAULTS)
def test_fuzzer_finds_what_is_missing(missing: str, tmp_path: Path) -> None:
    fault = FAULTS[missing]
    mutant = tmp_path / fault.source.name
    mutant.write_text(changed_text(fault.source, fault.changes), encoding="utf-8")
    program = fuzz.build(fault.fuzzer, tmp_path, {fault.source: mutant})
    done = fuzz.run(program, tmp_path, ["-seed=1", f"-runs={fault.runs}"])
    assert done.returncode != 0, "the fuzzer did not find it"
    assert re.search(fault.broken, done.stderr), done.stderr[-2000:]
