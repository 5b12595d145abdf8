"""Where the cycles of a bound go: the worst path of a task or an interrupt of the kit's firmware."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from avr_timing.bounds.worst_path import PathRow
from avr_timing.bounds.worst_path import worst_path as path_of
from avr_timing.interrupts.interrupts_off import ENTRY
from boebot.errors import TimingError
from boebot_timing.firmware import Firmware

ACCEPTANCE = "acceptance of the interrupt"


@dataclass(frozen=True, slots=True)
class WorstPath:
    """In the order in which the path comes to its lines first; their cycles are the bound in sum."""

    name: str
    kind: str  # "task" or "interrupt"
    cycles: int
    rows: tuple[PathRow, ...]

    def as_dict(self) -> dict[str, Any]:
        """For programs; units in the keys."""
        return {
            "name": self.name,
            "kind": self.kind,
            "bound_cycles": self.cycles,
            "path": [
                {
                    "function": row.function,
                    "line": row.line,
                    "cycles": row.cycles,
                    "runs": row.runs,
                    "loop_passes": list(row.passes),
                }
                for row in self.rows
            ],
        }


def worst_path(firmware: Firmware, name: str) -> WorstPath:
    """Of a task or an interrupt of the image's table.

    Raises:
        TimingError: there is none of that name.
        AnalysisError: it has no bound.
    """
    table = firmware.table
    vectors = {row.name: row.vector for row in table.interrupts}
    names = [row.name for row in table.tasks] + list(vectors)
    if name not in names:
        raise TimingError(
            f"{firmware.image.path} has no task or interrupt {name!r}; expected one of {', '.join(names)}"
        )
    is_interrupt = name in vectors
    entry = 4 * vectors[name] if is_interrupt else firmware.task_entry(name)
    rows = path_of(firmware.worst, entry)
    if is_interrupt:
        rows = (PathRow(ACCEPTANCE, None, ENTRY, 1, ()), *rows)
    return WorstPath(name, "interrupt" if is_interrupt else "task", sum(row.cycles for row in rows), rows)
