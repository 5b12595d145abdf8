"""Self-programming of the emulated ATmega328P: programs whose boot section rewrites flash by avr-libc's own boot.h."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from boebot.errors import BoardError
from sim_bridge.boards.avr import create
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import compiled
from sim_bridge.tests.boards.symbols import entry_of, find_symbol

PAGE_CYCLES = 72_000  # 4.5 ms, the longest that a page takes (data sheet, 27.8.12)
RWWSB, SPMEN = 0x40, 0x01

# What is marked BOOT lies in the boot section; `times` are counts of 8 cycles, by timer 1.
PROGRAM = """
#include <avr/boot.h>
#include <avr/interrupt.h>
#include <avr/pgmspace.h>
#define BOOT __attribute__((section(".boot"), noinline))
#define PAGE 0x1000u
volatile uint16_t times[2];
volatile uint8_t seen[8], done;
BOOT void erase(uint16_t page) {
  boot_page_erase(page);
  const uint16_t begin = TCNT1;
  seen[0] = SPMCSR;
  boot_spm_busy_wait();
  times[0] = TCNT1 - begin;
}
BOOT void put(uint16_t page, uint16_t first) {
  for (uint16_t i = 0; i < 128; i += 2) boot_page_fill(page + i, first + i);
  boot_page_fill(page, 0); /* a word is filled once */
  boot_page_write(page);
  const uint16_t begin = TCNT1;
  boot_spm_busy_wait();
  times[1] = TCNT1 - begin;
}
BOOT void enable(void) { boot_rww_enable(); }
BOOT void finish(void) { done = 1; for (;;) {} }
"""
WHOLE = """
BOOT int main_in_boot(void) {
  erase(PAGE);
  put(PAGE, 0x1234);
  seen[1] = SPMCSR;
  seen[2] = pgm_read_byte(PAGE);
  enable();
  seen[3] = SPMCSR;
  seen[4] = pgm_read_byte(PAGE);
  put(PAGE, 0xFF0F); /* not erased: bits are cleared only */
  enable();
  finish();
  return 0;
}
int main(void) { TCCR1B = 2; return main_in_boot(); }
"""


def board_of(text: str, folder: Path) -> BoardAccess:
    return BoardAccess(create(compiled(PROGRAM + text, folder / "program.elf", "-Wl,--section-start=.boot=0x7E00")))


def bare(text: str, folder: Path, begin: int = 0) -> BoardAccess:
    """A board with a program of assembler alone, at that address; it begins at `main` if that is in a boot section."""
    lines = " ".join(json.dumps(f"{line}\n") for line in (".global main", *text.splitlines()))
    source = f"__asm__({lines});"
    options = ("-nostartfiles", "-Wl,-e,main", f"-Wl,--section-start=.text={begin:#x}")
    return BoardAccess(create(compiled(source, folder / "program.elf", *options)))


def notes(board: BoardAccess) -> list[str]:
    return [note[2] for note in board.notes()]


def register(board: BoardAccess, number: int) -> int:
    return board.read_memory(number, 1)[0]


def read(board: BoardAccess, name: str) -> bytes:
    assert board.board.elf is not None
    return board.read_memory(*find_symbol(board.board.elf, name))


def test_a_page_takes_its_time_and_cannot_be_read_meanwhile(tmp_path: Path) -> None:
    board = board_of(WHOLE, tmp_path)
    board.run(5 * PAGE_CYCLES)
    assert read(board, "done") == b"\1"
    assert struct.unpack("<2H", read(board, "times")) == pytest.approx([PAGE_CYCLES / 8] * 2, abs=4)
    during, after, blocked, enabled, first = read(board, "seen")[:5]
    assert (during & (RWWSB | SPMEN), after, blocked, enabled) == (RWWSB | SPMEN, RWWSB, 0xFF, 0)
    assert first == 0x34
    assert notes(board) == ["fills a word of the page again", "reads flash that is being written"]


def test_a_page_has_what_was_filled_and_writing_clears_bits(tmp_path: Path) -> None:
    text = WHOLE.replace("finish();", "for (uint8_t i = 0; i < 8; i++) seen[i] = pgm_read_byte(PAGE + i); finish();")
    board = board_of(text, tmp_path)
    board.run(5 * PAGE_CYCLES)
    expected = struct.pack("<4H", *((0x1234 + i) & (0xFF0F + i) for i in (0, 2, 4, 6)))
    assert read(board, "seen") == expected


def test_a_page_of_the_boot_section_halts_the_cpu(tmp_path: Path) -> None:
    text = "BOOT int main_in_boot(void) { erase(0x7F00); finish(); return 0; }"
    board = board_of(text + "int main(void) { TCCR1B = 2; return main_in_boot(); }", tmp_path)
    board.run(PAGE_CYCLES + 2000)
    assert read(board, "done") == b"\1"
    assert read(board, "seen")[0] == 0  # nothing is under way any more, and all can be read
    assert struct.unpack("<2H", read(board, "times"))[0] < 8


@pytest.mark.parametrize("what", ["erase(PAGE); back();", "sei(); boot_page_erase(PAGE); boot_spm_interrupt_enable();"])
def test_a_program_that_goes_to_flash_while_it_is_written_stops(what: str, tmp_path: Path) -> None:
    text = "__attribute__((noinline)) void back(void) { done = 2; }\nISR(SPM_READY_vect) { done = 3; }\n"
    text += f"BOOT int main_in_boot(void) {{ {what} for (;;) {{}} }}\nint main(void) {{ return main_in_boot(); }}"
    board = board_of(text, tmp_path)
    with pytest.raises(BoardError, match=r"the program goes to 0x0.* while flash is written there \(RWWSB is set"):
        board.run(3 * PAGE_CYCLES)
    assert read(board, "done") == b"\0"


def test_the_interrupt_comes_while_nothing_is_under_way(tmp_path: Path) -> None:
    """Its flag is a state: while nothing is under way, it comes again and again."""
    text = "ISR(SPM_READY_vect) { if (++done == 3) SPMCSR = 0; }\n"
    text += "int main(void) { sei(); boot_spm_interrupt_enable(); for (;;) {} }"
    board = board_of(text, tmp_path)
    board.run(1000)
    assert read(board, "done") == b"\3"


@pytest.mark.parametrize(("nops", "erased"), [(3, True), (4, False)])
def test_spm_comes_within_four_cycles(nops: int, erased: bool, tmp_path: Path) -> None:
    """27.9.1: SPMEN clears itself."""
    text = f"""
    BOOT int main_in_boot(void) {{
      asm volatile("out 0x37, %0\\n .rept {nops}\\n nop\\n .endr\\n spm" :: "r"((uint8_t)3), "z"(PAGE));
      seen[0] = SPMCSR;
      finish();
      return 0;
    }}
    int main(void) {{ return main_in_boot(); }}"""
    board = board_of(text, tmp_path)
    board.run(1000)
    assert read(board, "seen")[0] == (RWWSB | 3 if erased else 0)
    assert notes(board) == ([] if erased else ["executes SPM"])


def test_signature_fuses_and_lock_bits(tmp_path: Path) -> None:
    """Of an Uno without a boot loader."""
    text = """
    int main(void) {
      for (uint8_t i = 0; i < 3; i++) seen[i] = boot_signature_byte_get(2 * i);
      seen[3] = boot_lock_fuse_bits_get(GET_LOW_FUSE_BITS);
      seen[4] = boot_lock_fuse_bits_get(GET_HIGH_FUSE_BITS);
      seen[5] = boot_lock_fuse_bits_get(GET_EXTENDED_FUSE_BITS);
      seen[6] = boot_lock_fuse_bits_get(GET_LOCK_BITS);
      seen[7] = pgm_read_byte(0);
      for (;;) {}
    }"""
    board = board_of(text, tmp_path)
    board.run(3000)
    assert read(board, "seen")[:7].hex(" ") == "1e 95 0f ff df fd ff"
    assert read(board, "seen")[7] == 0x0C  # of `jmp` at the reset vector: 0x940C


def test_flash_is_not_programmed_while_the_eeprom_is_written(tmp_path: Path) -> None:
    """27.8.8."""
    text = """
    BOOT int main_in_boot(void) {
      EEARL = 1; EEDR = 2; EECR = 1 << EEMPE; EECR |= 1 << EEPE;
      boot_page_erase(PAGE);
      seen[0] = SPMCSR;
      finish();
      return 0;
    }
    int main(void) { return main_in_boot(); }"""
    board = board_of(text, tmp_path)
    board.run(3000)
    assert read(board, "seen")[0] == 0
    assert [note[2:] for note in board.notes()] == [
        ("writes to SPMCSR", "it is dropped: the EEPROM is being written (27.8.8)")
    ]


def test_the_eeprom_is_not_written_while_flash_is(tmp_path: Path) -> None:
    """8.6.3; nor does its interrupt come."""
    text = """
    ISR(EE_READY_vect) { done = 4; }
    BOOT int main_in_boot(void) {
      boot_page_erase(PAGE);
      EECR = 1 << EERIE;
      sei();
      EEARL = 1; EEDR = 2; EECR |= 1 << EEMPE; EECR |= 1 << EEPE;
      seen[0] = EECR;
      cli();
      finish();
      return 0;
    }
    int main(void) { return main_in_boot(); }"""
    board = board_of(text, tmp_path)
    board.run(2 * PAGE_CYCLES)
    assert read(board, "done") == b"\1"
    assert read(board, "seen")[0] & 2 == 0 and board.read_eeprom()[1] == 0xFF  # EEPE
    assert [note[2:] for note in board.notes()] == [
        ("sets EEPE", "it is dropped: flash is being written (8.6.3)"),
    ]


# ---- where code is ----

# At 0x6FFC, the end of what cannot be read while it is written; main, at 0x7000, erases a page.
AT_THE_BORDER = """
application: inc r3
rjmp application
main: clr r3
ldi r24, 3
ldi r31, 0x10
out 0x37, r24
spm
"""
WAYS = {
    "brne": "tst r24\nwrong: brne application",
    "brid": "cli\nwrong: brid application",
    "rjmp": "wrong: rjmp application",
    "ijmp": "ldi r30, 0xFE\nldi r31, 0x37\nwrong: ijmp",
    "ret": "ldi r30, 0xFE\nldi r31, 0x37\npush r30\npush r31\nwrong: ret",
}


@pytest.mark.parametrize("way", WAYS)
def test_no_way_leads_into_flash_that_is_being_written(way: str, tmp_path: Path) -> None:
    board = bare(AT_THE_BORDER + WAYS[way], tmp_path, 0x6FFC)
    assert board.board.elf is not None
    wrong = entry_of(board.board.elf, "wrong")
    with pytest.raises(BoardError, match=rf"goes to 0x6FFC while flash is written there .* at address 0x{wrong:04X} "):
        board.run(100)
    assert register(board, 3) == 0


@pytest.mark.parametrize("way", WAYS)
def test_every_way_leads_into_flash_that_was_enabled_again(way: str, tmp_path: Path) -> None:
    enable = "1: in r25, 0x37\nsbrc r25, 0\nrjmp 1b\nldi r25, 0x11\nout 0x37, r25\nspm\n"
    board = bare(AT_THE_BORDER + enable + WAYS[way], tmp_path, 0x6FFC)
    board.run(PAGE_CYCLES + 100)
    assert register(board, 3) > 0 and board.notes() == []


@pytest.mark.parametrize("way", ["rjmp main", "tst r24\nbrne main", "cli\nbrid main", "ijmp"])
def test_every_jump_to_the_start_is_noted(way: str, tmp_path: Path) -> None:
    board = bare(f"main: inc r3\nldi r24, 1\nclr r30\nclr r31\n{way}\n1: rjmp 1b", tmp_path)
    before = register(board, 3)
    board.run(100)
    assert (register(board, 3) - before) % 256 > 2
    assert notes(board) == ["jumps to its start"]


def test_what_is_written_behind_the_image_is_code(tmp_path: Path) -> None:
    """And anything in RAM may be its stack."""
    text = """
    volatile uint8_t variables[100];
    BOOT int main_in_boot(void) {
      boot_page_fill(0x7F00, 0x9508); /* ret */
      boot_page_write(0x7F00);
      SP = (uint16_t)(variables + 50);
      asm volatile("call 0x7F00");
      finish();
      return 0;
    }
    int main(void) { variables[1] = 1; return main_in_boot(); }"""
    board = board_of(text, tmp_path)
    board.run(2 * PAGE_CYCLES)
    assert read(board, "done") == b"\1" and board.notes() == []


ERASES = """
main: ldi r24, 3
ldi r30, 0
ldi r31, 0x10
out 0x37, r24
spm
in r20, 0x37
ldi r24, 9
ldi r30, 3
clr r31
out 0x37, r24
lpm r21, Z
1: rjmp 1b
"""


@pytest.mark.parametrize(("begin", "fuse"), [(0x7000, 0xD8), (0x7800, 0xDA), (0x7C00, 0xDC), (0x7E00, 0xDE)])
def test_a_program_that_begins_in_the_boot_section_has_its_fuses(begin: int, fuse: int, tmp_path: Path) -> None:
    board = bare(ERASES, tmp_path, begin)
    assert board.board.begin == begin
    board.run(PAGE_CYCLES // 2)
    assert register(board, 20) == RWWSB | 3
    board = bare(ERASES.replace("spm", ""), tmp_path, begin)
    board.run(100)
    assert register(board, 21) == fuse and board.notes() == []


@pytest.mark.parametrize("at", [0x1000, 0x7000, 0x7DE0])
def test_spm_does_nothing_outside_of_the_boot_section(at: int, tmp_path: Path) -> None:
    """Of an Uno it is from 0x7E00 on, unless the image begins in a larger one."""
    board = bare(f"main: jmp there\n.org {at}" + ERASES.replace("main", "there"), tmp_path)
    board.run(1000)
    assert register(board, 20) & RWWSB == 0
    assert [note[2:] for note in board.notes()] == [
        (
            "executes SPM",
            "it is dropped: it works in the boot section only, which the fuses have from 0x7E00 on (27.3.2)",
        )
    ]


def test_a_boot_section_that_erases_itself_is_noted(tmp_path: Path) -> None:
    board = bare(ERASES.replace("ldi r31, 0x10", "ldi r31, 0x7E"), tmp_path, 0x7E00)
    with pytest.raises(BoardError, match="goes to 0x7E18, but ends at 0x7E18"):
        board.run(2 * PAGE_CYCLES)
    assert notes(board) == ["erases the page that it runs in", "runs through erased flash"]


def test_running_through_erased_flash_is_noted(tmp_path: Path) -> None:
    """Without a boot loader, too: between what a program has."""
    board = bare("main: rjmp hole\nhole: .fill 100, 2, 0xFFFF\nclr r31\n1: rjmp 1b", tmp_path)
    board.run(1000)
    assert notes(board) == ["runs through erased flash"] and register(board, 31) == 0
