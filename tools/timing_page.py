"""The documentation's page of the timing: what is promised, bounds, and what the emulator measured, in Markdown.

python -m tools.timing_page --page docs/reference/timing.md

prints the page there, and beside the other pictures the notes' timing diagram (Fig. 3.2) of a tick that was measured.
Without a measurement its cells are UNMEASURED: so the tests compare all else with the images of today.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rich.progress import track

from avr_timing.closed_pipe import exit_as
from boebot import resources
from boebot.description.robots import load_robot
from boebot.running.tasks import DEFAULT_PERIOD
from boebot_timing import diagram, realisable
from boebot_timing.budget import FOR_EVER, RAM_BYTES, Report, Row, prove_all
from boebot_timing.emulated.measure import CLOCK_HZ, measure_image
from boebot_timing.loads import LOADS
from boebot_timing.measured import Measurement
from tools.avr_program import IMAGES
from tools.timing_promises import PROMISES, Promise

ROOT = Path(__file__).resolve().parents[1]
TEXT = ROOT / "tools" / "timing_page.md"
PICTURE = "timing.svg"
DRAWN = "shieldbot"  # the image whose tick is drawn
SECONDS, SEED = 1.0, 1  # of each scenario, as `boebot timing` does by itself
UNMEASURED = "?"
NOTHING = "–"
Reports = Mapping[str, Report]  # by load


# ---- what is looked at ---------------------------------------------------------------------------------------------


def elf(image: str) -> Path:
    """The file of a bundled image."""
    return resources.folder("images") / f"{image}.elf"


def measured(image: str) -> Measurement:
    """As `boebot timing` measures it."""
    return measure_image(elf(image), seconds=SECONDS, seed=SEED)


def reports(image: str, what: Measurement | None = None) -> dict[str, Report]:
    """Of an image, under every load."""
    return prove_all(elf(image), LOADS, what)


# ---- cells and tables ----------------------------------------------------------------------------------------------


def table(titles: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> str:
    """In Markdown; the first `words` columns to the left, numbers to the right."""
    ruler = [*["---"] * words, *["---:"] * (len(titles) - words)]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (titles, ruler, *rows))


def _number(number: float | None, unknown: str = NOTHING) -> str:
    if number is None:
        return unknown
    if number >= FOR_EVER:
        return "∞"
    return f"{number:,}" if isinstance(number, int) else f"{number:,.1f}"


def _each(numbers: Iterable[int]) -> str:
    """One number where all loads give the same, else all of them in their order."""
    return " / ".join(_number(number) for number in dict.fromkeys(numbers))


def _unknown(report: Report) -> str:
    """What stands for a measured figure that is not there."""
    return UNMEASURED if report.measured is None else NOTHING


# ---- one image -----------------------------------------------------------------------------------------------------


def tasks(of: Reports) -> str:
    """Every task, with its response under each load."""
    titles = ["task (cycles)", "bound", "emulator", "ratio", "budget", *(f"response, {name}" for name in of)]
    unknown = _unknown(next(iter(of.values())))
    return table(titles, [_task(rows, unknown) for rows in _rows(of, "task")])


def _rows(of: Reports, kind: str) -> list[tuple[Row, ...]]:
    """Each task or interrupt as it is under all loads."""
    return [rows for rows in zip(*(report.rows for report in of.values()), strict=True) if rows[0].kind == kind]


def _task(rows: tuple[Row, ...], unknown: str) -> list[str]:
    first = rows[0]
    return [
        first.name,
        _number(first.bound) if first.unbounded is None else "not bounded",
        _number(first.emulator, unknown),
        unknown if first.ratio is None else f"{first.ratio:.2f}",
        _number(first.budget),
        *(_number(row.response, "overload") for row in rows),
    ]


def interrupts(of: Reports) -> str:
    """Every interrupt, with its latency under each load."""
    titles = ["interrupt (cycles)", "bound", "emulator", "budget", *(f"latency, {name}" for name in of), "limit"]
    unknown = _unknown(next(iter(of.values())))
    rows = [
        [
            row[0].name,
            _each(one.bound for one in row),
            _number(row[0].emulator, unknown),
            _number(row[0].budget),
            *(_number(one.latency) for one in row),
            _number(row[0].latency_limit),
        ]
        for row in _rows(of, "interrupt")
    ]
    return table(titles, rows)


def sums(of: Reports) -> str:
    """What a tick takes under each load, as shares of the tick or of all cycles."""
    columns = [_sums(report) for report in of.values()]
    return table(["of a tick", *of], [[name, *(column[name] for column in columns)] for name in columns[0]])


def _sums(report: Report) -> dict[str, str]:
    own, found, unknown = report.own, report.responses, _unknown(report)

    def percent(cycles: int | None, nothing: str = unknown) -> str:
        return nothing if cycles is None else f"{100 * cycles / report.tick_cycles:.1f} %"

    return {
        "work of its tasks, bound": percent(report.tick_work),
        "response, bound": percent(found.tick if found else None, "overload"),
        "tasks and interrupts, emulator": percent(own.worst_tick if own else None),
        "any instruction, emulator": percent(own.busiest_tick if own else None),
        "load with frames, emulator": f"{100 * own.load:.1f} %" if own else unknown,
        "slots that ended in the next one, emulator": _number(own.late_slots if own else None, unknown),
        "between two polls of the link, bound (cycles)": _number(report.gap, "overload"),
        "in the receive ring, bound (bytes)": _number(report.ring),
        "pin changes that wait, bound": _number(report.changes),
        "lost, emulator: bytes, frames, edges": _number(lost(own), unknown),
    }


def lost(of: Measurement | None) -> int | None:
    """How much of what came under a load did not arrive; None: nothing was measured."""
    return None if of is None else sum(of.losses.get(kind, 0) for kind in ("bytes", "frames", "edges"))


def memory(report: Report) -> str:
    """RAM, stack and flash in a sentence."""
    found, seen = report.memory, _number(report.memory.stack_seen, UNMEASURED)
    return (
        f"Stack: {found.stack} bytes by bound, {seen} in the emulator; with {found.static:,} bytes of static RAM "
        f"{found.static + found.stack:,} of {RAM_BYTES:,}. Flash: {found.flash:,} bytes.\n"
    )


def image_section(name: str, of: Reports) -> str:
    """All about an image."""
    first = next(iter(of.values()))
    return "\n".join([f"## {name}.elf\n", tasks(of), interrupts(of), sums(of), memory(first)])


# ---- all images ----------------------------------------------------------------------------------------------------


def promised(of: Mapping[str, Reports]) -> str:
    """What is promised, and what the images reach."""
    rows = []
    for one in PROMISES:
        cells = [_reached(one.figure(reports_[one.load]), one.unit) for reports_ in of.values()]
        rows.append([f"`{one.load}`", one.what, limit(one), *cells])
    return table(["load", "promise", "limit", *of], rows, 3)


def limit(of: Promise) -> str:
    """Of a promise, for people."""
    return f"≤ {of.most:,} {of.unit}".strip() if of.most else "none"


def _reached(figure: float | None, unit: str) -> str:
    if figure is None:
        return UNMEASURED
    if isinstance(figure, int):
        return f"{figure:,}"
    return f"{figure:.1f} %" if unit == "%" else f"{figure:.2f}"


def loads() -> str:
    """Their names, and what they say."""
    return table(["load", "what comes"], [[name, load.says] for name, load in LOADS.items()], 2)


def sensors(report: Report) -> str:
    """How long a reading takes in hardware, how often it is taken, how old it is when it is sent."""
    tick_ms = report.tick_cycles * 1000 / CLOCK_HZ
    rows = [
        [
            row.name,
            f"{row.conversion / 1000:g}",
            f"{row.period * tick_ms:g}",
            f"{row.conversion / (row.period * tick_ms * 10):.0f} %",
            f"{row.age / 1000:g}",
        ]
        for row in report.table.sensors
    ]
    return table(["sensor", "conversion (ms)", "period (ms)", "share", "age (ms)"], rows)


def verdict(image: str, report: Report) -> realisable.Verdict:
    """Of a step of the brain on the robot of that name, by the image's bounds."""
    found = report.responses
    telemetry = found.pieces["telemetry"] if found else 0
    board = realisable.BoardTimes(report.table.sensors, telemetry / CLOCK_HZ, (report.taken or 0) / CLOCK_HZ)
    return realisable.judge(load_robot(image), DEFAULT_PERIOD, board=board)


def steps(of: Mapping[str, Reports]) -> str:
    """What follows one another in a step of the brain, for each robot."""
    found = [verdict(image, one["figures"]) for image, one in of.items()]
    path = [[event for event in each.events if not event.beside] for each in found]
    rows = [[event.name, *(f"{each[i].seconds * 1000:.3f}" for each in path)] for i, event in enumerate(path[0])]
    rows.append(["all of them", *(f"{each.seconds * 1000:.3f}" for each in found)])
    return table(["in a step of the brain (ms)", *of], rows)


def page(of: Mapping[str, Reports], picture: str) -> str:
    """The whole page.

    Args:
        of: each image's reports, by the image's name.
        picture: where the diagram is, as seen from the page.
    """
    return TEXT.read_text(encoding="utf-8").format(
        promised=promised(of),
        drawn=DRAWN,
        picture=picture,
        steps=steps(of),
        sensors=sensors(of[DRAWN]["figures"]),
        loads=loads(),
        images="\n".join(image_section(name, one) for name, one in of.items()),
    )


def main() -> None:
    """Prints the page, or writes it with its picture."""
    parser = argparse.ArgumentParser(prog="python -m tools.timing_page", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--page", type=Path, metavar="FILE", help="write it there, and its picture to ../images")
    options = parser.parse_args()
    found = {name: reports(name, measured(name)) for name in track(IMAGES, "measuring", transient=True)}
    picture = Path("..") / "images" / PICTURE
    text = page(found, str(picture))
    if options.page is None:
        print(text, end="")
        return
    report = found[DRAWN]["figures"]
    drawn = diagram.files(report, verdict(DRAWN, report))["timing.svg"]
    (options.page.parent / picture).write_bytes(drawn)
    options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    exit_as(main)
