"""The registers that the interrupts keep for themselves (hal_avr.h): nothing else in an image touches them; and the
rings lie where the interrupts expect them."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from boebot import resources
from boebot.timing.graph import load_program
from sim_bridge.tests.symbols import find_symbol

RESERVED = re.compile(r"\br[2-7]\b")
OWNERS = ("__vector_4", "__vector_5", "__vector_18", "__vector_19", "hal_serial_take", "hal_changes_stop")
VECTORS = tuple(range(0, 26 * 4, 4))  # functions too, of a jump each
LINE = re.compile(r"^ *([0-9a-f]+):\t(.*)$", re.MULTILINE)
PIN_MAPS = ("boebot", "shieldbot", "shieldbot-quad")


def instructions(image: Path) -> dict[int, str]:
    """By address, as avr-objdump writes them, without its comments; constants in flash among them."""
    command = ["avr-objdump", "-d", "-z", "--no-show-raw-insn", str(image)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return {int(address, 16): found.split(";")[0] for address, found in LINE.findall(text)}


@pytest.mark.parametrize("name", PIN_MAPS)
def test_only_interrupts_touch_their_registers(name: str) -> None:
    image = resources.folder("images") / f"{name}.elf"
    program, text = load_program(image), instructions(image)
    owned, others = set[int](), set[int]()
    for function in program.functions.values():
        addresses = {each.address for block in function.blocks.values() for each in block.instructions}
        if function.name in OWNERS or (function.entry in VECTORS and function.entry > 0):
            owned |= addresses
        else:
            others |= addresses
    touched = {at: text[at].strip() for at in others - owned if RESERVED.search(text[at])}
    assert {"lds\tr3, 0x00C0", "sbrc\tr3, 7"} <= set(touched.values())  # hal_serial_look(), in interrupts
    rest = [each for each in touched.values() if each not in ("lds\tr3, 0x00C0", "sbrc\tr3, 7")]
    assert rest == ["eor\tr2, r2"]  # the zero, before interrupts are on
    assert sum(RESERVED.search(text[at]) is not None for at in owned) > 40


@pytest.mark.parametrize("name", PIN_MAPS)
def test_rings_are_where_their_low_bytes_wrap(name: str) -> None:
    image = resources.folder("images") / f"{name}.elf"
    for ring, size in (("hal_receive_ring", 256), ("hal_changes", 256), ("hal_send_ring", 128)):
        found = find_symbol(image, ring)
        assert (found.address % 256, found.size) == (0, size)
