"""The board times its tasks and says in which one it hung: the very image, with one task replaced by code whose length
in cycles is known from the data sheet."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from boebot.boards import BoardRequest, open_board
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.link import Link
from boebot.link.transport import BaudSelectable
from boebot_hil.rig import CYCLES_PER_US, HOST_NONCE, TICK_S
from boebot_timing.board import measure
from sim_bridge.bench.bench import bare
from sim_bridge.tests.firmware.test_planted_faults import CLI, JUMP_TO_ITSELF, RETURN, SEI, delay, planted
from sim_bridge.tests.rigs import SessionRig

FRAME_S = 2 * TICK_S  # of the servos: the turret's task runs once in each
CALL_CYCLES = 4 + 4 + 2  # call, return, and CLI with SEI
ROUND_CYCLES = 4  # of delay(), a whole number of them
BYTE_CYCLES = 90  # of an interrupt that sends or receives one, 320 cycles apart (tasks.def)
ROUND_S = 4 * TICK_S * (len(messages.Task) + 1)  # each task's time, and the counters
READING_CYCLES = 160  # from the first reading of the timer to the call, and from the return to the second, at most
LONGEST = 0xFFFF


def alone(image: str | None = None) -> SessionRig:
    """A board with nothing at its pins."""
    return SessionRig.open("avr", robot=bare("shieldbot"), image=image)


def session(image: str | None = None) -> SessionRig:
    host = alone(image)
    host.open_session()
    return host


def next_time(host: SessionRig, task: messages.Task) -> int:
    """The next time that the board sends of a task; meanwhile the session is kept open."""
    host.send(messages.ClockProbe(0))
    return host.first(
        messages.TaskTime, lambda time: time.task == task, ROUND_S + TICK_S, f"the time of {task}"
    ).longest


@pytest.mark.parametrize("cycles", [100, 200, 560])  # two bytes of 320 cycles wait in the receiver meanwhile, no more
def test_a_task_of_known_length_is_timed(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", CLI + delay(cycles) + SEI + RETURN))
    least = cycles - ROUND_CYCLES + CALL_CYCLES
    most = least + 2 * ROUND_CYCLES + READING_CYCLES + 3 * BYTE_CYCLES  # two received, one to send
    assert least <= next_time(host, messages.Task.TURRET) <= most


@pytest.mark.parametrize("cycles", [66_000, 72_000, 79_000, 90_000, 140_000])
def test_a_task_longer_than_the_timer_counts_is_told_as_the_longest(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", delay(cycles) + RETURN))
    assert next_time(host, messages.Task.TURRET) == LONGEST


@pytest.mark.parametrize("cycles", [4000, 20_000, 50_000])
def test_interrupts_are_in_the_time_of_a_task_also_of_one_longer_than_a_slot(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", delay(cycles) + RETURN))
    assert cycles - ROUND_CYCLES < next_time(host, messages.Task.TURRET) < cycles + 10_000


def test_each_task_is_told_within_a_round_and_its_time_never_falls() -> None:
    host = session()
    longest = dict.fromkeys(messages.Task, 0)
    for _ in range(3):
        host.send(messages.ClockProbe(0))
        host.answers.clear()
        host.listen(ROUND_S)
        heard = [message for message in host.answers if isinstance(message, messages.TaskTime)]
        assert sorted(time.task for time in heard) == list(messages.Task)
        for time in heard:
            if time.task == messages.Task.LINE:  # this image has none
                assert time.longest == 0
                continue
            assert (
                10 < longest[messages.Task(time.task)] <= time.longest < LONGEST
                or not longest[messages.Task(time.task)]
            )
            longest[messages.Task(time.task)] = time.longest


@pytest.mark.parametrize("closes", [True, False])
def test_the_longest_times_start_anew_with_each_session(closes: bool) -> None:
    """Storing the parameters takes the task `storage` longer than anything else that it does."""
    host = session()
    idle = next_time(host, messages.Task.STORAGE)
    assert host.request(messages.SaveParameters, within_s=1.0).status == messages.AnswerStatus.OK
    stored = next_time(host, messages.Task.STORAGE)
    assert stored > 1.5 * idle
    assert next_time(host, messages.Task.STORAGE) == stored
    if closes:
        host.send(messages.Close(host.seed))
        host.open_session()
    else:
        nonce = host.next_hello().board_nonce
        host.send(messages.Open(messages.PROTOCOL_VERSION, nonce, HOST_NONCE))
        host.decoder.seed = host.seed = nonce ^ HOST_NONCE
        assert host.next_hello().session == host.seed
    assert next_time(host, messages.Task.STORAGE) < stored / 1.5


@pytest.mark.parametrize("deaf", [False, True], ids=["", "with interrupts off"])
@pytest.mark.parametrize("task", ["turret", "counters"])
def test_the_task_that_hung_is_told_by_the_next_hello(tmp_path: Path, task: str, deaf: bool) -> None:
    """The first hello comes before these have run, the next one after the reset."""
    host = alone(planted(tmp_path, f"{task}_task", (CLI if deaf else b"") + JUMP_TO_ITSELF))
    assert host.next_hello().reset_cause == messages.ResetCause.POWER
    assert host.next_hello().reset_cause == messages.ResetCause[f"WATCHDOG_IN_{task.upper()}"]
    assert host.board.counters()["resets"] == 1
    host.board.reset("external")
    host.listen(0.001)
    assert host.next_hello().reset_cause == messages.ResetCause.EXTERNAL, "reported once"


def after_reset(host: SessionRig) -> int:
    """The cause in the first hello after a reset."""
    return host.first(
        messages.Hello, lambda hello: hello.reset_cause != messages.ResetCause.POWER, 1.0, "a hello after a reset"
    ).reset_cause


@pytest.mark.parametrize("deaf", [False, True], ids=["", "with interrupts off"])
def test_a_link_that_hung_is_told_as_outside_of_the_tasks(tmp_path: Path, deaf: bool) -> None:
    code = (CLI if deaf else b"") + JUMP_TO_ITSELF
    host = session(planted(tmp_path, "safety_accept", code))
    host.send(messages.SetpointCoast(250, 0))
    assert after_reset(host) == messages.ResetCause.WATCHDOG
    assert host.board.counters()["resets"] == 1


def test_an_interrupt_that_hung_is_told_as_what_it_interrupted(tmp_path: Path) -> None:
    """Of a byte."""
    host = alone(planted(tmp_path, "__vector_18", JUMP_TO_ITSELF))
    assert host.next_hello().reset_cause == messages.ResetCause.POWER
    host.send(messages.Identify())
    assert after_reset(host) >= messages.ResetCause.WATCHDOG


def linked(url: str, image: str | None = None) -> Iterator[Link]:
    board = open_board(url, BoardRequest(robot=load_robot("shieldbot"), noise=False, record=False, image=image))
    try:
        link = Link(board.transport)
        link.open()
        yield link
        link.close()
    finally:
        board.close()


def test_the_link_keeps_what_was_told() -> None:
    for link in linked("avr"):
        assert set(link.task_times.values()) == {None}, "not yet sent"
        shares: list[float] = []
        times = measure(link, FRAME_S, shares.append)
        assert times == link.task_times
        assert list(times) == [task.name.lower() for task in messages.Task]
        assert times.pop("line") == 0, "this image has no such task"
        assert all(10 < time < LONGEST for time in times.values()), times
        assert shares == sorted(shares) and 0 <= shares[0] < 0.1 and 0.9 < shares[-1] <= 1
        link.close()
        link.open()
        assert set(link.task_times.values()) == {None}, "of this session"


def test_the_native_board_takes_no_time_but_for_the_pulse_of_the_ping() -> None:
    for link in linked("native"):
        times = measure(link, 0.1)
        assert times.pop("ping") == 5 * CYCLES_PER_US
        assert set(times.values()) == {0}


def test_the_host_says_in_words_where_the_board_hung(tmp_path: Path) -> None:
    """It hangs where a set-point is carried out, in a poll of the link, so that a session comes before."""
    for link in linked("avr", planted(tmp_path, "safety_accept", JUMP_TO_ITSELF)):
        assert not link.notices
        resets = link.counts.board_resets
        link.send_coast(250, 0)
        end = link.transport.now() + 3.0
        while link.counts.board_resets == resets and link.transport.now() < end:
            link.poll(TICK_S)
        assert any("watchdog, outside of its tasks" in notice for notice in link.notices), link.notices


def test_the_host_says_in_words_that_the_link_hangs_at_each_opening(tmp_path: Path) -> None:
    words = r"no session within 2 s; its last reset was by its watchdog, outside of its tasks: .* the link"
    with pytest.raises(BoardError, match=words):
        next(linked("avr", planted(tmp_path, "__vector_18", JUMP_TO_ITSELF)))


def test_on_a_slow_line_telemetry_is_not_left_out_for_the_times_of_tasks() -> None:
    """9,600 baud: telemetry every 10 ticks, and each task's time comes within ten times as long."""
    host = session()
    baud = messages.PARAMETERS["baud_rate"]
    for request in ((messages.SetParameter, baud.id, 96), (messages.SaveParameters,)):
        assert host.request(*request, within_s=1.0).status == messages.AnswerStatus.OK
    host.board.reset("external")
    assert isinstance(host.transport, BaudSelectable)
    host.transport.set_baud(9600)
    assert host.open_session().telemetry_period == 10
    before = len(host.heard)
    host.listen(10 * ROUND_S)
    heard = host.heard[before:]
    ticks = [message.tick for message in heard if isinstance(message, messages.Telemetry)]
    assert ticks == list(range(ticks[0], ticks[0] + 10 * len(ticks), 10))
    assert len(ticks) >= 75
    assert {time.task for time in heard if isinstance(time, messages.TaskTime)} == set(messages.Task)
    assert [message.dropped for message in heard if isinstance(message, messages.Counters)] == [0]
