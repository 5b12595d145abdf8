"""What a board's slow devices said, as arrays with one entry per control tick of the telemetry: computed after a run.

Between two of their messages the last one stands, and its ages count on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.devices.equipment import SlowReader
from boebot.link.messages import DevicesTelemetry
from boebot.record.series import Bools, Floats, Readout

_APART = 1 << 40  # ticks between two starts of the board, as positions have them

# the brain's name of a device -> name of its column with the unit, digits, value of the device's view
COLUMNS: dict[str, tuple[str, int, Callable[[Any], float | None]]] = {
    "left_light": ("light_left_s", 6, lambda view: view.decay_time),
    "right_light": ("light_right_s", 6, lambda view: view.decay_time),
    "compass": ("compass_rad", 5, lambda view: view.heading),
    "battery": ("battery_v", 3, lambda view: view.voltage),
    "analog_ir": ("analog_infrared_m", 4, lambda view: view.distance),
    "left_zone": ("infrared_zone_left", 0, lambda view: view.zone),
    "right_zone": ("infrared_zone_right", 0, lambda view: view.zone),
    "turret": ("turret_rad", 4, lambda view: view.angle),
    "buzzer": ("buzzer_token", 0, lambda view: view.token),
}

# the same for people: unit, what the value is multiplied with, digits
_SHOWN: dict[str, tuple[str, float, int]] = {
    "left_light": ("ms", 1e3, 3),
    "right_light": ("ms", 1e3, 3),
    "compass": ("°", 180 / math.pi, 1),
    "battery": ("V", 1.0, 2),
    "analog_ir": ("m", 1.0, 3),
    "left_zone": ("of 5", 1.0, 0),
    "right_zone": ("of 5", 1.0, 0),
    "turret": ("°", 180 / math.pi, 1),
    "buzzer": ("tones", 1.0, 0),
}


class DevicesSeries:
    """What the slow devices said, one entry per tick of telemetry; NaN: nothing, or nothing yet.

    Attributes:
        values: by the brain's name of the device, SI units as `COLUMNS` says.
        ages: likewise, in seconds.
    """

    def __init__(
        self,
        messages: Sequence[tuple[int, bytes]],
        ticks: NDArray[np.uint32],
        restarted: Bools,
        readers: Mapping[str, SlowReader],
        tick_s: float,
    ) -> None:
        """`messages` as in `Record.devices`; `ticks` of the telemetry, and where the board began afresh."""
        told = [DevicesTelemetry.unpack(payload) for _, payload in messages]
        newest, since_s = _newest([row for row, _ in messages], [message.tick for message in told], ticks, restarted)
        since_s *= tick_s
        self.values: dict[str, Floats] = {}
        self.ages: dict[str, Floats] = {}
        for name, reader in readers.items():
            views = [reader(message, 0) for message in told]
            value_of = COLUMNS[name][2]
            said = np.array([value_of(view) for view in views] + [None], dtype=np.float64)  # None becomes NaN
            ages = np.array([view.age for view in views] + [np.nan], dtype=np.float64)
            ages[np.isinf(ages)] = np.nan  # never measured
            self.values[name] = said[newest]
            self.ages[name] = ages[newest] + since_s

    def columns(self) -> dict[str, tuple[NDArray[np.generic], int | None]]:
        """As `boebot.record.series.Series.columns`."""
        found: dict[str, tuple[NDArray[np.generic], int | None]] = {}
        for name, values in self.values.items():
            heading, digits, _ = COLUMNS[name]
            found[heading] = (values, digits)
            found[f"{_without_unit(heading)}_age_s"] = (self.ages[name], 3)
        return found

    def readouts(self) -> list[Readout]:
        """As `boebot.record.series.Series.readouts`."""
        found = []
        for name, values in self.values.items():
            unit, factor, digits = _SHOWN[name]
            found.append(Readout(name, unit, digits, values * factor, self.ages[name]))
        return found


def _newest(
    rows: Sequence[int], told: Sequence[int], ticks: NDArray[np.uint32], restarted: Bools
) -> tuple[NDArray[np.intp], Floats]:
    """For each tick of telemetry the message that was the newest then (-1: none), and the ticks since (NaN: none).

    Both are laid along one line of ticks that goes on over roll-overs of the board's count and its restarts.
    """
    if not len(told) or not len(ticks):
        return np.full(len(ticks), -1, dtype=np.intp), np.full(len(ticks), np.nan)
    steps = np.diff(ticks, prepend=ticks[:1]).astype(np.int32).astype(np.int64)
    steps[restarted] = _APART
    at = np.cumsum(steps)
    near = np.asarray(rows, dtype=np.intp)
    messages_at = at[near] + (np.asarray(told, dtype=np.uint32) - ticks[near]).astype(np.int32)
    order = np.argsort(messages_at, kind="stable")
    place = np.searchsorted(messages_at[order], at, side="right") - 1
    newest = np.where(place >= 0, order[place], -1)
    since = np.where(newest >= 0, at - messages_at[newest], _APART)
    none = since >= _APART // 2  # of an earlier start
    newest[none] = -1
    return newest, np.where(none, np.nan, since.astype(np.float64))


def _without_unit(heading: str) -> str:
    return heading.removesuffix("_s").removesuffix("_rad").removesuffix("_v").removesuffix("_m")
