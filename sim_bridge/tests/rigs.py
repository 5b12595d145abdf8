"""Rigs of the protocol (boebot_hil) at boards that no mark of `uno` can name: of a robot that a test describes, behind
a boot loader, in a world that a test has made."""

from __future__ import annotations

from typing import Any, Self, cast

import numpy as np

from boebot.boards import BoardRequest, open_board
from boebot.description.robots import RobotDescription, load_robot
from boebot_hil.rig import Rig
from sim_bridge.bench.pins import pulses_of
from sim_bridge.bench.serial import Line, Serial
from sim_bridge.bench.uno import Uno


class Held:
    """As much of an Uno as a rig needs, around a session."""

    def __init__(self, session: Any) -> None:
        self.session, self.serial, self.pins = session, Serial(Line(session.transport)), session.board

    def run(self, seconds: float) -> None:
        self.serial.listen(seconds)

    def bench(self, what: str) -> Held:
        del what
        return self


class SessionRig(Rig):
    """A rig around a session."""

    def __init__(self, session: Any) -> None:
        super().__init__(cast(Uno, Held(session)))
        self.session = session

    @classmethod
    def open(cls, url: str, robot: str | RobotDescription = "shieldbot", **request: Any) -> Self:
        """Around the board at `url`; `request`: what else a BoardRequest has, by default an empty field without
        noise."""
        described = load_robot(robot) if isinstance(robot, str) else robot
        return cls(open_board(url, BoardRequest(robot=described, **{"arena": "empty", "noise": False, **request})))

    def pulses(self, pin: int) -> np.ndarray:
        """Start and width, in cycles, of every high pulse that the board gave on `pin`: shape (n, 2)."""
        log = self.board.pin_log()
        return pulses_of(log[log["pin"] == pin])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
