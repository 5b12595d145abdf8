"""A pausable thread runs a stretch at a time, raises errors thrown into it, and Ctrl-C waits for its stretch's end."""

from __future__ import annotations

import contextlib
import signal
import threading
import time

import pytest

from boebot.errors import BoardError
from boebot.pausable_thread import DONE, PAUSED, EndedError, PausableThread


def test_stretches_alternate_with_the_resuming_thread() -> None:
    heard: list[object] = []

    def work() -> None:
        for number in range(3):
            heard.append(number)
            thread.pause(f"after {number}")

    thread = PausableThread(work, "test")
    assert heard == [] and not thread.is_done
    for number in range(3):
        assert thread.resume() == f"after {number}"
        heard.append("between")
    assert thread.resume() == DONE and thread.is_done and thread.error is None
    assert heard == [0, "between", 1, "between", 2, "between"]
    assert thread.resume() == DONE


def test_threads_never_run_at_the_same_time() -> None:
    inside = 0
    most = 0

    def work(thread: PausableThread) -> None:
        nonlocal inside, most
        for _ in range(20):
            inside += 1
            most = max(most, inside)
            time.sleep(1e-4)
            inside -= 1
            thread.pause()

    threads: list[PausableThread] = []
    for index in range(4):
        threads.append(PausableThread(lambda index=index: work(threads[index]), f"test {index}"))  # type: ignore[misc]
    while not all(thread.is_done for thread in threads):
        for thread in threads:
            thread.resume()
    assert most == 1


def test_error_is_thrown_where_it_paused() -> None:
    caught: list[str] = []

    def work() -> None:
        try:
            thread.pause()
        except BoardError as error:
            caught.append(str(error))
        thread.pause("cleared up")
        raise ValueError("inside")

    thread = PausableThread(work, "test")
    assert thread.resume() == PAUSED
    assert thread.resume(BoardError("gone")) == "cleared up"
    assert caught == ["gone"]
    assert thread.resume() == DONE
    assert isinstance(thread.error, ValueError)


def test_error_before_its_first_stretch_keeps_it_from_running() -> None:
    thread = PausableThread(lambda: pytest.fail("it ran"), "test")
    assert thread.resume(BoardError("gone")) == DONE
    assert isinstance(thread.error, BoardError)


def test_interrupt_waits_for_the_end_of_the_stretch() -> None:
    done: list[str] = []

    def work() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        time.sleep(0.1)
        done.append("whole stretch")
        thread.pause()
        done.append("next")

    thread = PausableThread(work, "test")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            thread.resume()
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["whole stretch"] and thread.said == PAUSED
    assert thread.resume() == DONE
    assert done == ["whole stretch", "next"]


def test_what_is_raised_in_an_open_wait_is_raised_at_once_and_the_stretch_can_be_ended() -> None:
    cleared: list[str] = []

    def work() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        try:
            while True:
                pass
        finally:
            cleared.append("up")

    thread = PausableThread(work, "test")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            thread.resume_openly()
    finally:
        signal.signal(signal.SIGINT, before)
    assert not thread.is_done and cleared == []
    thread.end(within_s=5.0)
    assert thread.is_done and isinstance(thread.error, EndedError) and cleared == ["up"]


@pytest.mark.parametrize("before_its_first_stretch", [True, False])
def test_one_that_paused_is_ended_there(before_its_first_stretch: bool) -> None:
    caught: list[BaseException] = []

    def work() -> None:
        for _ in range(2):
            try:
                thread.pause()
            except BaseException as error:
                caught.append(error)

    thread = PausableThread(work, "test")
    if not before_its_first_stretch:
        thread.resume_openly()
    thread.end(within_s=5.0)
    assert thread.is_done and thread.resume() == DONE
    assert [type(error) for error in caught] == ([] if before_its_first_stretch else [EndedError] * 2)


def test_one_that_does_not_end_is_left_to_itself_in_time() -> None:
    release = threading.Event()

    def work() -> None:
        with contextlib.suppress(BaseException):
            thread.pause()
        release.wait()  # in C, where no exception comes

    thread = PausableThread(work, "test")
    thread.resume()
    begun = time.perf_counter()
    thread.end(within_s=0.2)
    assert 0.15 < time.perf_counter() - begun < 60 and not thread.is_done
    release.set()
