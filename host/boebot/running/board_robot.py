"""A robot with a board in a world without boards, as a brain meets it: many worlds, no firmware, no link."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription
from boebot.devices.infrared import schedule_of
from boebot.devices.latest import NEVER
from boebot.devices.ping import PingSensor
from boebot.devices.readings import Layout
from boebot.link.messages import Infrared, Latch, PingStatus, Status, Telemetry, Whiskers
from boebot.robot import Observation, Robot
from boebot.running.driver import TICK_S

ECHO_MAX_US: Final = 18300  # firmware/src/ping.c: a longer pulse is that of a Ping which heard nothing
_BEFORE: Final = Telemetry(*[0] * len(Telemetry._fields))._replace(infrared_age=NEVER, ping_age=NEVER, supply=5000)


class BoardRobot:
    """One robot in one run. Of a world's readings it makes telemetry, as the board would send it; of that the host's
    readers make what the brain sees.

    Attributes:
        robot: what the brain meets.
    """

    def __init__(
        self,
        description: RobotDescription,
        layout: Layout,
        period_s: float,
        seed: int,
        pulses: Callable[[float, float], list[int]],
    ) -> None:
        """
        Args:
            layout: where the readings of each device stand, in the protocol's counts.
            period_s: from step to step of the brain.
            seed: of the brain's chance.
            pulses: in counts, of motor signals.
        """
        self._layout, self._pulses_of = layout, pulses
        ping = description.device.get("ping")
        self._ping_ticks = ping.period_ticks if isinstance(ping, PingSensor) else 1
        self._infrared_ticks = schedule_of(description.device).period_ticks
        self._equipment = Equipment(description, TICK_S)
        self._speed_maximum = description.body.wheel_speed_maximum_m_s
        self.robot = Robot(description.name, period_s, seed)
        self._pulses = [0, 0]

    def see(self, tick: int, values: Sequence[float]) -> None:
        """The robot's new observation, at that control tick."""
        latched = self.robot.latched
        found = {"tick": tick, "time": tick * 10_000 % 2**32, "whiskers": 0, "infrared": 0}
        found["pulse_left"], found["pulse_right"] = self._pulses
        found["latch"] = Latch.STOP_COMMAND if latched else Latch.NONE
        found["status"] = Status.LATCHED if latched else Status.MOTORS_ENABLED
        for name, where in self._layout.items():
            reads, *more = map(int, values[where])
            device, _, side = name.partition("_")
            if device == "encoder":
                found[name], found[f"edge_period_{side}"] = reads, *more
            elif device == "whisker":
                found["whiskers"] |= Whiskers[side.upper()] * reads
            elif device == "infrared":
                found["infrared"] |= Infrared[side.upper()] * reads
                found["infrared_age"] = tick % self._infrared_ticks
            elif device == "ping":
                is_heard = reads <= ECHO_MAX_US
                found["ping_echo"] = reads if is_heard else 0
                found["ping_status"] = PingStatus.OK if is_heard else PingStatus.NOTHING_NEAR
                found["ping_age"] = tick % self._ping_ticks
        time_s = tick * TICK_S
        self.robot.observation = Observation(_BEFORE._replace(**found), self._equipment, time_s, time_s, time_s, 0.0)

    @property
    def coasts(self) -> bool:
        """Its servos get no pulses, by its command."""
        return self.robot.latched or self.robot.command.kind == "stop"

    def signals(self) -> tuple[float, float]:
        """What the motors get by its command, left and right; a speed as the signal that stands for it."""
        kind, left, right = self.robot.command
        if kind == "speed":
            left, right = (min(max(each / self._speed_maximum, -1.0), 1.0) for each in (left, right))
        self._pulses = [0, 0] if self.coasts else self._pulses_of(left, right)
        return left, right
