"""The timing diagram of the notes (Fig. 3.2), drawn to scale: what fills a time step, and how much of it is left.

From above: the time step of the brain with all that follows one another in it, and what devices do beside it in
hardware of their own; the tasks of each slot of one control tick of the board, enlarged so that they can be read. Spans
come from the fullest tick that was measured; where none was, tasks are drawn as long as they can take by their bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.arguments import duration
from boebot.running.driver import TICK_S
from boebot.view import style
from boebot_timing.budget import Report
from boebot_timing.costs import SLOT_BEGINS
from boebot_timing.measured import Moment
from boebot_timing.plots import PLOTS
from boebot_timing.realisable import Event, Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "timing"
SCHEDULER = "scheduler"  # kind of a span before a slot's tasks
_COLOURS = {"task": "#0072b2", "interrupt": "#d55e00", "line": "#cc79a7", "process": "#009e73", "sense": "#e69f00"}
_COLOURS["command"] = _COLOURS["task"]
_ON = dict.fromkeys(_COLOURS, "white") | {"line": style.INK, "sense": style.INK}  # of text on these
_LEGEND = {
    "task": "task",
    "interrupt": "interrupt",
    "line": "bytes on the line",
    "process": "brain",
    "sense": "reading, in separate hardware",
}
_BETWEEN = "#d9dee5"  # the scheduler, before a slot's tasks and between them
_HEIGHT = 0.66  # of a box, in lanes
_LANE_IN, _SLOT_IN, _FRAME_IN = 0.24, 0.98, 1.0  # heights
_APART = 0.024  # of the names of tasks, as a share of the axes


def moments(report: Report) -> tuple[Moment, ...]:
    """Spans of one tick: those that were measured, or the tasks of the first tick by their bounds."""
    if measured := _measured(report):
        return measured
    found = []
    busy = 0
    for slot in range(report.schedule.slots_per_tick):
        busy = max(busy, slot * report.schedule.slot_cycles)
        for piece in report.schedule.slots[slot % len(report.schedule.slots)]:
            around, kind = (0, SCHEDULER) if piece.name == SLOT_BEGINS else (report.costs.around, "task")
            found.append(Moment(piece.name, kind, busy, busy + piece.cycles - around))
            busy += piece.cycles
    return tuple(found)


def _measured(report: Report) -> tuple[Moment, ...]:
    """Under the report's own load, else under another; none where no tick was measured."""
    run = report.own or report.measured
    return run.tick if run is not None else ()


def figure(report: Report, verdict: Verdict | None = None) -> Figure:
    """The diagram; `verdict` adds the step of the brain, with the line and the sensors of a robot."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    spans = moments(report)
    events = verdict.events if verdict is not None else ()
    heights = [_LANE_IN * (len(events) + 2.5) + 0.5] if events else []
    heights.append(_SLOT_IN * report.schedule.slots_per_tick + 0.8)
    with rc_context(PLOTS):
        drawn = Figure(figsize=(style.WIDTH_IN, sum(heights) + _FRAME_IN), dpi=style.DPI, layout="constrained")
        axes = drawn.subplots(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
        if verdict is not None and events:
            step(axes[0], verdict)
        _slots(axes[-1], spans, report)
        _legend(drawn, {span.kind for span in spans} | {event.kind for event in events})
        drawn.suptitle(f"{Path(report.path).name}: {_how(report)}", color=style.INK, fontsize=12)
    return drawn


def _how(report: Report) -> str:
    if not _measured(report):
        return "tasks as long as their bounds, drawn to scale"
    run = report.own or report.measured
    assert run is not None
    return f"the fullest tick that was measured ({run.scenarios[0]}), drawn to scale"


def files(report: Report, verdict: Verdict | None = None) -> dict[str, bytes]:
    """The diagram as timing.png and timing.svg."""
    from boebot.view import figure_file

    drawn = figure(report, verdict)
    return {f"{NAME}.{kind}": figure_file.as_bytes(drawn, kind, "Timing of the firmware") for kind in ("png", "svg")}


def _legend(drawn: Figure, kinds: set[str]) -> None:
    from matplotlib.patches import Patch

    shown = [Patch(color=_COLOURS[kind], label=label) for kind, label in _LEGEND.items() if kind in kinds]
    shown.insert(1, Patch(color=_BETWEEN, label=SCHEDULER))
    drawn.legend(handles=shown, loc="outside lower center", ncols=3, frameon=False, fontsize=8.5)


# ---- the step of the brain ------------------------------------------------------------------------------------------


def step(axes: Axes, verdict: Verdict) -> None:
    """A lane for each event of the time step, in their order; what is left of it; devices below."""
    period = verdict.period_s * 1000
    ticks = range(1, round(verdict.period_s / TICK_S))
    for tick in ticks:
        axes.axvline(tick * TICK_S * 1000, color=style.INK, linewidth=0.5, linestyle=(0, (1, 3)))
    longest = max([period, *(event.end * 1000 for event in verdict.events)])
    path = [event for event in verdict.events if not event.beside]
    beside = [event for event in verdict.events if event.beside]
    for lane, event in [*enumerate(path), *enumerate(beside, len(path) + 1)]:
        _event(axes, lane, event, longest)
    if verdict.is_realisable:
        _span(axes, verdict.seconds * 1000, period, len(path), duration(verdict.period_s - verdict.seconds))
    axes.axvline(period, color=style.INK, linewidth=1.2)
    _span(axes, 0, period, -1, f"Δt = {period:g} ms")
    names = [*(event.name for event in path), "what is left", *(event.name for event in beside)]
    axes.set_yticks(range(len(names)), names, fontsize=8.5)
    axes.set_ylim(len(names) - 0.5, -1.7)
    axes.set_xlim(0, longest * 1.02)
    axes.set_xlabel("time since the step of the brain began (ms); dotted: control ticks of 10 ms", fontsize=9)
    axes.set_title(f"Step of the brain, robot {verdict.robot}", loc="left", fontsize=10)
    axes.grid(visible=False)


def _event(axes: Axes, lane: int, event: Event, longest: float) -> None:
    """Its box; how long it takes stands beside it, or in it where it is long."""
    begin, length = event.begin * 1000, event.seconds * 1000
    kind = event.kind if event.beside or event.kind != "sense" else "task"
    axes.barh(lane, length, _HEIGHT, left=begin, color=_COLOURS[kind], linewidth=0)
    text = duration(event.seconds) + (f", every {duration(event.every)}" if event.beside else "")
    if length > 0.3 * longest:
        axes.text(begin + length / 2, lane, text, ha="center", va="center", color=_ON[kind], fontsize=8)
    else:
        axes.text(begin + length + 0.007 * longest, lane, text, ha="left", va="center", color=style.INK, fontsize=8)


def _span(axes: Axes, begin: float, end: float, lane: float, text: str) -> None:
    """A length with arrows at both ends, and what it is in its middle."""
    arrow = {"arrowstyle": "<->", "color": style.INK, "shrinkA": 0, "shrinkB": 0, "linewidth": 0.8}
    axes.annotate("", (end, lane), (begin, lane), arrowprops=arrow)
    paper = {"facecolor": axes.get_facecolor(), "edgecolor": "none", "pad": 1.5}
    axes.text((begin + end) / 2, lane, text, ha="center", va="center", color=style.INK, fontsize=8.5, bbox=paper)


# ---- the slots -------------------------------------------------------------------------------------------------------


def _slots(axes: Axes, spans: Sequence[Moment], report: Report) -> None:
    """The tasks of each slot, from the slot's beginning; interrupts below them."""
    slot_cycles, count = report.schedule.slot_cycles, report.schedule.slots_per_tick
    rows: list[list[Moment]] = [[] for _ in range(count)]
    for span in spans:
        slot = min(span.begin // slot_cycles, count - 1)
        begin, end = span.begin - slot * slot_cycles, span.end - slot * slot_cycles
        rows[slot].append(Moment(span.name, span.kind, begin, end))
    longest = max((span.end for row in rows for span in row if span.kind == "task"), default=1)
    width = max(longest * 1.06, 1)
    for slot, row in enumerate(rows):
        _slot(axes, slot, row, width)
    axes.set_yticks(range(count), [f"slot {slot}" for slot in range(count)], fontsize=8.5)
    axes.set_ylim(count - 0.55, -0.85)
    axes.set_xlim(0, width)
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.set_xlabel("cycles of 1/16 µs since the slot began", fontsize=9)
    share = 100 * width / slot_cycles
    text = f"Slots, enlarged: the first {width / 16:,.0f} µs, {share:.0f} % of each slot's {slot_cycles / 16:,.0f} µs"
    axes.set_title(text, loc="left", fontsize=10)
    axes.grid(axis="y", visible=False)


def _slot(axes: Axes, slot: int, row: Sequence[Moment], width: float) -> None:
    tasks = [span for span in row if span.kind == "task"]
    between = [(span.begin, span.end) for span in row if span.kind == SCHEDULER]
    between += [(before.end, after.begin) for before, after in pairwise(tasks) if after.begin > before.end]
    for begin, end in between:
        axes.barh(slot, end - begin, 0.14, left=begin, color=_BETWEEN, linewidth=0)
    for number, span in enumerate(tasks):
        shade = 1.0 if number % 2 == 0 else 0.72  # neighbours differ
        axes.barh(slot, span.end - span.begin, 0.26, left=span.begin, color=_COLOURS["task"], alpha=shade, linewidth=0)
    for span in row:
        if span.kind == "interrupt" and span.begin < width:
            length = span.end - span.begin
            axes.barh(slot + 0.24, length, 0.1, left=span.begin, color=_COLOURS["interrupt"], linewidth=0)
    _names(axes, tasks, slot, width)


def _names(axes: Axes, row: Sequence[Moment], slot: int, width: float) -> None:
    """The names of tasks above their boxes, slanted; each as near as the one before it lets it."""
    last = -width
    for span in row:
        middle = (span.begin + span.end) / 2
        place = max(middle, last + _APART * width)
        last = place
        axes.annotate(
            span.name,
            (middle, slot - 0.14),
            (place, slot - 0.22),
            rotation=40,
            rotation_mode="anchor",
            ha="left",
            va="bottom",
            fontsize=7.5,
            color=style.INK,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": style.INK, "linewidth": 0.4, "shrinkA": 0, "shrinkB": 0},
        )
