"""Avoid: away from what infra-red sensors see, and out of nooks (docs/reference/notes.md)."""

from __future__ import annotations

import math

import pytest

from boebot.behaviors import Avoid, Stop
from boebot.brain import Brain, StateVariable, Utility
from boebot.cognition import near
from boebot.errors import BrainError
from boebot.robot import Command
from steps import SteppedVehicle


def signals(left: float, right: float) -> Command:
    return Command("signal", pytest.approx(left), pytest.approx(right))  # type: ignore[arg-type]


@pytest.mark.parametrize(("left", "right", "turn"), [(0.5, 0.2, -0.5), (0.2, 0.5, 0.5)])
def test_avoid_turns_away_from_the_stronger_side_until_clear_and_a_little_longer(
    left: float, right: float, turn: float
) -> None:
    avoid, vehicle = Avoid(utility=Utility(b=-1.0, w={"near": 10.0}, tau=0.02)), SteppedVehicle()
    brain = Brain([Stop(utility=Utility(b=0.5)), avoid], [near()], period=0.01)
    assert {vehicle.steer(brain, 0.14, 0.14).kind for _ in range(20)} == {"stop"}, "10 · 0.14 - 1 < 0.5"
    for _ in range(5):
        vehicle.steer(brain, left, right)
    for _ in range(20):
        assert vehicle.steer(brain, left, right) == signals(-turn, turn)
        left, right = right, left  # the side is chosen once
    clear = [vehicle.steer(brain, 0.07, 0.07) == signals(-turn, turn) for _ in range(60)]
    assert all(clear[:39]) and not any(clear[42:]), "0.4 s, and the utility's lag"


def test_avoid_leaves_a_nook_whose_way_out_is_narrow() -> None:
    """It sees nothing for 0.3 s of each round: less than the 0.4 s that it wants; in the second round 0.2 s will do."""
    avoid, vehicle = Avoid(utility=Utility(b=-1.0, w={"near": 10.0}, tau=0.02)), SteppedVehicle()
    brain = Brain([Stop(utility=Utility(b=0.5)), avoid], [near()], period=0.01)
    size = vehicle.robot.dimensions
    a_round = 2 * math.pi / (2 * 0.5 * size.speed / size.track_width)
    for step in range(600):
        nearness = 0.5 if step * 0.01 % a_round >= 0.3 else 0.0
        vehicle.steer(brain, nearness, nearness)
    ended = [switch.time for switch in brain.switches if switch.off == avoid.name]
    begun = next(switch.time for switch in brain.switches if switch.on == avoid.name)
    assert begun + a_round < ended[0] < begun + 2 * a_round


def test_avoid_that_is_shut_in_does_not_turn_for_ever() -> None:
    """S = 0.1 all around is not clear, 0.08; in its second round 0.1 / 2 is."""
    avoid, vehicle = Avoid(utility=Utility(b=-1.0, w={"touch": 3.0}, tau=0.02)), SteppedVehicle()
    touch = StateVariable("touch", lambda robot: float(robot.time < 0.2))
    brain = Brain([Stop(utility=Utility(b=0.5)), avoid], [touch], period=0.01)
    for _ in range(300):
        vehicle.steer(brain, 0.1, 0.1)
    size = vehicle.robot.dimensions
    a_round = math.pi * size.track_width / (0.5 * size.speed)
    ended = next(switch.time for switch in brain.switches if switch.off == avoid.name)
    assert a_round < ended < a_round + 0.5, "a round, and 0.2 s"


@pytest.mark.parametrize(("key", "value"), [("turn", 0.0), ("turn", 1.5), ("clear", -0.1), ("after", math.nan)])
def test_avoid_refuses_parameters_that_do_not_fit(key: str, value: float) -> None:
    with pytest.raises(BrainError, match=f"^avoid: {key} is {value!r}; expected "):
        Avoid(**{key: value})  # type: ignore[arg-type]
