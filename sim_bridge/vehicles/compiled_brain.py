"""Brains in compiled code, each with what it needs: they trust the size of their memory and the order of readings, so
both are checked before they run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

from boebot import arguments
from boebot.errors import BrainError
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicles.worlds import STATE_BYTES_MAXIMUM

if TYPE_CHECKING:
    from sim_bridge.vehicle import VehicleModel

FIRST_PAGE: Final = 4096  # no function has an address in it
BRAIN: Final = ffi.typeof("vehicle_brain *")


class CompiledBrain:
    """A function `void brain(void *state, const double *readings, double *signals)` (vehicles/vehicle.h) and its needs.

    Attributes:
        function: C pointer `vehicle_brain *`.
        readings: sensors whose readings it takes, which stand first among all readings and in that order.
        state_bytes: of memory that it uses in each world.
        name: for errors.
    """

    def __init__(self, function: Any, *, readings: Sequence[str], state_bytes: int = 0, name: str = "brain") -> None:
        """`function`: of cffi, or the address of one, such as `numba.cfunc("void(voidptr, CPointer(float64),
        CPointer(float64))")(f).address`.

        Raises:
            BrainError: that is no function, or its needs are none.
        """
        sensors: list[Any] = (
            list(readings) if isinstance(readings, Iterable) and not isinstance(readings, str) else [None]
        )
        if not all(isinstance(sensor, str) for sensor in sensors):
            raise BrainError(f"{name}: readings are {arguments.shown(readings)}; expected a list of sensors' names")
        self.name, self.readings = name, tuple(sensors)
        self.state_bytes = arguments.whole(
            f"{name}: state_bytes", state_bytes, BrainError, least=0, most=STATE_BYTES_MAXIMUM
        )
        self._given = function  # a callback lives as long as somebody holds it
        self.function = _pointer(name, function)

    def check(self, who: str, model: VehicleModel, state_bytes: int) -> None:
        """Raises BrainError, with what was expected, unless worlds of this model with that much memory can run it."""
        if state_bytes < self.state_bytes:
            raise BrainError(
                f"{who}: {self.name} uses {self.state_bytes} bytes of memory, each world has {state_bytes}; "
                f"expected state_bytes={self.state_bytes} or more where the worlds are made"
            )
        first = 0
        for sensor in self.readings:
            where = model.names.get(sensor)
            if where is None or where.start != first:
                there = ", ".join(sorted(model.names, key=lambda name: model.names[name].start)) or "no sensors"
                raise BrainError(
                    f"{who}: {self.name} reads {', '.join(self.readings)}, the model has {there}; "
                    "expected the model's first sensors to be those that it reads, in that order"
                )
            first = where.stop


def _pointer(name: str, function: Any) -> Any:
    """The function as C has it."""
    if isinstance(function, int) and FIRST_PAGE <= function < 2**64:
        return ffi.cast("vehicle_brain *", function)
    if isinstance(function, ffi.CData):
        kind = ffi.typeof(function)
        if kind.cname != BRAIN.cname:  # by name: it may be of another cffi module
            raise BrainError(f"{name}: it is a C '{kind.cname}'; expected a C function or its address, '{BRAIN.cname}'")
        if function == ffi.NULL:
            raise BrainError(f"{name}: the function is a null pointer; expected a C function or its address")
        return ffi.cast("vehicle_brain *", function)
    raise BrainError(f"{name}: {arguments.shown(function)} is no function; expected a C function or its address")


WANDER: Final = CompiledBrain(
    ffi.addressof(lib, "vehicle_wander"),
    readings=("infrared_left", "infrared_right"),
    state_bytes=ffi.sizeof("vehicle_wander_state"),
    name="wander",
)
"""The notes' wandering for two IR sensors (vehicles/wander.h), with a `vehicle_wander_state`."""
