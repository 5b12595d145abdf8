"""replay.html: one page, offline, that plays and scrubs a run, of one robot or of several. The page is that of the live
view (boebot.view.web_page), with the data of the whole run in it (boebot.view.page_data)."""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot.record.interventions import STREAM, in_words
from boebot.view import page_data, scene, web_page
from boebot.view.utility_panel import shown_cognitive

if TYPE_CHECKING:
    from boebot.record.run import Run

STEPS_AT_MOST = 6_000  # of a brain of processes
SWEPT_AT_MOST = 1_000_000  # numbers of two bytes, of all sweeps of all robots: 2.7 MB of the page


def write(results: Sequence[Run], path: Path) -> Path:
    """Writes the page of the robots of one run."""
    path.write_text(page_text(results), encoding="utf-8")
    return path


def page_text(results: Sequence[Run]) -> str:
    """The page of the robots of one run."""
    return web_page.replay(content(results))


def content(results: Sequence[Run]) -> dict[str, Any]:
    """All that the page gets of the robots of one run."""
    views = [scene.view(result) for result in results]
    low, high = scene.bounds(*views)
    room = SWEPT_AT_MOST // max(1, sum(len(view.swept) for view in views))
    plan = views[0].plan
    return {
        "format": page_data.FORMAT,
        "plan": page_data.plan_data(plan),
        "bounds": [*low.tolist(), *high.tolist()],
        "runs": [
            run_data(result, view, number, room)
            for number, (result, view) in enumerate(zip(results, views, strict=True), 1)
        ],
        "moving": page_data.moving_data(plan.moving),
        "live": None,
    }


def run_data(result: Run, view: scene.View, number: int = 1, room: int | None = None) -> dict[str, Any]:
    """What the page shows of one robot, with its whole run. `number`: of the robot, from 1; `room`: of its sweeps."""
    brain = result.overview.brain
    cognitive = () if brain is None else shown_cognitive(brain)
    about = page_data.robot_data(
        result.robot,
        result.overview.columns,
        number=number,
        title=f"{result.brain} on {result.robot.name} ({result.board})",
        brain=result.brain,
        begin=result.clock_offset,
        known=view.known,
        has_estimate=view.estimate is not None,
        table=result.table(),
        way=result.way_in_words(),
        names=result.brain_names if brain is not None and len(brain) else None,
        cognitive=cognitive,
    )
    rows = page_data.rows_data(
        stretch(result, view), cognitive=cognitive, steps_at_most=STEPS_AT_MOST, sweeps_room=room
    )
    return about | {"rows": rows}


def _deeds(result: Run) -> list[page_data.Event]:
    """What people did to the robot meanwhile."""
    return [(time_s, "intervention", in_words(data)) for time_s, data in result.record.rows(STREAM)]


def stretch(result: Run, view: scene.View) -> page_data.Stretch:
    """The whole run."""
    few = result.overview
    return page_data.Stretch(
        series=few.columns,
        path=view.path,
        estimate=view.estimate,
        start=view.pose(0) if view.known else (0.0, 0.0, 0.0),
        shown=few.shown,
        layers=view.layers,
        brain=few.brain if few.brain is not None and len(few.brain) else None,
        swept=view.swept,
        true_contacts=view.true_contacts,
        touches=view.touches,
        events=sorted(page_data.events(few.columns, result.whiskers) + _deeds(result), key=itemgetter(0)),
        pins=page_data.pins(result.record.block("pins"), result.robot, result.clock_offset),
    )
