"""The bench's table: bounds, ratios, what a missed target looks like."""

from __future__ import annotations

import pytest
from rich.console import Console

from tools.bench.__main__ import row, table
from tools.bench.figures import Figure, Peer, figure


def a_figure(better: str, target: float, peer: Peer | None = None) -> Figure:
    return Figure("speed of a thing", "m/s", better, target, peer, lambda: 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("better", "value", "met"),
    [("more", 3.0, True), ("more", 2.99, False), ("less", 3.0, True), ("less", 3.01, False)],
)
def test_a_target_is_met_at_its_bound_and_on_its_better_side(better: str, value: float, met: bool) -> None:
    assert row(a_figure(better, 3.0), value)["met"] is met


def test_the_ratio_is_to_the_peer() -> None:
    assert row(a_figure("more", 3.0, Peer("somebody", 2.0)), 5.0)["ratio"] == 2.5
    assert row(a_figure("more", 3.0), 5.0)["ratio"] is None


def test_a_figure_has_exactly_one_bound() -> None:
    with pytest.raises(ValueError, match="either"):
        figure("no bound", "s")
    with pytest.raises(ValueError, match="either"):
        figure("two bounds", "s", at_least=1.0, at_most=2.0)


def test_the_table_shows_value_bound_peer_and_ratio() -> None:
    console = Console(width=120)
    with console.capture() as shown:
        console.print(table([row(a_figure("less", 4.0, Peer("somebody", 2.0)), 5.0)]))
    line = next(text for text in shown.get().splitlines() if "speed of a thing" in text)
    assert [cell.strip() for cell in line.split("│")[1:-1]] == [
        "speed of a thing",
        "5",
        "m/s",
        "≤ 4",
        "somebody: 2",
        "2.50",
    ]
