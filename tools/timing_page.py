"""The documentation's page of the timing: bounds, what the emulator measured, goals and what misses them, in Markdown.

python -m tools.timing_page --page docs/reference/timing.md

prints the page there, and beside the other pictures the notes' timing diagram (Fig. 3.2) of a tick that was measured.
Without a measurement its cells are UNMEASURED: so the tests compare all else with the images of today.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.progress import track

from boebot import resources
from boebot.robots import load_robot
from boebot.tasks import DEFAULT_PERIOD
from boebot.timing import diagram, realisable
from boebot.timing.budget import FOR_EVER, RAM_BYTES, Report, Row, prove
from boebot.timing.graph import load_program
from boebot.timing.loads import LOADS
from boebot.timing.measured import Measurement
from sim_bridge.timing.measure import CLOCK_HZ, measure_image

ROOT = Path(__file__).resolve().parents[1]
TEXT = ROOT / "tools" / "timing_page.md"
PICTURE = "timing.svg"
DRAWN = "shieldbot"  # the image whose tick is drawn
SECONDS, SEED = 1.0, 1  # of each scenario, as `boebot timing` does by itself
UNMEASURED = "?"
NOTHING = "–"
SET_POINT = "setpoint_"  # how the names of all their messages begin
Reports = Mapping[str, Report]  # by load


# ---- what is looked at ---------------------------------------------------------------------------------------------


def elf(image: str) -> Path:
    """The file of a bundled image."""
    return resources.folder("images") / f"{image}.elf"


def measured(image: str) -> Measurement:
    """As `boebot timing` measures it."""
    return measure_image(elf(image), seconds=SECONDS, seed=SEED)


def reports(image: str, what: Measurement | None = None) -> Reports:
    """Of an image, under its loads."""
    program = load_program(elf(image))
    return {name: prove(elf(image), LOADS[name], what, program=program) for name in loads_of(image)}


def loads_of(image: str) -> tuple[str, ...]:
    """Every load for the image whose tick is drawn; the two that the project's figures are about for the others."""
    return tuple(LOADS) if image == DRAWN else ("figures", "saturated")


def gate() -> Any:
    """The module of the gate, hil_tests/test_timing_budgets.py. It takes a helper from the host's tests, which pytest
    finds by its own path."""
    sys.path.append(str(ROOT / "host" / "tests"))
    return importlib.import_module("hil_tests.test_timing_budgets")


# ---- cells and tables ----------------------------------------------------------------------------------------------


def table(titles: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1) -> str:
    """In Markdown; the first `words` columns to the left, numbers to the right."""
    ruler = [*["---"] * words, *["---:"] * (len(titles) - words)]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in (titles, ruler, *rows))


def _number(number: float | None, unknown: str = NOTHING) -> str:
    if number is None:
        return unknown
    return "∞" if number >= FOR_EVER else f"{number:,}"


def _each(numbers: Iterable[int]) -> str:
    """One number where all loads give the same, else all of them in their order."""
    return " / ".join(_number(number) for number in dict.fromkeys(numbers))


def _percent(cycles: int | None, of: int, unknown: str) -> str:
    return unknown if cycles is None else f"{100 * cycles / of:.1f} %"


def _unknown(report: Report) -> str:
    """What stands for a measured figure that is not there."""
    return UNMEASURED if report.measured is None else NOTHING


# ---- one image -----------------------------------------------------------------------------------------------------


def tasks(of: Reports) -> str:
    """Every task, with its response under each load."""
    titles = ["task (cycles)", "bound", "emulator", "ratio", "budget", "slack", *(f"response, {name}" for name in of)]
    unknown = _unknown(next(iter(of.values())))
    return table(titles, [_task(rows, unknown) for rows in _rows(of, "task")])


def _rows(of: Reports, kind: str) -> list[tuple[Row, ...]]:
    """Each task or interrupt as it is under all loads."""
    return [rows for rows in zip(*(report.rows for report in of.values()), strict=True) if rows[0].kind == kind]


def _task(rows: tuple[Row, ...], unknown: str) -> list[str]:
    first = rows[0]
    found = [unknown if row.ratio is None else f"{row.ratio:.2f}" for row in rows]
    return [
        first.name,
        _each(row.bound for row in rows),
        _number(first.emulator, unknown),
        " / ".join(dict.fromkeys(found)),
        _number(first.budget),
        _each(row.slack for row in rows),
        *(_number(row.response, "overload") for row in rows),
    ]


def interrupts(of: Reports) -> str:
    """Every interrupt, with its latency under each load."""
    titles = ["interrupt (cycles)", "bound", "emulator", "budget", "slack"]
    titles += [*(f"latency, {name}" for name in of), "limit"]
    unknown = _unknown(next(iter(of.values())))
    rows = [
        [
            row[0].name,
            _each(one.bound for one in row),
            _number(row[0].emulator, unknown),
            _number(row[0].budget),
            _each(one.slack for one in row),
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
    own, found, tick, unknown = report.own, report.responses, report.tick_cycles, _unknown(report)
    return {
        "work of its tasks, bound": _percent(report.tick_work, tick, NOTHING),
        "response, bound": _percent(found.tick if found else None, tick, "overload"),
        "tasks and interrupts, bound": _percent(report.demand, tick, NOTHING),
        "tasks and interrupts, emulator": _percent(own.worst_tick if own else None, tick, unknown),
        "any instruction, emulator": _percent(own.busiest_tick if own else None, tick, unknown),
        "load of slots and interrupts in the long run, bound": f"{100 * report.load_bound:.1f} %",
        "load with frames, emulator": f"{100 * own.load:.1f} %" if own else unknown,
        "between two polls of the link, bound (cycles)": _number(report.gap, "overload"),
        "between two polls of the link, emulator (cycles)": _number(own.between_polls if own else None, unknown),
        "in the receive ring, bound (bytes)": _number(report.ring, "overload"),
        "frames that come": f"{report.frames_coming:.1f}",
        "frames that can be worked off, the costliest, bound": f"{report.frames_proven:.1f}",
        "lost, emulator: bytes, frames, edges, ticks": lost(report),
    }


def lines(of: Reports) -> str:
    """Of each message what a line full of it takes, under the load whose line is full."""
    titles = ["a line full of", "frame (bytes)", "each (cycles)", "answer (bytes)"]
    titles += ["come in a tick", "worked off, bound", "can be answered", "margin", "in the receive ring, bound (bytes)"]
    rows = [
        [
            line.cost.name,
            str(line.cost.bytes),
            _number(line.cycles),
            _number(line.cost.answer or None),
            f"{line.carried:.1f}",
            f"{line.worked_off:.1f}",
            NOTHING if line.answered is None else f"{line.answered:.1f}",
            f"{100 * line.margin:.0f} %",
            _number(line.ring),
        ]
        for report in of.values()
        for line in report.lines.lines
    ]
    found = next((report.lines for report in of.values() if report.lines.lines), None)
    if found is None:
        return ""
    mixed = f"In any mix of {', '.join(found.mixed)}: {found.ring} bytes.\n" if found.mixed else ""
    return f"{table(titles, rows)}\n{mixed}"


def lost(report: Report) -> str:
    """How much should have come and did not under the report's own load."""
    return _number(sum(report.own.losses.values()) if report.own else None, _unknown(report))


def memory(report: Report) -> str:
    """RAM, stack and flash in a sentence."""
    found, seen = report.memory, _number(report.memory.stack_seen, UNMEASURED)
    return (
        f"Stack: {found.stack} bytes by bound, {seen} in the emulator; with {found.static:,} bytes of static RAM "
        f"{found.static + found.stack:,} of {RAM_BYTES:,}. Flash: {found.flash:,} bytes.\n"
    )


def _image(name: str, of: Reports) -> str:
    first = next(iter(of.values()))
    return "\n".join([f"## {name}.elf\n", tasks(of), interrupts(of), sums(of), lines(of), memory(first)])


# ---- all images ----------------------------------------------------------------------------------------------------


def goals(of: Mapping[str, Reports], limits: Any) -> str:
    """The figures that were set for the project, and what the images reach."""
    tick = limits.TICK
    rows = [
        ("load, emulator, `figures`", f"≤ {100 * limits.LOAD_MOST // tick} %", _load_percent),
        (
            "work of the fullest tick, bound",
            f"≤ {100 * limits.WORK_MOST // tick} %",
            lambda r: 100 * r.tick_work / tick,
        ),
        (
            "static RAM and stack, bound (bytes)",
            f"≤ {limits.MEMORY_MOST:,}",
            lambda r: r.memory.static + r.memory.stack,
        ),
        ("flash (bytes)", f"≤ {limits.FLASH_MOST:,}", lambda r: r.memory.flash),
    ]
    cells = [[what, goal, *(_goal(find(one["figures"])) for one in of.values())] for what, goal, find in rows]
    cells += [
        ["response of the tick, bound, `saturated`", "≤ 100 %", *(_response(one["saturated"]) for one in of.values())],
        [
            "a line full of set-points loses nothing, bound, `saturated`",
            "all of each kind",
            *(_set_points(one["saturated"]) for one in of.values()),
        ],
        ["lost, emulator, `saturated`", "0", *(lost(one["saturated"]) for one in of.values())],
    ]
    return table(["figure", "goal", *of], cells, 2)


def _load_percent(report: Report) -> float | None:
    return None if report.own is None else 100 * report.own.load


def _goal(figure: float | None) -> str:
    if figure is None:
        return UNMEASURED
    return f"{figure:,}" if isinstance(figure, int) else f"{figure:.1f} %"


def _set_points(report: Report) -> str:
    found = [line for line in report.lines.lines if line.cost.name.startswith(SET_POINT)]
    proven = [line.cost.name.removeprefix(SET_POINT) for line in found if line.is_proven(report.ring_holds)]
    return "all" if found and len(proven) == len(found) else ", ".join(proven) or "none"


def _response(report: Report) -> str:
    if report.responses is None:
        return f"overload, {100 * report.load_bound:.1f} %"
    return f"{100 * report.responses.tick / report.tick_cycles:.1f} %"


def known(limits: Any) -> str:
    """What the gate knows not to hold."""
    rows = [[one.what, f"{one.most:,}", ", ".join(one.images), one.why] for one in limits.KNOWN]
    return table(["what does not hold", "no more than", "images", "why"], rows, 4) if rows else "The table is empty.\n"


def loads() -> str:
    """Their names, and what they say."""
    return table(["load", "what comes"], [[name, load.says] for name, load in LOADS.items()], 2)


def sensors(report: Report) -> str:
    """How long a reading takes in hardware, how often it is taken, how old it is when it is told."""
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
    limits = gate()
    return TEXT.read_text(encoding="utf-8").format(
        goals=goals(of, limits),
        known=known(limits),
        drawn=DRAWN,
        picture=picture,
        steps=steps(of),
        sensors=sensors(of[DRAWN]["figures"]),
        loads=loads(),
        images="\n".join(_image(name, one) for name, one in of.items()),
    )


def main() -> None:
    """Prints the page, or writes it with its picture."""
    parser = argparse.ArgumentParser(prog="python -m tools.timing_page", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--page", type=Path, metavar="FILE", help="write it there, and its picture to ../images")
    options = parser.parse_args()
    images = gate().PIN_MAPS
    found = {name: reports(name, measured(name)) for name in track(images, "measuring", transient=True)}
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
    main()
