"""Writes docs/experiments: a page with a picture for each experiment, and the list of them.

    python -m boebot_course.pages [NAME ...]

Without names it renews all, and removes what belongs to no experiment any more. The exit code is 1 when an experiment
is outside its criterion; its page says so.
"""

from __future__ import annotations

import inspect
import io
import os
import re
import sys
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from PIL import Image

from boebot.cli.output import share_bars
from boebot_course import output_files, running
from boebot_course.experiments import Experiment, Measured, Outcome, all_experiments
from boebot_course.output_files import stem

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "experiments"
LIST = "README.md"
SEED = 1
LARGEST_BYTES = 60_000  # of a picture
LOOKS = ((100, 256), (100, 64), (100, 24), (80, 24), (60, 16))  # dots per inch and colours, until it is small enough


def page(experiment: Experiment, measured: Iterable[Measured]) -> str:
    """The page of one, with what was measured with the seed `SEED`."""
    parts = [f"# {experiment.name}: {plain(experiment.title)}"]
    if said := inspect.getdoc(experiment.run):
        parts.append(said)
    parts += [
        f"* In the notes: {plain(experiment.source)}.\n* Robot: {robot(experiment)}.\n"
        f"* Again: `boebot experiment {experiment.name} --seed {SEED}`"
        + (", which takes a while." if experiment.slow else "."),
        f"![{experiment.caption}]({stem(experiment.name)}.png)",
        f"*{plain(experiment.caption)}*",
        "| figure | measured | expected | unit | |\n|---|--:|---|---|---|\n" + "\n".join(map(_row, measured)),
    ]
    parts.append(f"**Criterion.** {plain(experiment.criterion)}")
    return "\n\n".join(parts) + "\n"


def robot(experiment: Experiment) -> str:
    """The robot in words."""
    return "none, it is computed" if experiment.robot == "none" else experiment.robot


def _row(one: Measured) -> str:
    cells = (one.name, one.text, one.expected, one.unit, "met" if one.is_met else "missed")
    return f"| {' | '.join(map(plain, cells))} |"


def plain(text: str) -> str:
    """As Markdown that shows it as it stands."""
    return re.sub(r"([|<\\])|(?<=\s)([*_])(?=\S)", r"\\\1\2", text)


def listing(experiments: Iterable[Experiment]) -> str:
    """The list of all pages."""
    rows = "\n".join(
        f"| [{one.name}]({stem(one.name)}.md) | {' | '.join(map(plain, (one.title, one.robot, one.source)))} |"
        for one in experiments
    )
    return (
        "# Experiments\n\n"
        "Each shows something that the lecture notes say, and is run by one command: `boebot experiment NAME` prints\n"
        "what was measured against what was expected, and writes the figure and its data; `make experiments` runs all\n"
        "and leaves one page of them, build/experiments/index.html. `make pictures` renews these pages. Seed is 1\n"
        "here; `make soak` runs all at seeds 1 to 10. One that misses at some seeds states its rate on its page.\n\n"
        "A run leaves, in the folder experiments or where `--out` says, NAME.png and NAME.svg, the figure; NAME.csv,\n"
        "its data, with units in the columns' names and an empty cell where there is no number; NAME.json, the\n"
        "verdict. The same seed gives the same bytes, however many processes `--jobs` allows. The exit code is 0 when\n"
        "everything is met.\n\n"
        f"| name | what it shows | robot | in the notes |\n|---|---|---|---|\n{rows}\n"
    )


def files(experiment: Experiment, outcome: Outcome, seed: int) -> dict[str, bytes]:
    """Page and picture of one that has run."""
    name = stem(experiment.name)
    text = page(experiment, outcome.measured)
    return {f"{name}.md": text.encode(), f"{name}.png": _small(experiment, outcome)}


def _small(experiment: Experiment, outcome: Outcome) -> bytes:
    """The figure with few enough dots and colours."""
    for dpi, colours in LOOKS:
        (drawn,) = output_files.pictures(experiment, outcome, {"png": dpi})
        target = io.BytesIO()
        few = Image.open(io.BytesIO(drawn)).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        few.save(target, "PNG", optimize=True)
        if len(target.getvalue()) <= LARGEST_BYTES:
            return target.getvalue()
    raise ValueError(f"its picture does not fit into {LARGEST_BYTES} bytes")


def main(names: list[str]) -> int:
    """Renews the pages of those experiments, or all; the exit code."""
    known = all_experiments()
    if unknown := [name for name in names if name not in known]:
        print(f"there is no experiment {unknown[0]!r}", file=sys.stderr)
        return 2
    chosen = [known[name] for name in names] or list(known.values())
    FOLDER.mkdir(exist_ok=True)
    outside = []
    with (
        share_bars([one.name for one in chosen]) as watch,
        closing(running.run(chosen, SEED, os.cpu_count() or 1, watch, files)) as verdicts,
    ):
        for verdict in verdicts:
            output_files.write(FOLDER, verdict.files)
            watch({verdict.name: 1.0})
            if not verdict.is_met:
                outside.append(f"{verdict.name} {verdict.word}{verdict.error and ': '}{verdict.error}")
    if not names:
        wanted = {f"{stem(name)}{ending}" for name in known for ending in (".md", ".png")} | {LIST}
        for path in FOLDER.iterdir():
            if path.name not in wanted:
                path.unlink()
    (FOLDER / LIST).write_text(listing(known.values()), encoding="utf-8")
    print(f"{len(chosen)} pages in {FOLDER}", *sorted(outside), sep="\n")
    return 1 if outside else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
