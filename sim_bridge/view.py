"""A vehicle in its arena as a picture that follows it: body, path, sensors' rays, odometric ghost. What ARSim plots."""

from __future__ import annotations

import math
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from sim_bridge.arena_picture import draw_arena
from sim_bridge.vehicle import Vehicle

BODY, GHOST, RAY = "#4c6fb1", "#d08770", "#b48ead"


class View:
    """Draws what is there at once; `update` after some steps draws what has changed.

    Attributes:
        figure: of matplotlib; a notebook shows it, `save` writes it.
    """

    def __init__(self, vehicle: Vehicle, *, rays: bool = True, ghost: bool = True) -> None:
        """`rays`: of its sensors that look. `ghost`: where its odometer, if it has one of that name, believes it is."""
        self.vehicle = vehicle
        self.figure = Figure(figsize=(5.0, 5.0), dpi=110, layout="constrained")
        FigureCanvasAgg(self.figure)
        self._axes = self.figure.subplots()
        draw_arena(self._axes, vehicle.arena)
        self._axes.set_aspect("equal")
        self._axes.autoscale_view()
        self._axes.set(xlabel="x (m)", ylabel="y (m)")
        radius = vehicle.model.body["radius"]
        self._body = Circle((0, 0), radius, facecolor=BODY, alpha=0.85, zorder=6)
        self._ghost = Circle((0, 0), radius, fill=False, edgecolor=GHOST, ls="--", zorder=7)
        self._axes.add_patch(self._body)
        self._axes.add_patch(self._ghost)
        self._ghost.set_visible(ghost and "odometer" in vehicle.model.names)
        self._nose = self._axes.plot([], [], color="white", lw=2.0, zorder=7)[0]
        self._path = self._axes.plot([], [], color=BODY, lw=1.2, zorder=5)[0]
        self._rays = self._axes.plot([], [], color=RAY, lw=0.8, zorder=4)[0]
        self._rays.set_visible(rays)
        self._trail: list[tuple[float, float]] = []
        self.update()

    def update(self) -> None:
        """Takes the vehicle as it is now."""
        x, y, heading = self.vehicle.pose
        radius = self._body.radius
        self._trail.append((x, y))
        self._body.center = (x, y)
        self._nose.set_data((x, x + radius * math.cos(heading)), (y, y + radius * math.sin(heading)))
        self._path.set_data(*zip(*self._trail, strict=True))
        self._rays.set_data(*self._ray_lines())
        if self._ghost.get_visible():
            self._ghost.center = self.vehicle["odometer"][0], self.vehicle["odometer"][1]
        self._axes.set_title(f"{self.vehicle.time:.2f} s")

    def _ray_lines(self) -> tuple[list[float], list[float]]:
        """Each ray from its sensor to what it meets, as far as things stay in place, one after another with gaps."""
        x, y, heading = self.vehicle.pose
        xs: list[float] = []
        ys: list[float] = []
        for look, reach in self.vehicle.model.looks.values():
            x0 = x + look["x"] * math.cos(heading) - look["y"] * math.sin(heading)  # (3.9)
            y0 = y + look["x"] * math.sin(heading) + look["y"] * math.cos(heading)
            rays = int(look["rays"])
            for i in range(rays):
                share = i / (rays - 1) - 0.5 if rays > 1 else 0.0
                angle = heading + look["heading"] + share * look["opening"]  # (3.10), (3.11)
                length = self.vehicle.arena.ray(x0, y0, angle, reach) or reach
                xs += [x0, x0 + length * math.cos(angle), math.nan]
                ys += [y0, y0 + length * math.sin(angle), math.nan]
        return xs, ys

    def save(self, path: str | Path) -> Path:
        """Writes the picture; the file's ending says its format."""
        self.figure.savefig(path)
        return Path(path)
