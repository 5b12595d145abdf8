"""The emulated board against the data sheet, row by row; the command, the page and the way to a board on a port."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import re
import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.image.program import read_program
from sim_bridge.serve import serve
from tools.tests.calibration import __main__ as command
from tools.tests.calibration import board, emulator, table
from tools.tests.calibration.emulator import Measured
from tools.tests.calibration.program import ROWS, image, name
from tools.tests.calibration.talk import Talk, at_pin

pytestmark = pytest.mark.unsanitized

PAGE = Path(__file__).resolve().parents[4] / "docs" / "reference" / "calibration.md"

# The instruction set summary of the manual for AVRe+ with 128 KB at most, aliases left out where BRBS, BRBC, BSET and
# BCLR stand for them; SPM is not in use.
INSTRUCTIONS = """
ADD ADC ADIW SUB SUBI SBC SBCI SBIW AND ANDI OR ORI EOR COM NEG SBR CBR INC DEC TST CLR SER MUL MULS MULSU FMUL FMULS
FMULSU RJMP IJMP JMP RCALL ICALL CALL RET RETI CPSE CP CPC CPI SBRC SBRS SBIC SBIS BRBS BRBC MOV MOVW LDI LD LDD LDS ST
STD STS LPM IN OUT PUSH POP LSL LSR ROL ROR ASR SWAP SBI CBI BST BLD NOP SLEEP WDR BREAK
SEC CLC SEN CLN SEZ CLZ SEI CLI SES CLS SEV CLV SET CLT SEH CLH
"""


@cache
def measured() -> Measured:
    return emulator.measure()


@pytest.mark.parametrize("index", range(len(ROWS)), ids=[f"{row.group}: {row.what}" for row in ROWS])
def test_emulator_says_what_the_data_sheet_says(index: int) -> None:
    row, by_program, by_pin = ROWS[index], measured().by_program[index], measured().by_pin[index]
    right = table.is_right(row, by_program, by_pin)
    said = f"program {by_program}, pin {by_pin}; data sheet ({row.source}): {row.expected_text} {row.unit}"
    assert right != bool(row.difference), said


def test_every_time_is_measured_twice() -> None:
    for row, by_program, by_pin in zip(ROWS, measured().by_program, measured().by_pin, strict=True):
        assert by_program is not None
        assert by_pin == (None if row.is_number else by_program), row.what


def test_every_instruction_is_measured() -> None:
    rows = [row for row in ROWS if row.group == "Instructions"]
    named = {re.match(r"[A-Z]+|\(", row.what)[0]: row for row in rows}  # type: ignore[index]
    assert set(named) == {*INSTRUCTIONS.split(), "("}
    for mnemonic, row in named.items():
        between = row.code.partition("\nbegin\n")[2].partition("\nfinish\n")[0]
        assert mnemonic == "(" or between.upper().startswith(mnemonic), row.what


# ---- what is said when something differs ----


def changed(values: list[int | None], index: int, by: int) -> list[int | None]:
    """One value made wrong."""
    value = values[index]
    assert value is not None
    return [*values[:index], value + by, *values[index + 1 :]]


@pytest.mark.parametrize("way", ["by_program", "by_pin"])
@pytest.mark.parametrize("by", [-1, 1])
def test_one_cycle_more_or_less_is_wrong(way: str, by: int) -> None:
    for index, row in enumerate(ROWS):
        if isinstance(row.expected, tuple) or (row.is_number and way == "by_pin"):
            continue
        off = replace(measured(), **{way: changed(getattr(measured(), way), index, by)})
        wrong = table.wrong_rows(table.Calibration(off))
        assert wrong == [f"emulator: {row.group}: {row.what}"]
        assert table.cells(table.Calibration(off), index)[3].endswith(": wrong")


def test_a_known_difference_that_is_none_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = (replace(ROWS[0], difference="it is said to be slow"), *ROWS[1:])
    monkeypatch.setattr(table, "ROWS", rows)
    assert len(table.wrong_rows(table.Calibration(measured()))) == 1


def test_a_board_is_judged_where_it_can_be() -> None:
    real = list(measured().by_program)
    oscillator = next(index for index, row in enumerate(ROWS) if row.board_only_shown)
    assert table.wrong_rows(table.Calibration(measured(), board=changed(real, oscillator, 500))) == []
    result = table.Calibration(measured(), board=changed(real, 5, 1))
    assert table.wrong_rows(result) == [f"board: {ROWS[5].group}: {ROWS[5].what}"]
    assert table.cells(result, 5)[-1].endswith(": differs")


def test_another_program_is_refused() -> None:
    with pytest.raises(BoardError, match=r"'boebot calibration 00000000', another version.*flash it"):
        Talk().hear(b"\nboebot calibration 00000000\n")


def test_talk_cut_anywhere_is_understood_and_says_what_it_awaits() -> None:
    said = f"garbage\n=0002 0009\nend\n{name()}\nUUU\n=0000 0006\n>3\n\xff\n=0001 0007\n".encode("latin-1")
    for cut in range(len(said)):
        talk = Talk()
        assert talk.awaited == "the program's name"
        assert len(talk.hear(said[:cut]) + talk.hear(said[cut:])) == 3
        assert talk.values()[:3] == [0, 1, None]
        assert talk.awaited.startswith("row 2, Instructions: ADC")
    assert at_pin(talk, [0] * len(said), []) == [None] * len(ROWS)


# ---- page ----


def test_page_is_what_the_command_writes() -> None:
    """But for phases that the data sheet leaves open."""
    text = PAGE.read_text(encoding="utf-8")
    _, _, *found = [line[2:-2].split(" | ") for line in text.splitlines() if line.startswith("| ")]
    there = {row[0]: row for row in found}
    assert f"of {len(ROWS)} rows: emulator {len(ROWS)}." in text and len(there) == len(found)
    for index, row in enumerate(ROWS):
        if row.group == "Instructions" and row.what not in there:
            continue
        *expected, emulated = table.cells(table.Calibration(measured()), index)
        *said, ours = there.pop(row.what)
        assert said == expected
        assert ours == emulated or (isinstance(row.expected, tuple) and row.is_right(int(ours)))
    assert not there


# ---- a board on a port ----


@contextlib.contextmanager
def served(elf: Path) -> Iterator[str]:
    """The port of an emulated robot with that program, at the pace of the clock."""
    urls: queue.Queue[str] = queue.Queue()
    running = threading.Event()
    running.set()
    request = BoardRequest(robot=load_robot("shieldbot"), image=str(elf))
    server = threading.Thread(
        target=serve,
        args=("avr", request),
        kwargs={"tcp": None, "announce": urls.put, "visit": lambda _: None, "running": running.is_set},
    )
    server.start()
    try:
        yield urls.get(timeout=60)
    finally:
        running.clear()
        server.join(60)


@pytest.fixture
def avrdude(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where a stand-in for avrdude, found first, leaves its arguments and the program."""
    recorded = tmp_path / "recorded.json"
    tool = tmp_path / "bin" / "avrdude"
    tool.parent.mkdir()
    tool.write_text(
        "#!/usr/bin/env python3\nimport json, sys\n"
        "program = open(sys.argv[-1].split(':')[2], 'rb').read().hex()\n"
        f"json.dump([sys.argv[1:], program], open({str(recorded)!r}, 'w'))\n",
        encoding="utf-8",
    )
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tool.parent}{os.pathsep}{os.environ['PATH']}")
    return recorded


def test_board_on_a_port(tmp_path: Path, avrdude: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Flashing is replaced; the rest is real: a port, an emulated Shield-Bot behind it, its answers."""
    elf = tmp_path / "calibration.elf"
    elf.write_bytes(image())
    with served(elf) as port:
        assert command.main(["--port", port]) == 0
    arguments, program = json.loads(avrdude.read_text(encoding="utf-8"))
    assert arguments[:-1] == ["-p", "atmega328p", "-c", "arduino", "-b", "115200", "-P", port, "-D", "-U"]
    assert bytes.fromhex(program) == read_program(elf).flash.rstrip(b"\xff")
    shown = capsys.readouterr().out
    judged = sum(not row.board_only_shown for row in ROWS)
    assert f"board {judged} (of {judged} that are judged)" in shown and "Not as expected" not in shown


def test_port_that_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--port", "/dev/no-board", "--no-flash"]) == 2
    assert capsys.readouterr().err.startswith("calibration: ")


def test_board_that_says_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board, "GREETING_S", 0.2)
    master, slave = os.openpty()
    try:
        with pytest.raises(BoardError, match="does not talk; awaited: the program's name"):
            board.listen(os.ttyname(slave))
    finally:
        os.close(slave)
        os.close(master)


def test_avrdude_that_fails(tmp_path: Path, avrdude: Path) -> None:
    tool = tmp_path / "bin" / "avrdude"
    tool.write_text("#!/bin/sh\necho >&2; echo 'avrdude: no answer' >&2; exit 1\n", encoding="utf-8")
    with pytest.raises(BoardError, match=r"the board at /dev/robot does not answer; expected an Uno"):
        board.flash("/dev/robot")
