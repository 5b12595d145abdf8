"""The readings of a robot without a board as arrays: computed after a run."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from boebot.description import robots
from boebot.devices import vehicle_devices
from boebot.devices.readings import BRAIN_NAMES, Layout
from boebot.record.record import Record
from boebot.record.series import Bools, Floats, Pose, Readout, Series


class ReadingsSeries(Series):
    """A vehicle's readings, one entry per tick."""

    def __init__(self, record: Record, robot: robots.RobotDescription, layout: Layout) -> None:
        super().__init__(record.times, record.steps)
        self._robot = robot
        self._layout = layout
        self._samples = samples = [sample for sample, _, _ in record.readings]
        width = max((where.stop for where in layout.values()), default=0)
        self.raw = np.array(
            [(sample.tick, sample.status, sample.values) for sample in samples],
            dtype=[("tick", "<u4"), ("status", "<u2"), ("values", "<f8", (width,))],
        )
        self.status = self.raw["status"]
        self._signals = np.array([signals for _, *signals in record.readings], dtype=np.float64).reshape(-1, 2)

    def values(self, device: str) -> Floats:
        """All readings of a device of the description, shape (ticks, readings of the device)."""
        return np.asarray(self.raw["values"][:, self._layout[device]], dtype=np.float64)

    def _whisker(self, device: str) -> Bools:
        if device not in self._layout:
            return np.zeros(len(self), dtype=np.bool_)
        return np.asarray(self.values(device)[:, 0] > 0, dtype=np.bool_)

    def _infrared(self, device: str) -> Bools:
        sensor = self._robot.device.get(device)
        if device not in self._layout or not isinstance(sensor, vehicle_devices.InfraredProximity):
            return np.zeros(len(self), dtype=np.bool_)
        return np.asarray(self.values(device)[:, 0] >= sensor.threshold, dtype=np.bool_)

    @cached_property
    def left_whisker(self) -> Bools:
        """See `Series`."""
        return self._whisker("whisker_left")

    @cached_property
    def right_whisker(self) -> Bools:
        """See `Series`."""
        return self._whisker("whisker_right")

    @cached_property
    def left_ir(self) -> Bools:
        """See `Series`."""
        return self._infrared("infrared_left")

    @cached_property
    def right_ir(self) -> Bools:
        """See `Series`."""
        return self._infrared("infrared_right")

    @cached_property
    def ping_distance(self) -> Floats:
        """See `Series`."""
        sonar = self._robot.device.get("ping")
        if "ping" not in self._layout or not isinstance(sonar, vehicle_devices.Sonar):
            return np.full(len(self), np.nan)
        distance = self.values("ping")[:, 0]
        return np.where(distance < sonar.range_max_m, distance, np.nan)

    @property
    def left_signal(self) -> Floats:
        """See `Series`."""
        return np.asarray(self._signals[:, 0])

    @property
    def right_signal(self) -> Floats:
        """See `Series`."""
        return np.asarray(self._signals[:, 1])

    def readouts(self) -> list[Readout]:
        """See `Series`; of a laser its nearest distance."""
        found = []
        for name, where in self._layout.items():
            device = self._robot.device[name]
            if type(device) not in _SHOWN or name not in BRAIN_NAMES:
                continue
            unit, factor, digits = _SHOWN[type(device)]
            values = self.values(name)
            if isinstance(device, vehicle_devices.Laser):
                nearest = np.where(values < 0, np.inf, values).min(axis=1, initial=np.inf)
                shown = np.where(np.isfinite(nearest), nearest, np.nan)
            else:
                shown = values[:, 0] * factor
            found.append(Readout(BRAIN_NAMES[name], unit, digits, shown, self._ages[:, where.start]))
        return found

    @cached_property
    def _ages(self) -> Floats:
        return np.array([sample.ages for sample in self._samples], dtype=np.float64).reshape(len(self), -1)

    def odometry(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Pose:
        """See `Series`: the odometer's own estimate, laid off from `start`; without one it stays there."""
        x0, y0, heading0 = start
        if "odometer" not in self._layout or not len(self):
            return Pose(*(np.full(len(self), value) for value in start))
        x, y, heading = self.values("odometer").T
        turn = heading0 - heading[0]
        cosine, sine = math.cos(turn), math.sin(turn)
        dx, dy = x - x[0], y - y[0]
        turned = heading + turn
        return Pose(
            x0 + cosine * dx - sine * dy,
            y0 + sine * dx + cosine * dy,
            np.arctan2(np.sin(turned), np.cos(turned)),
        )

    def columns(self) -> dict[str, tuple[NDArray[np.generic], int | None]]:
        """See `Series`."""
        found: dict[str, tuple[NDArray[np.generic], int | None]] = {}
        for device, where in self._layout.items():
            values = self.values(device)
            names = _COLUMNS.get(type(self._robot.device[device]), ("",))
            if where.stop - where.start == len(names):
                for index, name in enumerate(names):
                    found["_".join(part for part in (device, name) if part)] = (values[:, index], 5)
            else:
                for index in range(values.shape[1]):
                    found[f"{device}_{index}_m"] = (values[:, index], 4)
        found |= {"signal_left": (self.left_signal, 4), "signal_right": (self.right_signal, 4)}
        found["status"] = (self.status, None)
        return found


# for people: unit, what the value is multiplied with, digits
_SHOWN: dict[type, tuple[str, float, int]] = {
    vehicle_devices.InfraredProximity: ("", 1.0, 2),
    vehicle_devices.Laser: ("m", 1.0, 2),
    vehicle_devices.HeadingCompass: ("°", 180 / math.pi, 1),
    vehicle_devices.Accelerometer: ("m/s²", 1.0, 2),
    vehicle_devices.Phototransistor: ("W/m²", 1.0, 2),
    vehicle_devices.Energy: ("V", 1.0, 2),
}

_COLUMNS: dict[type, tuple[str, ...]] = {
    vehicle_devices.Odometer: ("x_m", "y_m", "heading_rad"),
    vehicle_devices.HeadingCompass: ("rad",),
    vehicle_devices.Sonar: ("m",),
    vehicle_devices.Accelerometer: ("m_s2",),
    vehicle_devices.Energy: ("v",),
    vehicle_devices.Laser: (),
}
