"""A batch as a vectorised environment of Gymnasium: the learner's actions drive its robots.

Each world is to its learner what a `boebot.env.BoardEnv` is, with the same observations, actions and rewards; what is
learned here can then be tried there, on a board.

    env = BatchEnv(Batch(vehicle_model("shieldbot"), load_arena("room"), "random", range(100)), seconds=10)
    seen, _ = env.reset(seed=1)
    seen, rewards, _, over, info = env.step(env.action_space.sample())

docs/how-to/learn.md leads through it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot.arguments import duration, number, shown, whole
from boebot.errors import CallError
from boebot.learners import FlatView, Numbers, action_space, forward, gymnasium
from boebot.robot import Command, Observation
from boebot.running.board_robot import BoardRobot
from boebot.running.direct_driver import DirectRobot
from boebot.running.tasks import DEFAULT_PERIOD
from sim_bridge.batch import Batch
from sim_bridge.vehicles.brains import robot_of, steps_of


class BatchEnv(gymnasium.vector.VectorEnv[Numbers, ArrayLike, NDArray[Any]]):
    """The robot of each world; an episode is one run. A world whose episode has ended begins another one in the step
    after that, which takes no action of it (AutoresetMode.NEXT_STEP). What a world does depends on its seed, its place
    and its actions only.

    Attributes:
        names: of the numbers of an observation, as of `BoardEnv`.
    """

    metadata: dict[str, Any] = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}  # noqa: RUF012 (its base's)

    def __init__(
        self,
        batch: Batch,
        *,
        seconds: float = 10.0,
        period: float = DEFAULT_PERIOD,
        reward: Callable[[Observation, Command], float] = forward,
        final: Callable[[Mapping[str, Any]], float] | None = None,
    ) -> None:
        """
        Args:
            batch: of a robot's model (`vehicle_model`); each episode begins at its world's pose, or "random" ones at
                that of the episode's seed. It belongs to the environment from here on.
            seconds: of an episode, a whole number of periods.
            period: s, of a step.
            reward, final: as of `BoardEnv`; the figures are those of `Batch.figures`.

        Raises:
            BoebotError: it is no such batch, or seconds and period do not fit.
        """
        if not isinstance(batch, Batch) or not batch.count:
            raise CallError(f"the environment is of {shown(batch)}; expected a Batch of one world or more")
        self._batch, self.num_envs, self._reward, self._final = batch, batch.count, reward, final
        self._period_s = number("period", period, CallError)
        self._steps = steps_of(batch.model, self._period_s)
        periods = number("seconds", seconds, CallError, least=self._period_s) / self._period_s
        if abs(periods - round(periods)) > 1e-6:
            raise CallError(f"an episode of {seconds:g} s does not fit; expected a multiple of {duration(period)}")
        self._length = round(periods) * self._steps
        self._robots: dict[int, BoardRobot | DirectRobot] = {}
        self._chance = [gymnasium.utils.seeding.np_random()[0] for _ in range(batch.count)]
        self._over = np.zeros(batch.count, np.bool_)
        self._flat = FlatView(self._robot(0, 1).robot.observation)
        self._seen: Numbers = np.zeros((batch.count, len(self._flat.names)), np.float32)
        self.names, self.single_observation_space = self._flat.names, self._flat.space
        self.single_action_space = action_space()
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, batch.count)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, batch.count)

    def reset(
        self, *, seed: ArrayLike | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Begins an episode in each world, or in those that are True in `options["reset_mask"]`, an array. The runs'
        seeds are given by a list, or as `seed`, `seed + 1` and so on; where there is none, the world's own stream draws
        one. They are in `info`. Raises BoebotError if one cannot begin, or seeds or mask are none."""
        if seed is None or isinstance(seed, Integral):
            seed = [None if seed is None else int(seed) + world for world in range(self.num_envs)]
        asked = {"reset_mask": [True] * self.num_envs} | (options or {})
        seeds, mask = np.asarray(seed, object), np.asarray(asked.pop("reset_mask"))
        if seeds.shape != (self.num_envs,):
            raise CallError(f"seed is {shown(seed)}; expected a whole number, or a list of {self.num_envs}")
        if mask.shape != seeds.shape or mask.dtype != np.bool_:
            raise CallError(f"reset_mask is {shown(mask.tolist())}; expected {self.num_envs} of True and False")
        if asked:
            raise CallError(f"there are no options {', '.join(asked)}; expected reset_mask")
        infos: dict[str, Any] = {}
        for world in np.flatnonzero(mask).tolist():
            self._begin(world, seeds[world], infos)
        return self._seen.copy(), infos

    def _begin(self, world: int, seed: int | None, infos: dict[str, Any]) -> None:
        if seed is not None:
            seed = whole(f"the seed of world {world}", seed, CallError, least=0, most=2**63 - 1)
            self._chance[world], _ = gymnasium.utils.seeding.np_random(seed)
        key = int(self._chance[world].integers(2**31)) if seed is None else seed
        self._batch.restart(world, key)
        self._robots[world] = self._robot(world, key)
        self._seen[world] = self._flat(self._robots[world].robot.observation)
        self._over[world] = False
        self._add_info(infos, {"seed": key}, world)

    def _robot(self, world: int, seed: int) -> BoardRobot | DirectRobot:
        """At the beginning of a run."""
        robot = robot_of(self._batch.model, self._period_s, seed)
        robot.see(0, self._batch.readings[world].tolist())
        return robot

    def step(
        self, actions: ArrayLike
    ) -> tuple[Numbers, NDArray[Any], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Motor signals of shape (N, 2), left and right, for one period. With an episode's end, by time (`truncated`)
        or where a world goes no further (`terminated`), `info` has its "figures" by name; there is nothing new to be
        seen then. Raises BoebotError where actions are none, and no world has moved; or there is no episode."""
        batch, before = self._batch, self._over
        if len(self._robots) < self.num_envs:
            raise CallError("there is no episode to step; expected reset() of all worlds first")
        self._drive(actions)
        batch.step([self._robots[world].signals() for world in range(self.num_envs)], self._steps)
        terminated = (batch.flags != 0) & ~before
        truncated = (batch.steps >= self._length) & ~before & ~terminated
        self._over = terminated | truncated
        figures = batch.figures() if self._over.any() else {}
        rewards, infos = np.zeros(self.num_envs), dict[str, Any]()
        ticks = (batch.steps // batch.model.steps_a_tick).tolist()
        for world, readings in enumerate(batch.readings.tolist()):
            if before[world]:
                self._begin(world, None, infos)
                continue
            robot = self._robots[world]
            if not self._over[world]:
                robot.see(ticks[world], readings)
                self._seen[world] = self._flat(robot.robot.observation)
            rewards[world] = number("reward", self._reward(robot.robot.observation, robot.robot.command), CallError)
            if self._over[world]:
                own = {name: values[world].item() for name, values in figures.items()}
                rewards[world] += 0.0 if self._final is None else number("final", self._final(own), CallError)
                self._add_info(infos, {"figures": own}, world)
        return self._seen.copy(), rewards, terminated, truncated, infos

    def _drive(self, actions: ArrayLike) -> None:
        try:
            given = np.asarray(actions)
        except ValueError:  # rows of different lengths
            given = np.zeros(0)
        if given.shape != (self.num_envs, 2) or given.dtype.kind not in "fiu":
            expected = f"expected motor signals, left and right, -1 to 1: shape ({self.num_envs}, 2)"
            raise CallError(f"the actions are {shown(actions)}; {expected}")
        for world, signals in enumerate(np.where(self._over[:, None], 0.0, given).tolist()):
            self._robots[world].robot.drive(*signals)

    def close_extras(self, **_: Any) -> None:
        """Closes the batch."""
        self._batch.close()
