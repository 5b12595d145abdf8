"""Sensor models of the world, each against a closed form or the notes' section 3.2 (experiments E13, E14, E15, E70)."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from boebot.arenas import Arena
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square

OUTLINE = square(0, 0, 20)
ALIVE: weakref.WeakKeyDictionary[Any, Any] = weakref.WeakKeyDictionary()  # what a C struct points to


class View:
    """A body at a pose in an arena, with movers around it: what sensors ask."""

    def __init__(
        self,
        arena: Arena,
        pose: tuple[float, float, float] = (0, 0, 0),
        movers: Iterable[dict[str, Any]] = (),
        me: int = 1,
    ) -> None:
        things = list(movers)
        self._movers = ffi.new("mover[]", max(1, len(things)))
        for slot, thing in zip(self._movers, things, strict=False):
            slot.cosine, slot.height, slot.id = 1.0, 1.0, 99
            slot.infrared_reflectance = slot.sound_reflectance = 1.0
            for key, value in thing.items():
                setattr(slot, key, value)
        self._scene = ffi.new("scene *", {"arena": arena.handle, "movers": self._movers, "movers_count": len(things)})
        self.c = ffi.new("viewpoint *", {"around": self._scene, "id": me})
        ALIVE[self.c] = (arena, self._movers, self._scene)
        self.place(*pose)

    def place(self, x: float, y: float, heading: float) -> View:
        self.c.x, self.c.y, self.c.heading = x, y, heading
        self.c.cosine, self.c.sine = math.cos(heading), math.sin(heading)
        return self


def source(on: bool = True, seed: int = 1, device: int = 5) -> Any:
    return ffi.new("noise_source *", {"seed": seed, "device": device, "on": on})


def beam(**changes: Any) -> dict[str, Any]:
    return {"x": 0.0, "y": 0.0, "heading": 0.0, "opening": 0.0, "height": 0.06, "rays": 1} | changes


def made(kind: str, parameters: dict[str, Any]) -> Any:
    """A sensor of that kind."""
    self = ffi.new(f"{kind} *")
    assert getattr(lib, f"{kind}_init")(self, ffi.new(f"{kind}_parameters *", parameters)) == 0
    return self


def refused(kind: str, parameters: dict[str, Any]) -> bool:
    self = ffi.new(f"{kind} *")
    return bool(getattr(lib, f"{kind}_init")(self, ffi.new(f"{kind}_parameters *", parameters)) != 0)


def wall(distance: float) -> Arena:
    """A wall across the x axis."""
    return arena_of([(distance, -50), (distance + 1, -50), (distance + 1, 50), (distance, 50)])


# ---- the notes' IR proximity sensor ----------------------------------------------------------------------------------


def proximity(**changes: Any) -> Any:
    notes = {"beam": beam(opening=0.5, rays=3), "range": 1.0, "c1": 0.03, "c2": 0.1, "sigma": 0.0}
    return made("infrared_proximity", notes | changes)


@pytest.mark.parametrize(
    ("distance", "reading"), [(0.20, 0.803), (0.30, 0.411), (0.50, 0.211), (0.80, 0.142), (0.95, 0.129)]
)
def test_e13_reading_of_a_flat_wall(distance: float, reading: float) -> None:
    """The table of section 1.5."""
    sensed = lib.infrared_proximity_read(proximity(), View(wall(distance)).c, source(False))
    assert sensed == pytest.approx(reading, abs=1e-3)


@given(st.floats(0.02, 1.2))
def test_e13_reading_follows_3_12_to_3_14(distance: float) -> None:
    truth = 0.0
    for kappa in (-0.25, 0.0, 0.25):
        d = distance / math.cos(kappa)
        truth += min((0.03 / d**2 + 0.1) * math.cos(kappa), 1.0) if d <= 1.0 else 0.0
    sensed = lib.infrared_proximity_read(proximity(), View(wall(distance)).c, source(False))
    assert sensed == pytest.approx(truth / 3, abs=1e-12)


def test_e13_saturation_and_range() -> None:
    sensor = proximity()
    assert lib.infrared_proximity_read(sensor, View(wall(0.14)).c, source(False)) == 1.0
    assert lib.infrared_proximity_read(sensor, View(wall(1.01)).c, source(False)) == 0.0
    assert lib.infrared_proximity_read(sensor, View(wall(1e-9)).c, source(False)) == 1.0


def test_noise_of_a_reading_is_that_of_3_1_and_clamped() -> None:
    sensor, noise = proximity(sigma=0.01), source()
    view = View(wall(0.30))
    quiet = lib.infrared_proximity_read(proximity(), view.c, source(False))
    readings = np.array([lib.infrared_proximity_read(sensor, view.c, noise) for _ in range(5000)])
    assert readings.mean() == pytest.approx(quiet, rel=1e-3)
    assert readings.std() == pytest.approx(0.01 * quiet, rel=0.05)
    near = View(wall(0.1))
    assert max(lib.infrared_proximity_read(sensor, near.c, noise) for _ in range(100)) == 1.0


def test_a_dark_mover_reads_less_only_where_reflectance_counts() -> None:
    views = [
        View(arena_of(outline=OUTLINE), movers=[{"x": 0.5, "radius": 0.2, "infrared_reflectance": r}]) for r in (1, 0.2)
    ]
    plain = [lib.infrared_proximity_read(proximity(), view.c, source(False)) for view in views]
    graded = [lib.infrared_proximity_read(proximity(reflectance=1), view.c, source(False)) for view in views]
    assert plain[0] == plain[1] == graded[0] > graded[1] > 0


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-math.pi, math.pi), st.floats(-1, 1))
def test_rays_of_a_beam_are_where_3_9_to_3_11_put_them(x: float, y: float, heading: float, mount: float) -> None:
    """Sonar without losses: the nearest of five rays, by shapely."""
    arena = arena_of(square(2.5, 1.0, 0.8), square(-1.5, -2.0, 1.2), outline=OUTLINE)
    sensor = sonar(beam=beam(x=0.05, y=-0.03, heading=mount, opening=0.6, rays=5), range_maximum=30.0)
    rings = shapely.union_all([shapely.LinearRing(ring) for ring in arena.outlines])
    px = x + 0.05 * math.cos(heading) + 0.03 * math.sin(heading)
    py = y + 0.05 * math.sin(heading) - 0.03 * math.cos(heading)
    nearest = math.inf
    for i in range(5):
        angle = heading + mount - 0.3 + i * 0.15
        ray = shapely.LineString([(px, py), (px + 30 * math.cos(angle), py + 30 * math.sin(angle))])
        nearest = min(nearest, shapely.Point(px, py).distance(ray.intersection(rings)))
    assert lib.sonar_distance(sensor, View(arena, (x, y, heading)).c) == pytest.approx(nearest, abs=1e-7)


# ---- IR pair ---------------------------------------------------------------------------------------------------------


def pair(**changes: Any) -> Any:
    usual = {"beam": beam(opening=0.4, rays=5), "range": 0.2, "range_sigma": 0.0, "false_hit": 0.0, "direct": 2.0}
    return made("infrared_pair", usual | changes)


def test_five_frequencies_sort_objects_into_zones() -> None:
    """Range goes with the root of the receiver's sensitivity: peak 38.5 kHz, 50 % at 40, 20 % at 42 (data)."""
    sweep = [38e3, 39e3, 40e3, 41e3, 42e3]
    share = [lib.infrared_carrier_share(f) for f in sweep]
    assert share == sorted(share, reverse=True) and share[0] == pytest.approx(1.0)
    assert share[2] == pytest.approx(math.sqrt(0.5 / 0.97)) and share[4] == pytest.approx(math.sqrt(0.2 / 0.97))
    assert lib.infrared_carrier_share(38.5e3) > 1.0 > lib.infrared_carrier_share(30e3)
    hits = [
        sum(lib.infrared_pair_look(pair(), View(wall(d)).c, f, source(False)).seen for f in sweep)
        for d in (0.05, 0.1, 0.13, 0.15, 0.19, 0.25)
    ]
    assert hits == sorted(hits, reverse=True) and hits[0] == 5 and hits[-1] == 0 and len(set(hits)) >= 4


def test_range_goes_with_the_root_of_the_reflectance() -> None:
    for reflectance, radius_seen in ((1.0, 0.2), (0.25, 0.1)):
        for gap, seen in ((radius_seen - 0.002, 1), (radius_seen + 0.002, 0)):
            thing = {"x": gap + 0.5, "radius": 0.5, "infrared_reflectance": reflectance}
            view = View(arena_of(outline=OUTLINE), movers=[thing])
            assert lib.infrared_pair_look(pair(), view.c, 38e3, source(False)).seen == seen


def test_false_hits_come_as_often_as_they_should_and_can_be_off() -> None:
    view = View(arena_of(outline=OUTLINE))
    noise = source()
    sensor = pair(false_hit=0.1)
    seen = sum(lib.infrared_pair_look(sensor, view.c, 38e3, noise).seen for _ in range(5000))
    assert abs(seen - 500) < 4 * math.sqrt(5000 * 0.1 * 0.9)
    assert not any(lib.infrared_pair_look(pair(), view.c, 38e3, noise).seen for _ in range(100))


def burst_seen(
    of: Any, at: tuple[float, float, float], me: Any, mine: tuple[float, float, float], arena: Arena
) -> bool:
    """Whether the pair `me` at `mine` sees the burst of a pair at `at` on another robot."""
    robot = [{"x": at[0], "y": at[1], "radius": 0.08, "id": 2}, {"x": mine[0], "y": mine[1], "radius": 0.08, "id": 1}]
    burst = lib.infrared_pair_burst(of, View(arena, at, robot, me=2).c, 38e3)
    return bool(lib.infrared_pair_sees_burst(me, View(arena, mine, robot, me=1).c, ffi.new("infrared_burst *", burst)))


def test_another_robots_light_is_seen_when_both_look_at_each_other() -> None:
    front = pair(beam=beam(x=0.05, opening=0.4, rays=5))
    empty = arena_of(outline=OUTLINE)
    here = (0.0, 0.0, 0.0)
    assert burst_seen(front, (1.0, 0.0, math.pi), front, here, empty)
    assert burst_seen(front, (1.0, 0.1, math.pi), front, here, empty)
    assert not burst_seen(front, (1.0, 0.0, 0.0), front, here, empty), "it looks away"
    assert not burst_seen(front, (1.0, 0.0, math.pi), front, (0.0, 0.0, 1.0), empty), "I look away"
    assert not burst_seen(front, (2.5, 0.0, math.pi), front, here, empty), "too far"
    assert not burst_seen(front, (1.0, 0.0, math.pi), front, here, arena_of(square(0.5, 0, 0.2), outline=OUTLINE))
    assert not burst_seen(front, (1.0, 0.0, math.pi), pair(direct=0.0), here, empty), "switched off"


# ---- Sharp -----------------------------------------------------------------------------------------------------------


def sharp(**changes: Any) -> Any:
    usual = {"beam": beam(), "reach": 1.5, "sigma": 0.0, "gain": 1.0, "period": 0.0, "late": 0.0}
    return made("sharp_infrared", usual | changes)


def test_sharp_characteristic_and_fold_back() -> None:
    for cm in (10, 20, 40, 80):
        assert lib.sharp_infrared_volts(cm / 100) == pytest.approx(33.9 / (cm + 4.74), rel=1e-12)
    near = [lib.sharp_infrared_volts(d) for d in (0.0, 0.02, 0.05, 0.0999)]
    assert near == sorted(near) and near[-1] == pytest.approx(lib.sharp_infrared_volts(0.1), rel=1e-2)
    state = ffi.new("sharp_infrared_state *")
    assert lib.sharp_infrared_read(sharp(), state, View(wall(2.0)).c, 0.0, source(False)) == 0.0


def test_sharp_holds_its_value_and_is_late() -> None:
    """A wall that jumps at t = 0: the output follows 7.6 ms after the next measurement, and stays for a period."""
    sensor, state, quiet = sharp(period=0.0383, late=0.0076), ffi.new("sharp_infrared_state *"), source(False)
    far, near = View(wall(0.8)), View(wall(0.2))
    high, low = lib.sharp_infrared_volts(0.2), lib.sharp_infrared_volts(0.8)
    seen = []
    for ms in range(200):
        view = far if ms < 50 else near
        seen.append((ms, lib.sharp_infrared_read(sensor, state, view.c, ms / 1000, quiet)))
    measured = 2 * 38.3  # the first measurement after the jump
    for ms, volts in seen:
        expected = 0.0 if ms < 7.6 else (low if ms < measured + 7.6 else high)
        assert volts == pytest.approx(expected), ms


# ---- sonar -----------------------------------------------------------------------------------------------------------


def sonar(**changes: Any) -> Any:
    usual = {"beam": beam(opening=0.35, rays=3), "range_minimum": 0.02, "range_maximum": 3.0, "temperature": 20.0}
    return made("sonar", usual | changes)


def test_e14_misses_and_limits() -> None:
    noise, view = source(), View(wall(1.0))
    sensor = sonar(miss=0.02, sigma=0.01)
    reads = np.array([lib.sonar_read(sensor, view.c, noise) for _ in range(10_000)])
    detected = reads[np.abs(reads - 1.0) < 0.1]
    assert len(detected) / len(reads) == pytest.approx(0.98, abs=0.005)
    assert (reads[np.abs(reads - 1.0) >= 0.1] == 3.0).all()
    assert detected.std() == pytest.approx(0.01, rel=0.05) and detected.mean() == pytest.approx(1.0, abs=1e-3)
    close = View(wall(0.01))
    assert min(lib.sonar_read(sensor, close.c, noise) for _ in range(1000)) == 0.02
    border = [lib.sonar_read(sensor, View(wall(2.99)).c, noise) for _ in range(500)]
    assert max(border) == 3.0


def test_sound_is_turned_away_by_a_wall_met_flatly() -> None:
    """A wall at `angle` to the beam's normal is heard up to the grazing angle of 45 degrees."""
    single = sonar(beam=beam(), grazing_cosine=math.cos(math.radians(45)))
    for degrees, heard in ((0, True), (44, True), (46, False), (80, False)):
        distance = lib.sonar_distance(single, View(wall(0.3), (0, 0, math.radians(degrees))).c)
        assert (distance > 0) is heard
    assert lib.sonar_distance(sonar(beam=beam()), View(wall(0.3), (0, 0, math.radians(80))).c) > 0


def test_soft_things_are_heard_from_less_far() -> None:
    empty = arena_of(outline=OUTLINE)
    for sound, heard in ((1.0, True), (0.2, False)):
        view = View(empty, movers=[{"x": 2.5, "radius": 0.5, "sound_reflectance": sound}])
        assert (lib.sonar_distance(sonar(absorption=1), view.c) > 0) is heard
        assert lib.sonar_distance(sonar(), view.c) > 0


def test_echo_time_depends_on_the_temperature() -> None:
    for temperature in (-10.0, 0.0, 20.0, 40.0):
        sensor = sonar(temperature=temperature)
        assert lib.sonar_echo_time(sensor, 1.0) == pytest.approx(2.0 / (331.5 + 0.6 * temperature), rel=1e-12)


# ---- laser -----------------------------------------------------------------------------------------------------------


def laser(**changes: Any) -> Any:
    step = 2 * math.pi / 1024
    hokuyo = {"height": 0.1, "first": -341 * step, "step": step, "rays": 683, "range": 4.0, "sigma": 0.0}
    handle = lib.laser_new(ffi.new("laser_parameters *", hokuyo | changes))
    assert handle != ffi.NULL
    return ffi.gc(handle, lib.laser_destroy)


def scan(sensor: Any, view: View, noise: Any, rays: int = 683) -> Any:
    distances = np.empty(rays)
    lib.laser_scan(sensor, view.c, noise, ffi.from_buffer("double[]", distances))
    return distances


def test_e15_all_rays_free() -> None:
    assert (scan(laser(sigma=0.01), View(arena_of(outline=square(0, 0, 30))), source()) == -1).all()


def test_e15_order_is_right_to_left_around_the_heading() -> None:
    empty = arena_of(outline=square(0, 0, 30))
    heading = 0.7
    for index, angle in ((341, 0.0), (85, -math.pi / 2), (597, math.pi / 2)):
        x, y = 2 * math.cos(heading + angle), 2 * math.sin(heading + angle)
        distances = scan(laser(), View(empty, (0, 0, heading), [{"x": x, "y": y, "radius": 0.05}]), source())
        met = np.flatnonzero(distances > 0)
        assert met.mean() == pytest.approx(index, abs=1e-9)
        assert distances[index] == pytest.approx(1.95, abs=1e-9)


def test_laser_noise_is_3_1_for_each_ray_within_the_range() -> None:
    view = View(arena_of(outline=square(0, 0, 6)))
    truth = scan(laser(), view, source(False))
    noise = source()
    scans = np.array([scan(laser(sigma=0.01), view, noise) for _ in range(200)])
    hit = (truth > 0) & (truth < 3.8)
    assert (scans[:, hit] / truth[hit]).std() == pytest.approx(0.01, rel=0.02)
    assert scans.max() <= 4.0 and (scans[:, truth < 0] == -1).all()


# ---- bad parameters --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("infrared_proximity", {"beam": beam(rays=0), "range": 1.0}),
        ("infrared_proximity", {"beam": beam(rays=33), "range": 1.0}),
        ("infrared_proximity", {"beam": beam(opening=4.0), "range": 1.0}),
        ("infrared_proximity", {"beam": beam(heading=math.nan), "range": 1.0}),
        ("infrared_pair", {"beam": beam(), "range": 0.2, "false_hit": 1.5}),
        ("infrared_pair", {"beam": beam(), "range": -1.0}),
        ("sharp_infrared", {"beam": beam(), "reach": 1.5, "gain": math.nan}),
        ("sharp_infrared", {"beam": beam(), "reach": 1.5, "period": 0.01, "late": 0.02}),
        ("sonar", {"beam": beam(), "range_minimum": 1.0, "range_maximum": 0.5}),
        ("sonar", {"beam": beam(), "range_maximum": 3.0, "miss": math.nan}),
        ("phototransistor", {"near_distance": 0.0}),
    ],
)
def test_bad_parameters_are_refused(kind: str, parameters: dict[str, Any]) -> None:
    assert refused(kind, parameters)
