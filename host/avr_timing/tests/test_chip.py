"""Which chip an image is for: programs that avr-gcc builds for other chips, and notes that are damaged."""

from __future__ import annotations

import struct
import subprocess
from pathlib import Path

import pytest

from avr_image import build
from avr_timing.errors import AnalysisError
from avr_timing.image.chip import NOTE, assumed_chip
from avr_timing.image.elf import read_image

FLAGS_AT = 36  # e_flags in the header of an ELF32 file
AVR5, AVR6, AVRXMEGA3 = 5, 6, 103


def built(folder: Path, chip: str, *flags: str) -> bytes:
    source, image = folder / "chip.c", folder / f"{chip}.elf"
    source.write_text("int main(void) { for (;;) ; }\n", encoding="ascii")
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
    assert "does not say which chip" in assumed_chip("image.elf", data.replace(NOTE, b"x" + NOTE[1:]))
