"""What the frame's protections let through (tools/tests/error_rates).

In `make test`: every set of one and two wrong bits in all messages, some spoilt streams through the decoders in C. In
`make soak`: sets of three in frames of up to 28 bytes on the line, random ones beyond; streams through the decoders in
C until the allowed rate is shown for all faults together, some through the image; what gets through without each
protection; then all of `python -m tools.tests.error_rates`, with every set of three wrong bits and the allowed rate for
every single fault.
"""

from __future__ import annotations

import pytest

from boebot.link import messages
from tools.tests.error_rates import library, wrong_bits
from tools.tests.error_rates.__main__ import damaged_needed, missed
from tools.tests.error_rates.image import Image
from tools.tests.error_rates.statistics import LOST_ALLOWED, RATE_ALLOWED, trials_needed, upper_bound
from tools.tests.error_rates.streams import FAULTS, Tally, pooled, through_c

ENDS = tuple(library.ENDS)
SHORT = 28  # wire bytes up to which all sets of three wrong bits are tried here
SAMPLES = 5000


def test_bound_is_that_of_clopper_and_pearson() -> None:
    """Against the rule of three and values of their table (events, trials, bound at 95 %)."""
    assert upper_bound(0, 1_000_000) == pytest.approx(3e-6, rel=2e-3)
    for events, trials, bound in ((0, 10, 0.2589), (1, 10, 0.3942), (5, 10, 0.7776), (9, 10, 0.9949), (2, 50, 0.1206)):
        assert upper_bound(events, trials) == pytest.approx(bound, abs=1e-4)
    assert upper_bound(10, 10) == 1.0
    assert [trials_needed(0), trials_needed(1)] == pytest.approx([3_141_000, 4_974_000], rel=1e-3)


@pytest.mark.parametrize(("fault", "chance"), [("bursts", 4), ("noise", 0)])
def test_wrong_frames_beyond_chance_miss_the_rate(fault: str, chance: int) -> None:
    damaged = damaged_needed(FAULTS.index(fault))
    tallies = [Tally("C", fault, damaged=damaged, wrong=wrong) for wrong in (chance, chance + 1)]
    assert missed([], tallies) == tallies[1:]


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(
    "bits", [pytest.param(bits, marks=pytest.mark.soak if bits > 2 else ()) for bits in wrong_bits.BITS]
)
def test_no_frame_with_up_to_five_wrong_bits_is_accepted(end: str, bits: int) -> None:
    patterns = 0
    for size in wrong_bits.lengths(end):
        tally = wrong_bits.measure(end, size, bits, 3 if size <= SHORT else 2, SAMPLES)
        assert tally.met, tally
        patterns += tally.patterns
    assert patterns > 0


@pytest.mark.parametrize("end", ENDS)
def test_every_message_is_among_the_lengths(end: str) -> None:
    mine = {kind.ID for kind in wrong_bits.kinds(end)}
    assert mine == {number for number in messages.MESSAGES if (number >= 0x80) == (end == "host")}
    assert {kind.LENGTH + 8 for kind in wrong_bits.kinds(end)} == set(wrong_bits.lengths(end))


def assert_nothing_lost(tallies: list[Tally]) -> None:
    for tally in tallies:
        assert tally.excess == 0, tally
        assert tally.lost_rate <= tally.lost_allowed, tally
        assert tally.accepted > tally.rounds, "most neighbours of what was damaged arrived"


@pytest.mark.parametrize("end", ENDS)
def test_c_accepts_no_wrong_frame(end: str) -> None:
    tallies = [through_c(end, fault, 10_000) for fault in range(len(FAULTS))]
    assert_nothing_lost(tallies)
    assert pooled(tallies).damaged > 100_000 and pooled(tallies).wrong == 0


@pytest.mark.soak
@pytest.mark.parametrize("end", ENDS)
def test_rate_of_wrong_frames_in_c(end: str) -> None:
    tallies = [through_c(end, fault, 300_000) for fault in range(len(FAULTS))]
    assert_nothing_lost(tallies)
    assert pooled(tallies).wrong_bound <= RATE_ALLOWED, pooled(tallies)


@pytest.mark.soak
def test_image_accepts_no_wrong_frame_and_counts_as_the_same_c_does() -> None:
    with Image() as image:
        tallies = [image.run(fault, 2000) for fault in range(len(FAULTS))]
    assert_nothing_lost(tallies)
    assert pooled(tallies).damaged > 25_000 and pooled(tallies).wrong == 0


# Without a protection -> the faults that then get through, and the least share of damaged frames that are accepted.
GETS_THROUGH = {
    "checksum": {"bit errors, 1e-4": 0.2, "bursts": 0.05, "earlier session": 0.5},
    "exact length": {"foreign frames": 0.2},
    "stuffing": {"foreign frames": 0.2},
    "session seed": {"earlier session": 0.5},
}


@pytest.mark.soak
@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("protection", GETS_THROUGH)
def test_without_a_protection_wrong_frames_get_through(protection: str, end: str) -> None:
    for fault, least in GETS_THROUGH[protection].items():
        tally = through_c(end, FAULTS.index(fault), 20_000, without=protection)
        assert tally.wrong > least * tally.damaged, tally
        assert not tally.met


@pytest.mark.soak
@pytest.mark.parametrize("end", ENDS)
def test_without_the_leading_delimiter_neighbours_are_lost(end: str) -> None:
    for fault in ("bit errors, 1e-4", "truncation", "noise"):
        tally = through_c(end, FAULTS.index(fault), 20_000, without="leading delimiter")
        assert tally.lost_rate > LOST_ALLOWED and not tally.met, tally


@pytest.mark.soak
def test_without_the_checksum_wrong_bits_get_through() -> None:
    frame = library.new("wrong_bits_frame *", {"id": 0x10, "length": 8, "seed": 5})
    for without, caught in (("", True), ("checksum", False)):
        counts = library.new("wrong_bits_tally *")
        library.library("board", without).wrong_bits_all(frame, 1, counts)
        assert counts.patterns == 8 * 16 and (counts.accepted == 0) == caught
