"""Following the walls of a room: named in chapter 5 of the notes, Fig. 5.1; the law is the kit's own. E35."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from boebot import run
from boebot.behaviors import FollowWall
from boebot.brain import Brain
from boebot.description.robots import RobotDescription
from boebot.result import RunResult
from boebot_course.experiment import Figure, Measured, Outcome, Variant, experiment
from boebot_course.paths import floor
from boebot_course.variants import SMALL_SPEED, arena_file, small_arsim, varied

LENGTH, WIDTH = 3.0, 2.0  # of the room (m)
ROOM = f"""
[[outline]]
corners_m = [[0, 0], [{LENGTH}, 0], [{LENGTH}, {WIDTH}], [0, {WIDTH}]]
"""
SECONDS = 80.0
SPEED = 0.12  # v_0 (m/s)


def follower() -> Brain:
    """v_0 = 0.12 m/s, k = 0.5 m/s, S_ref = 0.25, as motor signals."""
    return Brain([FollowWall(signal=SPEED / SMALL_SPEED, gain=0.5 / SMALL_SPEED, reference=0.25)])


START = 0.30  # m, of the shieldbot from the wall: about the distance that it will keep


def pinger() -> RobotDescription:
    """shieldbot with its Ping on the turret."""
    return varied("shieldbot", "shieldbot-turret", turret={"on": True})


def lap(robot: RobotDescription, on: str | None, seed: int, start: float, seconds: float = SECONDS) -> RunResult:
    """A run along the walls, which begins `start` metres from one."""
    with arena_file("room", ROOM) as arena:
        return run(
            follower(),
            robot=robot,
            arena=arena,
            on=on,
            seconds=seconds,
            seed=seed,
            pose=(0.8 * LENGTH, start, 0.0),
        )


@experiment(
    "E35",
    on={
        "arsim": Variant(
            "arsim in the size of a Boe-Bot, IR ahead and at -60 degrees", small_arsim, None, 0.25, 0.20, 0.30
        ),
        "shieldbot": Variant("shieldbot with its turret (native)", pinger, "native", START, 0.19, 0.345),
        "avr": Variant("shieldbot with its turret (avr)", pinger, "avr", START, 0.19, 0.345, slow=True),
    },
)
def wall(
    robot: Callable[[], RobotDescription],
    on: str | None,
    start: float,
    least: float,
    most: float,
    seed: int,
) -> Outcome:
    """A lap along the walls

    In the notes: chapter 5, Fig. 5.1

    Figure: Path of a robot that follows the walls of a room of 3 m by 2 m, and its distance from them. The shieldbot's
    Ping on its turret looks to the wall, IR pairs look ahead.

    Expected: Once about the room at least in 80 s, at 0.25 m ± 0.05 m from the nearest wall, without a contact.

    Expected on shieldbot: S_ref = 0.25 is 0.30 m by Ping, whose beam of ±20 degrees about -60 degrees meets the
    wall at 80 degrees: 0.295 m from the middle, and 0.05 m more at most. In a corner it comes as near as its IR
    pairs let it: they reach 0.20 m less 3 × 3 %, at 0.25 rad to the heading and 0.05 m ahead of the middle, 0.226
    m; until the wheels answer (0.05 s for a reading, 0.05 s for a step, 0.055 s of lag) its 0.168 m/s take it 0.027
    m farther: 0.199 m, less 0.01 m for skew. By the servos' curve its motor signal stands for 0.168 m/s instead of
    0.12 m/s.

    Expected on avr: As on shieldbot.
    """
    result = lap(robot(), on, seed, start)
    truth = result.truth
    assert truth is not None
    time, x, y = truth.time - result.clock_offset, truth.x, truth.y
    distance = np.minimum(np.minimum(x, LENGTH - x), np.minimum(y, WIDTH - y))
    turns = (np.unwrap(truth.heading) - truth.heading[0]) / (2 * np.pi)
    measured = [
        Measured("turns about the room", float(turns[-1]), least=1.0),
        Measured("least distance from a wall", float(distance.min()), "m", least=least),
        Measured("greatest distance", float(distance.max()), "m", most=most),
        Measured("true contacts", float(result.true_contacts or 0), most=0.0),
    ]
    shown = slice(None, None, max(1, len(time) // 2000))
    data = {
        "time_s": time[shown],
        "true_x_m": x[shown],
        "true_y_m": y[shown],
        "true_heading_rad": truth.heading[shown],
        "true_distance_from_wall_m": distance[shown],
    }

    def draw(figure: Figure) -> None:
        above, beside = figure.subplots(1, 2, width_ratios=(1.5, 1))
        floor(above, truth.plan)
        above.plot(x, y, color="#0072b2", linewidth=1.3, label="path of its middle")
        above.plot(x[0], y[0], "o", color="#009e73", label="start")
        above.plot(x[-1], y[-1], "s", color="#d55e00", label="end")
        above.legend(loc="center", fontsize=9, frameon=False)
        beside.axhspan(least, most, color="#e3e5ea", label="criterion")
        beside.plot(time, distance, color="#0072b2", linewidth=1.0)
        beside.set(xlabel="time (s)", ylabel="distance from the nearest wall (m)", ylim=(0, 0.4))
        beside.legend(loc="lower right", fontsize=9, frameon=False)

    return Outcome(measured, data, draw)
