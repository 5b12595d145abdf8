"""A strand runs a stretch at a time, hears what is thrown, and Ctrl-C waits for the end of its stretch."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from boebot.driving.strand import DONE, PAUSED, Strand
from boebot.errors import BoardError


def test_stretches_alternate_with_whoever_resumes() -> None:
    heard: list[object] = []

    def work() -> None:
        for number in range(3):
            heard.append(number)
            strand.pause(f"after {number}")

    strand = Strand(work, "test")
    assert heard == [] and not strand.is_done
    for number in range(3):
        assert strand.resume() == f"after {number}"
        heard.append("between")
    assert strand.resume() == DONE and strand.is_done and strand.error is None
    assert heard == [0, "between", 1, "between", 2, "between"]
    assert strand.resume() == DONE


def test_strands_never_run_at_the_same_time() -> None:
    inside = 0
    most = 0

    def work(strand: Strand) -> None:
        nonlocal inside, most
        for _ in range(20):
            inside += 1
            most = max(most, inside)
            time.sleep(1e-4)
            inside -= 1
            strand.pause()

    strands: list[Strand] = []
    for index in range(4):
        strands.append(Strand(lambda index=index: work(strands[index]), f"test {index}"))  # type: ignore[misc]
    while not all(strand.is_done for strand in strands):
        for strand in strands:
            strand.resume()
    assert most == 1


def test_error_is_thrown_where_it_paused() -> None:
    caught: list[str] = []

    def work() -> None:
        try:
            strand.pause()
        except BoardError as error:
            caught.append(str(error))
        strand.pause("cleared up")
        raise ValueError("of its own")

    strand = Strand(work, "test")
    assert strand.resume() == PAUSED
    assert strand.resume(BoardError("gone")) == "cleared up"
    assert caught == ["gone"]
    assert strand.resume() == DONE
    assert isinstance(strand.error, ValueError)


def test_error_before_its_first_stretch_keeps_it_from_running() -> None:
    strand = Strand(lambda: pytest.fail("it ran"), "test")
    assert strand.resume(BoardError("gone")) == DONE
    assert isinstance(strand.error, BoardError)


def test_interrupt_waits_for_the_end_of_the_stretch() -> None:
    done: list[str] = []

    def work() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        time.sleep(0.1)
        done.append("whole stretch")
        strand.pause()
        done.append("next")

    strand = Strand(work, "test")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            strand.resume()
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["whole stretch"] and strand.said == PAUSED
    assert strand.resume() == DONE
    assert done == ["whole stretch", "next"]
