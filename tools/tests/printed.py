"""Pages of the documentation that end with what a program prints: text by hand, a mark, and behind it the print."""

from __future__ import annotations

from pathlib import Path

MARK = "<!-- printed from here on -->\n"


def reprint(page: Path, printed: str) -> None:
    """Replaces what stands behind the mark. Raises ValueError where there is none."""
    by_hand, mark, _ = page.read_text(encoding="utf-8").partition(MARK)
    if not mark:
        raise ValueError(f"{page} has no line {MARK.strip()}; expected one, and what was printed before behind it")
    page.write_text(f"{by_hand}{mark}\n{printed.strip()}\n", encoding="utf-8")


def markdown(head: list[str] | tuple[str, ...], rows: list[list[str]]) -> str:
    """A table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rows])
