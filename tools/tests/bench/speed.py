"""How much faster than real time runs go."""

from __future__ import annotations

import time

from boebot.boards import BoardRequest, open_board
from boebot.description.robots import load_robot
from boebot.running.tasks import Request
from tools.tests.bench import peers
from tools.tests.bench.figures import Peer, figure, ran

ARENA = "room"


def times_real_time(on: str, seconds: float, period: float) -> float:
    """Speed of a whole run of the wander brain, as the command prints it."""
    return ran(Request.single("wander", arena=ARENA, on=on, seconds=seconds, period=period)).real_time_factor or 0.0


@figure(
    "AVR image in the closed loop, wander at 50 ms, IR at 20 Hz",
    "× real time",
    times_at_least=0.4,
    peers=[Peer("Debian's simavr, board alone", peers.plain_simavr)],
)
def avr_closed_loop() -> float:
    return times_real_time("avr", 30.0, 0.05)


@figure(
    "native board and world, no brain",
    "× real time",
    times_at_least=40,
    peers=[Peer("ir-sim, steps of 10 ms", peers.ir_sim_room)],
    rounds=3,
)
def native_without_a_brain() -> float:
    session = open_board("native", BoardRequest(robot=load_robot("shieldbot"), arena=ARENA, record=False))
    try:
        seconds = 60.0
        started = time.perf_counter()
        session.transport.read(seconds, seconds)
        return seconds / (time.perf_counter() - started)
    finally:
        session.close()


@figure(
    "native board and world, wander at every 10 ms tick",
    "× real time",
    times_at_least=4,
    peers=[Peer("ir-sim without a brain, steps of 10 ms", peers.ir_sim_room)],
    rounds=3,
)
def native_with_wander() -> float:
    return times_real_time("native", 60.0, 0.01)


@figure(
    "demonstration brain, 10 minutes at 50 ms, native board",
    "× real time",
    times_at_least=5,
    peers=[Peer("ir-sim without a brain, steps of 10 ms", peers.ir_sim_room)],
    rounds=3,
)
def demonstration() -> float:
    request = Request.single(
        "demo", robot="shieldbot-charging", arena="station", on="native", seconds=600.0, period=0.05
    )
    return ran(request).real_time_factor or 0.0
