"""The vectorised environment over a batch: each world is as it is alone, and as the run that `BoardEnv` steps."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils import passive_env_checker
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import DictInfoToList, NormalizeObservation, RecordEpisodeStatistics

from boebot.arenas import load_arena
from boebot.env import BoardEnv
from boebot.errors import BoebotError, BrainError, CallError
from boebot.robot import Robot
from sim_bridge.batch import Batch
from sim_bridge.batch_env import BatchEnv
from sim_bridge.vehicle import VehicleModel, arsim, vehicle_model

ROOM = load_arena("room")
SECONDS = 0.5  # ten steps


def batch(count: int, robot: str = "shieldbot", threads: int = 1) -> Batch:
    return Batch(vehicle_model(robot), ROOM, "random", range(count), threads=threads)


def signals(step: int, count: int) -> np.ndarray[Any, Any]:
    """Actions, others in each world and each step."""
    chance = np.random.default_rng(step)
    return chance.uniform(-0.2, 1.0, (count, 2)).astype(np.float32)


def told(env: Any, steps: int, actions: Callable[[int], Any], seed: Any = 5) -> list[Any]:
    """All that an environment says over some steps."""
    return [env.reset(seed=seed), *(env.step(actions(step)) for step in range(steps))]


def expect_equal(one: Any, other: Any) -> None:
    """Bit for bit, with the same types."""
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        one, other = list(one.values()), list(other.values())
    if isinstance(one, list | tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            expect_equal(a, b)
    else:
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)


def row(said: Any, world: int, count: int) -> Any:
    """What an environment of `count` worlds says of one of them; infos without those of others."""
    if isinstance(said, dict):
        masks = {name: mask for name, mask in said.items() if name.startswith("_") and mask[world]}
        return {name[1:]: row(said[name[1:]], world, count) for name in masks}
    if isinstance(said, list | tuple):
        return type(said)(row(one, world, count) for one in said)
    return said[world : world + 1]


# ---- what a world does -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "asked"),
    [
        ("arsim", {}),
        ("arsim", {"period": 0.1, "reward": lambda seen, command: seen.time + command.left}),
        ("roller", {"final": lambda figures: figures["true_distance_m"]}),
    ],
)
def test_without_a_board_the_worlds_are_runs_that_boardenv_steps(robot: str, asked: dict[str, Any]) -> None:
    """Over three episodes, the later ones by seeds that each world draws; but a run's figures are more, and its way is
    added up from tick to tick."""
    final = asked.pop("final", None)
    near = 0 if final is None else 1e-2
    pose = (0.3, -0.2, 1.0)
    single = SyncVectorEnv(
        [lambda: BoardEnv(robot=robot, arena="room", pose=pose, seconds=SECONDS, final=final, **asked)] * 3
    )
    many = BatchEnv(Batch(vehicle_model(robot), ROOM, [pose] * 3, [1, 2, 3]), seconds=SECONDS, final=final, **asked)
    assert many.names == single.envs[0].names  # type: ignore[attr-defined]
    assert many.single_observation_space == single.single_observation_space
    assert many.observation_space == single.observation_space and many.action_space == single.action_space
    assert many.metadata["autoreset_mode"] == single.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    ends = 0
    for mine, theirs in zip(*(told(env, 30, lambda step: signals(step, 3)) for env in (many, single)), strict=True):
        expect_equal(mine[0], theirs[0])
        assert mine[-1].keys() == theirs[-1].keys()
        if len(mine) == 2 or "seed" in mine[-1]:
            expect_equal(mine[-1], theirs[-1])
            continue
        assert np.abs(mine[1] - theirs[1]).max() <= near
        expect_equal(mine[2:4], theirs[2:4])
        ends += int(mine[3].sum())
        for name, values in mine[-1].get("figures", {}).items():
            assert name == "true_distance_m" or values.tolist() == theirs[-1]["figures"][name].tolist()
    assert ends == 3 * (30 // (round(SECONDS / asked.get("period", 0.05)) + 1))


@pytest.mark.parametrize("robot", ["shieldbot", "arsim"])
def test_a_world_does_among_others_what_it_does_alone(robot: str) -> None:
    """The same pose, seed and actions: the same bits, over three episodes, with two threads, too."""
    count, steps = 5, 25
    model = vehicle_model(robot)
    poses = [ROOM.free_start(model.radius, world) for world in range(count)]
    many, threaded = (BatchEnv(Batch(model, ROOM, poses, [0] * count, threads=n), seconds=SECONDS) for n in (1, 2))
    together = told(many, steps, lambda step: signals(step, count))
    expect_equal(told(threaded, steps, lambda step: signals(step, count)), together)
    expect_equal(told(many, steps, lambda step: signals(step, count)), together)
    for world in range(count):
        alone = BatchEnv(Batch(model, ROOM, poses[world : world + 1], [0]), seconds=SECONDS)
        own = told(alone, steps, lambda step: signals(step, count)[world : world + 1], seed=5 + world)  # noqa: B023
        expect_equal(row(own, 0, 1), row(together, world, count))
    assert len(np.unique(together[9][0], axis=0)) == count
    threaded.close()


def test_with_a_board_a_world_is_that_of_a_brain_with_the_same_commands() -> None:
    kept = batch(2)
    env = BatchEnv(kept, seconds=SECONDS)
    infos = told(env, 10, lambda step: signals(step, 2))[-1][-1]
    steps = {5: iter(range(10)), 6: iter(range(10))}

    def drives(seed: int) -> Callable[[Robot], None]:
        def step(robot: Robot) -> None:
            robot.drive(*signals(next(steps[seed]), 2)[seed - 5].tolist())

        return step

    other = Batch(kept.model, ROOM, "random", [5, 6])
    other.run([drives(5), drives(6)], round(SECONDS / kept.model.dt))
    assert other.hashes().tolist() == kept.hashes().tolist()
    assert infos["figures"]["true_distance_m"].tolist() == other.figures()["true_distance_m"].tolist()
    assert infos["figures"]["seed"].tolist() == [5, 6] and infos["_figures"].all()


def test_new_episodes_in_some_worlds_do_not_disturb_the_others() -> None:
    untouched, env = BatchEnv(batch(4), seconds=SECONDS), BatchEnv(batch(4), seconds=SECONDS)
    mask = np.array([False, True, False, True])
    last, _ = (one.reset(seed=1)[0] for one in (env, untouched))
    for step in range(12):
        if step == 4:
            seen, infos = env.reset(seed=[None, 9, None, None], options={"reset_mask": mask})
            assert infos["seed"][1] == 9 and infos["_seed"].tolist() == mask.tolist()
            assert infos["seed"][3] not in (0, 4), "drawn by its own stream"
            assert np.array_equal(seen[~mask], last[~mask]) and not np.array_equal(seen[mask], last[mask])
        theirs, mine = (one.step(signals(step, 4)) for one in (untouched, env))
        last = mine[0]
        expect_equal([each[~mask] for each in mine[:4]], [each[~mask] for each in theirs[:4]])
        assert not mine[3][mask].any() and theirs[3].all() == (step == 9)
    fresh = BatchEnv(batch(1), seconds=SECONDS)
    assert np.array_equal(fresh.reset(seed=9)[0][0], seen[1])


def test_seeds_draw_starts_and_each_world_goes_on_with_its_own() -> None:
    env = BatchEnv(batch(3), seconds=0.1)
    seen, infos = env.reset(seed=[7, 8, 7])
    assert infos["seed"].tolist() == [7, 8, 7]
    assert np.array_equal(seen[0], seen[2])
    drawn = [env.reset()[1]["seed"].tolist() for _ in range(3)]
    env.reset(seed=np.array([7, 8, 7]))
    assert [env.reset()[1]["seed"].tolist() for _ in range(3)] == drawn
    assert len({one for seeds in drawn for one in seeds}) == 6 and all(seeds[0] == seeds[2] for seeds in drawn)
    assert env.reset(seed=np.int64(3))[1]["seed"].tolist() == [3, 4, 5]


def test_a_world_that_goes_no_further_is_terminated_and_begins_anew() -> None:
    """Against the wall 0.2 m ahead; the other world has 2 m."""
    model = vehicle_model("shieldbot", ends_at_collision=True)
    poses = [(1.5 - 0.08 - 0.2, 0.0, 0.0), (-0.5, 0.0, 0.0)]
    env = BatchEnv(Batch(model, ROOM, poses, [1, 2]), seconds=3, final=lambda figures: -100 * figures["true_contacts"])
    env.reset(seed=1)
    for _ in range(60):
        _, rewards, terminated, truncated, infos = env.step([[1.0, 1.0]] * 2)
        if terminated.any() or truncated.any():
            break
    assert terminated.tolist() == [True, False] and not truncated.any()
    assert infos["figures"]["ended"].tolist() == ["collision", None]
    assert rewards[0] < -90 and rewards[1] == 1.0
    _, rewards, terminated, truncated, infos = env.step([[float("nan"), 2.0], [1.0, 1.0]])
    assert rewards.tolist() == [0.0, 1.0] and not terminated.any() and infos["_seed"].tolist() == [True, False]


# ---- gymnasium's checks, as far as they are for vectorised environments ----------------------------------------------


@pytest.mark.parametrize("robot", ["shieldbot", "arsim"])
def test_gymnasiums_checks_pass(robot: str) -> None:
    env = BatchEnv(batch(3, robot), seconds=0.2)
    env.action_space.seed(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        passive_env_checker.check_observation_space(env.single_observation_space)
        passive_env_checker.check_action_space(env.single_action_space)
        wrapped, listed = NormalizeObservation(RecordEpisodeStatistics(env)), DictInfoToList(env)
        assert [world["seed"] for world in listed.reset(seed=1)[1]] == [1, 2, 3]
        for seen, *_ in told(env, 11, lambda _: env.action_space.sample()):
            assert env.observation_space.contains(seen)
            passive_env_checker.check_obs(seen[0], env.single_observation_space, "step")
        lengths = [
            infos["episode"]["l"]
            for *_, infos in told(wrapped, 11, lambda _: env.action_space.sample())[1:]
            if "episode" in infos
        ]
    assert [one.tolist() for one in lengths] == [[4] * 3] * 2
    parameters = inspect.signature(env.reset).parameters
    assert all(parameters[name].kind is inspect.Parameter.KEYWORD_ONLY for name in ("seed", "options"))
    assert isinstance(env, gymnasium.vector.VectorEnv) and env.unwrapped is env and str(env) == "BatchEnv(num_envs=3)"


# ---- wrong use -------------------------------------------------------------------------------------------------------


def test_bad_actions_move_no_world() -> None:
    env = BatchEnv(batch(2), seconds=SECONDS)
    with pytest.raises(CallError, match=r"there is no episode to step; expected reset\(\) of all worlds first"):
        env.step(np.zeros((2, 2)))
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(CallError, match="there is no episode"):
        env.step(np.zeros((2, 2)))
    first, _ = env.reset(seed=1)
    for wrong in (
        (0.5, 0.5),
        np.zeros((3, 2)),
        np.zeros((2, 1)),
        [[0.1], [0.2, 0.3]],
        "ab",
        None,
        [["a", "b"]] * 2,
        np.zeros((2, 2), complex),
    ):
        with pytest.raises(CallError, match=r"the actions are .*; expected motor signals, .* shape \(2, 2\)"):
            env.step(wrong)  # type: ignore[arg-type]
    for beyond in (1.5, float("nan"), float("inf")):
        with pytest.raises(BrainError, match="motor signals go from -1 to 1"):
            env.step([[0.0, 0.0], [0.0, beyond]])
    other = BatchEnv(batch(2), seconds=SECONDS)
    assert np.array_equal(other.reset(seed=1)[0], first)
    expect_equal(env.step(signals(0, 2)), other.step(signals(0, 2)))
    env.close()
    env.close()
    for use in (lambda: env.step(signals(0, 2)), lambda: env.reset(seed=1)):
        with pytest.raises(BoebotError, match="batch: it is closed"):
            use()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"seed": [1, 2, 3]}, r"seed is \[1, 2, 3\]; expected a whole number, or a list of 2"),
        ({"seed": "ab"}, "seed is 'ab'; expected a whole number"),
        ({"seed": 1.5}, "seed is 1.5; expected a whole number"),
        ({"seed": [1, 1.5]}, "the seed of world 1 is 1.5; expected a whole number from 0 to"),
        ({"seed": -1}, "the seed of world 0 is -1; expected a whole number from 0 to"),
        ({"seed": 2**63}, "the seed of world 0 is 9223372036854775808; expected a whole number from 0 to"),
        ({"options": {"mask": np.array([True, False])}}, "there are no options mask; expected reset_mask"),
        ({"options": {"reset_mask": [True]}}, r"reset_mask is \[True\]; expected 2 of True and False"),
        ({"options": {"reset_mask": np.array([1, 0])}}, r"reset_mask is \[1, 0\]; expected 2 of True and False"),
    ],
)
def test_wrong_resets_are_sentences(options: dict[str, Any], text: str) -> None:
    env = BatchEnv(batch(2), seconds=SECONDS)
    with pytest.raises(CallError, match=text):
        env.reset(**options)


@pytest.mark.parametrize("asked", [{"reward": lambda *_: None}, {"final": lambda _: float("nan")}])
def test_a_reward_that_is_no_number_is_a_sentence(asked: dict[str, Any]) -> None:
    env = BatchEnv(batch(2), seconds=0.05, **asked)
    env.reset(seed=1)
    with pytest.raises(CallError, match=r"(reward is None|final is nan); expected a finite number"):
        env.step(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: BatchEnv("shieldbot"), "the environment is of 'shieldbot'; expected a Batch of one world or more"),  # type: ignore[arg-type]
        (lambda: BatchEnv(batch(0)), "expected a Batch of one world or more"),
        (lambda: BatchEnv(batch(1), seconds=0.12), "an episode of 0.12 s does not fit; expected a multiple of 50 ms"),
        (lambda: BatchEnv(batch(1), seconds=0), "seconds is 0; expected a finite number of at least 0.05"),
        (lambda: BatchEnv(batch(1), seconds=float("inf")), "seconds is inf; expected a finite number"),
        (
            lambda: BatchEnv(batch(1), period=0.012),
            "a brain period of 12 ms does not fit; expected a multiple of 10 ms",
        ),
        (lambda: BatchEnv(batch(1), period="fast"), "period is 'fast'; expected a finite number"),  # type: ignore[arg-type]
        (lambda: BatchEnv(Batch(by_hand(), ROOM, "random", [1])), r"expected a model of vehicle_model\(\)"),
    ],
)
def test_what_cannot_be_an_environment_is_a_sentence(make: Callable[[], BatchEnv], text: str) -> None:
    with pytest.raises(BoebotError, match=text):
        make()


def by_hand() -> VehicleModel:
    model = VehicleModel(arsim().body)
    model.dc_motors()
    return model
