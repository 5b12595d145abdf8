"""PROTOCOL.md, its tables: what a board keeps over a reset, and what it says of the reset."""

from __future__ import annotations

import pytest

from boebot.link import messages
from boebot.link.messages import AnswerStatus, ResetCause
from boebot_hil.rig import CYCLES_PER_S, Rig

pytestmark = [pytest.mark.emulated, pytest.mark.uno(robot="shieldbot", motors=False)]

CHANGED = {"track_width": 12_345, "servo_left_centre": 24_016, "servo_right_gain": -3100, "bandgap": 1050}
CAUSES = ("power", "external", "brown_out", "watchdog")


def in_force(rig: Rig) -> dict[str, int]:
    """Values of those parameters, in counts."""
    return {name: rig.request(messages.GetParameter, messages.PARAMETERS[name].id).value for name in CHANGED}


@pytest.mark.promise(
    "Writes all parameters to the EEPROM",
    "All parameters to the image's defaults",
    "Sets one parameter until the next reset",
)
def test_saved_parameters_outlive_every_reset_and_are_reset_to_the_robots(rig: Rig) -> None:
    robots = in_force(rig)
    for name, value in CHANGED.items():
        rig.set(name, value)
    assert rig.request(messages.SaveParameters, within_s=1.0).status == AnswerStatus.OK
    rig.set("track_width", 54_321)  # is not saved
    for cause in CAUSES:
        rig.uno.reset(cause)
        assert rig.start(arm=False).parameters_saved == 1
        assert in_force(rig) == CHANGED
    assert rig.request(messages.ResetParameters).status == AnswerStatus.OK
    assert in_force(rig) == robots


@pytest.mark.promise("Why the microcontroller started")
@pytest.mark.promise("It draws another one at each start")
def test_cause_of_each_reset_is_told_and_the_nonce_is_another_one(rig: Rig) -> None:
    nonces = []
    for cause in CAUSES:
        rig.uno.reset(cause)
        hello = rig.start(arm=False)
        # the watchdog's may have come while a task was running, which is then said, too
        assert ResetCause(hello.reset_cause).name.partition("_IN_")[0] == cause.upper()
        assert bool(rig.latest().status & messages.Status.WATCHDOG_RESET) == (cause == "watchdog")
        nonces.append(rig.next_hello().board_nonce)
    assert len(set(nonces)) == len(nonces)


@pytest.mark.promise("number of this start: 1 + the earlier ones that ran for 10 s")
def test_starts_that_last_are_counted(rig: Rig) -> None:
    """One that runs for 10 s; not one that is cut before."""
    assert rig.next_hello().boot_counter == 1
    rig.uno.reset("external")
    assert rig.start(arm=False).boot_counter == 1
    rig.listen(11.0)
    rig.uno.reset("external")
    assert rig.start(arm=False).boot_counter == 2


@pytest.mark.promise("Then nothing is written to the EEPROM either")
def test_nothing_is_saved_while_the_supply_is_low(rig: Rig) -> None:
    rig.set("track_width", 12_345)
    rig.board.supply(3.9)
    rig.listen(0.05)
    assert rig.request(messages.SaveParameters, within_s=1.0).status == AnswerStatus.SUPPLY_LOW
    rig.board.supply(None)
    rig.uno.reset("external")
    assert rig.start(arm=False).parameters_saved == 0


@pytest.mark.promise("answered when they are written and read back", "the EEPROM is being written")
def test_a_save_misses_no_tick(rig: Rig) -> None:
    begun = rig.board.cycle
    first = len(rig.telemetry)
    assert rig.request(messages.SaveParameters, within_s=1.0).status == AnswerStatus.OK
    seconds = (rig.board.cycle - begun) / CYCLES_PER_S
    assert seconds > 0.0034 * 2 * len(messages.PARAMETERS), "each byte takes 3.4 ms (ATmega328P data sheet, 8.6.3)"
    frames = rig.telemetry[first:]
    assert [frame.tick - frames[0].tick for frame in frames] == list(range(len(frames)))
    saving = [bool(frame.status & messages.Status.SAVING) for frame in frames]
    assert sum(saving) >= 0.9 * seconds / 0.010 and frames[-1].overruns == 0
