"""A line full of each message in turn, in each image in the emulator, beside its bounds.

Run `python -m tools.full_lines [--seconds 5] [--seed 1] [--image shieldbot ...]`; `make soak` does. The exit code is 1
where a poll took longer than its bound, more bytes waited, or something was lost that is proven not to be.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table

from boebot import resources
from boebot.errors import BoebotError
from boebot.robots import load_robot
from boebot.timing.budget import prove
from boebot.timing.full_line import FullLine
from boebot.timing.loads import LOADS
from sim_bridge.timing.one_kind import TO_BOARD, Carried, carry

IMAGES = ("boebot", "shieldbot", "shieldbot-quad")


def broken(line: FullLine, seen: Carried, is_proven: bool) -> Iterator[str]:
    """What the emulator shows against the bounds, each a sentence without its end."""
    if seen.poll > line.cost.poll:
        yield f"a poll took {seen.poll} cycles, its bound is {line.cost.poll}"
    if line.ring is not None and seen.waiting > line.ring:
        yield f"{seen.waiting} bytes waited, their bound is {line.ring}"
    if is_proven and (seen.frames_lost or seen.bytes_lost or seen.good != seen.sent):
        yield f"{seen.frames_lost} frames and {seen.bytes_lost} bytes were lost, {seen.good} of {seen.sent} taken"


def judge(image: str, seconds: float, seed: int, console: Console) -> int:
    """Shows what came of each message in an image, what was seen before its bound; how many bounds are broken."""
    elf = resources.folder("images") / f"{image}.elf"
    report = prove(elf, LOADS["saturated"])
    lines = {line.cost.id: line for line in report.lines.lines}
    shown = Table(title=image, box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    shown.add_column("a line full of", no_wrap=True)
    for title in ("come", "bound", "", "poll", "bound", "ring", "bound", "lost"):
        shown.add_column(title, justify="right", no_wrap=True)
    sentences: list[str] = []
    for kind in track(TO_BOARD, description=image, console=console, transient=True):
        line, seen = lines[kind.ID], carry(elf, load_robot(image), kind, seconds, seed)
        found = list(broken(line, seen, line.is_proven(report.ring_holds)))
        shown.add_row(
            line.cost.name,
            f"{seen.per_tick:.1f}",
            f"{line.least:.1f}",
            "proven" if line.is_proven(report.ring_holds) else "",
            f"{seen.poll:,}",
            f"{line.cost.poll:,}",
            str(seen.waiting),
            "–" if line.ring is None else str(line.ring),
            f"{seen.frames_lost} + {seen.bytes_lost} B",
        )
        sentences += [f"{image}, {line.cost.name}: {sentence}" for sentence in found]
    console.print(shown)
    for sentence in sentences:
        console.print(f"broken: {sentence}")
    return len(sentences)


def main() -> int:
    """As the arguments say."""
    parser = argparse.ArgumentParser(prog="python -m tools.full_lines", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S", help="of the board's time, for each message")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the phases")
    parser.add_argument("--image", nargs="+", choices=IMAGES, default=IMAGES, metavar="NAME", help="only these")
    options = parser.parse_args()
    console = Console(highlight=False)
    try:
        count = sum(judge(image, options.seconds, options.seed, console) for image in options.image)
    except BoebotError as error:
        console.print(str(error))
        return 2
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
