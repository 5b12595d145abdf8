"""What one message costs, by hand in a program of assembler; the bytes that wait while a line is full, by hand and
against a main loop cycle by cycle."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avr_image import assembled
from boebot.errors import TimingError
from boebot.timing.frames import FrameCost, frame_costs
from boebot.timing.full_line import FullLine, FullLines, Waiting
from boebot.timing.response import Piece, Schedule, Source

# Loops over a frame's bytes are bounded by those of the longest payload, 9, and 8 or 3 more.
PROGRAM = """
.macro row section, words:vararg
.pushsection .boebot.\\section, "", @progbits
.long \\words
.popsection
.endm
.pushsection .boebot.timing, "", @progbits
.asciz "FRAME one 1 4"
.asciz "FRAME two 2 9"
.popsection
main: rcall link_poll
 rjmp main
link_poll: rcall link_take_frame
JOINED
 lds r24, 0x100
1: row ids, 1b, 24
 cpi r24, 1
 breq one
 cpi r24, 2
 breq two
 ret
one: .rept 10
 nop
 .endr
 ret
two: LENGTH
 rcall send_message
 ret
send_message: nop
 ret
link_take_frame: ldi r18, 2
2: lds r19, 0x101
 row loops, 2b, 2, 0xFFFFFFFF
3: dec r19
 row loops, 3b, 17, 0xFFFFFFFF
 brne 3b
 lds r21, 0x102
 tst r21
 brne 4f
 dec r18
 brne 2b
4: rcall frame_decode_end
 ret
frame_decode_end: lds r19, 0x103
5: dec r19
 row loops, 5b, 12, 0xFFFFFFFF
 brne 5b
 ret
"""
LENGTH = "ldi r20, 5"


def program(joined: str = "", length: str = LENGTH) -> str:
    return PROGRAM.replace("JOINED", joined).replace("LENGTH", length)


def test_costs_of_messages_by_hand(tmp_path: Path) -> None:
    """An empty piece takes 11 cycles, a frame of n bytes 8 + 3 n to the call of its check, that with the call and the
    returns 12 + 3 m: 31 + 3 n + 3 m, n = payload + 8, m = payload + 3. `one` has 22 more, `two` 23."""
    one, two = frame_costs(assembled(tmp_path, program()))
    assert one == FrameCost("one", 1, bytes=12, poll=31 + 3 * 12 + 3 * 7 + 22, answer=0)
    assert two == FrameCost("two", 2, bytes=17, poll=31 + 3 * 17 + 3 * 12 + 23, answer=13)


def test_longer_handler_costs_its_own_message_more(tmp_path: Path) -> None:
    sound, slowed = (frame_costs(assembled(tmp_path, text)) for text in (program(), program(length=f"nop\n {LENGTH}")))
    assert slowed == (sound[0], replace(sound[1], poll=sound[1].poll + 1))


@pytest.mark.parametrize("joined", ["sbrc r0, 0\n rjmp 1f", "rjmp 1f"])
def test_an_id_that_may_be_another_one_tells_nothing(joined: str, tmp_path: Path) -> None:
    """A way leads past the load of the id."""
    assert frame_costs(assembled(tmp_path, program(joined=joined))) == ()


def test_image_that_names_no_place_of_an_id_tells_nothing(tmp_path: Path) -> None:
    assert frame_costs(assembled(tmp_path, program().replace("row ids, 1b, 24", ""))) == ()


def test_answer_whose_length_is_not_constant_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TimingError, match="with a length that is not a constant"):
        frame_costs(assembled(tmp_path, program(length="lds r20, 0x104")))


BYTE = Source("bytes", 1, 10)


def come(window: int) -> int:
    return BYTE.requests(window + 1)


def waiting(*slots: int, begun: int = 0, sources: Sequence[Source] = (), every: int = 1000) -> Waiting:
    return Waiting(Schedule(tuple((Piece("all", one),) for one in slots), every, 1), sources, begun, come)


@pytest.mark.parametrize(
    ("begun", "slot", "most"),
    [
        (0, 0, 7),  # 3 had come; at 0, 10, 20, 30 four more until the frame is done
        (100, 0, 17),  # at 0, 10, ... 130
        (0, 100, 17),  # a slot's work is as good
        (60, 100, 23),
    ],
)
def test_bytes_that_wait_by_hand(begun: int, slot: int, most: int) -> None:
    """Frames of 4 bytes, one each 40 cycles, take 30. Each one that is worked off makes one byte less wait."""
    assert waiting(slot, begun=begun).most(30, 4) == most


def test_frames_that_take_longer_than_they_come_have_no_bound() -> None:
    assert waiting(0, every=1_000_000).most(40_000, 4) is None


def test_interrupts_lengthen_the_wait_by_hand() -> None:
    """30 cycles under 10 in each 50 take 40, for the second comes at 50: at 0, 10, ... 40 five bytes."""
    assert waiting(0, sources=[Source("a", 10, 50)]).most(30, 4) == 3 + 5


def seen(
    slots: Sequence[int], every: int, interrupt: tuple[int, int, int], frames: Sequence[tuple[int, int]], phase: int
) -> int:
    """Cycle by cycle: the most bytes in the ring, of which a frame's leave when it has been worked off."""
    own, interval, first = interrupt
    ends: deque[tuple[int, int]] = deque()
    due: deque[int] = deque()
    bytes_ = most = size = 0
    number, left_of_frame = 0, frames[0][1]
    busy = preempted = 0
    for now in range(4 * every * len(slots)):
        if now >= first and (now - first) % interval == 0:
            preempted += own
        if now % every == 0:
            due.append(slots[now // every % len(slots)])
        if now >= phase and (now - phase) % BYTE.interval == 0:
            bytes_ += 1
            left_of_frame -= 1
            if left_of_frame == 0:
                ends.append(frames[number % len(frames)])
                number += 1
                left_of_frame = frames[number % len(frames)][1]
        most = max(most, bytes_)
        if preempted:
            preempted -= 1
            continue
        if not busy and due:
            busy = due.popleft()
        elif not busy and ends:
            busy, size = ends.popleft()
        if busy:
            busy -= 1
            if not busy:
                bytes_, size = bytes_ - size, 0
    return most


@settings(max_examples=60, deadline=None)
@given(
    slots=st.lists(st.integers(0, 200), min_size=1, max_size=3),
    interrupt=st.tuples(st.integers(1, 10), st.integers(60, 300), st.integers(0, 300)),
    frames=st.lists(st.tuples(st.integers(1, 40), st.integers(7, 12)), min_size=1, max_size=4),
    phase=st.integers(0, 500),
)
def test_no_more_bytes_wait_than_the_bound_says(
    slots: list[int], interrupt: tuple[int, int, int], frames: list[tuple[int, int]], phase: int
) -> None:
    """One kind, and any order of several."""
    most = waiting(*slots, sources=[Source("a", *interrupt[:2])], every=500)
    each = [most.most(cycles, size) for cycles, size in frames]
    mixed = most.most_of_mix(frames)
    assert mixed is not None
    for one, bound in zip(frames, each, strict=True):
        assert bound is not None and seen(slots, 500, interrupt, [one], phase) <= bound <= mixed
    assert seen(slots, 500, interrupt, frames, phase) <= mixed


def test_what_is_proven_is_said_with_what_is_not() -> None:
    cost = FrameCost("first", 1, bytes=10, poll=100, answer=0)
    first = FullLine(cost, cycles=120, carried=50.0, worked_off=60.0, answered=None, ring=40)
    second = replace(first, cost=replace(cost, name="second", answer=20), answered=30.0, ring=None)
    assert [first.margin, second.margin] == pytest.approx([0.2, -0.4])
    lines = FullLines((first, second), ("first",), 44)
    assert lines.is_proven(44) and not lines.is_proven(43) and not lines.is_proven(None)
    assert first.is_proven(40) and not first.is_proven(39) and not second.is_proven(255)
    says = lines.says(255)
    assert "any mix of first is proven to lose nothing: 44 of 255 bytes" in says and "second 30.0 of 50.0" in says
    assert "proven" not in lines.says(43) and "first 60.0 of 50.0" in lines.says(43)
    assert lines.as_dict(255)["messages"][1]["receive_ring_needed_bytes"] is None
