"""What gets lost in a run, by what both ends of the line, the encoders' counts and the emulator say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boebot.link import messages
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import TICK_CYCLES, PulseTrain

COUNTERS_TICKS = 80  # from one message with the board's counters to the next one at most
SIDES = ("left", "right")
MASKED = messages.Status.ENCODER_LEFT_MASKED | messages.Status.ENCODER_RIGHT_MASKED


@dataclass(frozen=True, slots=True)
class Losses:
    """What got lost under a load, counted by who knows best; all 0 where nothing was."""

    frames: int  # refused at either end, or missing in the sequence numbers
    bytes: int  # that the receiver or its ring had no room for
    edges: int  # of encoders, that the counts lack
    ticks: int  # without telemetry
    late_ticks: int  # whose work went on when the next tick had begun
    masked: int  # telemetries with a masked encoder line
    resets: int


def losses(line: Line, wheels: Sequence[Sequence[PulseTrain]]) -> Losses:
    """Since power-on, of a board that nothing acts on any more. Lets time pass until the board reports it.

    `wheels`: the encoder lines of the left and the right wheel; one whose line is noisy may be left empty: its edges
    are masked, and not counted as lost.
    """
    bench = line.bench
    board, since = bench.pins.counters(), len(line.heard)
    bench.run(COUNTERS_TICKS * TICK_CYCLES)
    counted = line.wait(messages.Counters, since)
    telemetry = [heard.message for heard in line.telemetry]
    edges = 0
    for side, trains in zip(SIDES, wheels, strict=False):
        if trains:
            edges += sum(len(train.edges) for train in trains) - getattr(telemetry[-1], f"encoder_{side}")
    return Losses(
        frames=counted.bad + counted.dropped + line.decoder.bad + line.decoder.lost,
        bytes=board["overruns"] + counted.overrun,
        edges=edges,
        ticks=int((np.diff([message.tick for message in telemetry]) - 1).sum()),
        late_ticks=int((np.diff([message.overruns for message in telemetry]) % 256).sum()),
        masked=sum(bool(message.status & MASKED) for message in telemetry),
        resets=board["resets"],
    )
