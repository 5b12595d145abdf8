"""Writes a brain of processes as the TOML file that composes it anew (boebot.brain.composition)."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from boebot.brain.composition import described
from boebot.brains import LoadedBrain
from boebot.errors import BrainError


def text(loaded: LoadedBrain, comment: str, robot: str | None, arena: str | None) -> str:
    """The file, with the parameters that are in force now, for that robot and arena.

    Raises:
        BrainError: a file cannot say what the brain is made of.
    """
    if loaded.brain is None:
        raise BrainError(
            f"brain {loaded.name!r} has no processes; expected a Brain of processes, whose parameters evolve"
        )
    table = described(loaded.brain)
    if odd := table["undescribed"]:
        raise BrainError(
            f"brain {loaded.name!r} cannot be written as a TOML file: {odd[0]}; expected the kit's processes and "
            "state variables alone"
        )
    plain = {"period_s": table["period_s"], "margin": table["margin"], "robot": robot, "arena": arena}
    lines = [f"# {comment}", "", *_lines(plain)]
    for kind in ("variable", "process"):
        for name, one in table[kind].items():
            lines += ["", f"[{kind}.{_key(name)}]", *_lines(one)]
    return "\n".join(lines) + "\n"


def _lines(table: Mapping[str, Any]) -> Iterator[str]:
    """A line for each key that has a value."""
    return (f"{_key(name)} = {_value(value)}" for name, value in table.items() if value is not None)


def _value(value: Any) -> str:
    """As TOML has it: but for tables that is JSON's spelling."""
    if isinstance(value, dict):
        return f"{{ {', '.join(_lines(value))} }}" if value else "{}"
    return json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)
