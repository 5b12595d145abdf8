"""Joins the files of the folder `page` into the one page of a run: text with style, scripts and data in it, which needs
nothing else. A replay needs no network and is allowed none; a live page may reach the server that it came from."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from boebot.view import style

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


def replay(content: dict[str, Any]) -> str:
    """The page of a run that is over."""
    return _joined(content, POLICY)


def live(server: str) -> str:
    """The page of a run that goes on, which asks for its data. `server`: as in ws://127.0.0.1:8080."""
    return _joined(None, f"{POLICY}; connect-src 'self' {server}")


def _joined(content: dict[str, Any] | None, policy: str) -> str:
    """All of it; the data may hold any text."""
    data = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    parts = {
        "POLICY": policy,
        "COLOURS": colours(),
        "STYLE": _read("style.css"),
        "SCRIPT": "\n".join(map(_read, SCRIPTS)),
        "DATA": data,
        "LAYERS": json.dumps(style.LAYERS),
    }
    # DATA and LAYERS stand in SCRIPT, so that is filled in before; nothing is looked for in the data
    page = _filled(_read("page.html"), {name: parts[name] for name in ("POLICY", "COLOURS", "STYLE", "SCRIPT")})
    return _filled(page, {name: parts[name] for name in ("DATA", "LAYERS")})


def colours() -> str:
    """The palette as CSS variables; the page's scripts read these, too."""
    light = {name: style.paint(name) for name in style.DARK}
    dark = f"@media (prefers-color-scheme: dark) {{ :root {{ {_variables(style.DARK)} }} }}"
    return f":root {{ {_variables(light)} }}\n{dark}"


def _variables(values: dict[str, str]) -> str:
    return " ".join(f"--{name}: {value};" for name, value in values.items())


def _filled(text: str, parts: dict[str, str]) -> str:
    """With each part where its name stands, as in /*STYLE*/."""
    return re.sub(r"/\*([A-Z]+)\*/(null|\[\])?", lambda found: parts.get(found[1], found[0]), text)


def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
