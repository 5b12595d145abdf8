"""The page of a run, of one robot or of several: the files of the folder `page` in one text, which needs nothing else.

replay.html has the data of the whole run in it (boebot.view.page_data); it needs no network and is allowed none. The
page of the live view asks for its data, and may reach the server that it came from.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot.view import page_data, scene, style

if TYPE_CHECKING:
    from boebot.record.run import Run

SWEPT_AT_MOST = 1_000_000  # numbers of two bytes, of all sweeps of all robots: 2.7 MB of the page


FOLDER = Path(__file__).with_name("page")
SCRIPTS = (
    "base.js",  # elements, numbers, colours
    "model.js",  # a robot's run, which grows
    "camera.js",  # which part of the arena is seen
    "arena.js",  # the painter; arena, robots, paths from above
    "lanes.js",  # signals over time
    "panels.js",  # signals at a moment, values under the pointer
    "live.js",  # of a run that goes on: the connection, the newest moment, controls
    "hand.js",  # driving it, moving what is in it
    "time.js",  # the moment that is shown: playing, scrubbing; the beginning
)
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'"


def write(results: Sequence[Run], path: Path) -> Path:
    """Writes the page of the robots of one run."""
    path.write_text(page_text(results), encoding="utf-8")
    return path


def page_text(results: Sequence[Run]) -> str:
    """The page of the robots of one run."""
    return joined(content(results))


def content(results: Sequence[Run]) -> dict[str, Any]:
    """All that the page gets of the robots of one run."""
    views = [scene.view(result) for result in results]
    low, high = scene.bounds(*views)
    room = SWEPT_AT_MOST // max(1, sum(len(view.swept) for view in views))
    plan = views[0].plan
    return {
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
    about = page_data.robot_data(result, view, number, table=result.table(), way=result.way_in_words())
    return about | {"rows": page_data.rows_data(result, view, view.columns, result.record, sweeps_room=room)}


# ---- the page's text -------------------------------------------------------------------------------------------------


def live_page(server: str) -> str:
    """The page of a run that goes on, which asks for its data. `server`: as in ws://127.0.0.1:8080."""
    return joined(None, f"{POLICY}; connect-src 'self' {server}")


def joined(content: dict[str, Any] | None, policy: str = POLICY) -> str:
    """All of it; the data may hold any text."""
    page = _read("page.html")
    parts = {
        "/*POLICY*/": policy,
        "/*COLOURS*/": colours(),
        "/*STYLE*/": _read("style.css"),
        "/*SCRIPT*/": "\n".join(map(_read, SCRIPTS)),
        "/*LAYERS*/[]": json.dumps(style.LAYERS),
        # at last, as nothing is looked for in the data
        "/*DATA*/null": json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
    }
    for place, part in parts.items():
        page = page.replace(place, part)
    return page


def colours() -> str:
    """The palette as CSS variables; the page's scripts read these, too."""
    light = {name: style.paint(name) for name in style.DARK}
    dark = f"@media (prefers-color-scheme: dark) {{ :root {{ {_variables(style.DARK)} }} }}"
    return f":root {{ {_variables(light)} }}\n{dark}"


def _variables(values: dict[str, str]) -> str:
    return " ".join(f"--{name}: {value};" for name, value in values.items())


def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
