"""The line saturated both ways on the AVR image, with all sensors on: what is lost.

Run `python -m tools.bench.saturation [SECONDS]`. To the board go set-points (16 bytes on the line) and
set_parameter requests (15 bytes), without a gap; `open` alone is longer (17), and a host says it once.
Back come telemetry (46 bytes), an answer (15 bytes) to each request, and now and then hello (52 bytes)
and counters (28 bytes). The servos hold still, and both encoder lines are driven as by wheels at full speed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from boebot.link import messages
from hil_tests.rig import CYCLES_PER_S, LINE_BYTES_PER_TICK, TICK_S, Rig

DEVICES = messages.Devices
SENSORS = DEVICES.ENCODERS | DEVICES.WHISKERS | DEVICES.INFRARED | DEVICES.PING
ENCODERS = {16: 160.0, 17: 157.0}  # edges per second, by pin: not in step with each other or with the tick
REQUESTS = 9  # to each set-point: their answers and the telemetry fill the way back


@dataclass(frozen=True)
class Saturation:
    """What came of it, of which everything but the first four should be 0.

    Attributes:
        to_board, from_board: bytes per second.
        load: share of all cycles that the CPU executed.
        edges: per second, of the slower encoder.
        bytes_lost: received bytes that the board's UART or ring lost, as the emulator counts them.
        frames_bad: frames refused at either end, and gaps in the board's sequence numbers.
        ticks_missed: ticks without telemetry, and overruns that the board counted.
    """

    to_board: float
    from_board: float
    load: float
    edges: float
    bytes_lost: int
    frames_bad: int
    ticks_missed: int


def _frames(rig: Rig) -> Iterator[bytes]:
    """What goes to the board, on and on. The board answers a request that comes again as it answered the first time."""
    request = rig.numbered(messages.SetParameter, messages.PARAMETERS["track_width"].id, 10_000)
    while True:
        yield rig.encode(rig.signal(0.0, 0.0))
        for _ in range(REQUESTS):
            yield rig.encode(request)


def _fill_the_line(rig: Rig, frames: Iterator[bytes], ticks: int) -> None:
    """For that long as many whole frames as the line carries."""
    owed = 0
    for _ in range(ticks):
        owed += LINE_BYTES_PER_TICK
        wire = bytearray()
        while len(wire) < owed:
            wire += next(frames)
        owed -= len(wire)
        rig.transport.write(bytes(wire))
        rig.listen(TICK_S)


def saturate(rig: Rig, seconds: float) -> Saturation:
    """The figures of that long; the board's time. Raises AssertionError if a sensor is off or no answer comes."""
    hello = rig.start()
    if hello.devices & SENSORS != SENSORS:
        raise AssertionError(f"sensors are off: {DEVICES(SENSORS & ~hello.devices)!r}")
    rig.alive = False  # the set-points keep the session open
    for pin, edges in ENCODERS.items():
        rig.board.square_wave(pin, round(2 * CYCLES_PER_S / edges), seconds + 2.0)
    frames = _frames(rig)
    _fill_the_line(rig, frames, 10)
    rig.latest()
    before, begun = rig.board.counters(), len(rig.telemetry)
    bad, lost = rig.decoder.bad, rig.decoder.lost
    _fill_the_line(rig, frames, round(seconds / TICK_S))
    after = rig.board.counters()
    rig.listen(10 * TICK_S)
    telemetry = rig.telemetry[begun:]
    rig.alive = True
    counted = rig.next(messages.Counters, 1.0)
    first, last = telemetry[0], telemetry[-1]
    gaps = int(np.sum(np.diff([message.tick for message in telemetry]) - 1))
    edges_counted = min(last.encoder_left - first.encoder_left, last.encoder_right - first.encoder_right)
    return Saturation(
        to_board=(after["bytes_in"] - before["bytes_in"]) / seconds,
        from_board=(after["bytes_out"] - before["bytes_out"]) / seconds,
        load=(after["executed_cycles"] - before["executed_cycles"]) / (seconds * CYCLES_PER_S),
        edges=edges_counted / ((last.tick - first.tick) * TICK_S),
        bytes_lost=after["overruns"] - before["overruns"],
        frames_bad=counted.bad + counted.dropped + rig.decoder.bad - bad + rig.decoder.lost - lost,
        ticks_missed=gaps + (last.overruns - first.overruns) % 256,
    )


def saturated(seconds: float) -> Saturation:
    """The same of a board that was just powered on, in the room."""
    with Rig.open("avr", arena="room") as rig:
        return saturate(rig, seconds)


if __name__ == "__main__":
    result = saturated(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
    for name, value in vars(result).items():
        print(f"{name:13} {value:10.3f}" if isinstance(value, float) else f"{name:13} {value:10}")
    sys.exit(int(bool(result.bytes_lost or result.frames_bad or result.ticks_missed)))
