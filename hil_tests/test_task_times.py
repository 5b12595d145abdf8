"""The board times its tasks and tells in which one it hung: the very image, with one task replaced by code whose length
in cycles is known from the data sheet."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from boebot.boards import BoardRequest, open_board
from boebot.link import messages
from boebot.link.session import Link
from boebot.robots import load_robot
from hil_tests.minimal_host import TICK_S, MinimalHost, power_on
from hil_tests.rig import CYCLES_PER_US
from hil_tests.test_faults import CLI, JUMP_TO_ITSELF, RETURN, SEI, delay, planted
from sim_bridge.boards.board import ResetCause

pytestmark = pytest.mark.emulated

FRAME_S = 2 * TICK_S  # of the servos: the turret's task runs once in each
CALL_CYCLES = 4 + 4 + 2  # call, return, and CLI with SEI
ROUND_CYCLES = 4  # of delay(), a whole number of them
READING_CYCLES = 40  # from the first reading of the timer to the call, and from the return to the second, at most
LONGEST = 0xFFFF


def session(image: str) -> MinimalHost:
    host = MinimalHost(power_on("avr", image=image))
    host.open()
    return host


def turret_time(host: MinimalHost) -> int:
    answer = host.ask(messages.TakeTaskTime, messages.Task.TURRET)
    assert answer.status == messages.AnswerStatus.OK
    return answer.value


@pytest.mark.parametrize("cycles", [100, 200, 560])  # two bytes of 320 cycles wait in the receiver meanwhile, no more
def test_a_task_of_known_length_is_timed(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", CLI + delay(cycles) + SEI + RETURN))
    times = []
    for _ in range(6):  # one at least without an interrupt before CLI or after SEI
        turret_time(host)
        host.listen(FRAME_S)
        times.append(turret_time(host))
    least = cycles - ROUND_CYCLES + CALL_CYCLES
    assert least <= min(times) <= least + 2 * ROUND_CYCLES + READING_CYCLES
    assert max(times) < cycles + 1000


@pytest.mark.parametrize("cycles", [66_000, 72_000, 79_000, 90_000, 140_000, 200_000])
def test_a_task_longer_than_the_timer_counts_is_told_as_the_longest(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", delay(cycles) + RETURN))
    host.listen(2 * FRAME_S)
    assert turret_time(host) == LONGEST


@pytest.mark.parametrize("cycles", [4000, 20_000, 50_000])
def test_interrupts_are_in_the_time_of_a_task_also_of_one_longer_than_a_slot(tmp_path: Path, cycles: int) -> None:
    host = session(planted(tmp_path, "turret_task", delay(cycles) + RETURN))
    host.listen(2 * FRAME_S)
    assert cycles - ROUND_CYCLES < turret_time(host) < cycles + 10_000


def test_a_time_once_taken_begins_anew(tmp_path: Path) -> None:
    host = session(planted(tmp_path, "turret_task", delay(4000) + RETURN))
    host.listen(FRAME_S)
    first = host.begin(messages.TakeTaskTime, messages.Task.TURRET)
    second = host.begin(messages.TakeTaskTime, messages.Task.TURRET)
    answers = {a.number: a.value for a in host.listen(TICK_S / 2) if isinstance(a, messages.Answer)}
    assert answers[first] > 4000 - ROUND_CYCLES
    assert answers[second] == 0, "it has not run since"
    host.listen(FRAME_S)
    assert turret_time(host) > 4000 - ROUND_CYCLES


def test_a_task_that_is_none_is_out_of_range() -> None:
    host = MinimalHost(power_on("avr"))
    host.open()
    for number in (len(messages.Task), 255):
        answer = host.ask(messages.TakeTaskTime, number)
        assert (answer.status, answer.value) == (messages.AnswerStatus.OUT_OF_RANGE, 0)


@pytest.mark.parametrize("deaf", [False, True], ids=["", "with interrupts off"])
@pytest.mark.parametrize("task", ["encoder", "turret", "devices"])
def test_the_task_that_hung_is_told_by_the_next_hello(tmp_path: Path, task: str, deaf: bool) -> None:
    """The first hello comes before any task has run, the next one after the reset."""
    board = power_on("avr", image=planted(tmp_path, f"{task}_task", (CLI if deaf else b"") + JUMP_TO_ITSELF))
    host = MinimalHost(board)
    assert host.hello().reset_cause == messages.ResetCause.POWER
    assert host.hello().reset_cause == messages.ResetCause[f"WATCHDOG_IN_{task.upper()}"]
    assert board.counters()["resets"] == 1
    board.reset(ResetCause.EXTERNAL)
    host.listen(0.001)
    assert host.hello().reset_cause == messages.ResetCause.EXTERNAL, "told once"


def linked(url: str, image: str | None = None) -> Iterator[Link]:
    board = open_board(url, BoardRequest(robot=load_robot("shieldbot"), noise=False, record=False, image=image))
    try:
        link = Link(board.transport, record=False)
        link.open()
        yield link
        link.close()
    finally:
        board.close()


def test_the_link_asks_for_all_tasks() -> None:
    for link in linked("avr"):
        end = link.transport.now() + FRAME_S
        while link.transport.now() < end:
            link.poll(TICK_S)
        times = link.take_task_times()
        assert list(times) == [task.name.lower() for task in messages.Task]
        assert all(time is not None and 10 < time < LONGEST for time in times.values()), times


def test_the_native_board_takes_no_time_but_for_the_pulse_of_the_ping() -> None:
    for link in linked("native"):
        times = link.take_task_times()
        assert times.pop("ping") in (None, 5 * CYCLES_PER_US)
        assert set(times.values()) == {None}


def test_the_host_says_in_words_where_the_board_hung(tmp_path: Path) -> None:
    for link in linked("avr", planted(tmp_path, "begin_record", JUMP_TO_ITSELF)):
        assert not link.notices
        resets = link.board_resets
        link.submit(messages.SaveParameters, what="save its parameters")
        end = link.transport.now() + 3.0
        while link.board_resets == resets and link.transport.now() < end:
            link.poll(TICK_S)
        assert any("watchdog, in task storage" in notice for notice in link.notices), link.notices
