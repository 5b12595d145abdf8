"""The environment of Gymnasium: a run that the learner's code steps is the run of a brain with the same commands."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import boebot
from boebot.boards import board_kinds
from boebot.env import BoardEnv
from boebot.errors import BoebotError, BrainError, CallError
from boebot.learners import AGE_MAXIMUM
from boebot.robot import Robot
from boebot.running.board_driver import BoardDriver
from boebot.running.stepping import AT_LEISURE

pytestmark = pytest.mark.skipif("native" not in board_kinds(), reason="the simulator is not installed")


@pytest.fixture(autouse=True)
def _no_thread_is_left() -> Iterator[None]:
    before = threading.active_count()
    yield
    assert threading.active_count() == before


def signals(step: int) -> tuple[float, float]:
    """The commands of these tests, exact in 32 bits."""
    return 0.5, 0.25 + (step % 8) / 16


def episode(env: BoardEnv, seed: int) -> tuple[list[float], dict[str, object]]:
    """Rewards of an episode and its figures."""
    env.reset(seed=seed)
    rewards: list[float] = []
    while True:
        seen, reward, terminated, truncated, info = env.step(signals(len(rewards)))
        assert env.observation_space.contains(seen) and not terminated
        rewards.append(reward)
        if truncated:
            return rewards, info["figures"]


def by_a_brain(seed: int, **asked: object) -> dict[str, object]:
    """Figures of the run of a brain with the same commands."""
    steps = iter(range(10**6))

    def step(robot: Robot) -> None:
        robot.drive(*signals(next(steps)))

    return boebot.run(step, seed=seed, **asked).table()  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "asked",
    [
        {"robot": "shieldbot", "arena": "room"},
        {"robot": "shieldbot", "on": "avr", "seconds": 0.5},
        {"robot": "arsim"},
        {"robot": "shieldbot-charging", "arena": "station", "period": 0.1, "pose": (0.2, 0.1, 1.0)},
        {"robot": "shieldbot", "without": ("slip",), "imperfections": {"servo_lag_s": 0.2}},
        {"robot": "shieldbot", "arena": "room", "faults": ["ping.missing@0.2..0.6s"]},
    ],
    ids=["native", "avr", "direct", "slow devices", "imperfections", "faults"],
)
def test_an_episode_is_the_run_of_a_brain_with_the_same_commands(asked: dict[str, object]) -> None:
    whole = {"seconds": 1.0} | asked
    env = BoardEnv(**whole)  # type: ignore[arg-type]
    rewards, figures = episode(env, 5)
    assert figures.pop("brain") == "learner"
    assert figures == {name: value for name, value in by_a_brain(5, **whole).items() if name != "brain"}
    assert len(rewards) == figures["steps"]
    assert env.result is not None and env.result.hash == figures["hash"]
    again, other = episode(env, 5), episode(env, 6)
    assert again == (rewards, {"brain": "learner"} | figures) and other[1]["seed"] == 6


@pytest.mark.parametrize("robot", ["shieldbot", "arsim", "roller"])
def test_gymnasiums_checker_passes_without_a_warning(robot: str) -> None:
    env = BoardEnv(robot=robot, seconds=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)  # there is nothing to render
    env.close()


def test_what_is_seen_is_what_a_brain_reads() -> None:
    env = BoardEnv(robot="shieldbot-charging", arena="room", seconds=1.0)
    rows = [env.reset(seed=1)[0]] + [env.step(signals(step))[0] for step in range(19)]
    steps = iter(range(20))
    at = {name: index for index, name in enumerate(env.names)}

    def step(robot: Robot) -> None:
        robot.drive(*signals(number := next(steps)))
        ping, battery, encoder, whisker = robot.ping, robot.battery, robot.encoder_left, robot.whisker_left
        for name, value in {
            "ping.distance": ping.distance or 0.0,
            "ping.distance.known": ping.distance is not None,
            "ping.age": min(ping.age, AGE_MAXIMUM),
            "battery.voltage": battery.voltage or 0.0,
            "battery.voltage.known": battery.voltage is not None,
            "battery.age": min(battery.age, AGE_MAXIMUM),
            "battery.valid": battery.valid,
            "encoder_left.count": encoder.count,
            "whisker_left.pressed": whisker.pressed,
            "infrared_left.zone.known": False,  # it does not sweep
        }.items():
            assert rows[number][at[name]] == np.float32(value), (number, name)

    result = boebot.run(step, robot="shieldbot-charging", arena="room", seconds=1.0, seed=1)
    assert result.steps == 20 and rows[-1][at["ping.distance.known"]] == rows[-1][at["battery.voltage.known"]] == 1
    env.close()


def test_every_ray_of_a_laser_is_a_number() -> None:
    env = BoardEnv(robot="roller", arena="room", seconds=0.2)
    rays = [name for name in env.names if name.startswith("laser.distances.")]
    assert len(rays) > 100 and len(env.names) == len(set(env.names)) == len(env.reset()[0])
    env.close()


def test_environments_may_be_stepped_in_turns() -> None:
    environments = [BoardEnv(robot=robot, arena="room", seconds=1.0) for robot in ("shieldbot", "shieldbot", "arsim")]
    for env in environments:
        env.reset(seed=3)
    for step in range(20):
        for env in environments:
            over = env.step(signals(step))[3]
            assert over == (step == 19)
    hashes = [env.result.hash for env in environments if env.result is not None]
    robots = ("shieldbot", "arsim")
    one, other = (by_a_brain(3, robot=robot, arena="room", seconds=1.0)["hash"] for robot in robots)
    assert hashes == [one, one, other]


def test_a_seed_is_the_runs_own_and_without_one_each_episode_is_another() -> None:
    env = BoardEnv(seconds=0.2)
    assert env.reset(seed=7)[1] == {"seed": 7}
    drawn = [env.reset()[1]["seed"] for _ in range(3)]
    assert len({7, *drawn}) == 4
    env.reset(seed=7)
    assert [env.reset()[1]["seed"] for _ in range(3)] == drawn
    env.close()


def test_rewards_are_of_what_is_seen_commanded_and_of_the_runs_figures() -> None:
    env = BoardEnv(robot="shieldbot", arena="room", pose=(1.3, 0.0, 0.0), seconds=3.0)
    rewards, figures = episode(env, 1)
    drive = [sum(signals(step)) / 2 for step in range(len(rewards))]
    touched = [pytest.approx(forward - 1.0) == reward for forward, reward in zip(drive, rewards, strict=True)]
    assert figures["whisker_touches"] and any(touched) and not touched[0]
    assert all(hit or reward == forward for hit, forward, reward in zip(touched, drive, rewards, strict=True))
    own = BoardEnv(
        seconds=0.2,
        reward=lambda seen, command: seen.time + command.right,
        final=lambda figures: 100.0 * figures["steps"],
    )
    seconds = [0.05, 0.10, 0.15, 0.15]  # nothing new is seen after the last step
    expected = [time_s + signals(step)[1] for step, time_s in enumerate(seconds)]
    expected[-1] += 400
    assert episode(own, 1)[0] == pytest.approx(expected)


def test_one_that_is_dropped_stops_its_board(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    end = BoardDriver.end

    def ends(driver: BoardDriver) -> None:
        end(driver)
        stopped.append(1)

    monkeypatch.setattr(BoardDriver, "end", ends)
    env, threads = BoardEnv(), threading.active_count()
    for _ in range(2):
        env.reset(seed=1)
    assert len(stopped) == 2 and threading.active_count() > threads
    itself = [env]
    itself.append(itself)  # type: ignore[arg-type]
    del env, itself
    gc.collect()
    assert len(stopped) == 3 and threading.active_count() == threads


def test_a_learner_may_think_for_longer_than_a_brain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boebot.running.board_driver.AT_LEISURE", AT_LEISURE._replace(seconds=0.1))
    env = BoardEnv(seconds=0.2)
    env.reset(seed=1)
    time.sleep(0.5)
    env.step((0.0, 0.0))
    env.close()


def test_what_ends_a_run_before_its_time_is_raised() -> None:
    env = BoardEnv(seconds=0.2, faults=["ping.missing@0.19s"])  # no ping falls into it
    env.reset(seed=1)
    for _ in range(3):
        env.step((0.0, 0.0))
    with pytest.raises(BoebotError, match=r"fault ping\.missing@0\.19s did not fire"):
        env.step((0.0, 0.0))
    with pytest.raises(CallError, match="there is no episode"):
        env.step((0.0, 0.0))


def test_bad_input_is_a_sentence() -> None:
    with pytest.raises(BoebotError, match="there is no robot 'nobot'"):
        BoardEnv(robot="nobot")
    with pytest.raises(BoebotError, match="a run cannot last 0 s"):
        BoardEnv(seconds=0)
    for beyond in (float("inf"), float("nan")):
        with pytest.raises(CallError, match=f"seconds is {beyond}; expected a finite number"):
            BoardEnv(seconds=beyond)
    env = BoardEnv(seconds=0.5)
    with pytest.raises(CallError, match=r"there is no episode to step; expected reset\(\) first"):
        env.step((0.0, 0.0))
    env.reset(seed=1)
    for action in ((0.5,), (0.1, 0.2, 0.3), 1.0, ("a", "b"), None):
        with pytest.raises(CallError, match="expected two motor signals"):
            env.step(action)
    for seed in (-1, 1.5):
        with pytest.raises(gymnasium.error.Error, match=r"^Seed must be"):
            env.reset(seed=seed)  # type: ignore[arg-type]
    env.reset(seed=1)
    for beyond in (1.5, float("nan")):
        with pytest.raises(BrainError, match="motor signals go from -1 to 1"):
            env.step((beyond, 0.0))
    assert not env.step((1.0, -1.0))[3], "it goes on"
    env.close()
    env.close()


@pytest.mark.parametrize("asked", [{"reward": lambda *_: None}, {"final": lambda _: float("nan")}])
def test_a_reward_that_is_no_number_is_a_sentence(asked: dict[str, Any]) -> None:
    env = BoardEnv(seconds=0.05, **asked)
    env.reset(seed=1)
    with pytest.raises(CallError, match=r"(reward is None|final is nan); expected a finite number"):
        env.step((0.0, 0.0))


def test_without_gymnasium_the_extra_is_named() -> None:
    code = "import sys; sys.modules['gymnasium'] = None; import boebot.env"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    sentence = r"an environment for learners needs gymnasium, which is not installed: pip install .boebot\[learn\]."
    assert re.search(sentence, done.stderr), done.stderr
