"""Following a wall with a Ping on its turret, where IR pairs say only yes or no: observations and commands."""

from __future__ import annotations

import msgspec
import pytest

from boebot.behaviors import FollowWall, Stop
from boebot.behaviors.follow_wall import LOOK_RAD, SETTLING_S
from boebot.brain import Brain, StateVariable, Utility
from boebot.cognition import near, nearness_ahead
from boebot.devices import turret as turret_device
from boebot.devices.latest import Latest, without_readings
from boebot.devices.ping import SPEED_OF_SOUND
from boebot.devices.turret import PositionServo
from boebot.link import messages
from boebot.link.messages import PingStatus
from steps import SHIELDBOT, Stepped


def position_servo() -> PositionServo:
    turret = msgspec.structs.replace(SHIELDBOT.device["turret"], on=True)
    assert isinstance(turret, PositionServo)
    return turret


TURRET = position_servo()
TURNING = msgspec.structs.replace(SHIELDBOT, device=SHIELDBOT.device | {"turret": TURRET})


class Followed(Stepped):
    """shieldbot with a turret that does at once what it is commanded."""

    def __init__(self, brain: Brain) -> None:
        self.pulse = 0
        self.brain = brain
        super().__init__(0.05, description=TURNING)

    def look(self, wall: float | None, infrared: int = 0, turret: float | None = None) -> tuple[float, float]:
        """A step with a wall at that distance (m) before the Ping; the motor signals."""
        if turret is not None:
            message = turret_device.command(turret)
            self.pulse = TURRET.pulse_of(message)
        echo = 18500 if wall is None else round(2 * wall / SPEED_OF_SOUND * 1e6)
        self.see(ping_echo=echo, ping_status=PingStatus.OK, infrared=infrared)
        devices = without_readings(messages.DevicesTelemetry)._replace(turret_pulse=self.pulse)
        self.robot.observation = self.robot.observation._replace(slow=Latest({messages.DevicesTelemetry: devices}, 0))
        self.brain.step(self.robot)
        self.steps += 1
        return self.robot.command[1:]

    @property
    def commanded(self) -> float | None:
        """The angle that the turret was commanded last."""
        command = self.robot.slow_command
        return None if command is None or command.turret is None else command.turret.angle * turret_device.ANGLE_SCALE


def settled(behavior: FollowWall, wall: float) -> Followed:
    away = -LOOK_RAD if behavior.side == "right" else LOOK_RAD
    one = Followed(Brain([behavior]))
    for _ in range(round(SETTLING_S / 0.05) + 4):
        one.look(wall, turret=away)
    return one


def test_scale_of_the_turrets_pulse() -> None:
    one = Followed(Brain([Stop()]))
    one.look(None, turret=0.5)
    assert one.robot.turret.angle == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(("side", "sign"), [("right", -1), ("left", 1)])
def test_it_turns_its_ping_to_the_wall_and_waits_for_it(side: str, sign: int) -> None:
    one = Followed(Brain([FollowWall(side=side)]))  # type: ignore[arg-type]
    assert one.look(0.3) == (0.0, 0.0)
    assert one.commanded == pytest.approx(sign * LOOK_RAD, abs=1e-4)
    assert one.look(0.3, turret=sign * LOOK_RAD) == (0.0, 0.0)  # the pulse is there before the turret is
    for _ in range(round(SETTLING_S / 0.05)):
        one.look(0.3)
    assert one.look(0.3) != (0.0, 0.0)


@pytest.mark.parametrize(("wall", "nearness"), [(0.30, 0.25), (0.20, 0.5), (0.36, 0.1), (0.40, 0.0), (1.0, 0.0)])
def test_it_follows_the_law(wall: float, nearness: float) -> None:
    """e = 1 - d / 0.4 m - S_ref; the wall is on the right: too close turns left, the right wheel is faster."""
    error = 0.4 * (nearness - 0.25)
    left, right = settled(FollowWall(signal=0.5, gain=0.4), wall).look(wall)
    assert (left, right) == pytest.approx((0.5 - error, 0.5 + error), abs=0.002)
    left, right = settled(FollowWall(signal=0.5, gain=0.4, side="left"), wall).look(wall)
    assert (left, right) == pytest.approx((0.5 + error, 0.5 - error), abs=0.002)


def test_one_missed_echo_changes_nothing_and_a_lost_wall_does() -> None:
    one = settled(FollowWall(), 0.3)
    straight = one.look(0.3)
    assert one.look(None) == straight
    assert one.look(0.3) == straight
    one.look(None)
    left, right = one.look(None)
    assert left > right


@pytest.mark.parametrize("seen", [messages.Infrared.LEFT, messages.Infrared.RIGHT])
def test_it_turns_from_what_the_pairs_see_ahead(seen: int) -> None:
    one = settled(FollowWall(turn=0.3), 0.3)
    assert one.look(0.3, infrared=int(seen)) == (-0.3, 0.3)


def test_a_ping_that_looks_aside_says_nothing_about_the_way_ahead() -> None:
    one = settled(FollowWall(), 0.1)
    assert nearness_ahead(one.robot) is None
    assert near().value(one.robot) == 0.0
    one.look(0.1, turret=0.0)
    assert nearness_ahead(one.robot) == pytest.approx(0.75, abs=0.01)


def test_the_turret_looks_ahead_again_when_others_drive() -> None:
    asked = [0.0]
    other = Stop(utility=Utility(b=-1.0, w={"asked": 3.0}, tau=0.01))
    one = Followed(Brain([FollowWall(), other], [StateVariable("asked", lambda robot: asked[0])]))
    one.look(0.3, turret=-LOOK_RAD)
    asked[0] = 1.0
    one.look(0.3)
    one.look(0.3)
    assert one.brain.active == "stop" and one.commanded == 0.0
