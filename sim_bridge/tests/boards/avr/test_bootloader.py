"""The boot loader speaks and treats a program as Debian's Optiboot does, in the same 512 bytes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from boebot.errors import BoardError
from boebot.image.program import read_program
from boebot_hil.rig import CYCLES_PER_S
from sim_bridge.boards import avr
from sim_bridge.boards.board import Level, ResetCause
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import assemble
from sim_bridge.tests.boards.avr.bootloader import BEGIN, KITS, optiboot

pytestmark = pytest.mark.unsanitized

PAGE = 128
PIN = 2
LAST_PAGE = BEGIN - PAGE  # of a program
IN_SYNC, OK, END = 0x14, 0x10, b"\x20"
# the program that is written: it sets a pin
PROGRAM = bytes.fromhex("529a 5a9a ffcf").ljust(PAGE, b"\xff")  # sbi DDRD, 2; sbi PORTD, 2; rjmp .-2
LOADERS: dict[str, Callable[[Path], Path]] = {"the kit's": lambda _: KITS, "Optiboot": optiboot}


def board_with(loader: Path) -> BoardAccess:
    """A board that was reset from outside, with nothing in flash but the boot loader; the outside at its rate."""
    board = BoardAccess(avr.create(None, loader))
    board.run(1000)
    board.reset(ResetCause.EXTERNAL)
    board.line_rate(115_200)
    board.run(CYCLES_PER_S // 2)  # Optiboot's light goes on and off first
    return board


def ask(board: BoardAccess, command: bytes) -> bytes:
    """The answer to a command of STK500, without the bytes that frame it."""
    board.send(command + END)
    answer = b""
    for _ in range(40):
        board.run(CYCLES_PER_S // 100)
        answer += board.received()[0]
        if len(answer) > 1 and answer[-1] == OK and not board.received()[0]:
            break
    assert (answer[0], answer[-1]) == (IN_SYNC, OK), (command, answer)
    return answer[1:-1]


def load(board: BoardAccess, address: int) -> None:
    assert ask(board, b"\x55" + (address // 2).to_bytes(2, "little")) == b""


def write(board: BoardAccess, address: int, data: bytes) -> None:
    load(board, address)
    assert ask(board, b"\x64" + len(data).to_bytes(2, "big") + b"F" + data) == b""


def read(board: BoardAccess, address: int) -> bytes:
    load(board, address)
    return ask(board, b"\x74" + PAGE.to_bytes(2, "big") + b"F")


def high_after_s(board: BoardAccess, longest_s: float) -> float | None:
    """Until the program has set its pin; None: it has not."""
    begin = board.now
    while board.now - begin < longest_s * CYCLES_PER_S:
        if board.output(PIN) == Level.HIGH:
            return (board.now - begin) / CYCLES_PER_S
        board.run(CYCLES_PER_S // 1000)
    return None


@pytest.mark.parametrize("name", LOADERS)
def test_it_answers_as_optiboot_does(name: str, tmp_path: Path) -> None:
    """What avrdude asks of it, in its order, and the most that a program fills."""
    board = board_with(LOADERS[name](tmp_path))
    counting = bytes(range(PAGE))
    said = [ask(board, command) for command in (b"0", b"0", b"A\x80", b"B" + bytes(20), b"E" + bytes(5), b"P")]
    assert said == [b"", b"", b"\x03" if name == "Optiboot" else b"\x04", b"", b"", b""]
    assert ask(board, b"u") == bytes.fromhex("1e950f")
    assert ask(board, b"V\xa0\x03\xfc\x00") == b"\x00"
    for address, data in ((0, PROGRAM), (PAGE, counting), (LAST_PAGE, counting[::-1])):
        write(board, address, data)
    for address, data in ((0, PROGRAM), (PAGE, counting), (2 * PAGE, b"\xff" * PAGE), (LAST_PAGE, counting[::-1])):
        assert read(board, address) == data
    assert ask(board, b"Q") == b""
    started_s = high_after_s(board, 0.1)
    assert started_s is not None and started_s < 0.03, "the watchdog's 16 ms"


@pytest.mark.parametrize("name", LOADERS)
@pytest.mark.parametrize(
    ("cause", "least_s", "most_s"),
    [(ResetCause.POWER, 0.0, 0.005), (ResetCause.WATCHDOG, 0.0, 0.005), (ResetCause.EXTERNAL, 0.9, 1.5)],
)
def test_only_an_external_reset_waits_for_a_program(
    name: str, cause: ResetCause, least_s: float, most_s: float, tmp_path: Path
) -> None:
    image = tmp_path / "program.elf"
    image.write_bytes(assemble("main: sbi DDRD, 2\n sbi PORTD, 2\n1: rjmp 1b"))
    board = BoardAccess(avr.create(image, LOADERS[name](tmp_path)))
    board.run(CYCLES_PER_S // 100)
    board.reset(cause)
    board.run(100)
    started_s = high_after_s(board, 2.0)
    assert started_s is not None and least_s <= started_s <= most_s


def test_it_does_not_write_itself() -> None:
    """As the Uno's lock bits have it."""
    board = board_with(KITS)
    before = read(board, BEGIN)
    assert before == read_program(KITS).flash[BEGIN : BEGIN + PAGE]
    write(board, BEGIN, bytes(PAGE))
    assert read(board, BEGIN) == before


def test_what_is_out_of_step_or_at_another_rate_does_not_keep_it(tmp_path: Path) -> None:
    for rate in (9600, 115_200):
        board = board_with(KITS)
        write(board, 0, PROGRAM)
        board.line_rate(rate)
        for _ in range(20):
            board.send(b"hello, program\n")
            board.run(CYCLES_PER_S // 10)
        assert board.output(PIN) == Level.HIGH


def test_a_program_that_reaches_into_its_section_is_refused(tmp_path: Path) -> None:
    image = tmp_path / "large.elf"
    image.write_bytes(assemble(f"main: rjmp main\n .org {BEGIN - 2}\n .word 1, 2"))
    with pytest.raises(BoardError, match=r"program fills 32\d{3} bytes of flash; expected 32256 at most"):
        avr.create(image, KITS)
    with pytest.raises(BoardError, match=r"large\.elf is no boot loader: it begins at 0x0000; expected 0x7000"):
        avr.create(None, image)
