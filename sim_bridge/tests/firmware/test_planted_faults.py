"""Faults planted in the very image: what the robot does when its program hangs, crashes or is reset in mid-run."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from boebot import resources
from boebot.boards import BoardRequest, open_board
from boebot.description.robots import load_robot
from boebot.errors import BoebotError
from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US
from sim_bridge.tests.rigs import SessionRig

pytestmark = pytest.mark.unsanitized

LEFT, RIGHT = 13, 12
JUMP_TO_ITSELF = b"\xff\xcf"  # rjmp .-2
RETURN, CLI, SEI = b"\x08\x95", b"\xf8\x94", b"\x78\x94"
RESERVED_OPCODE = b"\xff\x00"  # 0x00ff is no instruction of the ATmega328P


def planted(folder: Path, function: str, code: bytes) -> str:
    """A copy of the image in which `function` begins with `code`."""
    image = bytearray((resources.folder("images") / "shieldbot.elf").read_bytes())
    elf = ELFFile(io.BytesIO(bytes(image)))
    symbols, text = elf.get_section_by_name(".symtab"), elf.get_section_by_name(".text")
    assert isinstance(symbols, SymbolTableSection)
    assert text is not None
    found = symbols.get_symbol_by_name(function)
    assert found is not None
    (symbol,) = found
    start = text["sh_offset"] + symbol["st_value"] - text["sh_addr"]
    image[start : start + len(code)] = code
    path = folder / f"{function}.elf"
    path.write_bytes(image)
    return str(path)


def rig_with(image: str) -> SessionRig:
    return SessionRig(
        open_board("avr", BoardRequest(robot=load_robot("shieldbot"), arena="empty", noise=False, image=image))
    )


def test_program_that_hangs_is_reset_by_the_watchdog_and_stops_the_motors(tmp_path: Path) -> None:
    """A task hangs: the pulses, made by interrupts, go on until the watchdog ends it."""
    with rig_with(planted(tmp_path, "identity_send", JUMP_TO_ITSELF)) as rig:
        assert rig.start().reset_cause == messages.ResetCause.POWER
        rig.drive_for(0.5, 0.5, 0.2)
        hung_at = rig.board.cycle
        rig.answers.clear()
        rig.send(messages.Identify())
        hello = rig.wait_for(
            lambda: next((a for a in rig.answers if isinstance(a, messages.Hello)), None),
            1.0,
            "a hello after the reset",
        )
        assert hello.reset_cause == messages.ResetCause.WATCHDOG_IN_SESSION
        rig.start()
        assert rig.latest().status & messages.Status.WATCHDOG_RESET
        rig.listen(0.3)
        last = rig.pulses(LEFT)[-1].sum()
        assert (last - hung_at) / CYCLES_PER_S < 0.20, "the motors ran on"
        assert rig.latest().pulse_left == 0
        rig.drive_for(0.5, 0.5, 0.2)
        assert rig.latest().pulse_left > 0, "after the reset a fresh set-point drives again"


def delay(cycles: int) -> bytes:
    """Code that takes that long: ldi r24; ldi r25; sbiw r24, 1; brne .-4."""
    count = cycles // 4

    def load(register: int, value: int) -> int:
        return 0xE000 | (value & 0xF0) << 4 | (register - 16) << 4 | (value & 0x0F)

    code = [load(24, count & 0xFF), load(25, count >> 8), 0x9701, 0xF7F1]
    return b"".join(word.to_bytes(2, "little") for word in code)


def test_board_that_never_catches_up_is_reset_by_the_watchdog(tmp_path: Path) -> None:
    """A task takes longer than its slot: interrupts and main loop go on, but ticks are dropped for good."""
    with rig_with(planted(tmp_path, "whisker_task", delay(60_000) + RETURN)) as rig:
        hello = rig.wait_for(
            lambda: next(
                (
                    a
                    for a in rig.answers
                    if isinstance(a, messages.Hello) and a.reset_cause != messages.ResetCause.POWER
                ),
                None,
            ),
            2.0,
            "a hello after the reset",
        )
        assert hello.reset_cause == messages.ResetCause.WATCHDOG_IN_WHISKER


def test_board_that_is_late_within_its_tick_is_not_reset(tmp_path: Path) -> None:
    with rig_with(planted(tmp_path, "whisker_task", delay(25_000) + RETURN)) as rig:
        rig.start()
        rig.listen(1.0)
        assert rig.board.counters()["resets"] == 0


def test_pulse_that_begins_late_keeps_its_width(tmp_path: Path) -> None:
    """Interrupts are off when the left pulse should begin: it begins late, and is as long as it should be."""
    with rig_with(planted(tmp_path, "whisker_task", CLI + delay(12_000) + SEI + RETURN)) as rig:
        rig.start()
        for _ in range(40):  # bytes are lost while interrupts are off: at every phase of the tick
            rig.drive(0.5, 0.5)
            rig.listen(0.0073)
        for pin, width in ((LEFT, 1600), (RIGHT, 1400)):
            pulses = rig.pulses(pin)
            assert len(pulses) >= 5
            assert np.all(np.abs(pulses[:, 1] - width * CYCLES_PER_US) <= 16), pulses[:, 1] - width * CYCLES_PER_US


def test_program_that_crashes_is_said_so_in_one_sentence(tmp_path: Path) -> None:
    with rig_with(planted(tmp_path, "identity_send", RESERVED_OPCODE)) as rig:
        rig.start()
        rig.send(messages.Identify())
        with pytest.raises(BoebotError, match=r"instruction|opcode"):
            rig.listen(0.2)


def test_image_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "image.elf"
    path.write_bytes(b"this is no ELF file")
    with pytest.raises(BoebotError, match=r"image\.elf"):
        rig_with(str(path))
