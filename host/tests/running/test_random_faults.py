"""Random schedules of faults: however they coincide, three promises hold.

1. The motors stop: no servo pulse begins later than the time to live, a slot and a servo frame after the start of the
   tick that the last set-point answers which the host has sent; and so after the instant from which no host speaks.
2. Telemetry is back within 1 s after both ends and the line between them are up again, goes on, and the motors are
   armed (docs/reference/link.md, "A run").
3. Arming follows PROTOCOL.md, "Fail-safe": only an `arm` that crossed the line in this session, after the last stop,
   and names the `latches` of now unlatches the motors; a new session, a start and a low supply find them latched; no
   pulse without motors that the board says are enabled, by telemetry or by the event of their dead-man stop.

All times are the board's: pulses are edges at the pins of the servos, bytes are seen below what damages them, at the
board's end of the line. A schedule that breaks one is made as short as possible, and printed as the command that
repeats it. Faults that do not fire are counted, and break nothing.
"""

from __future__ import annotations

import contextlib
import math
import shlex
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from struct import unpack
from typing import NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import boebot
from boebot.description.robots import load_robot
from boebot.errors import BoebotError
from boebot.link import messages
from boebot.link.frame import NO_SESSION, Decoder
from boebot.running.faults import UnfiredError, known, read
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.sessions.session import SimTransport

TIME_TO_LIVE_S = 0.25  # of a brain that steps every 50 ms
SLOT_S, FRAME_S = 0.0025, 0.020  # of the firmware's tasks, of servos
TICK_S = 0.01
BACK_S = 1.0
STEADY_S = 0.1  # telemetry comes every 10 ms; some is lost where a session begins
SECONDS = 3.8
LATEST_S, LONGEST_S, LATE_S = 1.5, 1.0, 0.2  # begin of a fault, its span, and how much later something comes
ROBOTS = ("shieldbot", "boebot", "shieldbot-quad", "shieldbot-line")
SETPOINTS = (messages.SetpointSignal, messages.SetpointSpeed)
GONE = ("host.stopped", "host.killed", "cable.out")
CUTS = ("serial", "cable", "host", "board", "battery")  # owners whose faults may cost telemetry


class Schedule(NamedTuple):
    """Of one run."""

    robot: str
    seed: int
    faults: tuple[str, ...]

    def command(self, board: str) -> str:
        """That repeats it."""
        said = ["boebot", "run", "wander", "--robot", self.robot, "--on", board, "--arena", "room"]
        said += ["--seconds", str(SECONDS), "--seed", str(self.seed)]
        return shlex.join([*said, *(word for fault in self.faults for word in ("--fault", fault))])


@st.composite
def schedules(draw: st.DrawFn) -> Schedule:
    robot = draw(st.sampled_from(ROBOTS))
    single = {name: kind for name, (kind, whose) in known(load_robot(robot)).items() if len(whose) == 1}
    faults = []
    for name in draw(st.lists(st.sampled_from(sorted(single)), min_size=1, max_size=4, unique=True)):
        kind = single[name]
        value, is_harmless = "", False
        if kind.words:
            value = "=" + draw(st.sampled_from(kind.words))
        elif kind.default is not None:
            most = LATE_S if kind.unit == "s" else kind.most
            choices = [kind.default, kind.least, most, min(10 * kind.default, most)]
            number = draw(st.sampled_from(choices))
            value, is_harmless = f"={number:g}", number == kind.harmless
        begin_ms = draw(st.integers(0, round(1000 * LATEST_S)))
        end = ""
        if kind.when != "once":
            end = f"..{(begin_ms + draw(st.integers(1, round(1000 * LONGEST_S)))) / 1000:g}s"
        if not is_harmless:
            faults.append(f"{name}{value}@{begin_ms / 1000:g}s{end}")
    return Schedule(robot, draw(st.integers(1, 1000)), tuple(faults))


# ---- what is seen ----------------------------------------------------------------------------------------------------


class Tap:
    """Messages that crossed the line whole, at the board's end, each with its time (s since power-on) and session."""

    def __init__(self) -> None:
        self.sent: list[tuple[float, int, messages.Message]] = []
        self.said: list[tuple[float, int, messages.Telemetry]] = []
        self.events: list[tuple[int, messages.Event]] = []
        self._to_board = {0: Decoder(NO_SESSION, to_board=True)}
        self._to_host: dict[int, Decoder] = {}

    def to_board(self, time_s: float, data: bytes) -> None:
        """The host's end of the line has given these bytes to it."""
        for seed, decoder in list(self._to_board.items()):
            for number, _, payload in decoder.feed(data):
                message = messages.MESSAGES[number].unpack(payload)
                if isinstance(message, messages.Open):
                    new = message.board_nonce ^ message.host_nonce
                    if new not in self._to_board:
                        self._to_board[new] = Decoder(new, to_board=True)
                        self._to_host[new] = Decoder(new)
                elif seed:
                    self.sent.append((time_s, seed, message))

    def to_host(self, pieces: list[tuple[float, bytes]]) -> None:
        """The board's end has."""
        for time_s, data in pieces:
            for seed, decoder in self._to_host.items():
                for number, _, payload in decoder.feed(data):
                    if number == messages.Telemetry.ID:
                        self.said.append((time_s, seed, messages.Telemetry.unpack(payload)))
                    elif number == messages.Event.ID:
                        self.events.append((seed, messages.Event.unpack(payload)))


@contextlib.contextmanager
def tapped() -> Iterator[Tap]:
    tap, write, read_stamped = Tap(), SimTransport.write, SimTransport.read_stamped

    def tapped_write(self: SimTransport, data: bytes) -> None:
        tap.to_board(self.now(), data)
        write(self, data)

    def tapped_read(self: SimTransport, *waits: float) -> list[tuple[float, bytes]]:
        pieces = read_stamped(self, *waits)
        tap.to_host(pieces)
        return pieces

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimTransport, "write", tapped_write)
        patch.setattr(SimTransport, "read_stamped", tapped_read)
        yield tap


class Seen:
    """A run as it is judged; times in s since power-on."""

    def __init__(self, tap: Tap, result: boebot.RunResult, schedule: Schedule) -> None:
        self.result = result
        self.robot = load_robot(schedule.robot)
        faults = [read(text, self.robot) for text in schedule.faults]
        self.faults = [
            (one, one.begin_s + result.clock_offset, (one.end_s or one.begin_s) + result.clock_offset) for one in faults
        ]
        pins = {self.robot.device[name].pin for name in ("servo_left", "servo_right")}  # type: ignore[attr-defined]
        self.pulses = [time_s for time_s, row in result.record.each_row("pins") if row[0] in pins and row[1] == 1]
        self.delivered = [unpack("<dd", row[-16:])[0] for _, row in result.record.each_row("telemetry")]
        self.sent = tap.sent
        # The board's clock has started this long after power-on: telemetry takes some time to the host's end
        clocks: dict[int, float] = {}
        for time_s, seed, telemetry in tap.said:
            clocks[seed] = min(clocks.get(seed, math.inf), time_s - telemetry.time * 1e-6)
        self.said = [(clocks[seed] + telemetry.time * 1e-6, seed, telemetry) for _, seed, telemetry in tap.said]
        self.outlived = [  # when set-points in force have outlived themselves
            clocks[seed] + event.time * 1e-6
            for seed, event in tap.events
            if event.kind == messages.EventKind.DEAD_MAN and seed in clocks
        ]

    def cuts(self) -> list[tuple[float, float]]:
        """When telemetry may be missing: spans, in order, none touches another."""
        spans: list[tuple[float, float]] = []
        for fault, begin_s, end_s in sorted(self.faults, key=lambda one: one[1]):
            if fault.name.partition(".")[0] not in CUTS:
                continue
            if fault.name == "host.killed":
                end_s = math.inf
            if fault.name in ("serial.delayed", "host.slow"):
                end_s += float(fault.value or 0.0)
            if spans and begin_s <= spans[-1][1]:
                begin_s, end_s = spans[-1][0], max(end_s, spans.pop()[1])
            spans.append((begin_s, end_s))
        return spans


# ---- the laws --------------------------------------------------------------------------------------------------------


def motors_stop(seen: Seen) -> None:
    ends = []  # of set-points: when they were sent, the latest instant at which a pulse may begin by them
    for sent_s, seed, message in seen.sent:
        if isinstance(message, SETPOINTS):
            tick = message.answers_tick
            at = [s for s, of, telemetry in seen.said if of == seed and telemetry.tick & 0xFFFF == tick and s <= sent_s]
            assert at, f"the set-point at {sent_s:.4f} s answers tick {tick}, which the board has not said"
            ends.append((sent_s, at[-1] + TIME_TO_LIVE_S + SLOT_S + FRAME_S))
    for pulse_s in seen.pulses:
        latest_s = max((end_s for sent_s, end_s in ends if sent_s <= pulse_s), default=-math.inf)
        assert pulse_s <= latest_s, f"a pulse begins at {pulse_s:.6f} s; expected none after {latest_s:.6f} s"
    for fault, begin_s, end_s in seen.faults:
        if fault.name in GONE:
            over_s = begin_s + TIME_TO_LIVE_S + SLOT_S + FRAME_S
            until_s = math.inf if fault.name == "host.killed" else end_s
            late = [pulse_s for pulse_s in seen.pulses if over_s < pulse_s <= until_s]
            assert not late, f"{fault}: pulses begin up to {late[-1]:.6f} s; expected none after {over_s:.6f} s"


def telemetry_is_back(seen: Seen) -> None:
    end_s = seen.result.clock_offset + SECONDS - 2 * TICK_S
    cuts = seen.cuts()
    for (_, up_s), (next_s, _) in pairwise([(0.0, seen.result.clock_offset), *cuts, (end_s, math.inf)]):
        if up_s + BACK_S > next_s:
            continue
        came = [s for s in seen.delivered if up_s < s <= next_s]
        assert came and came[0] <= up_s + BACK_S, f"no telemetry for {BACK_S} s after {up_s:.3f} s"
        steady = [max(came[0], up_s), *(s for s in came if s > up_s), next_s]
        gap_s, at_s = max((b - a, a) for a, b in pairwise(steady))
        assert gap_s <= STEADY_S, f"no telemetry for {gap_s:.3f} s after {at_s:.3f} s"
        is_latched, at_s = [(telemetry.latch != messages.Latch.NONE, s) for s, _, telemetry in seen.said if s < next_s][
            -1
        ]
        assert not is_latched, f"the motors are not armed again at {at_s:.3f} s"


def arming_follows_its_rule(seen: Seen) -> None:
    arms = [(s, seed, message) for s, seed, message in seen.sent if isinstance(message, messages.Arm)]
    stops = [(s, seed) for s, seed, message in seen.sent if isinstance(message, messages.Stop)]
    enabled = list(seen.outlived)  # until then, also where that began and ended between two telemetries
    was_low = False
    for at_s, seed, telemetry in seen.said:
        is_low = bool(telemetry.status & messages.Status.SUPPLY_LOW)
        is_armed = telemetry.latch == messages.Latch.NONE
        assert is_armed != bool(telemetry.status & messages.Status.LATCHED)
        if telemetry.status & messages.Status.MOTORS_ENABLED:
            assert is_armed, f"motors are enabled and latched at {at_s:.4f} s"
            enabled.append(at_s)
        if is_armed:
            stopped_s = max((s for s, of in stops if of == seed and s < at_s - 2 * TICK_S), default=-math.inf)
            by = [s for s, of, arm in arms if of == seed and arm.latches == telemetry.latches and s <= at_s + TICK_S]
            assert by, f"armed at {at_s:.4f} s, latches {telemetry.latches}, by no arm that names them"
            assert by[-1] > stopped_s, f"armed at {at_s:.4f} s by an arm from before the stop at {stopped_s:.4f} s"
            assert not (is_low and was_low), f"armed at {at_s:.4f} s with a low supply"
        was_low = is_low
    early_s = SLOT_S + FRAME_S + TICK_S
    # Where it is reset before it can say so, or what it says is garbled at the other end already:
    unheard = ("board", "battery", "serial.rate")
    spans = [(begin_s, end_s) for fault, begin_s, end_s in seen.faults if fault.name.startswith(unheard)]
    for pulse_s in seen.pulses:
        if any(begin_s - 2 * TICK_S <= pulse_s <= end_s + 2 * TICK_S for begin_s, end_s in spans):
            continue
        assert any(pulse_s - early_s <= s <= pulse_s + TICK_S for s in enabled), (
            f"a pulse begins at {pulse_s:.6f} s, and the board does not say then that motors are enabled"
        )


def check(schedule: Schedule, board: str, counts: Counter[str]) -> None:
    """Runs it once, and judges that."""
    request = Request.single(
        "wander",
        robot=schedule.robot,
        arena="room",
        on=board,
        seconds=SECONDS,
        seed=schedule.seed,
        pins=True,
        faults=schedule.faults,
    )
    try:
        with tapped() as tap:
            result = execute(request)
        counts["runs"] += 1
        counts["faults"] += len(schedule.faults)
        counts["unfired"] += sum(not count for count in result.faults.values())
        seen = Seen(tap, result, schedule)
        motors_stop(seen)
        arming_follows_its_rule(seen)
        if "its supply is low" in str(result.error):  # as link.md says: of a wheel that is blocked, too
            counts["ended by a low supply"] += 1
            assert any(telemetry.latch == messages.Latch.SUPPLY_LOW for _, _, telemetry in seen.said)
            return
        if not isinstance(result.error, UnfiredError | None):
            raise result.error
        telemetry_is_back(seen)
    except (AssertionError, BoebotError) as error:
        error.add_note(f"repeat it by: {schedule.command(board)}")
        raise


@pytest.mark.parametrize(
    ("board", "count"),
    [
        pytest.param("native", 20, id="few"),
        pytest.param("native", 1000, id="native", marks=pytest.mark.soak),
        pytest.param("avr", 100, id="avr", marks=pytest.mark.soak),
    ],
)
def test_schedules(board: str, count: int, capsys: pytest.CaptureFixture[str]) -> None:
    counts: Counter[str] = Counter()

    @settings(
        max_examples=count, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(schedules())
    def judge(schedule: Schedule) -> None:
        check(schedule, board, counts)

    judge()
    with capsys.disabled():
        print(f"\n{board}: {dict(counts)}")
