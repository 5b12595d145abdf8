"""Path integration and homing against closed forms: home vectors, the spiral, missing and stale readings, wrap-around.

The robot is arsim without its motors: tests say what its odometer and its compass read (notes, section 4.4.4).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from boebot.behaviors import Homing, Stop
from boebot.behaviors.homing import corner, leg_length
from boebot.brain import Brain, MotorBehavior
from boebot.brain.composition import load
from boebot.cognition import Odometry, PathIntegration, SunCompass, sun_azimuth, wrapped
from boebot.description.equipment import Equipment
from boebot.description.robots import load_robot
from boebot.devices.readings import Readings
from boebot.errors import BrainError
from boebot.robot import Observation, Robot

ARSIM = load_robot("arsim")
LAYOUT = {"odometer": slice(0, 3), "compass": slice(3, 4)}
PERIOD = 0.05
TURNS = st.floats(-10, 10)
WAYS = st.floats(-2, 2)


class Walked:
    """A robot whose place a test says.

    Attributes:
        x, y, heading: where it really is (m, rad).
        brain: with PathIntegration, as `path`, and Odometry, both begun where the robot is.
    """

    def __init__(
        self, path: PathIntegration, *others: object, at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        self.x, self.y, self.heading = at
        self.path = path
        motors = [one for one in others if isinstance(one, MotorBehavior)] or [Stop()]
        rest = [one for one in others if not isinstance(one, MotorBehavior)]
        self.brain = Brain([*motors, Odometry(), *rest, path])  # type: ignore[list-item]
        self.robot = Robot(ARSIM.name, PERIOD)
        self.steps = 0
        self.step()

    def step(
        self, compass: float | None = None, odometer: tuple[float, float, float] | None = None, age: float = 0.0
    ) -> None:
        """A step of the brain that reads these; None: the truth."""
        place = (self.x, self.y, wrapped(self.heading)) if odometer is None else odometer
        values = (*place, wrapped(self.heading) if compass is None else compass)
        sample = Readings(self.steps, 0, (0.0, 0.0, 0.0, age), values)
        equipment = Equipment(ARSIM, 0.01, LAYOUT)
        self.robot.observation = Observation(sample, equipment, self.steps * PERIOD, slow=sample)
        self.brain.step(self.robot)
        self.steps += 1

    def go(self, turn: float, way: float) -> None:
        """Turns on the spot (rad), then goes straight on (m)."""
        self.heading += turn
        self.step()
        self.x += way * math.cos(self.heading)
        self.y += way * math.sin(self.heading)
        self.step()

    def drive(self) -> None:
        """Moves as a robot of arsim's size would under its command, without inertia; then a step."""
        _, left, right = self.robot.command
        speed = ARSIM.body.wheel_speed_maximum_m_s
        turned = (right - left) * speed / ARSIM.body.track_width_m * PERIOD
        way = (left + right) / 2 * speed * PERIOD
        self.x += way * math.cos(self.heading + turned / 2)
        self.y += way * math.sin(self.heading + turned / 2)
        self.heading += turned
        self.step()


def walked(*others: object, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Walked:
    return Walked(PathIntegration(), *others, at=at)


# ---- path integration ----------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(TURNS, WAYS), max_size=12), st.floats(-20, 20))
def test_home_vector_is_the_way_back_from_any_path(legs: list[tuple[float, float]], first: float) -> None:
    """Headings of many turns, forward and backward: h = home - place, the sum of the legs with the sign reversed."""
    one = walked(at=(1.0, -2.0, first))
    for turn, way in legs:
        one.go(turn, way)
    assert one.path.vector == pytest.approx((1.0 - one.x, -2.0 - one.y), abs=1e-9)
    assert one.path.travelled == pytest.approx(sum(abs(way) for _, way in legs), abs=1e-9)
    assert -math.pi < one.path.heading <= math.pi
    assert one.path.distance == pytest.approx(math.dist((one.x, one.y), (1.0, -2.0)), abs=1e-9)


def test_a_circle_closes() -> None:
    """Chords of a circle under the mean of the headings at their ends add up to nothing, however long they are."""
    one = walked()
    for count in range(1, 13):
        angle = count * math.pi / 6
        one.x, one.y, one.heading = math.sin(angle), 1 - math.cos(angle), angle
        one.step()
    assert one.path.vector == pytest.approx((0.0, 0.0), abs=1e-12)
    assert one.path.travelled == pytest.approx(12 * 2 * math.sin(math.pi / 12), abs=1e-12)


def test_headings_to_either_side_of_pi_do_not_cancel() -> None:
    one = walked(at=(0.0, 0.0, math.pi))
    for count in range(100):
        one.x -= 0.1
        one.step(compass=math.pi - 0.01 if count % 2 else -math.pi + 0.01)
    assert one.path.vector[0] == pytest.approx(10.0, abs=0.01)
    assert one.path.direction == pytest.approx(0.0, abs=0.01)


def test_the_compass_counts_and_not_the_wheels_heading() -> None:
    """An odometer whose heading drifts by 0.05 rad each step: the way is its own, the direction is not."""
    one = walked()
    x = y = drifted = 0.0
    for _ in range(40):
        one.x += 0.1
        drifted += 0.05
        x, y = x + 0.1 * math.cos(drifted), y + 0.1 * math.sin(drifted)
        one.step(odometer=(x, y, wrapped(drifted)))
    assert one.path.vector == pytest.approx((-4.0, 0.0), abs=1e-9)


def test_home_is_where_it_is_set() -> None:
    one = walked()
    one.go(0.3, 2.0)
    one.path.set_home()
    assert (one.path.distance, one.path.travelled, one.path.direction) == (0.0, 0.0, 0.0)
    one.go(math.pi / 2 - 0.3, 1.5)
    assert one.path.vector == pytest.approx((0.0, -1.5), abs=1e-9)
    assert one.path.direction == pytest.approx(-math.pi / 2)
    assert one.path.position == pytest.approx((0.0, 1.5))


def test_a_new_run_begins_at_home() -> None:
    one = walked()
    one.go(0.0, 3.0)
    Walked(one.path)
    assert one.path.vector == (0.0, 0.0)


@pytest.mark.parametrize("missing", [math.nan, math.inf])
def test_wheels_stand_in_while_the_compass_says_nothing(missing: float) -> None:
    one = walked()
    one.go(0.5, 1.0)
    one.heading += 1.0
    one.step(compass=missing)
    one.x, one.y = one.x + 2 * math.cos(1.5), one.y + 2 * math.sin(1.5)
    one.step(compass=missing)
    assert one.path.vector == pytest.approx((-one.x, -one.y), abs=1e-9)
    assert one.path.heading == pytest.approx(1.5)


def test_what_was_gone_before_the_compass_spoke_is_turned_by_its_first_reading() -> None:
    """The odometer began at 0, the compass then says that this is west: 2 m so far were gone to the west."""
    one = Walked(PathIntegration())
    one.robot = Robot(ARSIM.name, PERIOD)  # a new run, without a reading
    one.step(compass=math.nan)
    one.x = 2.0
    one.step(compass=math.nan)
    assert one.path.vector == pytest.approx((-2.0, 0.0))
    one.step(compass=math.pi)
    assert one.path.vector == pytest.approx((2.0, 0.0), abs=1e-12)
    assert one.path.heading == pytest.approx(math.pi)


def test_a_pose_that_is_no_number_is_made_up_for_by_the_next() -> None:
    one = walked()
    one.x = 1.0
    one.step(odometer=(math.nan, 0.0, 0.0))
    assert one.path.vector == (0.0, 0.0)
    one.x = 2.0
    one.step()
    assert one.path.vector == pytest.approx((-2.0, 0.0))


def test_the_sky_turns_and_the_ephemeris_makes_up_for_it() -> None:
    """Six hours from step to step: the pattern turns by a right angle each time, the ants go east all the while."""
    sky = SunCompass(turning=True, azimuth_at_start=0.4)
    one = Walked(PathIntegration(sky=True), sky)
    for _ in range(8):
        one.x += 1.0
        one.steps += round(6 * 3600 / PERIOD)
        one.step(compass=wrapped(-sun_azimuth(one.steps * PERIOD, 0.4)))
    # the first heading was read against the pattern of time 0 as if it were 0.4 rad: half of the first metre's angle
    assert one.path.vector == pytest.approx((-7 - math.cos(0.2), -math.sin(0.2)), abs=1e-9)


def test_the_state_variable_grows_with_the_distance() -> None:
    path = PathIntegration(scale=2.0)
    one, away = Walked(path), path.variable()
    assert away.value(one.robot) == 0.0
    one.go(1.0, 2.0)
    assert away.value(one.robot) == pytest.approx(1 - math.exp(-1))


# ---- homing ---------------------------------------------------------------------------------------------------------


@given(st.integers(0, 200), st.floats(0.01, 10), st.floats(-4, 4))
def test_the_spirals_corners_are_its_legs_in_a_row(legs: int, pitch: float, first: float) -> None:
    x = y = 0.0
    for leg in range(legs):
        x += leg_length(leg, pitch) * math.cos(first + leg * math.pi / 2)
        y += leg_length(leg, pitch) * math.sin(first + leg * math.pi / 2)
    assert corner(legs, pitch, first) == pytest.approx((x, y), abs=1e-9 * pitch * (legs + 1) ** 2)


@pytest.mark.parametrize("side", [0, 1, 2, 3])
def test_parallel_legs_lie_one_pitch_apart(side: int) -> None:
    across = 1 if side % 2 == 0 else 0  # legs along x lie apart in y
    places = [corner(side + 4 * ring, 0.1)[across] for ring in range(1, 10)]
    assert [abs(b - a) for a, b in pairwise(places)] == pytest.approx([0.1] * 8)


def homed(homing: Homing, away: tuple[float, float], seconds: float) -> tuple[Walked, list[tuple[float, float]]]:
    """A robot that has gone there and then begins to home; its places (m from home)."""
    one = walked(homing)
    one.go(math.atan2(away[1], away[0]), math.hypot(*away))
    homing.enter(one.robot)
    places = []
    for _ in range(round(seconds / PERIOD)):
        one.drive()
        places.append((one.x, one.y))
    return one, places


@pytest.mark.parametrize("away", [(3.0, 0.0), (-2.0, 2.0), (0.0, -4.0), (-3.0, -1e-9)])
def test_it_goes_straight_home(away: tuple[float, float]) -> None:
    """Along the line to home but for turning to it, at full signal but for that: |away| / speed and the turn."""
    homing = Homing(signal=0.5)
    _, places = homed(homing, away, 8.0)
    assert homing.arrived is not None
    length = math.hypot(*away)
    speed = 0.5 * ARSIM.body.wheel_speed_maximum_m_s
    before = [place for place in places if math.hypot(*place) > 0.1]
    off = max(abs(x * away[1] - y * away[0]) / length for x, y in before[: round((length / speed) / PERIOD)])
    assert off < 0.1
    assert min(math.hypot(*place) for place in places) < 0.1


def test_the_search_passes_every_place_near_home() -> None:
    """Within half a pitch (and what it cuts at corners) of all places that the rings so far go round."""
    homing = Homing(search_signal=0.1, gain=1.0, pitch=0.2)
    _, places = homed(homing, (0.5, 0.0), 140.0)
    for x in range(-3, 4):
        for y in range(-3, 4):
            target = 0.1 * x, 0.1 * y
            assert min(math.dist(place, target) for place in places) < 0.15, target


def test_it_stays_once_home_is_found() -> None:
    found: list[float] = []
    homing = Homing(found=lambda robot: found[-1] if found else None)
    one, _ = homed(homing, (0.5, 0.0), 6.0)
    assert homing.arrived is not None and homing.home is None and homing.machine.state == "search"
    found.append(0.4)
    one.drive()
    assert homing.home is None
    found.append(1.0)
    one.drive()
    assert homing.home == pytest.approx(one.robot.time)
    found.append(0.0)  # it has been there
    place = one.x, one.y
    for _ in range(20):
        one.drive()
    assert (one.x, one.y) == place and one.robot.command[1:] == (0.0, 0.0)


def test_home_may_be_found_on_the_way() -> None:
    homing = Homing(found=lambda robot: 1.0)
    homed(homing, (5.0, 0.0), 0.2)
    assert homing.home is not None and homing.arrived is None


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(*[st.floats(allow_nan=True, allow_infinity=True, width=32)] * 4), max_size=20))
@example([(0.0, 0.0, math.inf, 0.0)])
@example([(0.0, math.nan, 0.0, -math.inf)])
@example([(1e38, 0.0, 0.0, 0.0), (-1e38, 1e38, 0.0, 0.0)])
def test_no_reading_makes_a_command_that_is_none(readings: list[tuple[float, float, float, float]]) -> None:
    one = walked(Homing())
    for x, y, heading, compass in readings:
        one.step(compass=compass, odometer=(x, y, heading))
        _, left, right = one.robot.command
        assert -1 <= left <= 1 and -1 <= right <= 1


# ---- errors, and TOML -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Homing(pitch=0.0), "homing: pitch is 0.0; expected more than 0"),
        (lambda: Homing(arrival=math.nan), "homing: arrival is nan; expected a number"),
        (lambda: Homing(signal=1.5), "homing: signal is 1.5; expected a motor signal from -1 to 1"),
        (lambda: PathIntegration(scale=-1.0), "path_integration: scale is -1.0; expected more than 0"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(BrainError) as caught:
        make()
    assert str(caught.value) == sentence


HOME = """
[variable.home]
kind = "contact"

[variable.away]
of = "path_integration"

[process.odometry]
[process.path_integration]
[process.homing]
pitch = 0.2
"""


def test_a_file_may_say_what_home_is_known_by(tmp_path: Path) -> None:
    path = tmp_path / "home.toml"
    path.write_text(HOME + 'found = "home"\n')
    homing = next(one for one in load(path).processes if isinstance(one, Homing))
    assert homing.pitch == 0.2 and homing.found is not None
    one = walked()
    assert homing.found(one.robot) == 0.0  # arsim has no whiskers to feel home with
    path.write_text(HOME)
    assert next(one for one in load(path).processes if isinstance(one, Homing)).found is None
    path.write_text(HOME + 'found = "beacon"\n')
    with pytest.raises(BrainError, match=r"process\.homing\.found names the state variable 'beacon'"):
        load(path)
    path.write_text(HOME + "found = 3\n")
    with pytest.raises(BrainError, match="found"):
        load(path)
