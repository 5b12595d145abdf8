"""Parameters of a board, read, set, saved and reset over a link."""

from __future__ import annotations

import pytest
from linked import listen, open_link

from boebot.errors import BoardError, BoebotError
from boebot.link import messages


@pytest.mark.parametrize("value", [1, 251, -5, float("nan"), float("inf")])
def test_parameter_out_of_range_is_refused_before_it_is_sent(value: float) -> None:
    link, peer, _ = open_link()
    with pytest.raises(BoebotError, match=r"infrared_period cannot be .* ticks; expected 2 to 250"):
        link.parameters.set("infrared_period", value)
    assert peer.carried_out == []


def test_unknown_parameter_is_named() -> None:
    link, _, _ = open_link()
    with pytest.raises(BoebotError, match="no parameter 'speed'; expected one of devices"):
        link.parameters.get("speed")


def test_parameter_travels_in_its_unit() -> None:
    link, peer, _ = open_link()
    assert link.parameters.set("servo_left_centre", 1499.5) == 1499.5
    assert peer.parameter("servo_left_centre") == 23992
    assert link.parameters.get("servo_left_centre") == 1499.5


def test_parameters_are_saved_and_reset() -> None:
    link, peer, session = open_link()
    link.parameters.set("ping_period", 9)
    begun = session.now()
    link.parameters.save()
    assert session.now() - begun >= 0.2, "answered when it is written"
    assert peer.saved is not None
    link.parameters.reset()
    assert link.parameters.get("ping_period") != 9
    peer.reset()
    listen(link, 0.1)
    assert link.parameters.get("ping_period") == 9 and link.open().parameters_saved == 1


def test_board_that_is_busy_writing_is_asked_again() -> None:
    link, peer, session = open_link()
    saving = link.submit(messages.SaveParameters, what="save", limit_s=5.0)
    listen(link, 0.105)
    assert not saving.done
    listen(link, 0.2)
    assert saving.done
    peer._saving_until = session.now() + 0.2
    assert link.parameters.set("ping_period", 9) == 9
    assert peer._saving_until is None


@pytest.mark.parametrize(
    ("status", "reason"), [(messages.AnswerStatus.OUT_OF_RANGE, "out of range"), (99, "unknown 99")]
)
def test_board_that_refuses_a_parameter_is_believed(status: int, reason: str) -> None:
    link, peer, _ = open_link()
    peer._set = lambda message, saving: (status, 0)  # type: ignore[method-assign]
    with pytest.raises(BoardError, match=f"refuses parameter devices: {reason}"):
        link.parameters.set("devices", 3)
