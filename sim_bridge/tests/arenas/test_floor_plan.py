"""What pictures get of an arena, and the rays that a view of a vehicle draws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.arenas import Arena, ArenaDescription, Disc, Moving, Polygon, Wall, Waypoint, load_arena
from boebot.arenas.floor_plan import SAMPLES_MAXIMUM, Solid, floor_plan, path_end, poses_of
from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot_course.vehicle_view import View
from sim_bridge.sessions.session import DirectSession
from sim_bridge.sessions.world import NATIVE, direct_world, open_on
from sim_bridge.tests.simulated import arena_of, happened, square
from sim_bridge.vehicle import Vehicle, arsim


def test_showcase_is_told_whole() -> None:
    plan = floor_plan(load_arena("showcase"), 0.0, 10.0)
    assert plan.described.name == "showcase" and plan.described.title == "one of everything"
    assert [(solid.kind, solid.name) for solid in plan.solids] == [
        ("outline", "walls"),
        ("obstacle", "crate"),
        ("obstacle", "plank"),
        ("obstacle", "cushion"),
        ("wall", "screen"),
        ("disc", "pillar"),
    ]
    by_name = {solid.name: solid for solid in plan.solids}
    assert by_name["plank"].is_low and by_name["plank"].height == 0.04 and not by_name["crate"].is_low
    assert by_name["cushion"].is_dull and by_name["cushion"].infrared_reflectance == 0.1
    assert np.array_equal(by_name["screen"].points, [(0.6, 0.4), (0.9, 0.7), (0.9, 1.1)])
    assert np.array_equal(by_name["pillar"].points, [(0.2, -0.9)]) and by_name["pillar"].radius == 0.15
    assert [(patch.name, patch.grip) for patch in plan.described.patch] == [("carpet", 0.9), ("wet floor", 0.15)]
    assert [(lamp.x_m, lamp.y_m, lamp.power_w, lamp.height_m) for lamp in plan.described.light] == [
        (1.6, 1.2, 5.0, 0.25)
    ]
    assert plan.described.charger is not None and (
        plan.described.charger.x_m,
        plan.described.charger.y_m,
        plan.described.charger.radius_m,
    ) == (1.6, 1.2, 0.15)
    assert [moving.solid.name for moving in plan.moving] == ["cart", "ball"]


@pytest.mark.parametrize("time", [0.0, 1.0, 5.0, 12.3, 26.0, 40.0])
def test_moving_shapes_are_where_the_world_has_them(time: float) -> None:
    arena = load_arena("showcase")
    plan = floor_plan(arena, 0.0, 60.0)
    for moving, truth in zip(plan.moving, poses_of(arena.movers(time)), strict=True):
        x, y, heading = moving.pose(time)
        assert (x, y, math.cos(heading), math.sin(heading)) == pytest.approx(truth, abs=2e-3)


def test_poses_go_on_over_full_turns() -> None:
    """Two turns in 4 s: the heading grows evenly, and is not wrapped."""
    path = [Waypoint(time_s=0, x_m=0, y_m=0), Waypoint(time_s=4, x_m=1, y_m=0, heading_rad=4 * math.pi)]
    fan = Moving(corners_m=[(-0.1, 0), (0.1, 0), (0, 0.1)], path=path, repeat="once")
    arena = Arena(ArenaDescription(name="fan", moving=[fan]))
    (moving,) = floor_plan(arena, 0.0, 4.0).moving
    assert np.allclose(moving.heading, math.pi * moving.time, atol=1e-9) and np.allclose(moving.x, moving.time / 4)
    assert path_end(arena) == 4.0
    (long,) = floor_plan(arena, 0.0, 1e5).moving
    assert len(long.time) == SAMPLES_MAXIMUM and long.time[-1] == 1e5


def test_a_run_tells_of_its_own_time() -> None:
    """From the first recorded instant to the last, with a board and without."""
    session = open_on(NATIVE, BoardRequest(robot=load_robot("shieldbot"), arena="showcase"))
    try:
        session.transport.read(2.0, 2.0)
        truth = happened(session.robot)
    finally:
        session.close()
    assert truth is not None and truth.plan.described.name == "showcase"
    cart = truth.plan.moving[0]
    assert (cart.time[0], cart.time[-1]) == (truth.time[0], truth.time[-1]) and cart.time[-1] > 1.9
    vehicle = direct_world([BoardRequest(robot=load_robot("arsim"), arena="showcase")]).sessions[0]
    assert isinstance(vehicle, DirectSession)
    for _ in range(100):
        vehicle.step(0.1, 0.1)
    truth = happened(vehicle.robot)
    assert truth is not None and truth.plan.moving[0].time[-1] == pytest.approx(1.0)
    assert truth.plan.moving[0].pose(1.0)[0] == pytest.approx(1.0 + 0.6 / 4)


def lengths(view: View) -> np.ndarray:
    """Of the rays of the one sensor, in m."""
    x, y = np.array(view._ray_lines()).reshape(2, -1, 3)
    drawn: np.ndarray = np.hypot(x[:, 1] - x[:, 0], y[:, 1] - y[:, 0])
    return drawn


def looking_ahead(arena: Arena, x: float) -> Vehicle:
    return Vehicle(arsim(infrared_rad=(0.0,)), arena, pose=(x, 0.0, 0.0))


def test_rays_pass_over_what_is_low_and_end_at_what_is_not() -> None:
    def ahead(height: float | None) -> float:
        thing = Polygon(corners_m=[(0.5, -1), (0.6, -1), (0.6, 1), (0.5, 1)], height_m=height)
        view = View(looking_ahead(Arena(ArenaDescription(name="low", obstacle=[thing])), 0.0))
        return float(lengths(view)[1])

    (look, reach) = next(iter(arsim(infrared_rad=(0.0,)).looks.values()))
    assert look["height"] == 0.06
    assert ahead(None) == ahead(0.07) == pytest.approx(0.5 - look["x"])
    assert ahead(0.05) == pytest.approx(reach)


def test_a_ray_without_length_is_drawn_without_length() -> None:
    """A wall runs through the sensor itself: until now its rays went to full reach."""
    vehicle = looking_ahead(arena_of(outline=square(0, 0, 8)), 0.0)
    (look, reach) = next(iter(vehicle.model.looks.values()))
    place = look["x"], look["y"]
    wall = Wall(points_m=[(place[0], place[1] - 0.05), (place[0], place[1] + 0.05)], height_m=5.0)
    view = View(vehicle)
    assert lengths(view) == pytest.approx([reach] * 3)
    vehicle.arena = Arena(ArenaDescription(name="through", wall=[wall]))
    assert lengths(view) == pytest.approx([0.0] * 3, abs=1e-12)


def test_rays_end_at_what_moves_and_the_picture_follows_it() -> None:
    path = [Waypoint(time_s=0, x_m=0.9, y_m=0), Waypoint(time_s=1, x_m=0.9, y_m=2)]
    arena = Arena(ArenaDescription(name="gate", moving=[Moving(radius_m=0.2, path=path, repeat="once")]))
    vehicle = looking_ahead(arena, 0.0)
    view = View(vehicle)
    (look, reach) = next(iter(vehicle.model.looks.values()))
    assert lengths(view)[1] == pytest.approx(0.7 - look["x"])
    for _ in range(100):
        vehicle.step(0.0, 0.0)
    view.update()
    assert lengths(view)[1] == pytest.approx(reach)
    assert view._moving[0].get_xy()[:-1].mean(axis=0) == pytest.approx((0.9, 2.0))


def test_solids_know_their_box() -> None:
    disc = Disc(x_m=1.0, y_m=2.0, radius_m=0.5)
    (solid,) = floor_plan(Arena(ArenaDescription(name="disc", disc=[disc])), 0.0, 0.0).solids
    assert isinstance(solid, Solid)
    low, high = solid.box
    assert tuple(low) == (0.5, 1.5) and tuple(high) == (1.5, 2.5)
