"""The timing diagram of the notes (Fig. 3.2), drawn to scale: what fills a time step, and how much of it is left.

Above, one control tick as a whole: tasks, interrupts, the line, and what sensors do in hardware of their own meanwhile.
Below, the work of each slot, enlarged so that its tasks can be read. Spans come from a tick that was measured; where
none was, tasks are drawn as long as they can take by their bounds.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from boebot.report import style
from boebot.timing.budget import Report
from boebot.timing.measured import Moment
from boebot.timing.realisable import Verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "timing"
_CYCLES_PER_MS = 16_000
_COLOURS = {"task": "#0072b2", "interrupt": "#d55e00", "line": "#cc79a7", "process": "#009e73", "sense": "#e69f00"}
_HEIGHT = 0.66  # of a box, in lanes
_LETTER = 0.011  # width of a letter, as a share of the axes


def moments(report: Report) -> tuple[Moment, ...]:
    """Spans of one tick: those that were measured, or the tasks of the first tick by their bounds."""
    if report.measured is not None and report.measured.tick:
        return report.measured.tick
    found = []
    busy = 0
    for slot in range(report.schedule.slots_per_tick):
        busy = max(busy, slot * report.schedule.slot_cycles)
        for piece in report.schedule.slots[slot % len(report.schedule.slots)]:
            found.append(Moment(piece.name, "task", busy, busy + piece.cycles))
            busy += piece.cycles
    return tuple(found)


def figure(report: Report, verdict: Verdict | None = None) -> Figure:
    """The diagram; `verdict` adds the line, the brain and the sensors of a robot."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    spans = moments(report)
    with rc_context(style.PLOTS):
        drawn = Figure(figsize=(style.WIDTH_IN, 7.4), dpi=style.DPI, layout="constrained")
        FigureCanvasAgg(drawn)
        above, below = drawn.subplots(2, 1, height_ratios=(1, 1.25))
        _tick(above, spans, report, verdict)
        _slots(below, spans, report)
        measured = report.measured is not None and bool(report.measured.tick)
        how = "as measured" if measured else "by bounds: no tick was measured"
        drawn.suptitle(f"One control tick, drawn to scale, {how}", color=style.INK, fontsize=12)
    return drawn


def files(report: Report, verdict: Verdict | None = None) -> dict[str, bytes]:
    """The diagram as timing.png and timing.svg."""
    from matplotlib import rc_context

    drawn = figure(report, verdict)
    found = {}
    for kind in ("png", "svg"):
        target = io.BytesIO()
        with rc_context({"svg.hashsalt": "boebot", "svg.fonttype": "none"}):
            drawn.savefig(target, format=kind, metadata={"Date": None} if kind == "svg" else None)
        found[f"{NAME}.{kind}"] = target.getvalue()
    return found


def _tick(axes: Axes, spans: Sequence[Moment], report: Report, verdict: Verdict | None) -> None:
    """The whole tick, a lane for each kind of event."""
    period_ms = report.tick_cycles / _CYCLES_PER_MS
    boxes = [(span.name, span.kind, span.begin / _CYCLES_PER_MS, span.end / _CYCLES_PER_MS) for span in spans]
    lanes = ["tasks"] + (["interrupts"] if any(kind == "interrupt" for _, kind, _, _ in boxes) else [])
    rows = [("tasks" if kind == "task" else "interrupts", *rest) for rest in boxes for kind in (rest[1],)]
    if verdict is not None:
        period_ms = max(period_ms, verdict.period_s * 1000)
        for event in verdict.events:
            if event.kind == "command" or (event.kind == "sense" and not event.beside):
                continue  # work of tasks, which are drawn
            lane = event.name.partition(",")[0]
            rows.append((lane, event.name, event.kind, event.begin * 1000, event.end * 1000))
            lanes += [] if lane in lanes else [lane]
    for lane, name, kind, begin, end in rows:
        place = lanes.index(lane)
        axes.barh(place, end - begin, _HEIGHT, left=begin, color=_COLOURS[kind], linewidth=0)
        if lane not in ("tasks", "interrupts"):
            _label(axes, f"{name}  {end - begin:.3g} ms", begin, end, place, period_ms)
    axes.axvline(period_ms, color=style.INK, linewidth=1.2)
    axes.annotate("", (period_ms, -0.75), (0, -0.75), arrowprops={"arrowstyle": "<->", "color": style.INK})
    axes.text(period_ms / 2, -0.85, f"Δt = {period_ms:g} ms", ha="center", va="bottom", color=style.INK)
    axes.set_yticks(range(len(lanes)), lanes)
    axes.set_ylim(len(lanes) - 0.5, -1.35)
    longest = max([period_ms, *(end for *_, end in rows)])
    axes.set_xlim(0, longest * 1.02)
    axes.set_xlabel("time since the tick began (ms)")
    axes.grid(axis="y", visible=False)


def _label(axes: Axes, text: str, begin: float, end: float, place: float, width: float) -> None:
    """In the box where it fits, else beside it."""
    if (end - begin) / width > _LETTER * len(text):
        axes.text((begin + end) / 2, place, text, ha="center", va="center", color="white", fontsize=8.5)
    elif end / width < 0.7:
        axes.text(end + 0.006 * width, place, text, ha="left", va="center", color=style.INK, fontsize=8.5)
    else:
        axes.text(begin - 0.006 * width, place, text, ha="right", va="center", color=style.INK, fontsize=8.5)


def _slots(axes: Axes, spans: Sequence[Moment], report: Report) -> None:
    """The tasks of each slot, from the slot's beginning; interrupts below them."""
    slot_cycles, count = report.schedule.slot_cycles, report.schedule.slots_per_tick
    rows: list[list[Moment]] = [[] for _ in range(count)]
    for span in spans:
        slot = min(span.begin // slot_cycles, count - 1)
        rows[slot].append(span)
    ends = [span.end - slot * slot_cycles for slot, row in enumerate(rows) for span in row if span.kind == "task"]
    longest = max(ends, default=1)
    width = max(longest * 1.03, 1)
    for slot, row in enumerate(rows):
        for number, span in enumerate(one for one in row if one.kind == "task"):
            begin, end = span.begin - slot * slot_cycles, span.end - slot * slot_cycles
            shade = 1.0 if number % 2 == 0 else 0.72  # neighbours differ
            axes.barh(slot, end - begin, 0.34, left=begin, color=_COLOURS["task"], alpha=shade, linewidth=0)
        _names(axes, [one for one in row if one.kind == "task"], slot, slot_cycles, width)
        for span in row:
            if span.kind == "interrupt":
                begin, length = span.begin - slot * slot_cycles, span.end - span.begin
                axes.barh(slot + 0.27, length, 0.16, left=begin, color=_COLOURS["interrupt"], linewidth=0)
    axes.set_yticks(range(count), [f"slot {slot}" for slot in range(count)])
    axes.set_ylim(count - 0.5, -0.75)
    axes.set_xlim(0, width)
    share = 100 * width / slot_cycles
    axes.set_xlabel(f"cycles since the slot began ({share:.0f} % of a slot's {slot_cycles:,} are shown)")
    axes.grid(axis="y", visible=False)


def _names(axes: Axes, row: Sequence[Moment], slot: int, slot_cycles: int, width: float) -> None:
    """The names of tasks above their boxes, slanted; those of the shortest are left out where they would collide."""
    last = -width
    by_length = sorted(row, key=lambda span: span.begin - span.end)
    kept: list[float] = []
    for span in by_length:
        middle = (span.begin + span.end) / 2 - slot * slot_cycles
        if all(abs(middle - other) > 0.017 * width for other in kept):
            kept.append(middle)
            axes.text(middle, slot - 0.19, span.name, rotation=38, ha="left", va="bottom", fontsize=7, color=style.INK)
        last = max(last, middle)
