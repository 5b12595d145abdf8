"""A run as an environment of Gymnasium: the learner's code drives the robot, step by step, in place of a brain.

The whole circle is there: board, link, firmware, parts and world, by the one loop of all runs. The learner sees what a
brain sees, readings with their age and validity, and never the truth. The brain of the run pauses in each of its steps
until `step` says what the motors do; it runs in a thread that takes turns with the caller's (boebot.pausable_thread).

    env = BoardEnv(robot="shieldbot", arena="room", seconds=10)
    seen, _ = env.reset(seed=1)
    seen, reward, _, over, info = env.step((0.5, 0.5))

docs/how-to/learn.md leads through it.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boebot.arguments import number
from boebot.description.robots import RobotDescription
from boebot.errors import BoebotError, CallError
from boebot.learners import FlatView, Numbers, action_space, forward, gymnasium
from boebot.pausable_thread import DONE, PausableThread
from boebot.record.interventions import Fault
from boebot.result import RunResult
from boebot.robot import Command, Observation, Robot
from boebot.running.loop import execute
from boebot.running.tasks import Request

_END_S = 5.0  # by the wall clock, for a run to end that is cut


class BoardEnv(gymnasium.Env[Numbers, Numbers]):
    """A robot in its arena; an episode is one run.

    Attributes:
        names: of the numbers of an observation, in order, such as "whisker_left.pressed". A value that a device may not
            have, such as "ping.distance", is 0 then, and "ping.distance.known" 0 in place of 1.
        observation_space: those numbers in one Box, as learners take it: most of their policies are networks of one
            flat input.
        result: of the last whole episode, as `boebot.run` gives it.
    """

    def __init__(
        self,
        robot: str | Path | RobotDescription | None = None,
        arena: str | Path | None = None,
        on: str | None = None,
        seconds: float = 10.0,
        period: float | None = None,
        pose: tuple[float, float, float] | None = None,
        without: Sequence[str] = (),
        imperfections: Mapping[str, float] | None = None,
        faults: Sequence[str | Fault] = (),
        reward: Callable[[Observation, Command], float] = forward,
        final: Callable[[Mapping[str, Any]], float] | None = None,
    ) -> None:
        """Begins a run, to see what the robot's devices say, and ends it.

        Args:
            robot, arena, on, seconds, period, pose, without, imperfections, faults: as of `boebot.run`; seconds are
                finite.
            reward: of a step, by what the robot sees after it and what it was commanded.
            final: what is added at the end of an episode, by the run's figures as `info` has them.

        Raises:
            BoebotError: no such run can begin.
        """
        number("seconds", seconds, CallError)
        self._asked = {name: value for name, value in locals().items() if name not in ("self", "reward", "final")}
        self._reward, self._final = reward, final
        self.result: RunResult | None = None
        self._episode: _Episode | None = _Episode(self, {**self._asked, "seed": 1})
        self._flat = FlatView(self._episode.robot.observation)
        self.close()
        self.names, self.observation_space = self._flat.names, self._flat.space
        self.action_space = action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Begins an episode; one that goes on is cut. The run has the seed that is given, or else one drawn by the
        environment's own stream, which is in `info`. Raises BoebotError if it cannot begin; Gymnasium's Error if the
        seed is no whole number of 0 or more."""
        super().reset(seed=seed)
        self.close()
        seed = int(self.np_random.integers(2**31)) if seed is None else seed
        self._episode = _Episode(self, {**self._asked, "seed": seed})
        return self._flat(self._episode.robot.observation), {"seed": seed}

    def step(self, action: Any) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Motor signals, left and right, for one period of the brain. With the episode's end, by time (`truncated`),
        `info` has the run's "figures" by name (docs/reference/run-files.md); there is nothing new to be seen then.

        Raises:
            BoebotError: the run has ended before its time: by a low supply, a board that is gone, a fault that changes
                nothing; or the action is none, or the episode is over.
        """
        if (episode := self._episode) is None:
            raise CallError("there is no episode to step; expected reset() first")
        try:
            left, right = (float(signal) for signal in action)
        except (TypeError, ValueError):
            raise CallError(f"the action is {action!r}; expected two motor signals, left and right, -1 to 1") from None
        episode.robot.drive(left, right)
        command = episode.robot.command
        info: dict[str, Any] = {}
        try:
            over = episode.go_on()
        finally:
            if episode.thread.is_done:
                self.close()
        reward = number("reward", self._reward(episode.robot.observation, command), CallError)
        if over:
            self.result = episode.result
            info["figures"] = figures = episode.result.table()
            reward += 0.0 if self._final is None else number("final", self._final(figures), CallError)
        return self._flat(episode.robot.observation), reward, False, over, info

    def close(self) -> None:
        """Ends the run that goes on, if there is one."""
        if self._episode is not None:
            self._episode.end()
            self._episode = None


class _Episode:
    """One run, up to the first step of its brain; the brain waits there for `go_on`."""

    robot: Robot
    result: RunResult

    def __init__(self, env: BoardEnv, asked: Mapping[str, Any]) -> None:
        self._asked = asked
        self.thread = PausableThread(self._run, "episode")
        self.end = weakref.finalize(env, self.thread.end, _END_S)  # also where that is dropped without close()
        if self.go_on():
            raise BoebotError("the run has ended before its first step; expected more seconds")

    def _run(self) -> None:
        self.result = execute(Request.single(self.learner, step_timeout=math.inf, **self._asked))

    def learner(self, robot: Robot) -> None:
        """The brain; the record has its name."""
        self.robot = robot
        self.thread.pause()

    def go_on(self) -> bool:
        """Up to the next step; whether the run is over. Raises what has ended it before its time."""
        if self.thread.resume() != DONE:
            return False
        if (error := self.thread.error or self.result.error) is not None:
            raise error
        return True
