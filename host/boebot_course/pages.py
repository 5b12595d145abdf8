"""Pages of experiments, in Markdown. Run as a program it writes docs/experiments: a page for each chapter of the notes
with its experiments' pictures, and the list of all.

    python -m boebot_course.pages [CHAPTER ...]

Without chapters it renews all, and removes what belongs to no experiment any more. The exit code is 1 when an
experiment is outside its criterion; its page says so.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path

from PIL import Image

from boebot.cli.output import progress_bar
from boebot.record.run_folder import write_files
from boebot_course import output_files, running
from boebot_course.experiments import Experiment, Measured, Outcome, all_experiments

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "experiments"
SEED = 1
LARGEST_BYTES = 60_000  # of a picture
LOOKS = ((100, 256), (100, 64), (100, 24), (80, 24), (60, 16))  # dots per inch and colours, until it is small enough


def chapter_of(experiment: Experiment) -> str:
    """Of the notes."""
    return experiment.section.partition(".")[0]


def page(title: str, experiments: Iterable[Experiment], verdicts: Mapping[str, running.Verdict]) -> str:
    """The page of some experiments, with what came of them, by name."""
    parts = [f"# {title}"]
    last = ""
    for one in experiments:
        if one.bare_name != last:
            last = one.bare_name
            parts += [f"## {last}: {plain(one.title)}", f"{capital(plain(one.source))}. {plain(one.caption)}"]
        if one.on:
            parts.append(f"### On {one.on}")
        parts.append(plain(one.criterion) if one.on == one.robot else f"{capital(robot(one))}. {plain(one.criterion)}")
        verdict = verdicts.get(one.name, running.Verdict(one.name))
        if verdict.error:
            parts.append(f"**Failed**: {plain(verdict.error)}")
        else:
            rows = "\n".join(["figure | measured", "---|---", *map(row, verdict.measured)])
            parts += [f"![{one.name}]({one.name}.png)", rows]
    return "\n\n".join(parts) + "\n"


def chapter_page(chapter: str, verdicts: Mapping[str, running.Verdict]) -> str:
    """The page of a chapter."""
    ones = [one for one in all_experiments().values() if chapter_of(one) == chapter]
    return page(f"Experiments of chapter {chapter}", ones, verdicts)


def row(one: Measured) -> str:
    """Of the table of figures."""
    expected = "" if one.expected == "no criterion" else f" ({one.expected})"
    value = f"{one.text} {one.unit}".strip() + expected
    return f"{plain(one.name)} | {value if one.is_met else f'**{value}, missed**'}"


def robot(experiment: Experiment) -> str:
    """The robot in words."""
    return "computed" if experiment.robot == "none" else experiment.robot


def capital(text: str) -> str:
    """As a sentence begins."""
    return text[0].upper() + text[1:]


def plain(text: str) -> str:
    """As Markdown that shows it as it stands."""
    return re.sub(r"([|<\\])|(?<=\s)([*_])(?=\S)", r"\\\1\2", text)


def listing(experiments: Iterable[Experiment]) -> str:
    """The list of all."""
    chapters: dict[str, list[str]] = {}
    for one in experiments:
        if one.name == one.bare_name:
            chapters.setdefault(chapter_of(one), []).append(one.name)
    rows = "\n".join(
        f"* [Chapter {chapter}](chapter-{chapter}.md): {', '.join(chapters[chapter])}" for chapter in sorted(chapters)
    )
    return (
        "# Experiments\n\n"
        "Each shows something that the lecture notes say. `boebot experiment NAME` runs one, with `--on ROBOT` on\n"
        "another robot or board. It prints what was measured and expected, here in brackets, and leaves NAME.png and\n"
        "NAME.svg, the figure; NAME.csv, its data, with units in the columns' names and an empty cell where there is\n"
        "no number; and NAME.json, the verdict. The same seed gives the same bytes. The exit code is 0 when all is\n"
        "met.\n\n"
        "There is a page for each chapter of the notes, at seed 1; `make pictures` renews them. `make soak` runs all\n"
        "experiments at seeds 1 to 10. One that misses at some seeds states its rate.\n\n"
        f"{rows}\n"
    )


def picture(experiment: Experiment, outcome: Outcome, seed: int) -> dict[str, bytes]:
    """The figure of one that has run, with few enough dots and colours."""
    for dpi, colours in LOOKS:
        (drawn,) = output_files.pictures(experiment, outcome, {"png": dpi})
        target = io.BytesIO()
        few = Image.open(io.BytesIO(drawn)).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        few.save(target, "PNG", optimize=True)
        if len(target.getvalue()) <= LARGEST_BYTES:
            return {f"{experiment.name}.png": target.getvalue()}
    raise ValueError(f"its picture does not fit into {LARGEST_BYTES} bytes")


def main(chapters: list[str]) -> int:
    """Renews the pages of those chapters, or all; the exit code."""
    known = all_experiments().values()
    chosen = [one for one in known if not chapters or chapter_of(one) in chapters]
    with (
        progress_bar("experiments", len(chosen), unit="") as watch,
        closing(running.run(chosen, SEED, os.cpu_count() or 1, watch, "boebot_course.pages:picture")) as coming,
    ):
        verdicts = {verdict.name: verdict for verdict in coming}
    for verdict in verdicts.values():
        write_files(FOLDER, verdict.files)
    pages = {f"chapter-{chapter}.md": chapter_page(chapter, verdicts) for chapter in set(map(chapter_of, chosen))}
    pages["README.md"] = listing(known)
    write_files(FOLDER, {name: text.encode() for name, text in pages.items()})
    if not chapters:
        for path in FOLDER.iterdir():
            if path.name not in pages.keys() | {f"{one.name}.png" for one in known}:
                path.unlink()
    outside = [f"{one.name} {one.word}{one.error and ': '}{one.error}" for one in verdicts.values() if not one.is_met]
    print(f"{len(pages)} pages in {FOLDER}", *sorted(outside), sep="\n")
    return 1 if outside else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
