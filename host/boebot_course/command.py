"""`boebot experiment NAME`: runs experiments of the notes; prints what was measured against what was expected."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from contextlib import closing
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from boebot import resources
from boebot.cli import options, output
from boebot.errors import BoebotError, did_you_mean

if TYPE_CHECKING:
    from boebot_course.experiments import Experiment
    from boebot_course.running import Verdict

FOLDER = Path("experiments")


def listed() -> list[dict[str, Any]]:
    """Rows of `boebot list experiments`."""
    from boebot_course.experiments import all_experiments

    known = all_experiments().values()
    fields = ("name", "slow", "title", "robot", "section", "source")
    return [
        {field: getattr(one, field) for field in fields}
        | {"on": ", ".join(other.on for other in known if other.bare_name == one.name and other.on)}
        for one in known
        if one.name == one.bare_name
    ]


def _names() -> list[str]:
    from boebot_course.experiments import all_experiments

    return list(dict.fromkeys(one.bare_name for one in all_experiments().values()))


def experiment(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            autocompletion=options.one_of(_names),
            help="Of an experiment, or a pattern with * and ?.",
            show_default=False,
        ),
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Run all of them, on all their robots.")] = False,
    on: Annotated[
        str | None,
        typer.Option("--on", metavar="ROBOT", help="On which of its robots or boards, or a pattern. Else the first."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Seed of all that is left to chance.")] = 1,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where to write the files.")] = FOLDER,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", metavar="N", min=1, help="Processes beside each other. Else one for each processor."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Run experiments of the notes: figures, measured against expected.

      boebot list experiments         what there is

      boebot experiment E29 E59       two of them

      boebot experiment E22 --on avr  on another robot or board; --on "*" on all that it knows

      boebot experiment --all         all of them on all robots, beside each other

    Each leaves NAME.png and NAME.svg, its figure; NAME.csv, the data; NAME.json, the verdict. Several leave index.md
    too, a page of all of them. The exit code is 1 when one is outside its criterion.
    """
    # here, as it takes a while: no other sub-command should wait for it
    from boebot_course.experiments import all_experiments

    if every == bool(names):
        raise typer.BadParameter("give either NAME or --all")
    chosen = _chosen(names or ["*"], on or ("*" if every else None), all_experiments().values())
    _run(chosen, seed, out, jobs or os.cpu_count() or 1, json)


def _chosen(wanted: Sequence[str], on: str | None, known: Collection[Experiment]) -> list[Experiment]:
    """Those that are meant, each once, in the order of all; `on`: None for the first robot of each, else a pattern."""
    names: set[str] = set()
    for text in wanted:
        found = {one.bare_name for one in known if fnmatchcase(one.bare_name.lower(), text.lower())}
        if not found:
            near = did_you_mean(text, [one.bare_name for one in known]) or "; `boebot list experiments` names all"
            raise typer.BadParameter(f"there is no experiment {text!r}{near}")
        names |= found
    meant = [one for one in known if one.bare_name in names]
    chosen = [one for one in meant if (one.name == one.bare_name if on is None else fnmatchcase(one.on, on))]
    if not chosen:
        robots = ", ".join(dict.fromkeys(one.on for one in meant if one.on)) or "one robot alone"
        raise typer.BadParameter(f"no such experiment runs on {on!r}; expected {robots}")
    return chosen


def _run(experiments: Sequence[Experiment], seed: int, out: Path, jobs: int, as_json: bool) -> None:
    """Runs them, writes their files as they come, and prints what came of each.

    Raises:
        BoebotError: some are outside their criteria, or the files cannot be written.
    """
    from boebot.record.run_folder import make_folder, write_files
    from boebot_course import output_files, pages, running

    make_folder(out)
    by_name: dict[str, Verdict] = {}
    files: list[Path] = []
    with (
        output.progress_bar("experiments", len(experiments), unit="") as watch,
        closing(running.run(experiments, seed, jobs, watch, "boebot_course.output_files:files")) as coming,
    ):
        for verdict in coming:
            by_name[verdict.name] = verdict
            files += write_files(out, verdict.files)
    verdicts = [by_name[one.name] for one in experiments]
    if len(verdicts) > 1:
        met = sum(verdict.is_met for verdict in verdicts)
        index = pages.page(f"Experiments: {met} of {len(verdicts)} met, seed {seed}", experiments, by_name)
        files = write_files(out, {"index.md": index.encode()}) + sorted(files)
    if as_json:
        pairs = zip(experiments, verdicts, strict=True)
        found = [output_files.record(one, verdict.measured, verdict.error) for one, verdict in pairs]
        known = {"seed": seed, "version": resources.version(), "experiments": found}
        output.print_json(known | {"files": list(map(str, files))})
    else:
        _print(experiments, verdicts)
        if files:
            few = len(verdicts) == 1
            names = ", ".join(path.name for path in files)
            output.line(f"files in {out}: {names}" if few else f"all figures: {files[0]}")
    outside = [verdict.name for verdict in verdicts if not verdict.is_met]
    if outside:
        which = f"{len(outside)} of {len(verdicts)} experiments are" if len(verdicts) > 1 else "the experiment is"
        raise BoebotError(f"{which} outside the criterion: {', '.join(outside)}")


def _print(experiments: Sequence[Experiment], verdicts: Sequence[Verdict]) -> None:
    """A table for each."""
    from rich.text import Text

    console = output.console()
    colours = {"met": "green", "missed": "bold red", "failed": "bold red"}
    for one, verdict in zip(experiments, verdicts, strict=True):
        console.print(
            Text.assemble((one.name, "bold"), f"  {one.title}  ", (verdict.word, colours[verdict.word])),
            Text(f"{one.source}; robot: {one.robot}", style="dim"),
            sep="\n",
        )
        if verdict.error:
            console.print(Text(verdict.error))
        else:
            rows = output.empty_table()
            for title in ("figure", "measured", "expected", "unit", ""):
                rows.add_column(title, justify="right" if title == "measured" else "left", overflow="fold")
            for figure in verdict.measured:
                cells = map(Text, (figure.name, figure.text, figure.expected, figure.unit))
                rows.add_row(*cells, Text(figure.word, colours[figure.word]))
            console.print(rows)
        console.print(Text(f"Criterion: {one.criterion}", style="dim"))
        console.print()
