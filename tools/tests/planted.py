"""A fault that is planted in a source: texts of it and what replaces them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def changed_text(source: Path, changes: Mapping[str, str]) -> str:
    """The text of a source, each of these texts in it replaced.

    Raises:
        ValueError: it does not hold one of them, or more than once.
    """
    text = source.read_text(encoding="utf-8")
    for before, after in changes.items():
        if (found := text.count(before)) != 1:
            raise ValueError(f"{source.name} holds {before!r} {found} times, not once; correct the planted fault")
        text = text.replace(before, after)
    return text
