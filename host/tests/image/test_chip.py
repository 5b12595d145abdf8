"""Which chip an image is for: programs that avr-gcc builds for other chips, and notes that are damaged."""

from __future__ import annotations

import struct
import subprocess
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from avr_image import build
from avr_timing.bounds.stack import Stack
from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.graph import load_program
from avr_timing.interrupts.interrupts_off import InterruptsOff
from boebot.errors import AnalysisError
from boebot.image.chip import NOTE, assumed_chip
from boebot.image.elf import read_image

SOURCE = """
volatile int number;
__attribute__((noinline)) static int count(int n) { for (int i = 0; i < 9; i++) { n += number; } return n / 3; }
int main(void) { for (;;) { number = count(number); if (number == 7) { __asm__("sleep"); } } }
"""
FLAGS_AT = 36  # e_flags in the header of an ELF32 file
AVR5, AVR6, AVRXMEGA3 = 5, 6, 103


def built(folder: Path, chip: str, *flags: str) -> bytes:
    source, image = folder / "chip.c", folder / f"{chip}.elf"
    source.write_text(SOURCE, encoding="ascii")
    subprocess.run(["avr-gcc", f"-mmcu={chip}", *flags, "-o", str(image), str(source)], check=True)
    return image.read_bytes()


def refused(data: bytes) -> str:
    with pytest.raises(AnalysisError) as caught:
        assumed_chip("image.elf", data)
    assert str(caught.value).startswith("image.elf")
    return str(caught.value)


@pytest.mark.parametrize(
    ("chip", "name"),
    [
        ("atmega2560", "ATmega2560"),
        ("atxmega128a1", "ATxmega128A1"),
        ("attiny85", "ATtiny85"),
        ("atmega32u4", "ATmega32U4"),  # the core and the flash of the ATmega328P
        ("atmega32", "ATmega32"),
        ("atmega644", "ATmega644"),
        ("atmega168p", "ATmega168P"),
    ],
)
def test_an_image_for_another_chip_is_refused_by_its_name(tmp_path: Path, chip: str, name: str) -> None:
    assert refused(built(tmp_path, chip)) == f"image.elf is for the {name}; expected an image for the ATmega328P"


def with_flags(data: bytes, flags: int) -> bytes:
    return data[:FLAGS_AT] + struct.pack("<I", flags) + data[FLAGS_AT + 4 :]


def test_without_a_note_the_core_is_asked(tmp_path: Path) -> None:
    """`-nostartfiles` leaves out the start-up code, which has the note. Bit 7 of the flags: prepared for relaxing."""
    path = build(tmp_path, "main: rjmp main\n", "-nostartfiles", assembler=True)
    taken = "does not say which chip it is for: it is taken for an ATmega328P"
    assert read_image(path).assumed_chip == f"{path} {taken}"
    data = path.read_bytes()
    assert taken in assumed_chip("image.elf", with_flags(data, 0x80 | AVR5))
    assert "is for the core avr:6 " in refused(with_flags(data, 0x80 | AVR6))
    assert "is for the core avr:103 " in refused(with_flags(data, AVRXMEGA3))
    assert "is for the core avr:0 (avr-readelf -h); expected avr:5, the ATmega328P's" in refused(with_flags(data, 0))


def test_an_image_for_the_chip_is_taken_without_a_word(tmp_path: Path) -> None:
    """The ATmega328 shares the data sheet; its programs are the same."""
    for chip in ("atmega328p", "atmega328"):
        assert assumed_chip("image.elf", built(tmp_path, chip)) == ""


def test_a_note_that_contradicts_is_refused(tmp_path: Path) -> None:
    data = built(tmp_path, "atmega328p")
    assert "is for the core avr:6 " in refused(with_flags(data, AVR6))
    assert "is for the ATmega329P" in refused(data.replace(b"atmega328p", b"atmega329p"))
    assert "is for the chip without a name" in refused(data.replace(b"atmega328p\0", bytes(11)))
    assert "does not say which chip" in assumed_chip("image.elf", data.replace(NOTE.encode(), b"x" + NOTE[1:].encode()))


CHIPS = ("atmega2560", "atxmega128a1", "attiny85", "atmega32u4", "atmega32", "atmega328p")


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("chips")
    return {chip: built(folder, chip, "-Os") for chip in CHIPS}


def places(data: bytes) -> list[range]:
    """Bytes of the header, of the table of sections, of the chip's note, of the code, and of all that there is."""
    elf = ELFFile(BytesIO(data))
    found = [range(52), range(elf["e_shoff"], len(data)), range(len(data))]
    for name in (NOTE, ".text"):
        section = elf.get_section_by_name(name)
        assert section is not None
        found.append(range(section["sh_offset"], section["sh_offset"] + section["sh_size"]))
    return [place for place in found if place]


@given(
    st.sampled_from((*CHIPS, *3 * ("atmega328p",))),
    st.lists(st.tuples(st.integers(0, 4), st.floats(0, 0.999), st.integers(0, 255)), max_size=4),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_damaged_image_is_refused_in_a_sentence_or_judged(
    images: dict[str, bytes], tmp_path: Path, chip: str, changes: list[tuple[int, float, int]]
) -> None:
    """Of another chip it is never judged without a word, whatever becomes of its flags, its note and its sections."""
    data, path = bytearray(images[chip]), tmp_path / "damaged.elf"
    for place, share, byte in changes:
        where = places(images[chip])[place]
        data[where[int(share * len(where))]] = byte
    path.write_bytes(data)
    try:
        image, program = read_image(path), load_program(path)
    except AnalysisError as error:
        text = str(error)
        assert text.startswith(str(path)) and text.isprintable()
        return
    assert image.assumed_chip or b"atmega328" in data
    for judge in (WorstCase(program).of, Stack(program).of, InterruptsOff(program).of):
        for entry in program.functions:
            with suppress(AnalysisError):
                judge(entry)
