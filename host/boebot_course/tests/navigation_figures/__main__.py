"""Measures how reliably robots find their way, and prints it as a table.

    python -m boebot_course.tests.navigation_figures [--only PATTERN ...] [--json] [--page FILE]

Seeds are fixed: the same figures each time. The exit code is 1 when a criterion is missed. --page also draws
docs/images/localization.png. What is fast or slow is in `make bench ONLY=navigation`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from boebot_course.experiment import Measured
from boebot_course.tests.navigation_figures import picture
from boebot_course.tests.navigation_figures.figures import FIGURES

HERE = Path(__file__).resolve().parent
PICTURE = HERE.parents[3] / "docs" / "images" / "localization.png"
HEAD = ["figure", "measured", "criterion", ""]


def rows(measured: dict[str, list[Measured]]) -> list[list[str]]:
    """The cells of the table."""
    table = []
    for name, figures in measured.items():
        table.append([f"**{name}**", "", "", ""])
        for one in figures:
            has_criterion = one.expected != "no criterion"
            met = ("✓" if one.is_met else "missed") if has_criterion else ""
            table.append([one.name, one.text, one.expected if has_criterion else "–", met])
    return table


def markdown(measured: dict[str, list[Measured]]) -> str:
    """The table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in [HEAD, ["---"] * len(HEAD), *rows(measured)])


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m boebot_course.tests.navigation_figures", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--only", action="append", default=[], metavar="PATTERN", help="figures whose names contain it")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    parser.add_argument("--page", type=Path, metavar="FILE", help="also write the documentation's page and its picture")
    options = parser.parse_args(arguments)
    chosen = [name for name in FIGURES if not options.only or any(part in name for part in options.only)]
    if not chosen:
        parser.error(f"no figure's name contains {' or '.join(options.only)}; there are {', '.join(FIGURES)}")
    if options.page and options.only:
        parser.error("the page has all figures; leave out --only")
    measured: dict[str, list[Measured]] = {}
    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True)) as bars:
        for name in chosen:
            bar = bars.add_task(name, total=1.0)
            measured[name] = FIGURES[name](lambda share, bar=bar: bars.update(bar, completed=share))  # type: ignore[misc]
        if options.page:
            bar = bars.add_task("Picture", total=1.0)
            picture.draw(picture.medians(lambda share: bars.update(bar, completed=share)), PICTURE)
    if options.json:
        fields = [
            {"figure": name, "name": one.name, "value": one.value, "unit": one.unit, "met": one.is_met}
            for name, figures in measured.items()
            for one in figures
        ]
        print(json.dumps(fields, indent=2))
    else:
        print(markdown(measured))
    if options.page:
        template = (HERE / "page.md").read_text(encoding="utf-8")
        options.page.write_text(template.replace("{table}", markdown(measured)), encoding="utf-8")
    return 0 if all(one.is_met for figures in measured.values() for one in figures) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
