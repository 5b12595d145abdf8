"""A brain whose one parameter says how its run goes wrong. Copied beside a test's plan."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import dataclass

from boebot import Robot
from boebot.behaviors import Wander
from boebot.brain import Brain


@dataclass(eq=False)
class Odd(Wander):
    """Wanders, and after half a second does what `how` says."""

    how: str = "well"

    def step(self, robot: Robot) -> None:
        if robot.time > 0.5:
            if self.how == "raises":
                raise ValueError("as it was asked to")
            if self.how == "interrupts":
                raise KeyboardInterrupt
            if self.how == "exits":
                sys.exit()
            if self.how == "sleeps":
                time.sleep(3600)
            if self.how == "loops":
                while True:
                    pass
            if self.how == "kills":
                os.kill(os.getpid(), signal.SIGKILL)
        super().step(robot)


brain = Brain([Odd(name="odd")])
