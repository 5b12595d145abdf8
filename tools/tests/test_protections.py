"""Each protection of the firmware is tested: without it a unit test fails. `make soak` compiles and runs that; `make
test` looks whether each protection is where its row says.

A row names the protection, the file that holds it, the text that is it, what stands there without it, and the file of
firmware/test/test_units that must notice. The checks of a frame are left out in test_fuzz.py and test_error_rates.py.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import pytest

from tools.tests.fuzz import FIRMWARE, TEST, firmware_sources
from tools.tests.planted import changed_text

# As the environment `native` of platformio.ini, without warnings: without a protection some names are not used.
FLAGS = ("-DPIN_MAP_SHIELDBOT", "-w", f"-I{FIRMWARE}", f"-I{TEST}")
C = ("gcc", "-std=gnu11", "-O1")
DOCTEST = ("-isystem", "/usr/include/doctest", "-isystem", "/usr/local/include/doctest")
CPP = ("g++", "-std=gnu++17", "-O0", *DOCTEST)  # the suites take longer to optimise than to run


class Row(NamedTuple):
    """A protection and how to take it away.

    Attributes:
        protection: what it is.
        file: in firmware/src.
        text: stands there exactly once.
        instead: takes its place.
        suite: of firmware/test/test_units; its assertions fail then.
    """

    protection: str
    file: str
    text: str
    instead: str
    suite: str


ROWS = (
    Row("a set-point's age by its tick", "safety.c", "age >= life || ", "", "safety"),
    Row("order of set-points", "safety.c", "|| has_newer(answers_tick, sequence) ", "", "safety"),
    Row(
        "set-points from before arming",
        "safety.c",
        "own.ticks_are_over && (int16_t)(answers_tick",
        "false && (0",
        "safety",
    ),
    Row("copies from before a dead-man stop", "safety.c", "  end_ticks(own.last_tick);\n", "", "safety"),
    Row("latch", "safety.c", "own.latch != LATCH_NONE || ", "", "safety"),
    Row("longest time to live", "safety.c", "time_to_live > SAFETY_TIME_TO_LIVE_MAX", "false", "safety"),
    Row("arm names the latch that it ends", "safety.c", "known_latches != own.latches", "false", "safety"),
    Row("dead-man", "safety.c", "(int32_t)(clock_time() - own.deadline) >= 0", "false", "safety"),
    Row("no arming below the supply's minimum", "safety.c", "if (supply_low() || ", "if (", "safety"),
    Row(
        "no arming before the supply is measured",
        "safety.c",
        "if (supply_low() || supply_voltage() == 0",
        "if (supply_low()",
        "safety",
    ),
    Row(
        "no fallback before the supply is measured",
        "safety.c",
        "|| supply_voltage() == 0) {\n    return false",
        ") {\n    return false",
        "fallback",
    ),
    Row("no fallback after a stop", "safety.c", "own.fallback_allowed = false;\n  stop_all", "stop_all", "fallback"),
    Row("no fallback while a host speaks", "fallback.c", "silence = 0;\n  if (drives)", "if (0)", "fallback"),
    Row("a low supply latches", "safety.c", "if (supply_low()) {", "if (false) {", "safety"),
    Row("one low measurement is not low", "supply.c", "below && was_below", "below", "supply"),
    Row("range of set-points", "link/dispatch.c", "beyond(message.left, most) ||", "", "safety"),
    Row("stop latches", "link/dispatch.c", "safety_latch(LATCH_STOP_COMMAND);", "", "safety"),
    Row("closing latches", "link/session.c", "safety_latch(LATCH_SESSION_ENDED);\n  begin", "begin", "session"),
    Row("a new opening latches", "link/session.c", "safety_latch(LATCH_SESSION_ENDED);\n    begin", "begin", "session"),
    Row("the silence of a host latches", "link/session.c", "safety_host_lost();", "", "safety"),
    Row(
        "open names the board's nonce",
        "link/session.c",
        "message->board_nonce != session_board_nonce()",
        "false",
        "session",
    ),
    Row("open names the version", "link/session.c", "PROTOCOL_MAJOR(message->protocol_version) !=", "0 &&", "session"),
    Row("time-out of the session", "link/session.c", "parameters_u16(PARAMETER_SESSION_TIME_OUT)", "~0ul", "session"),
    Row("the handshake keeps no session open", "link/link.c", "!message_is_handshake(id)", "true", "session"),
    Row("close names its session", "link/session.c", "of != session_seed()", "false", "session"),
    Row(
        "no frame but the handshake's without a session",
        "link/receive.c",
        "&receive_decoder, seed)",
        "&receive_decoder, seed & 0x1FFFFF)",
        "session",
    ),
    Row("describe names the board's nonce", "link/dispatch.c", "message.board_nonce != session_", "0 && ", "session"),
    Row("a copy of a request is not a new one", "link/requests.c", "number == answer.number", "false", "requests"),
    Row("order of requests", "link/requests.c", "(uint16_t)(answer.number + 1u)", "number", "requests"),
    Row("no new parameters during a save", "link/requests.c", "if (must_wait(id))", "if (false)", "requests"),
    Row(
        "an event is sent again",
        "link/event_delivery.c",
        "wait = retry_time();",
        "wait = UINT16_MAX;",
        "event_delivery",
    ),
    Row("acknowledgements name the event", "link/event_delivery.c", "arrived != number", "false", "event_delivery"),
    Row("touches of an earlier session", "link/session.c", "events_forget_touches();", "", "event_delivery"),
    Row("an event that finds the queue full is sent later", "events.c", "deferred++;", "return;", "events"),
    Row("touches that were merged", "events.c", "waits[what->kind] && what->kind", "false && 0", "events"),
    Row("what is left of a cut frame", "link/receive.c", "  frame_decoder_cut(&receive_decoder);\n", "", "link"),
    Row("bytes that found no room are counted", "link/receive.c", "  counters_lose_bytes();\n", "", "link"),
    Row("a storm masks its line", "pin_changes.c", " || row == STORM", "", "pin_changes"),
    Row("a full ring masks its line", "pin_changes.c", "is_full || row", "row", "pin_changes"),
    Row("pulses too short to be seen", "pin_changes.c", "unseen > UNSEEN_MAX", "false", "pin_changes"),
    Row("cells of the EEPROM are read back", "storage.c", "own.is_writing && !reads_back()", "false", "storage"),
    Row("the mark is void during a write", "storage.c", "= MARK_VOID;", "= MARK_VALID;", "storage"),
    Row("a record's checksum", "storage.c", "&& crc == expected", "", "storage"),
    Row(
        "range of a loaded parameter",
        "parameters.c",
        "!is_allowed(parameter, kept[parameter], range_of(parameter))",
        "0",
        "storage",
    ),
    Row("no save while the supply is low", "storage.c", "supply_low()) {\n    return", "0) {\n    return", "storage"),
    Row("no cell while the supply is low", "storage.c", "supply_low()) {\n    give", "0) {\n    give", "storage"),
    Row("a start counts after 10 s", "storage.c", "own.run_slots == RUN_SLOTS && ", "", "storage"),
)
SUITES = tuple(sorted({row.suite for row in ROWS}))


def without(row: Row) -> str:
    """The text of the row's file without its protection."""
    return changed_text(FIRMWARE / row.file, {row.text: row.instead})


class Workshop:
    """Compiles what is unchanged once, then suites with one file of the firmware changed."""

    def __init__(self, folder: Path, pool: ThreadPoolExecutor) -> None:
        """Begins to compile everything into the folder."""
        self.folder = folder
        sources = (TEST / "main.cpp", TEST / "host_frame.c", *firmware_sources())
        suites = {name: TEST / "test_units" / f"{name}.cpp" for name in SUITES}
        self.objects = {path: pool.submit(self.compiled, path, f"{number}") for number, path in enumerate(sources)}
        self.suites = {name: pool.submit(self.compiled, path, f"suite-{name}") for name, path in suites.items()}

    def compiled(self, source: Path, name: str) -> str:
        """The object file of a source."""
        made = self.folder / f"{name}.o"
        compiler = CPP if source.suffix == ".cpp" else C
        subprocess.run([*compiler, *FLAGS, "-c", str(source), "-o", str(made)], check=True)
        return str(made)

    def run(self, suite: str, name: str, changed: Mapping[Path, str]) -> subprocess.CompletedProcess[str]:
        """Runs a suite with other texts in the places of sources, up to the first assertion that fails."""
        objects = {source: done.result() for source, done in self.objects.items()}
        for source, text in changed.items():
            mutant = self.folder / f"{name}.c"
            mutant.write_text(text, encoding="utf-8")
            objects[source] = self.compiled(mutant, name)
        program = self.folder / f"program-{name}"
        parts = [*objects.values(), self.suites[suite].result()]
        subprocess.run(["g++", *parts, "-o", str(program)], check=True)
        command = [str(program), "--abort-after=1", "--no-colors=true"]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


Outcomes = Mapping[str, Future[subprocess.CompletedProcess[str]]]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Outcomes]:
    """Runs under way, two at a time or more: one for each row, and for each suite one with nothing changed."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        workshop = Workshop(tmp_path_factory.mktemp("protections"), pool)

        def of_row(number: int, row: Row) -> subprocess.CompletedProcess[str]:
            return workshop.run(row.suite, f"mutant-{number}", {FIRMWARE / row.file: without(row)})

        runs = {suite: pool.submit(workshop.run, suite, suite, {}) for suite in SUITES}
        runs |= {row.protection: pool.submit(of_row, number, row) for number, row in enumerate(ROWS)}
        yield runs


@pytest.mark.parametrize("row", ROWS, ids=[row.protection for row in ROWS])
def test_protection_is_where_its_row_says(row: Row) -> None:
    assert without(row)
    assert (TEST / "test_units" / f"{row.suite}.cpp").is_file()


@pytest.mark.soak
@pytest.mark.parametrize("suite", SUITES)
def test_suite_passes_with_every_protection(suite: str, outcomes: Outcomes) -> None:
    done = outcomes[suite].result()
    assert done.returncode == 0, done.stdout[-4000:]


@pytest.mark.soak
@pytest.mark.parametrize("row", ROWS, ids=[row.protection for row in ROWS])
def test_suite_fails_without(row: Row, outcomes: Outcomes) -> None:
    done = outcomes[row.protection].result()
    assert done.returncode == 1, f"it ended with {done.returncode}, not by a failed assertion\n{done.stdout[-2000:]}"
    failed = re.search(r"assertions: .*\| +(\d+) failed", done.stdout)
    assert failed and int(failed[1]) == 1, done.stdout[-2000:]
