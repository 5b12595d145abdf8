"""Many worlds without boards in one call: motor signals in, readings out, numpy arrays in and out.

Each world has its own seed, pose and, if wished, arena. What a world does depends on nothing but these: neither on the
size of the batch, nor on its place in it, nor on how many threads step it.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot.errors import BrainError, RobotError
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.vehicle import STATE_BYTES, VehicleModel, place, worlds

Floats = NDArray[np.float64]
WANDER: Final = ffi.addressof(lib, "vehicle_wander")
"""A compiled brain: the notes' wandering for two IR sensors (vehicles/wander.h), with a `vehicle_wander_state *`."""


class Batch:
    """N worlds of one model.

    Attributes:
        readings: shape (N, M), a view that changes with each step; `model.names` says which column is what.
    """

    def __init__(
        self,
        model: VehicleModel,
        arenas: Arena | Sequence[Arena],
        poses: ArrayLike,
        seeds: ArrayLike,
        *,
        threads: int = 1,
        state_bytes: int = STATE_BYTES,
    ) -> None:
        """N worlds at `poses`, shape (N, 3): x, y (m), heading (rad), with `seeds`, shape (N,); one arena or N of them.

        Raises:
            ArenaError: a start is not free space.
            RobotError: shapes do not fit, or a number is not finite.
        """
        starts = np.asarray(poses, dtype=np.float64)
        keys = np.asarray(seeds)
        if starts.ndim != 2 or starts.shape[1] != 3 or keys.shape != starts.shape[:1]:
            raise RobotError(f"batch: poses {starts.shape}, seeds {keys.shape}; expected shapes (N, 3) and (N,)")
        self.model, self.count, self.threads = model, len(starts), max(1, threads)
        around = [arenas] * self.count if isinstance(arenas, Arena) else list(arenas)
        if len(around) != self.count:
            raise RobotError(f"batch: {len(around)} arenas for {self.count} poses; expected one, or as many")
        self.arenas = around
        self.handle = worlds(model, self.count, state_bytes)
        for index, (arena, pose, seed) in enumerate(zip(around, starts, keys.tolist(), strict=True)):
            place(self.handle, index, arena, int(seed), 1, pose)
        columns = lib.vehicles_reading_count(self.handle)
        size = 8 * self.count * columns
        room = ffi.buffer(lib.vehicles_readings(self.handle), size) if size else b""
        self.readings: Floats = np.frombuffer(room, dtype=np.float64).reshape(self.count, columns)
        self.readings.flags.writeable = False
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def _shares(self) -> list[tuple[int, int]]:
        """First world and number of worlds of each thread."""
        borders = np.linspace(0, self.count, self.threads + 1).astype(int).tolist()
        return [(a, b - a) for a, b in pairwise(borders) if b > a]

    def _each(self, work: Any) -> None:
        """Calls work(first, count), which leaves the interpreter, for all shares."""
        if self._pool is None:
            statuses = [work(0, self.count)]
        else:
            statuses = [task.result() for task in [self._pool.submit(work, *share) for share in self._shares()]]
        if any(statuses):
            raise BrainError("batch: a motor signal is not a finite number; expected numbers in [-1, 1]")

    def step(self, signals: ArrayLike, steps: int = 1) -> Floats:
        """`steps` steps under motor signals of shape (N, 2), left and right. Returns the readings.

        Raises:
            BrainError: a signal is not finite, and then no world has moved.
            RobotError: the shape does not fit.
        """
        given = np.ascontiguousarray(signals, dtype=np.float64)
        if given.shape != (self.count, 2):
            raise RobotError(f"batch: signals {given.shape}; expected shape ({self.count}, 2)")
        if self._pool is not None and not np.isfinite(given).all():
            raise BrainError("batch: a motor signal is not a finite number; expected numbers in [-1, 1]")
        pointer = ffi.from_buffer("double[]", given)
        self._each(lambda first, count: lib.vehicles_step(self.handle, first, count, pointer + 2 * first, steps))
        return self.readings

    def run(self, brain: Any, steps: int) -> Floats:
        """`steps` steps with a brain in compiled code that is asked in each of them. Returns the readings.

        Args:
            brain: C function `void brain(void *state, const double *readings, double *signals)` (vehicle.h): a cffi
                function, or the address of one, such as `numba.cfunc("void(voidptr, CPointer(float64),
                CPointer(float64))")(f).address`. `state` is its memory in that world, see `states`.
            steps: how many.

        Raises:
            BrainError: it gave a signal that is not finite.
        """
        function = ffi.cast("vehicle_brain *", brain)
        if function == ffi.NULL:
            raise BrainError("batch: brain is a null pointer; expected a C function or its address")
        self._each(lambda first, count: lib.vehicles_run(self.handle, first, count, function, steps))
        return self.readings

    def state(self, index: int, kind: str = "unsigned char *") -> Any:
        """The compiled brain's memory in a world, as a pointer of that C type."""
        return ffi.cast(kind, lib.vehicles_brain_state(self.handle, self._index(index)))

    def _index(self, index: int) -> int:
        if not 0 <= index < self.count:
            raise RobotError(f"batch: there is no world {index}; expected 0 to {self.count - 1}")
        return index

    @property
    def poses(self) -> Floats:
        """Truth: shape (N, 3), x (m), y (m), heading (rad)."""
        poses = np.empty((self.count, 3))
        lib.vehicles_poses(self.handle, 0, self.count, ffi.from_buffer("double[]", poses))
        return poses

    @property
    def flags(self) -> NDArray[np.int8]:
        """Shape (N,): 0 while a run goes on, 1 ended by a collision, 2 by an empty battery."""
        flags = np.empty(self.count, dtype=np.int8)
        lib.vehicles_flags(self.handle, 0, self.count, ffi.from_buffer("int8_t[]", flags))
        return flags

    @property
    def steps(self) -> NDArray[np.uint64]:
        """Shape (N,): steps done by each world."""
        done = (lib.vehicles_steps_done(self.handle, i) for i in range(self.count))
        return np.fromiter(done, dtype=np.uint64, count=self.count)

    def save(self, index: int) -> bytes:
        """The state of one world; `restore` takes it into any world of the same model and arena."""
        world = self._index(index)
        room = ffi.new("unsigned char[]", lib.vehicles_snapshot_size(self.handle, world))
        lib.vehicles_save(self.handle, world, room)
        return bytes(ffi.buffer(room))

    def restore(self, index: int, state: bytes) -> None:
        """Raises RobotError: it is of another model or version, or damaged."""
        if lib.vehicles_restore(self.handle, self._index(index), state, len(state)):
            raise RobotError("batch: this is no saved state of this model and version; expected what save() gave")

    def hashes(self) -> NDArray[np.uint64]:
        """Shape (N,): of each world's body, drive, battery and readings."""
        return np.array([lib.vehicles_hash(self.handle, i) for i in range(self.count)], dtype=np.uint64)

    @property
    def bytes_per_world(self) -> float:
        """Memory of one world, without the arena."""
        return float(lib.vehicles_memory(self.handle) / self.count) if self.count else 0.0
