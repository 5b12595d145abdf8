"""The slow devices around the whole circle: arena, model, part, pin, firmware, telemetry, host.

Expected values come from the arena's geometry and the data sheets' curves (Parallax, Sharp), without noise
unless a test is about it.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.arenas import Light
from boebot.description.robots import load_robot
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.compass import MagneticCompass
from boebot.link import messages
from boebot.link.messages import CompassStatus
from boebot_hil.rig import CYCLES_PER_S, TICK_S
from reading import read
from sim_bridge.robots import imperfections
from sim_bridge.tests.circle.circle import CircleRig, arena_of, block, circle, robot_of, wall_at
from sim_bridge.tests.simulated import tones, turret_angle

pytestmark = pytest.mark.unsanitized

SUPPLY_V = 5.0  # the boebot's rail while it stands: its pack has 5.3 V
SHARP_X = 0.06  # before the axle
PERIOD_S, LATE_S = 0.0383, 0.0076  # of the Sharp sensor
SOUND_M_S = 331.5 + 0.6 * 20.0
TURRET, BUZZER = 11, 4


# ---- analog infra-red ------------------------------------------------------------------------------------------------


def sharp_volts(distance: float) -> float:
    """V = 33.9 / (d + 4.74), d in cm; nearer than 10 cm it falls again."""
    return 33.9 / (100 * distance + 4.74)


def test_analog_infrared_follows_its_curve_before_a_wall(board_url: str) -> None:
    with circle(board_url, arena_of(wall_at(2.0))) as rig:
        sharp = SharpSensor(pin="A2", position_m=(0, 0), heading_rad=0)
        for distance in (0.10, 0.15, 0.25, 0.40, 0.60, 0.75):
            rig.place(2.0 - SHARP_X - distance, 0.3)
            reported = rig.devices(after_s=0.15)
            assert abs(reported.analog_infrared - sharp_volts(distance) / SUPPLY_V * 1024) <= 1.5
            seen = read(sharp, "analog_infrared", reported)
            step_m = 0.01 * 33.9 / sharp_volts(distance) ** 2 * (SUPPLY_V / 1024)  # of the converter
            assert seen.valid and seen.distance is not None
            # half a per cent of the supply is what the bandgap resolves
            assert abs(seen.distance - distance) <= 1.5 * step_m + 0.006 * (distance + 0.0474)
        rig.place(0.0, 0.3)
        nothing = read(sharp, "analog_infrared", rig.devices(after_s=0.15))
        assert nothing.distance is None and nothing.valid


def test_analog_infrared_looks_slantwise_and_folds_back(board_url: str) -> None:
    with circle(board_url, arena_of(wall_at(1.0))) as rig:
        rig.place(0.5, 0.0, 0.6)  # along the ray: (1 - x) / cos
        reported = rig.devices(after_s=0.15)
        distance = 0.5 / math.cos(0.6) - SHARP_X
        assert abs(reported.analog_infrared - sharp_volts(distance) / SUPPLY_V * 1024) <= 1.5
        near, far = 0.04, 0.0
        rig.place(1.0 - SHARP_X - near, 0.0)
        folded = rig.devices(after_s=0.15).analog_infrared / 1024 * SUPPLY_V
        assert folded < sharp_volts(0.10)
        far = 0.01 * (33.9 / folded - 4.74)
        assert far > 0.20, "a thing at 4 cm looks like one far away"


def test_analog_infrared_holds_its_value_until_the_next_measurement(board_url: str) -> None:
    with circle(board_url, arena_of(wall_at(1.0))) as rig:
        rig.set("devices_period", 1)
        rig.place(0.2, 0.0)
        old = rig.devices(after_s=0.2).analog_infrared
        for wait in (0.003, 0.011, 0.019, 0.027):
            rig.listen(wait)
            placed = rig.board.cycle / CYCLES_PER_S
            rig.place(0.7 if rig.robot.body().x < 0.5 else 0.2, 0.0)
            due = math.ceil(placed / PERIOD_S) * PERIOD_S + LATE_S
            reported = rig.devices()
            while reported.analog_infrared == old:
                reported = rig.devices()
            converted = (rig.transport.now() - TICK_S * reported.analog_infrared_age) - due
            assert -0.5 * TICK_S <= converted <= 4.5 * TICK_S
            old = rig.devices(after_s=0.1).analog_infrared


# ---- light -----------------------------------------------------------------------------------------------------------


def decay_us(x: float, y: float, heading: float, lamps: list[Light]) -> float:
    """1.5 ms at L = 1; L = ambient + sum P max(0, cos theta) / (d0^2 + d^2) (world/sensors/light.h)."""
    light = imperfections.AS_BUILT["light_ambient"]
    for lamp in lamps:
        dx, dy = lamp.x_m - x, lamp.y_m - y
        d = math.hypot(dx, dy)
        facing = max(0.0, math.cos(math.atan2(dy, dx) - heading))
        light += lamp.power_w * facing / (imperfections.AS_BUILT["light_near_m"] ** 2 + d * d)
    return 1500.0 / light


def light_mounts(x: float, y: float, heading: float) -> list[tuple[float, float, float]]:
    """Of the left and the right sensor, 5 cm ahead and 4 cm aside, turned 0.5 rad outwards."""
    mounts = []
    for way in (1, -1):
        ahead, aside = 0.05, 0.04 * way
        mounts.append(
            (
                x + ahead * math.cos(heading) - aside * math.sin(heading),
                y + ahead * math.sin(heading) + aside * math.cos(heading),
                heading + 0.5 * way,
            )
        )
    return mounts


# The interrupt that stamps the edge waits, on a busy line, for a byte received and one sent (tasks.def: 54 and 50
# cycles), and reads the time some 30 cycles after it began: 134 cycles, 8.4 us, reported in whole us. It never stamps
# early, but the expected time is rounded too, and the release is timed up to 1 us after it.
STAMP_LATE_US = (-2, 9)


def is_punctual(reported: int, true: float) -> bool:
    """Whether a decay time (us) is right but for what its stamp may be late."""
    return STAMP_LATE_US[0] <= reported - true <= STAMP_LATE_US[1]


def assert_light(rig: CircleRig, pose: tuple[float, float, float], lamps: list[Light]) -> None:
    rig.place(*pose)
    reported = rig.devices(after_s=0.15)
    left, right = (decay_us(*mount, lamps) for mount in light_mounts(*pose))
    assert is_punctual(reported.light_left, left) and is_punctual(reported.light_right, right)
    assert reported.light_age <= 4


@pytest.mark.parametrize("robot", ["boebot", "shieldbot-basic"])
def test_light_sensors_near_a_lamp(board_url: str, robot: str) -> None:
    """The left one on port C beside other lines, or on Timer1's capture pin."""
    lamps = [Light(1.0, 0.4, 3.0)]
    with circle(board_url, arena_of(light=lamps), load_robot(robot)) as rig:
        for pose in ((0.0, 0.0, 0.0), (0.6, 0.0, 1.0), (0.6, 0.6, -0.4), (0.0, 0.0, math.pi), (0.8, 0.3, 0.4)):
            assert_light(rig, pose, lamps)


def test_what_is_high_enough_shades_the_light_sensors(board_url: str) -> None:
    lamp = Light(1.0, 0.0, 3.0)
    for height, lit in ((None, []), (0.10, []), (0.08, [lamp])):
        with circle(board_url, arena_of(block(0.4, -0.5, 0.5, 0.5, height), light=[lamp])) as rig:
            assert_light(rig, (0.0, 0.0, 0.0), lit)


def test_light_sensors_are_where_the_description_has_them(board_url: str) -> None:
    lamps = [Light(1.0, 0.4, 3.0)]
    mount = {"position_m": (0.0, 0.0), "heading_rad": math.pi / 2}
    with circle(board_url, arena_of(light=lamps), robot_of(light_left=mount)) as rig:
        reported = rig.devices(after_s=0.15)
        assert is_punctual(reported.light_left, decay_us(0.0, 0.0, math.pi / 2, lamps))


# ---- compass ---------------------------------------------------------------------------------------------------------


HEADINGS = np.linspace(-math.pi, math.pi, 12, endpoint=False) + 0.1


def fields_over_a_turn(rig: CircleRig) -> list[messages.DevicesTelemetry]:
    reported = []
    for heading in HEADINGS:
        rig.place(0.0, 0.0, float(heading))
        reported.append(rig.devices(after_s=0.15))
        assert reported[-1].compass_status == CompassStatus.OK
    return reported


def wrapped(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def test_compass_gives_the_heading_of_the_placed_robot(board_url: str) -> None:
    """1,090 counts a gauss: 0.19 G along the floor is a circle of 207 counts, half a count of it 0.0035 rad."""
    with circle(board_url, arena_of()) as rig:
        compass = MagneticCompass(sda_pin="A4", scl_pin="A5")
        for heading, reported in zip(HEADINGS, fields_over_a_turn(rig), strict=True):
            reading = read(compass, "compass", reported)
            assert reading.valid and reading.heading is not None
            assert abs(wrapped(reading.heading - heading)) <= 0.0036
            assert abs(reported.compass_z + 0.45 * 1090) <= 1


@pytest.mark.parametrize("seed", [1, 4])
def test_a_turn_finds_the_compass_of_this_unit(board_url: str, seed: int) -> None:
    """The circle's centre is the robot's iron; what remains is the bias of the mounting, the same at each heading."""
    draw = imperfections.Draw(seed, noise=True, robot=0)
    bias = draw["compass_bias_rad"] * draw(61, 0)
    iron = draw["compass_iron"] * math.hypot(draw(61, 1), draw(61, 2))
    counts = draw["compass_horizontal_g"] * 1090
    with circle(board_url, arena_of(), noise=True, seed=seed) as rig:
        reported = fields_over_a_turn(rig)
        centre = float(np.mean([t.compass_x for t in reported])), float(np.mean([t.compass_y for t in reported]))
        assert abs(math.hypot(*centre) - iron * counts) <= 3
        compass = MagneticCompass(sda_pin="A4", scl_pin="A5", offset_counts=centre)
        errors = []
        for heading, message in zip(HEADINGS, reported, strict=True):
            reading = read(compass, "compass", message)
            assert reading.heading is not None
            errors.append(wrapped(reading.heading - heading))
        assert abs(np.mean(errors) - bias) <= 0.006
        assert np.ptp(errors) <= 0.05


# ---- turret ----------------------------------------------------------------------------------------------------------


BOX = {"ahead": 1.0, "behind": -1.5, "left": 0.6, "right": -0.45}
BEAM_RAD, RAYS, GRAZING_RAD = 0.70, 7, 0.785


def distance_in_the_box(x: float, y: float, heading: float) -> float:
    """Of the nearest ray that meets a wall of BOX within 45 degrees of its normal."""
    nearest = math.inf
    for angle in heading + np.linspace(-BEAM_RAD / 2, BEAM_RAD / 2, RAYS):
        c, s = math.cos(angle), math.sin(angle)
        along_x = ((BOX["ahead"] if c > 0 else BOX["behind"]) - x) / c
        along_y = ((BOX["left"] if s > 0 else BOX["right"]) - y) / s if s else math.inf
        facing = abs(c) if along_x < along_y else abs(s)
        if facing >= math.cos(GRAZING_RAD):
            nearest = min(nearest, along_x, along_y)
    return nearest


def test_turret_turns_and_the_ping_on_it_sees_what_is_there(board_url: str) -> None:
    walls = [
        block(BOX["ahead"], -2.0, 1.1, 2.0),
        block(-1.6, -2.0, BOX["behind"], 2.0),
        block(-1.4, BOX["left"], 0.9, 0.7),
        block(-1.4, -0.55, 0.9, BOX["right"]),
    ]
    with circle(board_url, arena_of(*walls)) as rig:
        for asked in (0.0, 0.5 * math.pi, 0.3, -0.5 * math.pi, -0.3):
            rig.send(messages.Turret(round(asked * 1e4), 1))
            rig.listen(1.2)
            angle = turret_angle(rig.robot, TURRET)
            assert abs(angle - asked) <= 0.0075  # the dead band, 4 us of 573 a radian
            x, y = 0.045 + 0.015 * math.cos(angle), 0.015 * math.sin(angle)
            now = rig.latest()
            assert abs(now.ping_echo * 1e-6 * SOUND_M_S / 2 - distance_in_the_box(x, y, angle)) <= 0.001
        rig.stop()
        rig.listen(0.1)
        assert rig.devices().turret_pulse == 0
        assert abs(turret_angle(rig.robot, TURRET) - asked) <= 0.0075, "the gear holds"


def test_the_turrets_axis_is_where_the_description_has_it(board_url: str) -> None:
    robot = robot_of(turret={"position_m": (-0.04, 0.0)})
    with circle(board_url, arena_of(block(-1.0, 0.6, 1.0, 0.7)), robot) as rig:
        rig.send(messages.Turret(round(0.5e4 * math.pi), 1))
        rig.listen(1.2)
        assert abs(rig.latest().ping_echo * 1e-6 * SOUND_M_S / 2 - (0.6 - 0.10)) <= 0.002


# ---- buzzer ----------------------------------------------------------------------------------------------------------


def test_tones_have_their_frequency_and_duration(board_url: str) -> None:
    notes = [(440, 0.20), (1047, 0.10), (4000, 0.05)]
    with circle(board_url, arena_of()) as rig:
        for token, (frequency, seconds) in enumerate(notes, start=1):
            rig.send(messages.Buzzer(frequency, round(seconds * 100), token))
            rig.listen(seconds + 0.1)
            assert rig.devices().buzzer_token == token
        _, durations, frequencies = tones(rig.board.pin_log(), BUZZER).T
        assert frequencies == pytest.approx([frequency for frequency, _ in notes], rel=0.01)
        assert np.all(np.abs(durations - [seconds for _, seconds in notes]) <= TICK_S + 0.0025)


def test_a_stop_silences_the_buzzer(board_url: str) -> None:
    with circle(board_url, arena_of()) as rig:
        rig.send(messages.Buzzer(1000, 200, 1))
        rig.listen(0.3)
        rig.stop()
        rig.listen(0.2)
        _, durations, _ = tones(rig.board.pin_log(), BUZZER).T
        assert durations == pytest.approx([0.3], abs=0.03)


def test_a_low_supply_silences_the_buzzer_once_and_a_warning_may_sound(board_url: str) -> None:
    with circle(board_url, arena_of()) as rig:
        rig.send(messages.Buzzer(1000, 200, 1))
        rig.listen(0.1)
        rig.board.supply(3.5)
        rig.listen(0.3)
        assert rig.latest().latch == messages.Latch.SUPPLY_LOW
        rig.send(messages.Buzzer(2000, 20, 2))
        rig.listen(0.4)
        _, durations, frequencies = tones(rig.board.pin_log(), BUZZER).T
        assert frequencies == pytest.approx([1000, 2000], rel=0.01)
        assert durations[0] < 0.3 and durations[1] == pytest.approx(0.2, abs=0.02)


# ---- infra-red -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("distance", "zone"), [(0.25, 0), (0.168, 2), (0.130, 3), (0.104, 4), (0.070, 5)])
def test_infrared_zones_rise_as_a_wall_nears(board_url: str, distance: float, zone: int) -> None:
    """The range goes with the root of the receiver's sensitivity: 0.97, 0.90, 0.50, 0.33, 0.20 at 38 to 42 kHz."""
    reaches = [0.20 * math.sqrt(share / 0.97) for share in (0.97, 0.90, 0.50, 0.33, 0.20)]
    assert sum(distance < reach for reach in reaches) == zone
    first_ray = 0.45 - 0.20  # the inner edge of the beam meets the wall first
    with circle(board_url, arena_of(wall_at(1.0))) as rig:
        rig.set("infrared_sweep", 1)
        rig.place(1.0 - 0.05 - distance * math.cos(first_ray), 0.0)
        reported = rig.devices(after_s=0.3)
        assert (reported.infrared_zone_left, reported.infrared_zone_right) == (zone, zone)
        assert reported.infrared_zone_age <= 6


# ---- heights ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("height", "seen_by"),
    [
        (0.02, set()),
        (0.04, {"whiskers"}),
        (0.07, {"whiskers", "infrared"}),
        (0.085, {"whiskers", "infrared", "ping", "analog_infrared"}),
        (0.10, {"whiskers", "infrared", "ping", "analog_infrared", "shade"}),
    ],
)
def test_low_obstacles_are_seen_by_those_sensors_that_sit_low_enough(
    board_url: str, height: float, seen_by: set[str]
) -> None:
    """Heights above the floor: whiskers 0.03, infra-red 0.06, Ping and Sharp 0.08, light sensors 0.09 m."""
    lamp = Light(1.0, 0.0, 5.0)
    with circle(board_url, arena_of(wall_at(0.085, height), light=[lamp])) as rig:
        reported = rig.devices(after_s=0.3)
        now = rig.latest()
        left, _ = (decay_us(*mount, [lamp]) for mount in light_mounts(0.0, 0.0, 0.0))
        seen = {
            "whiskers": now.whiskers == messages.Whiskers.LEFT | messages.Whiskers.RIGHT,
            "infrared": now.infrared == messages.Infrared.LEFT | messages.Infrared.RIGHT,
            "ping": 0 < now.ping_echo < 1000,  # 18.5 ms stand for no echo
            "analog_infrared": reported.analog_infrared > 0,
            "shade": abs(reported.light_left - left) > 50,
        }
        assert {name for name, is_seen in seen.items() if is_seen} == seen_by
