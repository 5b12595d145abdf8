"""What the firmware noted, read from the RAM of the running board while the image stays untouched: the stamps of
encoder edges and of echoes, and the cycle at which each tick begins.

The firmware stamps by Timer1, which counts every cycle from its start on; `timer_start` finds that cycle.
"""

from __future__ import annotations

import io
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from boebot.errors import BoardError
from sim_bridge.boards import avr
from sim_bridge.boards.board import BoardAccess
from sim_bridge.timing.loads import SLOT_CYCLES, TICK_CYCLES, Bench

RAM_BASE = 0x800000  # where the linker puts the data space
TCCR1B, CS10 = 0x81, 0x01
START_LATEST = 16_000_000  # cycles from power-on
COARSE = 4_000
CHANGE_BYTES, CHANGES_BYTES = 4, 256  # an entry of the ring, the ring (hal.h)
STORE_LATEST = 8_000  # cycles after a tick's nominal start: by then its interrupt has begun, or will not


def variables(elf: Path, *names: str) -> dict[str, int]:
    """Addresses in data space of variables of the image by their names.

    Raises:
        BoardError: the image has not exactly one of each.
    """
    table = ELFFile(io.BytesIO(elf.read_bytes())).get_section_by_name(".symtab")
    found: dict[str, set[int]] = {name: set() for name in names}
    for symbol in table.iter_symbols() if isinstance(table, SymbolTableSection) else ():
        name = symbol.name.split(".")[0]  # a compiler that sees the whole program numbers what is local to a file
        if name in found and symbol["st_value"] >= RAM_BASE:
            found[name].add(symbol["st_value"] - RAM_BASE)
    for name, addresses in found.items():
        if len(addresses) != 1:
            raise BoardError(f"{elf.name} has {len(addresses)} variables {name!r}; expected 1, to read its stamps")
    return {name: addresses.pop() for name, addresses in found.items()}


def timer_start(elf: Path) -> int:
    """The cycle at which Timer1 of a board with that image reads 0 and begins to count.

    Raises:
        BoardError: it does not start it within a second.
    """

    def starts(board: BoardAccess, until: int, step: int) -> int:
        before = board.now
        while not board.read_memory(TCCR1B, 1)[0] & CS10:
            if board.now >= until:
                raise BoardError(f"{elf.name} does not start Timer1 within {START_LATEST / 16e6:g} s")
            before = board.now
            board.advance(board.now + step)
        return before if step > 1 else board.now

    coarse = avr.create(elf).access()
    before = starts(coarse, START_LATEST, COARSE)
    coarse.close()
    fine = avr.create(elf).access()
    fine.advance(before)
    start = starts(fine, before + 2 * COARSE, 1)
    fine.close()
    return start


class EncoderStamps:
    """The changes of the encoders' port as the interrupt stamped them: cycles by bit of the port."""

    def __init__(self, bench: Bench, start: int) -> None:
        self.changes: list[list[int]] = [[] for _ in range(8)]
        self._bench, self._start = bench, start
        at = variables(bench.elf, "hal_changes", "hal_changes_head")
        self._ring, self._head = at["hal_changes"], at["hal_changes_head"]
        self._seen = self._now()
        self._bits = self._entry(self._seen)[2]
        bench.after_slice.append(self._look)

    def _now(self) -> int:
        return self._bench.access.read_memory(self._head, 1)[0]

    def _entry(self, place: int) -> bytes:
        return self._bench.access.read_memory(self._ring + place, CHANGE_BYTES)

    def _look(self) -> None:
        head = self._now()
        while self._seen != head:
            self._seen = (self._seen + CHANGE_BYTES) % CHANGES_BYTES
            entry = self._entry(self._seen)
            passed = self._bench.now - self._start
            cycle = self._bench.now - ((passed - int.from_bytes(entry[:2], "little")) & 0xFFFF)
            for bit in range(8):
                if (entry[2] ^ self._bits) >> bit & 1:
                    self.changes[bit].append(cycle)
            self._bits = entry[2]


class EchoStamps:
    """Rise and fall of each echo as the capture interrupt noted them, in cycles."""

    def __init__(self, bench: Bench, start: int) -> None:
        self.echoes: list[tuple[int, int]] = []
        self._bench, self._start = bench, start
        at = variables(bench.elf, "rise", "fall")
        self._rise, self._fall = at["rise"], at["fall"]
        self._taken = self._before = self._read()
        bench.after_slice.append(self._look)

    def _read(self) -> tuple[bytes, bytes]:
        memory = self._bench.access.read_memory
        return memory(self._rise, 3), memory(self._fall, 3)

    def _look(self) -> None:
        read = self._read()
        if read[1] != self._taken[1] and read == self._before:  # not in the midst of writing
            self._taken = read
            self.echoes.append((self._cycle(read[0]), self._cycle(read[1])))
        self._before = read

    def _cycle(self, moment: bytes) -> int:
        """Of a schedule_moment: slot n begins when the timer has counted (n + 1) slots; offsets above three quarters of
        the count are before its start (schedule.c)."""
        offset = int.from_bytes(moment[1:3], "little")
        offset -= 65_536 if offset >= 0xC000 else 0
        slot = (self._bench.now - self._start) // SLOT_CYCLES - 1
        slot -= (slot - moment[0]) & 0xFF
        return self._start + (slot + 1) * SLOT_CYCLES + offset


class TickStarts:
    """How long after a tick's nominal start its interrupt counts the slot: as a source, it steps the board there
    instruction by instruction."""

    def __init__(self, bench: Bench, start: int) -> None:
        self.delays: list[int] = []
        self._bench, self._start = bench, start
        self._slot = variables(bench.elf, "schedule_slot")["schedule_slot"]

    def watch(self) -> None:
        """Runs up to the next tick and sees it begin."""
        ticks = (self._bench.now - self._start - SLOT_CYCLES) // TICK_CYCLES + 1
        nominal = self._start + SLOT_CYCLES + ticks * TICK_CYCLES
        self._bench.run_until(nominal - 1)
        access = self._bench.access
        before = access.read_memory(self._slot, 1)
        while access.read_memory(self._slot, 1) == before:
            if access.now > nominal + STORE_LATEST:
                raise BoardError(f"{self._bench.elf.name}: tick {ticks} does not begin")
            access.advance(access.now + 1)
        self.delays.append(access.now - nominal)
