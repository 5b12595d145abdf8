"""A vehicle in its arena as a picture that follows it: body, path, sensors' rays, odometric ghost. What ARSim plots."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from matplotlib.patches import Patch, Polygon
from matplotlib.transforms import Affine2D

from boebot.arenas.floor_plan import floor_plan, moving_solids, poses_of
from boebot.description.outlines import way_out
from boebot.devices.drawing import circle
from boebot.errors import BoebotError
from boebot.view import style
from boebot.view.painter import draw_arena, frame
from boebot.view.picture import NotebookFigure
from boebot.view.scene import moving_item, plan_bounds
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicle import Vehicle

BODY, GHOST, RAY = style.END, style.ESTIMATE, "#aa4499"


class View:
    """Draws what is there at once; `update` after some steps draws what has changed.

    Attributes:
        figure: of matplotlib; a notebook shows it, `save` writes it.
    """

    def __init__(self, vehicle: Vehicle, *, rays: bool = True, ghost: bool = True) -> None:
        """`rays`: of its sensors that look. `ghost`: where its odometer, if it has one of that name, believes it is."""
        self.vehicle = vehicle
        self.figure = NotebookFigure(figsize=(5.0, 5.0), dpi=110, layout="constrained")
        self._axes = self.figure.subplots()
        plan = floor_plan(vehicle.arena, 0.0, 0.0)
        draw_arena(self._axes, replace(plan, moving=()))
        x, y, _ = vehicle.true_pose
        frame(self._axes, *plan_bounds(plan, [(x, y)]))
        self._solids = moving_solids(vehicle.arena)
        look: dict[str, Any] = {"facecolor": style.MOVING, "edgecolor": style.EDGE, "lw": 1.2, "zorder": 4}
        self._moving = [Polygon(((0, 0), (1, 0), (0, 1)), **look) for _ in self._solids]
        for patch in self._moving:
            self._axes.add_patch(patch)
        outline = vehicle.model.body.get("outline_m", ()) or circle((0.0, 0.0), vehicle.model.body["radius"])
        self._front = way_out(outline)
        self._body = Polygon(outline, closed=True, facecolor=BODY, alpha=0.85, zorder=8)
        self._ghost = Polygon(outline, closed=True, fill=False, edgecolor=GHOST, ls="--", zorder=9)
        self._axes.add_patch(self._body)
        self._axes.add_patch(self._ghost)
        self._ghost.set_visible(ghost and "odometer" in vehicle.model.names)
        self._nose = self._axes.plot([], [], color="white", lw=2.0, zorder=9)[0]
        self._path = self._axes.plot([], [], color=BODY, lw=1.2, zorder=7)[0]
        self._rays = self._axes.plot([], [], color=RAY, lw=0.8, zorder=6)[0]
        self._rays.set_visible(rays)
        self._trail: list[tuple[float, float]] = []
        self.update()

    def update(self) -> None:
        """Takes the vehicle, and what moves beside it, as they are now."""
        x, y, heading = self.vehicle.true_pose
        self._trail.append((x, y))
        self._put(self._body, x, y, heading)
        tip = x + self._front * math.cos(heading), y + self._front * math.sin(heading)
        self._nose.set_data((x, tip[0]), (y, tip[1]))
        self._path.set_data(*zip(*self._trail, strict=True))
        self._rays.set_data(*self._ray_lines())
        if self._ghost.get_visible():
            self._put(self._ghost, *self.vehicle["odometer"])
        movers = poses_of(self.vehicle.movers)
        for patch, shape, (at_x, at_y, cosine, sine) in zip(self._moving, self._solids, movers.tolist(), strict=True):
            patch.set_xy(moving_item(shape.placed(at_x, at_y, math.atan2(sine, cosine))).points)
        self._axes.set_title(f"{self.vehicle.time:.2f} s", color=style.INK)

    def _put(self, patch: Patch, x: float, y: float, heading: float) -> None:
        patch.set_transform(Affine2D().rotate(heading).translate(x, y) + self._axes.transData)

    def _ray_lines(self) -> tuple[list[float], list[float]]:
        """Each ray from its sensor to what it meets at its height, one after another with gaps; beyond its reach there
        is nothing to meet."""
        arena = self.vehicle.arena
        movers = self.vehicle.movers
        scene = ffi.new("scene *", {"arena": arena.handle, "movers": movers, "movers_count": len(movers)})
        xs: list[float] = []
        ys: list[float] = []
        for x, y, angle, reach, height in self._each_ray():
            cosine, sine = math.cos(angle), math.sin(angle)
            met = lib.scene_ray(scene, x, y, cosine, sine, reach, height, 0, ffi.NULL)
            length = reach if met < 0 else met
            xs += [x, x + length * cosine, math.nan]
            ys += [y, y + length * sine, math.nan]
        return xs, ys

    def _each_ray(self) -> Iterator[tuple[float, float, float, float, float]]:
        """Of each sensor that looks: where a ray begins, its direction, reach and height."""
        x, y, heading = self.vehicle.true_pose
        for look, reach in self.vehicle.model.looks.values():
            x0 = x + look["x"] * math.cos(heading) - look["y"] * math.sin(heading)  # (3.9)
            y0 = y + look["x"] * math.sin(heading) + look["y"] * math.cos(heading)
            rays = int(look["rays"])
            for i in range(rays):
                share = i / (rays - 1) - 0.5 if rays > 1 else 0.0
                yield x0, y0, heading + look["heading"] + share * look["opening"], reach, look["height"]  # (3.10)

    def save(self, path: str | Path) -> Path:
        """Writes the picture; the file's ending says its format.

        Raises:
            BoebotError: it names none, or the file cannot be written.
        """
        try:
            self.figure.savefig(path)
        except OSError as error:
            raise BoebotError(f"the picture cannot be written to {path}: {error.strerror}") from None
        except ValueError as error:  # of matplotlib: a format that it does not know
            raise BoebotError(f"the picture cannot be written to {path}: {error}") from None
        return Path(path)
