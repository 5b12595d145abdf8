"""Many worlds without boards in one call: motor signals in, readings out, numpy arrays in and out.

Each world has its own seed, pose and, if wished, arena. What a world does depends on nothing but these: neither on the
size of the batch, nor on its place in it, nor on how many threads step it.
"""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot import arguments
from boebot.arenas import Arena
from boebot.brains import LoadedBrain
from boebot.errors import BrainError, RobotError
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicle import VehicleModel
from sim_bridge.vehicles import ENDS, worlds
from sim_bridge.vehicles.brains import Brains
from sim_bridge.vehicles.compiled_brain import WANDER, CompiledBrain

__all__ = ["WANDER", "Batch", "CompiledBrain"]

Floats = NDArray[np.float64]
THREADS_MAXIMUM: Final = 256
# Long calls are made in portions, between which Ctrl-C is heard. Worlds know nothing of them.
PORTION_FIRST: Final = 4096  # steps of all worlds together
PORTION_SHORT_S: Final = 0.02  # such portions are doubled ...
PORTION_LONG_S: Final = 0.1  # ... and such halved


class Batch:
    """N worlds of one model. With several threads, `close` it or use it by `with`; what was read stays.

    Attributes:
        readings: shape (N, M), a view that changes with each step; `model.names` says which column is what.
    """

    def __init__(
        self,
        model: VehicleModel,
        arenas: Arena | Sequence[Arena],
        poses: ArrayLike | Literal["random"],
        seeds: ArrayLike,
        *,
        threads: int = 1,
        state_bytes: int = worlds.STATE_BYTES,
    ) -> None:
        """N worlds at `poses`, shape (N, 3): x, y (m), heading (rad), with `seeds`, shape (N,); one arena or N of them.

        With "random" in place of poses each world starts anywhere that is free, by its seed (`Arena.free_start`).

        Raises:
            ArenaError: a start is not free space, or there is none.
            RobotError: shapes do not fit, or something is no number, seed, model or arena.
        """
        keys = _array("batch: seeds", seeds, RobotError, "(N,)")
        is_random = isinstance(poses, str) and poses == "random"
        given = np.zeros((keys.size, 3)) if is_random else poses
        starts = _floats("batch: poses", given, RobotError, '(N, 3), or "random"')
        if starts.ndim != 2 or starts.shape[1] != 3 or keys.shape != starts.shape[:1]:
            raise RobotError(f"batch: poses {starts.shape}, seeds {keys.shape}; expected shapes (N, 3) and (N,)")
        self.model, self.count = model, len(starts)
        self.threads = arguments.whole("batch: threads", threads, RobotError, least=1, most=THREADS_MAXIMUM)
        self.arenas = self._arenas(arenas)
        self.handle = worlds.make_worlds("batch", model, self.count, state_bytes)
        self.state_bytes = int(state_bytes)
        self._poses = [None] * self.count if is_random else starts.tolist()
        self._seeds: list[int] = keys.tolist()
        for index, seed in enumerate(self._seeds):
            self._place(index, seed)
        size = 8 * self.count * model.readings
        room = ffi.buffer(worlds.kept(self.handle.readings, self.handle), size) if size else b""
        self.readings: Floats = np.frombuffer(room, dtype=np.float64).reshape(self.count, model.readings)
        self.readings.flags.writeable = False
        self._brains: Brains | None = None
        self._coasts = np.zeros(self.count, dtype=np.bool_)
        self._closed = False
        self._pool: ThreadPoolExecutor | None = None
        self._open_pool()

    def _arenas(self, arenas: Any) -> list[Arena]:
        """One for each world."""
        try:
            around = [arenas] * self.count if isinstance(arenas, Arena) else list(arenas)
        except TypeError:
            around = [arenas]
        for arena in around:
            worlds.check_arena("batch", arena)
        if len(around) != self.count:
            raise RobotError(f"batch: {len(around)} arenas for {self.count} poses; expected one, or as many")
        return around

    def _place(self, index: int, seed: int) -> None:
        arena, pose = self.arenas[index], self._poses[index]
        pose = arena.free_start(self.model.radius, seed) if pose is None else pose
        worlds.place(f"batch, world {index}", self.handle, index, self.model, arena, seed, 1, pose)

    # ---- threads -----------------------------------------------------------------------------------------------------

    def _open_pool(self) -> None:
        if self.threads > 1:
            self._pool = ThreadPoolExecutor(self.threads)
            weakref.finalize(self, self._pool.shutdown, wait=False)
        self._closed = False

    def close(self) -> None:
        """Ends its threads. Readings, poses and states can still be read; there are no more steps."""
        pool, self._pool, self._closed = self._pool, None, True
        if pool is not None:
            pool.shutdown(wait=True)

    def __enter__(self) -> Batch:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _expect_open(self) -> None:
        if self._closed:
            raise RobotError("batch: it is closed; expected no steps after close()")

    def _shares(self) -> list[tuple[int, int]]:
        """First world and number of worlds of each thread."""
        borders = np.linspace(0, self.count, self.threads + 1).astype(int).tolist()
        return [(a, b - a) for a, b in pairwise(borders) if b > a]

    def _portion(self, work: Callable[[int, int, int], int | None], steps: int) -> bool:
        """Calls work(first, count, steps), which leaves the interpreter, for all shares. Whether all went well."""
        if self._pool is None:
            return not work(0, self.count, steps)
        try:
            tasks = [self._pool.submit(work, *share, steps) for share in self._shares()]
            statuses = [task.result() for task in tasks]  # of all, before anything else is asked of the worlds
        except BaseException:  # Ctrl-C: wait for the threads, a portion at most; should it come again, closed it stays
            self.close()
            self._open_pool()
            raise
        return not any(statuses)

    def _advance(self, work: Callable[[int, int, int], int | None], steps: int) -> bool:
        """`steps` steps of all worlds, in portions. Whether all went well."""
        left = arguments.whole("batch: steps", steps, RobotError, least=0, most=worlds.STEPS_MAXIMUM)
        self._expect_open()
        portion, well = max(1, PORTION_FIRST // max(1, self.count)), True
        while left > 0:
            portion = min(portion, left)
            started = time.perf_counter()
            well = self._portion(work, portion) and well
            left -= portion
            took = time.perf_counter() - started
            if took < PORTION_SHORT_S:
                portion *= 2
            elif took > PORTION_LONG_S:
                portion = max(1, portion // 2)
        return well

    # ---- steps -------------------------------------------------------------------------------------------------------

    def step(self, signals: ArrayLike, steps: int = 1, *, coasts: ArrayLike = False) -> Floats:
        """`steps` steps under motor signals of shape (N, 2), left and right. Returns the readings. Where `coasts` is
        true, for all or each world (N,), the servos of a robot with a board get no pulses, and its wheels turn freely.

        Ctrl-C ends it soon, after some of the steps; the batch goes on from there.

        Raises:
            BrainError: a signal is not finite, and then no world has moved.
            RobotError: the shape does not fit, it is closed, or a robot without a board shall coast.
        """
        given = np.ascontiguousarray(_floats("batch: signals", signals, BrainError, f"({self.count}, 2)"))
        if given.shape != (self.count, 2):
            raise RobotError(f"batch: signals {given.shape}; expected shape ({self.count}, 2)")
        if not np.isfinite(given).all():
            raise BrainError("batch: a motor signal is not a finite number; expected numbers in [-1, 1]")
        self._coast(_array("batch: coasts", coasts, RobotError, f"({self.count},)"))
        pointer = ffi.from_buffer("double[]", given)
        self._advance(
            lambda first, count, some: lib.vehicles_step(self.handle, first, count, pointer + 2 * first, some), steps
        )
        return self.readings

    def _coast(self, coasts: NDArray[Any]) -> None:
        if coasts.dtype != np.bool_ or coasts.shape not in ((), (self.count,)):
            shown = arguments.shown(coasts.tolist())
            raise RobotError(f"batch: coasts are {shown}; expected True or False, or {self.count} of them")
        if self.model.unit is None and coasts.any():
            raise RobotError("batch: coasts is True, but only servos at a board get no pulses; expected signals of 0")
        for index in np.flatnonzero(coasts != self._coasts).tolist():
            lib.vehicles_coast(self.handle, index, not self._coasts[index])
        self._coasts[:] = coasts

    def restart(self, index: int, seed: int) -> None:
        """World `index` begins anew with that seed and a new brain, at its own pose; a "random" one is drawn by the
        seed. The others stay as they are.

        Raises:
            ArenaError: no start is free.
            RobotError: there is no such world or seed, or it is closed.
        """
        self._expect_open()
        self._place(self._index(index), seed)
        self._seeds[index], self._coasts[index] = int(seed), False
        if self._brains is not None:
            self._brains.begin(index, seed)

    def run(
        self,
        brain: object,
        steps: int,
        *,
        period: float | None = None,
        parameters: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
    ) -> Floats:
        """`steps` steps with a brain. Returns the readings.

        A `CompiledBrain` is asked in each step; its memory in each world is at `state`. Any other brain is one as
        `boebot.run` takes it: a name, a file, `step(robot)`, a class, an object; or a list of N of them. Each world has
        its own, in `brains` (an object is copied), and its own robot, with the world's seed. `parameters` of brains of
        processes are as of `boebot.run`, for all or a list of N. They are asked every `period` seconds (None: as the
        brain says, or 0.05), from the first step on; with the brain of the run before they go on. Ctrl-C ends it soon,
        after some of the steps.

        Raises:
            BrainError: the model or the memory is not what the brain needs, and then no world has moved; or the brain
                gave a signal that is not finite, and then that world's run has ended and the others' went on; or a
                brain in Python has failed, and all worlds stand where they were when it was asked.
            RobotError: it is closed.
        """
        if isinstance(brain, ffi.CData):
            raise BrainError(f"batch: brain is {arguments.shown(brain)}; expected a CompiledBrain of it")
        if not isinstance(brain, CompiledBrain):
            return self._run_python(brain, steps, period, parameters)
        if period is not None or parameters is not None:
            raise BrainError("batch: a compiled brain is asked in each step; expected no period and no parameters")
        self._coast(np.array(False))
        brain.check("batch", self.model, self.state_bytes)
        well = self._advance(
            lambda first, count, some: int(lib.vehicles_run(self.handle, first, count, brain.function, some)), steps
        )
        if not well:
            worlds_failed = np.flatnonzero(self.flags == lib.VEHICLE_BRAIN_FAILED)
            raise BrainError(
                f"batch: {brain.name} gave a motor signal that is not a finite number in {len(worlds_failed)} of "
                f"{self.count} worlds, first in world {worlds_failed[0]}; expected numbers in [-1, 1]"
            )
        return self.readings

    def _run_python(self, brain: object, steps: int, period: float | None, parameters: Any) -> Floats:
        left = arguments.whole("batch: steps", steps, RobotError, least=0, most=worlds.STEPS_MAXIMUM)
        if self._brains is None or self._brains.made_of != (brain, period, parameters):
            self._brains = Brains(brain, self.model, self._seeds, period, parameters)
        while left > 0:
            runs = (self.flags == lib.VEHICLE_RUNS).tolist()
            signals = self._brains.step(self.steps.tolist(), self.readings.tolist(), runs)
            few = min(left, self._brains.period_steps)
            self.step(signals, few, coasts=self._brains.coasts)
            left -= few
        return self.readings

    @property
    def brains(self) -> list[LoadedBrain]:
        """Of the last run with brains in Python, that of each world; `brains[i].brain` is a `boebot.brain.Brain`."""
        return [] if self._brains is None else self._brains.loaded

    def state(self, index: int, kind: str = "unsigned char *") -> Any:
        """The compiled brain's memory in a world, as a pointer of that C type.

        Raises:
            RobotError: there is no such world or type, or it is larger than the memory.
        """
        memory = self.handle.brains + self._index(index) * self.handle.state_size
        try:
            pointer = ffi.cast(kind, memory)
            size = ffi.sizeof(ffi.typeof(pointer).item)
        except (TypeError, AttributeError, ValueError, ffi.error):
            raise RobotError(
                f"batch: {arguments.shown(kind)} is no C type here; expected a pointer, such as double *"
            ) from None
        if size > self.state_bytes:
            raise RobotError(
                f"batch: a brain's memory has {self.state_bytes} bytes, {kind} points to {size}; "
                f"expected state_bytes={size} or more where the worlds are made"
            )
        return worlds.kept(pointer, self.handle)

    def _index(self, index: int) -> int:
        try:
            return arguments.whole("", index, RobotError, least=0, most=self.count - 1)
        except RobotError:
            shown = arguments.shown(index)
            raise RobotError(f"batch: there is no world {shown}; expected 0 to {self.count - 1}") from None

    # ---- what can be read --------------------------------------------------------------------------------------------

    @property
    def true_poses(self) -> Floats:
        """Truth: shape (N, 3), x (m), y (m), heading (rad)."""
        return self._of_all("body", "state", "x", kind=np.float64, numbers=3)

    @property
    def flags(self) -> NDArray[np.int8]:
        """Shape (N,): 0 while a run goes on, 1 ended by a collision, 2 by an empty battery, 3 by a compiled brain that
        gave a signal that is no finite number."""
        return self._of_all("state", "flag", kind=np.int32)[:, 0].astype(np.int8)

    @property
    def steps(self) -> NDArray[np.uint64]:
        """Shape (N,): steps done by each world."""
        return self._of_all("state", "step", kind=np.uint64)[:, 0]

    def figures(self) -> dict[str, NDArray[Any]]:
        """What came of each world so far, shape (N,), under the names that `Run.table()` has for it; "ended":
        "complete", or why it goes no further."""
        distance = self._of_all("body", "state", "distance", kind=np.float64)[:, 0]
        contacts = self._of_all("state", "contacts", kind=np.uint64)[:, 0]
        return {
            "seed": np.array(self._seeds),
            "run_time_s": np.round(self.steps * self.model.dt, 3),
            "true_distance_m": np.round(distance, 3),
            "true_contacts": contacts.astype(np.int64),
            "ended": np.array([ENDS[flag] or "complete" for flag in self.flags.tolist()]),
        }

    def _of_all(self, *place: str, kind: type[Any], numbers: int = 1) -> NDArray[Any]:
        """A field of C struct vehicle, of each world: a copy of shape (N, numbers)."""
        each, size = ffi.sizeof("vehicle"), np.dtype(kind).itemsize
        room = ffi.buffer(self.handle.worlds, each * (self.count + 1))  # there is room for one more
        at = ffi.offsetof("vehicle", *place)
        return np.ndarray((self.count, numbers), kind, room, at, (each, size)).copy()

    def hashes(self) -> NDArray[np.uint64]:
        """Shape (N,): of all that each world has come to; the same on every machine."""
        return np.array([lib.vehicles_hash(self.handle, i) for i in range(self.count)], dtype=np.uint64)

    @property
    def bytes_per_world(self) -> float:
        """Memory of one world, without the arena."""
        return float(lib.vehicles_memory(self.handle) / self.count) if self.count else 0.0


def _array(what: str, values: Any, error: type[RobotError] | type[BrainError], shape: str) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except (TypeError, ValueError):  # rows of different lengths
        raise error(f"{what} are {arguments.shown(values)}; expected numbers of shape {shape}") from None


def _floats(what: str, values: Any, error: type[RobotError] | type[BrainError], shape: str) -> Floats:
    array = _array(what, values, error, shape)
    if array.dtype.kind in "fiu":
        return array.astype(np.float64, copy=False)
    raise error(f"{what} are {arguments.shown(values)}; expected numbers of shape {shape}")
