"""Measures how reliably robots find their way, and prints it as a table.

    python -m boebot_course.tests.navigation_figures [--only PATTERN ...] [--page FILE]

Seeds are fixed: the same figures each time. The exit code is 1 when a criterion is missed. --page puts the table onto
a page of the documentation and draws docs/images/localization.png. How fast it is: `make bench ONLY=navigation`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from boebot_course import pages
from boebot_course.experiment import Measured
from boebot_course.tests.navigation_figures import picture
from boebot_course.tests.navigation_figures.figures import FIGURES
from tools.tests.printed import reprint

PICTURE = Path(__file__).resolve().parents[4] / "docs" / "images" / "localization.png"


def table(measured: dict[str, list[Measured]]) -> str:
    """In Markdown."""
    parts = ["\n".join([f"**{name}** |", *map(pages.row, figures)]) for name, figures in measured.items()]
    return "\n".join(["figure | measured (criterion)", "---|---", *parts])


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m boebot_course.tests.navigation_figures", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--only", action="append", default=[], metavar="PATTERN", help="figures whose names contain it")
    parser.add_argument(
        "--page", type=Path, metavar="FILE", help="also renew this page of the documentation, its picture"
    )
    options = parser.parse_args(arguments)
    chosen = [name for name in FIGURES if not options.only or any(part in name for part in options.only)]
    if not chosen:
        parser.error(f"no figure's name contains {' or '.join(options.only)}; there are {', '.join(FIGURES)}")
    if options.page and options.only:
        parser.error("the page has all figures; leave out --only")
    measured: dict[str, list[Measured]] = {}
    for name in chosen:
        print(f"{name} ...", file=sys.stderr)
        measured[name] = FIGURES[name]()
    print(table(measured))
    if options.page:
        picture.draw(picture.medians(), PICTURE)
        reprint(options.page, table(measured))
    return 0 if all(one.is_met for figures in measured.values() for one in figures) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
