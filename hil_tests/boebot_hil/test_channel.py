"""The whole link, kit's end and board's, over a bad line: bit errors, copies, a stall, resets. Nothing is lost that
must arrive, commands come in time, and what was held up moves nothing."""

from __future__ import annotations

import itertools
import random

import pytest

from boebot.link import messages
from boebot.link.bad_line import BOTH, TO_BOARD
from boebot.link.link import Link
from sim_bridge.bench.uno import Uno

pytestmark = [pytest.mark.emulated, pytest.mark.uno(robot="shieldbot", motors=False)]

TICK_S = 0.010
LOOK_S = 0.004  # between two looks at what has come
PING = messages.PARAMETERS["ping_period"]


class Kept:
    """The line of an Uno, for the kit's end of it: what comes is kept with the test."""

    realtime = False

    def __init__(self, uno: Uno) -> None:
        line = uno.serial.line.transport
        self.name, self.now, self.write, self.close = line.name, line.now, line.write, line.close
        self._uno, self._taken = uno, 0

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        end, heard = self.now() + wait_s, self._uno.serial.heard
        self._uno.run(quiet_s)
        while len(heard) == self._taken and (left := end - self.now()) > 1e-9:
            self._uno.run(min(left, LOOK_S))
        data, self._taken = bytes(heard[self._taken :]), len(heard)
        return data


def linked(uno: Uno, **shares: float) -> Link:
    """A link over a line with these faults, "serial" of each name, from now on."""
    link = Link(Kept(uno))
    for name, share in shares.items():
        link.line.make_bad(1).add(f"serial.{name}", share, 0.0, ways=[TO_BOARD] if name == "repeated" else BOTH)
    link.open()
    return link


def listen(link: Link, seconds: float) -> None:
    end = link.transport.now() + seconds
    while link.transport.now() < end - 1e-9:
        link.poll(end - link.transport.now())


def pulses(uno: Uno) -> int:
    """How many pulses the servos' pins gave."""
    return sum(len(uno.pin(pin).all_pulses()) for pin in (12, 13))


@pytest.mark.promise("**exactly_once**, requests")
@pytest.mark.parametrize(("bit_errors", "copies"), [(1e-4, 0.0), (1e-3, 0.0), (1e-4, 0.3)])
def test_requests_arrive_once_and_in_time(uno: Uno, bit_errors: float, copies: float) -> None:
    """Each sets another value and reads it back: nothing lost, nothing twice, nothing swapped. At 1e-4, 99 of 100
    commands are answered within three ticks."""
    link = linked(uno, flipped=bit_errors, repeated=copies)
    line = link.transport
    latencies = []
    draw = random.Random(5)
    for index in range(900):
        listen(link, draw.uniform(0.0, TICK_S))  # at every phase of the tick
        value = 4 + index % 200
        begun = line.now()
        assert link.request(messages.SetParameter, PING.id, value, what="set").value == value
        latencies.append(line.now() - begun)
        if index % 10 == 0:
            assert link.parameters.get("ping_period") == value
    latencies.sort()
    assert link.counts.sessions == 1
    if bit_errors <= 1e-4:
        assert latencies[round(0.99 * len(latencies))] <= 3 * TICK_S, latencies[-10:]
    listen(link, 1.5)
    assert link.board_counters.values["bad"] > 0 and link.counters().bad > 0
    if copies:
        assert link.board_counters.values["duplicate"] > 50


@pytest.mark.promise("**exactly_once**, events")
@pytest.mark.parametrize("bit_errors", [1e-4, 1e-3])
def test_events_arrive_once_and_in_order(uno: Uno, bit_errors: float) -> None:
    """A whisker is pressed and let go: every change comes, once."""
    link = linked(uno, flipped=bit_errors)
    listen(link, 0.2)
    link.events.fetch()
    pressed = []
    for _ in range(60):
        for level, flags in ((0, 1), (1, 0)):
            uno.pin(5).drive(level)
            listen(link, 0.15)
            pressed.append(flags)
    listen(link, 0.5)
    found = [event for event in link.events.fetch() if event.kind == messages.EventKind.WHISKERS]
    assert [event.value & 0xFF for event in found] == pressed
    assert all(a.time < b.time for a, b in itertools.pairwise(found))
    assert link.counts.sessions == 1


@pytest.mark.promise("It is refused as *late* when its time to live has passed")
@pytest.mark.parametrize("held_s", [2.0, 0.9])
def test_commands_that_were_held_up_move_nothing(uno: Uno, held_s: float) -> None:
    """The line to the board stalls with motion commands queued, and lets them go: whether the board has ended the
    session meanwhile (2 s) or not, no pulse comes of them."""
    link = linked(uno)
    line = link.transport
    link.parameters.set("session_time_out", 1.0)
    link.arm()
    listen(link, 0.05)
    assert link.telemetry.latest is not None
    sessions = link.counts.sessions
    end = line.now() + held_s - 0.3
    held = link.line.make_bad(1).add("serial.stalled", 0.0, line.now(), line.now() + held_s, [TO_BOARD])
    tick = 0
    while line.now() < end:
        listen(link, TICK_S)
        if link.telemetry.latest is not None:
            tick = messages.Telemetry.unpack(link.telemetry.latest).tick
        link.send_signal(1.0, 1.0, 250, tick)
    listen(link, 0.3)  # the last of them has outlived itself
    assert held() > 500
    listen(link, 0.5)
    assert pulses(uno) == 0
    assert (link.counts.sessions == sessions) is (held_s < 1.0)
    link.arm()
    listen(link, 0.02)
    link.send_signal(1.0, 1.0, 250, messages.Telemetry.unpack(link.telemetry.latest).tick)
    listen(link, 0.1)
    assert pulses(uno) > 0, "a fresh one moves it"


@pytest.mark.promise("was reset, or has not heard it. It opens a new one (step 3)")
@pytest.mark.parametrize("at_s", [0.0, 0.011, 0.137, 0.5])
def test_traffic_resumes_within_a_second_of_any_reset(uno: Uno, at_s: float) -> None:
    link = linked(uno)
    line = link.transport
    link.arm()
    listen(link, at_s)
    for cause in ("external", "brown_out", "watchdog"):
        sessions = link.counts.sessions
        begun = line.now()
        uno.reset(cause)
        link.submit(messages.GetParameter, PING.id, what="send it")  # under way as it happens
        while link.counts.sessions == sessions or link.telemetry.latest is None:
            link.poll(TICK_S)
            assert line.now() - begun < 1.0
        assert link.session.hello is not None
        told = messages.ResetCause(link.session.hello.reset_cause).name
        assert told.partition("_IN_")[0] == cause.upper()  # the watchdog's may say in which task
        assert messages.Telemetry.unpack(link.telemetry.latest).latch == messages.Latch.START
    assert link.counts.board_resets == link.counts.sessions_lost == 3
