"""The bench: bounds, rounds, peers in turns, what a missed target looks like, options, and Ctrl-C."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import copied_process
from tools.tests.bench import report, scene
from tools.tests.bench.__main__ import figures
from tools.tests.bench.figures import Figure, Peer, figure
from tools.tests.printed import MARK

ROOT = Path(__file__).resolve().parents[2]
RESULT = ROOT / "build" / "bench.json"


def a_figure(better: str, target: float | None, *peers: Peer, measure: Any = lambda: 5.0, **more: Any) -> Figure:
    of_peer = more.pop("of_peer", False)
    return Figure("speed of a thing", "m/s", better, target, of_peer, peers, measure, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("better", "target", "value", "met"),
    [
        ("more", 3.0, 3.0, True),
        ("more", 3.0, 2.99, False),
        ("less", 3.0, 3.0, True),
        ("less", 3.0, 3.01, False),
        ("more", None, 0.0, True),
    ],
)
def test_a_target_is_met_at_its_bound_and_on_its_better_side(
    better: str, target: float | None, value: float, met: bool
) -> None:
    assert report.row_of(a_figure(better, target), [value], [])["met"] is met


def test_peers_take_turns_and_the_best_or_the_median_of_the_rounds_counts() -> None:
    order: list[str] = []

    def taking_turns(who: str, values: list[float]) -> Any:
        left = iter(values)

        def measure() -> float:
            order.append(who)
            return next(left)

        return measure

    def rows(better: str, of: str) -> dict[str, Any]:
        order.clear()
        peer = Peer("somebody", taking_turns("peer", [1.0, 4.0, 2.0]))
        ours = taking_turns("ours", [5.0, 8.0, 6.0])
        return report.measure(a_figure(better, 3.0, peer, measure=ours, rounds=3, of=of))

    best, least, median = rows("more", "best"), rows("less", "best"), rows("more", "median")
    assert order == ["ours", "peer"] * 3
    assert (best["value"], best["peers"][0]["value"], best["peers"][0]["ratio"]) == (8.0, 4.0, 2.0)
    assert (least["value"], least["peers"][0]["value"]) == (5.0, 1.0)
    assert (median["value"], median["peers"][0]["value"], median["peers"][0]["ratio"]) == (6.0, 2.0, 3.0)
    assert median["rounds"] == [5.0, 8.0, 6.0] and report.spread(median) == "50 %"


def test_a_bound_is_on_the_value_or_on_its_ratio_to_the_first_peer() -> None:
    slow, fast = Peer("slow", lambda: 2.0), Peer("fast", lambda: 10.0)
    for peers, met in (((slow, fast), True), ((fast, slow), False)):
        row = report.measure(a_figure("more", 2.5, *peers, of_peer=True))
        assert row["met"] is met and report.target(row) == "≥ × 2.5"


def test_a_figure_has_at_most_one_bound() -> None:
    with pytest.raises(ValueError, match="two bounds"):
        figure("two bounds", "s", at_least=1.0, at_most=2.0)
    with pytest.raises(ValueError, match="no peer"):
        figure("no peer", "s", times_at_least=1.0)


def test_the_table_shows_value_spread_bound_and_peers() -> None:
    rows = [
        report.measure(a_figure("less", 4.0, Peer("somebody", lambda: 2.0), Peer("else", lambda: 10.0))),
        report.failed(a_figure("more", None), RuntimeError("no such thing")),
    ]
    result = {"computer": report.computer() | {"load_before": 1, "load_after": 2}, "seconds": 90, "complete": True}
    text = report.printed(result | {"figures": rows})
    found = [line[2:-2].split(" | ") for line in text.splitlines() if line.startswith("| speed of a thing")]
    assert found[0] == ["speed of a thing", "5", "–", "m/s", "≤ 4", "somebody: 2 (× 2.5); else: 10 (× 0.5)"]
    assert found[1] == ["speed of a thing", "failed", "–", "m/s", "–", "–"]
    assert "Took 1.5 minutes." in text and "Missed: speed of a thing." in text
    assert "Failed: speed of a thing: RuntimeError: no such thing." in text


def run(*options: str) -> copied_process.Done:
    return copied_process.module("tools.tests.bench", options, ROOT)


@pytest.mark.soak
def test_every_figure_has_a_name_of_its_own_and_only_chooses() -> None:
    names = run("--list").stdout.splitlines()
    assert len(set(names)) == len(names) > 25
    lasers = run("--list", "--only", "laser of 683", "--only", "no such thing").stdout.splitlines()
    assert lasers == [name for name in names if "laser of 683" in name] and len(lasers) == 4
    chosen = figures(["laser of 683"])
    assert {(one.target, one.of_peer, one.unit) for one in chosen} == {(100, True, "rays/s")}
    (wandering,) = figures(["native board and world, wander"])
    assert wandering.target == 4 and wandering.better == "more"


def test_a_pattern_without_a_figure_is_one_sentence() -> None:
    done = run("--only", "no such thing")
    assert done.returncode == 2 and "no figure's name contains 'no such thing'" in done.stderr


@pytest.mark.soak
def test_page_and_progress(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"By hand.\n{MARK}old")
    done = run("--only", "encodes telemetry", "--page", str(page))
    result = json.loads(RESULT.read_text())
    assert f"Took {result['seconds'] / 60:.1f} minutes; not all figures." in done.stdout
    assert [row["unit"] for row in result["figures"]] == ["frames/s"] * 2 and result["complete"] is False
    assert "[1/2] Python encodes" in done.stderr and "[2/2]" in done.stderr
    assert done.returncode == int(not all(row["met"] for row in result["figures"]))
    assert page.read_text().startswith("By hand.\n") and "old" not in page.read_text()
    assert "| Python encodes telemetry of 37 B: fields to frame |" in page.read_text()


@pytest.mark.soak
def test_ctrl_c_shows_what_was_measured_so_far() -> None:
    """Frames are the first matches, in seconds; a run of 10 simulated minutes is the next one."""
    command = [
        sys.executable,
        "-m",
        "tools.tests.bench",
        "--only",
        "encodes telemetry",
        "--only",
        "10 simulated minutes",
    ]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None and process.stdout is not None
        text = ""
        while "[3/3]" not in text:
            got = process.stderr.read(1)
            assert got, text
            text += got
        process.send_signal(signal.SIGINT)
        assert "; not all figures." in process.stdout.read()
    result = json.loads(RESULT.read_text())
    assert process.returncode == 130
    assert len(result["figures"]) == 2 and result["complete"] is False


# ---- the scene -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("edges", [48, 100, 1000, 4000])
def test_the_scene_has_as_many_edges_and_the_robots_start_in_free_space(edges: int) -> None:
    outline, pillars = scene.shapes(edges)
    assert 4 + 4 * len(pillars) == edges
    (left, low), (right, high) = outline[0], outline[2]
    for corners in pillars:
        x, y = (sum(values) / 4 for values in zip(*corners, strict=True))
        assert left < x < right and low < y < high
        assert math.dist((0, 0), (x, y)) > scene.RADIUS + 2 * scene.PILLAR
        for a in (-0.5, 0.5, 1.5):
            for b in (-0.5, 0.5, 1.5):
                assert math.dist((a, b), (x, y)) > scene.RADIUS + 2 * scene.PILLAR
