"""Brains in Python that drive the worlds of a batch: one in each world, with a robot as in `boebot.run`."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

from boebot.arguments import shown
from boebot.brains import LoadedBrain
from boebot.description.robots import RobotDescription
from boebot.errors import BoebotError, BrainError
from boebot.running.board_robot import BoardRobot
from boebot.running.brain_parameters import set_parameters
from boebot.running.direct_driver import DirectRobot
from boebot.running.driver import whole_ticks
from boebot.running.stepping import AT_LEISURE, StepTimes, StepWatch, step_once
from boebot.running.tasks import expect, prepare
from sim_bridge.compiled import lib
from sim_bridge.vehicles.model import VehicleModel


class Brains:
    """One brain and one robot for each world.

    Attributes:
        made_of: the brain, the period and the parameters that they were asked for by.
        loaded: the brain of each world.
        coasts: whether the servos of each world get no pulses, by its last command.
        period_steps: steps of the world from step to step of a brain.
    """

    def __init__(
        self, source: object, model: VehicleModel, seeds: list[int], period: float | None, parameters: Any = None
    ) -> None:
        """Brains as `boebot.run` takes them, one for each of the `seeds`, or a list with one for each; parameters of
        them by name, or a list with those of each.

        Raises:
            BoebotError: it is no brain, does not fit the robot, or cannot be made several times; no such period or
                parameter; a list of another length; brains with different periods.
        """
        self.made_of = (source, period, copy.deepcopy(parameters))
        self.loaded: list[LoadedBrain] = []
        self.coasts = [False] * len(seeds)
        self.period_steps = 1
        self._model, self._period = model, period
        self._direct: list[BoardRobot | DirectRobot] = []
        self._times = StepTimes()
        self._sources, self._values = _each("brains", source, len(seeds)), _each("parameters", parameters, len(seeds))
        for world, seed in enumerate(seeds):
            self.begin(world, seed)

    def begin(self, world: int, seed: int) -> None:
        """A new brain and a new robot in that world, or in the next one. Raises as above."""
        model = self._model
        loaded, _, own_s = prepare(_another(self._sources[world]), described(model), self._period)
        steps = steps_of(model, own_s)
        if self.loaded and steps != self.period_steps:
            raise BrainError(f"batch, world {world}: its brain has another period; expected one for all")
        try:
            expect("parameters", self._values[world], "values by name", Mapping, type(None))
            set_parameters(loaded, self._values[world] or {})
        except BoebotError as error:
            raise BrainError(f"batch, world {world}: {error}") from None
        self.period_steps = steps
        self.loaded[world : world + 1] = [loaded]
        self._direct[world : world + 1] = [robot_of(model, steps * model.dt, seed)]

    def step(self, steps: list[int], readings: list[list[float]], runs: list[bool]) -> list[tuple[float, float]]:
        """One step of the brain of each world that `runs`, after that many steps and with these readings there. Returns
        the motor signals.

        Raises:
            BrainError: something goes wrong in one; it says in which world, and the place in the user's file.
        """
        signals = [(0.0, 0.0)] * len(self._direct)
        with StepWatch(AT_LEISURE) as watch:
            for world, direct in enumerate(self._direct):
                if not runs[world]:
                    continue
                direct.see(steps[world] // self._model.steps_a_tick, readings[world])
                try:
                    step_once(direct.robot, self.loaded[world], watch, self._times)
                except BoebotError as error:
                    raise type(error)(f"batch, world {world}: {error}") from error.__cause__
                signals[world] = direct.signals()
                self.coasts[world] = direct.coasts
        return signals


def described(model: VehicleModel) -> RobotDescription:
    """The robot whose model it is. Raises BrainError where it was built by hand."""
    if model.robot is None:
        raise BrainError("batch: brains in Python need a robot's description; expected a model of vehicle_model()")
    return model.robot


def steps_of(model: VehicleModel, period_s: float) -> int:
    """Steps of the world in a brain's period. Raises BoebotError where it does not fit the robot's clock."""
    return whole_ticks(period_s, model.dt * model.steps_a_tick) * model.steps_a_tick


def robot_of(model: VehicleModel, period_s: float, seed: int) -> BoardRobot | DirectRobot:
    """The robot in one world, as a brain meets it that is asked every `period_s` seconds."""
    robot = described(model)
    layout = {name: where for name, where in model.names.items() if name in robot.device}
    if not robot.has_board:
        return DirectRobot(robot, layout, model.readings, model.dt, period_s, seed)

    def pulses(*signals: float) -> list[int]:
        return [lib.motion_pulse_of(*one) for one in zip(model.motion_maps, signals, strict=True)]

    return BoardRobot(robot, layout, period_s, seed, pulses)


def _each(what: str, given: Any, count: int) -> Sequence[Any]:
    """One for each world, of a list or of one for all."""
    each = given if isinstance(given, list | tuple) else [given] * count
    if len(each) != count:
        raise BrainError(f"batch: {len(each)} {what} for {count} worlds; expected one for all, or as many")
    return each


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
