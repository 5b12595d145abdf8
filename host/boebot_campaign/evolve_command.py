"""`boebot evolve FILE`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from boebot.cli import options, output
from boebot_campaign import evolution, evolve_file
from boebot_campaign.command import Out, Scheduler, Workers, shown


def evolve(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="How to evolve: docs/how-to/evolve.md has its keys.")],
    out: Out = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check all, say how many runs it is, and run none.")
    ] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Find parameters with which a brain does better, as a file says.

    Stopped anywhere, the same command goes on where it was. The best brain is a TOML file that runs on any board."""
    asked, folder = evolve_file.read(file), out or Path(file.stem)
    if dry_run:
        output.print_json({"runs": asked.most_runs}) if json else output.line(f"at most {asked.most_runs:,} runs")
        return
    with shown("evolve", folder, asked.most_runs, quiet or json) as told:
        done = evolution.evolve(file, out=folder, scheduler=scheduler, workers=workers, progress=told)
    if json:
        output.print_json(msgspec.to_builtins(done, enc_hook=str))
    elif not quiet:
        output.line(f"fitness in training {done.curve[-1].best_so_far:.2f}, by hand {done.by_hand:.2f}")
        output.line(f"in the test {evolution.in_words(done)}")
        output.line(f"best brain: {done.brain}")
        output.line(f"picture: {done.picture}")
