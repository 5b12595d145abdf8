"""Jitter and latency of an untouched image, as distributions: what its pins and its line show under each load.

A run is made in jitter_run.py; here its record becomes values, one for each pulse, edge, frame or event.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from boebot.link import messages
from boebot_timing.emulated.line import Heard
from boebot_timing.emulated.losses import Losses, losses
from boebot_timing.tests import latency_limits as limits
from boebot_timing.tests.jitter_run import CENTRE, GAIN, MIRROR, Run
from boebot_timing.tests.latency_limits import SERVO_FRAME_CYCLES, Limits
from sim_bridge.bench.pins import Pin

CYCLES_PER_US = 16
SAME_WIDTH = 16  # cycles by which a pulse may differ from the set-point's


@dataclass(frozen=True, slots=True)
class Distribution:
    """All values of one quantity under one load, in cycles, in the order in which they came; `least` and `most` are
    what it may be, as promised or derived from the schedule; None: not said."""

    quantity: str  # "servo width, left"
    values: NDArray[np.int64]
    least: int | None
    most: int | None

    @property
    def broken(self) -> int:
        """How many values are not what they may be."""
        below = 0 if self.least is None else int(np.sum(self.values < self.least))
        above = 0 if self.most is None else int(np.sum(self.values > self.most))
        return below + above


def distributions(run: Run) -> list[Distribution]:
    """All quantities of a run."""
    return [
        *servo_pulses(run),
        echo_lengths(run),
        *(_only_counted(one) if run.load == "overload" else one for one in (*reactions(run), *observations(run))),
    ]


def _only_counted(one: Distribution) -> Distribution:
    """Without limits: where frames are dropped nothing is promised of how soon something is reported."""
    return replace(one, least=None, most=None)


def _of(quantity: str, values: Iterable[int], may: Limits) -> Distribution:
    return Distribution(quantity, np.array(list(values), dtype=np.int64), *may)


def width_of(side: str, signals: tuple[int, int]) -> int:
    """Cycles of the pulse that a set-point asks for: centre + gain x signal (motion.c), exact for `SIGNALS`."""
    signal = signals[0] if side == "left" else signals[1]
    return CENTRE + MIRROR[side] * GAIN * signal // 10_000


def servo_pulses(run: Run) -> list[Distribution]:
    """Width of both servos' pulses, less what was set, and their period from rise to rise, less 20 ms."""
    found = []
    widths = {side: [width_of(side, change.signals) for change in run.traffic.changes] for side in MIRROR}
    for side in MIRROR:
        pin = run.pins[f"servo {side}"]
        pulses = Pin(run.bench, pin).all_pulses(run.begun + 1)
        pulses = pulses[pulses[:, 0] < run.ended]
        allowed = np.array(sorted(set(widths[side])) or [CENTRE])
        errors = [int(width - allowed[np.argmin(np.abs(allowed - width))]) for width in pulses[:, 1]]
        periods = np.diff(pulses[:, 0]) - SERVO_FRAME_CYCLES
        found += [
            _of(f"servo width, {side}", errors, limits.EXACT),
            _of(f"servo period, {side}", periods, limits.EXACT),
        ]
    return found


def echo_lengths(run: Run) -> Distribution:
    """An echo's length as reported, in whole microseconds, less that of the pulse."""
    errors = [
        heard.message.ping_echo * CYCLES_PER_US - (fall - rise)
        for (rise, fall), heard in echoes_told(run)
        if run.begun < rise < run.ended
    ]
    return _of("echo length", errors, limits.ECHO)


def echoes_told(run: Run) -> Iterator[tuple[tuple[int, int], Heard]]:
    """Each echo with the first telemetry that shows it: the one whose age begins anew."""
    telemetry = run.line.telemetry
    for before, heard in pairwise(telemetry):
        if heard.message.ping_age < before.message.ping_age or before.message.ping_age == 255 != heard.message.ping_age:
            ended = [echo for echo in run.ping.echoes if run.begun < echo[1] < heard.first]
            if ended:
                yield ended[-1], heard


def reactions(run: Run) -> list[Distribution]:
    """From the last byte of a frame to what it brings about; of a set-point to the first pulse of its width."""
    answers = {
        heard.message.token: heard.first for heard in run.line.heard if isinstance(heard.message, messages.ClockAnswer)
    }
    probes = [answers[probe.token] - probe.arrived for probe in run.traffic.probes if probe.token in answers]
    found = [
        _of("byte in to reaction", probes, limits.BYTE_TO_REACTION)  # to the first byte of the answer to a probe
    ]
    for slot, side in enumerate(MIRROR):
        pulses = Pin(run.bench, run.pins[f"servo {side}"]).all_pulses(1)
        delays = []
        for change in run.traffic.changes[1:]:  # with the first one pulses begin
            off = np.abs(pulses[:, 1] - width_of(side, change.signals))
            new = pulses[(pulses[:, 0] > change.arrived) & (off <= SAME_WIDTH), 0]
            if len(new):
                delays.append(int(new[0]) - change.arrived)
        found.append(_of(f"set-point to pulse, {side}", delays, limits.setpoint_to_pulse(slot)))
    return found


def observations(run: Run) -> list[Distribution]:
    """From an event at a pin to the end of the telemetry that first shows it."""
    telemetry = run.line.telemetry
    found = []
    for side, bit in (("left", 1), ("right", 2)):
        delays = []
        for closed in run.contacts[f"whisker {side}"].closings:
            seen = (one.last for one in telemetry if one.last > closed and one.message.whiskers & bit)
            if closed < run.ended and (last := next(seen, None)) is not None:
                delays.append(last - closed)
        found.append(_of(f"whisker {side} to observation", delays, limits.WHISKER))
    echoes = [heard.last - fall for (_, fall), heard in echoes_told(run)]
    found.append(_of("echo to observation", echoes, limits.NEXT_TICK))
    for side, wheel in zip(MIRROR, run.encoders, strict=False):
        if not wheel:
            continue
        edges = np.sort(np.concatenate([train.edges for train in wheel]))
        counts = np.array([getattr(one.message, f"encoder_{side}") for one in telemetry])
        order = np.searchsorted(counts, np.arange(1, len(edges) + 1))  # the first telemetry with that count
        ends = np.array([one.last for one in telemetry])
        delays = [int(ends[at] - edge) for at, edge in zip(order, edges, strict=True) if at < len(ends)]
        found.append(_of(f"encoder {side} to observation", delays, limits.NEXT_TICK))
    return found


def lost(run: Run) -> Losses:
    """What got lost in a run. Lets time pass until the board reports it."""
    return losses(run.line, run.encoders)
