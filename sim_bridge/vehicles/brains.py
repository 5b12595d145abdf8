"""Brains in Python that drive the worlds of a batch: one in each world, with a robot as in `boebot.run`."""

from __future__ import annotations

import copy
from typing import Any

from boebot.arguments import shown
from boebot.brains import LoadedBrain
from boebot.errors import BoebotError, BrainError
from boebot.running.direct_driver import DirectRobot
from boebot.running.driver import whole_ticks
from boebot.running.stepping import AT_LEISURE, StepTimes, StepWatch, step_once
from boebot.running.tasks import prepare
from sim_bridge.vehicles.model import VehicleModel


class Brains:
    """One brain and one robot for each world.

    Attributes:
        made_of: the brain and the period that they were asked for by.
        loaded: the brain of each world.
        period_ticks: steps of the world from step to step of a brain.
    """

    def __init__(self, source: object, model: VehicleModel, seeds: list[int], period: float | None) -> None:
        """Brains as `boebot.run` takes them, one for each of the `seeds`.

        Raises:
            BoebotError: it is no brain, does not fit the robot, or cannot be made several times; no such period.
        """
        if model.robot is None:
            raise BrainError("batch: brains in Python need a robot's description; expected a model of vehicle_model()")
        self.made_of = (source, period)
        layout = {name: where for name, where in model.names.items() if name in model.robot.device}
        self.loaded: list[LoadedBrain] = []
        self._direct: list[DirectRobot] = []
        self._times = StepTimes()
        for seed in seeds:
            loaded, _, period_s = prepare(_another(source) if self.loaded else source, model.robot, period)
            self.period_ticks = whole_ticks(period_s, model.dt)
            self.loaded.append(loaded)
            direct = DirectRobot(model.robot, layout, model.readings, model.dt, self.period_ticks * model.dt, seed)
            self._direct.append(direct)

    def step(self, ticks: list[int], readings: list[list[float]], runs: list[bool]) -> list[tuple[float, float]]:
        """One step of the brain of each world that `runs`, after that many ticks and with these readings there. Returns
        the motor signals.

        Raises:
            BrainError: something goes wrong in one; it says in which world, and the place in the user's file.
        """
        signals = [(0.0, 0.0)] * len(self._direct)
        with StepWatch(AT_LEISURE) as watch:
            for world, direct in enumerate(self._direct):
                if not runs[world]:
                    continue
                direct.show(direct.sample(ticks[world], tuple(readings[world])))
                try:
                    step_once(direct.robot, self.loaded[world], watch, self._times)
                except BoebotError as error:
                    raise type(error)(f"batch, world {world}: {error}") from error.__cause__
                signals[world] = direct.signals()
        return signals


def _another(source: Any) -> Any:
    """What makes a brain for one more world: an object is copied, as it was handed over."""
    if isinstance(source, str | type) or not callable(getattr(source, "step", None)):
        return source
    try:
        return copy.deepcopy(source)
    except Exception as error:
        raise BrainError(
            f"batch: {shown(source)} cannot be copied for each world ({error}); expected its class, or a file"
        ) from None
