"""Names the place in the program where something went wrong. The image's ELF file is read only then."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from boebot.boards import WatchdogReset

CLOCK_HZ = 16_000_000
PROLOGUE = "__prologue_saves__"  # of libgcc, without source lines: -mcall-prologues


def places(elf: Path | None, addresses: Iterable[int]) -> dict[int, str]:
    """Function and source line of each address; empty where there is no file that can be read."""
    if elf is None:
        return {}
    from boebot.errors import AnalysisError
    from boebot.image.elf import read_image
    from boebot.image.places import place

    try:
        image = read_image(elf)
    except AnalysisError:
        return {}
    return {address: place(image, address) for address in addresses}


def with_place(fault: str, elf: Path | None, address: int, z: int = 0) -> str:
    """What went wrong, with the place of that address behind it, by the image's file; without where there is none.

    `z`: the register Z then, by which a function says where it goes on to the code that saves registers for all.
    """
    if address < 0:
        return fault
    found = places(elf, (address, 2 * z))
    where = found.get(address, "")
    if where == f"in {PROLOGUE}" and (caller := found[2 * z]):
        where += f" of {caller.removeprefix('in ')}"
    return f"{fault} {where}".rstrip()


def note_sentences(notes: Sequence[tuple[int, int, str, str]], elf: Path | None) -> list[str]:
    """For people: the notes of a board (`BoardMemory.notes`), with places by the image's file."""
    found = places(elf, [address for _, address, _, _ in notes]) if notes else {}
    return [
        f"the program {does} at address 0x{address:04X} in cycle {cycle} {found.get(address, '')}".rstrip() + f": {why}"
        for cycle, address, does, why in notes
    ]


def watchdog_resets(log: Sequence[tuple[int, int]], elf: Path | None) -> list[WatchdogReset]:
    """What the log of a board's watchdog says (`BoardMemory.watchdog_log`), with places by the image's file."""
    found = places(elf, [address for _, address in log]) if log else {}
    return [
        WatchdogReset(cycle=cycle, time_s=cycle / CLOCK_HZ, address=address, place=found.get(address, ""))
        for cycle, address in log
    ]
