"""The loop of boards and world (loop/loop.h) as Python calls it: an arena, the robots in it, their truth and logs."""

from __future__ import annotations

import math
import struct
import weakref
from bisect import insort
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import arguments
from boebot.arenas import Arena
from boebot.arenas.floor_plan import Lateness, Shift
from boebot.arguments import point, shown, whole
from boebot.boards import TruthNow
from boebot.description import robots
from boebot.description.equipment import check_setting
from boebot.devices.display import letters_of
from boebot.devices.faults import BODY_FAULTS
from boebot.errors import ArenaError, BoardError, BrainError
from boebot.record.blocks import Block, Group, group_of
from sim_bridge.boards.board import CLOCK_HZ, EmulatedBoard
from sim_bridge.compiled import ffi, lib
from sim_bridge.robots.imperfections import Draw, applied, body_parameters, collision_outline
from sim_bridge.robots.wiring import done, join
from sim_bridge.vehicles import ENDS

TICK_CYCLES = 160_000  # of the firmware; a world step divides it
STEP_CYCLES = 16_000  # 1 ms
RECORD_CYCLES = 160_000  # 10 ms
CYCLES_MAXIMUM = 2**62  # 9,000 years
NUMBER_MAXIMUM = 2**30 - 1
STEP_MINIMUM = 160  # cycles of a world step: 10 us
NEVER = 2**64 - 1

BODY_PLACES = {
    "wheel_left": lib.FAULTY_LEFT_WHEEL,
    "wheel_right": lib.FAULTY_RIGHT_WHEEL,
    "robot": lib.FAULTY_ROBOT,
}
"""In the place of a part's number."""

TRUTH = ("time", "x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
_WAIT = struct.Struct("<dd")
_SHIFT = struct.Struct("<dddd")

BAUD_MAXIMUM = 4_000_000
ROOM = 1024  # bytes that are fetched at a time
PORTION_CYCLES = CLOCK_HZ  # of a long run, between two chances for Ctrl-C


Floats = NDArray[np.float64]
Pose = tuple[float, float, float]


def checked_pose(what: str, pose: object) -> Pose:
    """A pose that is one (m, m, rad), else raises ArenaError; `what` names it."""
    far = float(lib.ARENA_FARTHEST_M)
    x, y, heading = point(
        what, pose, ArenaError, "x (m), y (m) and heading (rad)", (far, far, float(lib.BODY_HEADING_LIMIT))
    )
    return x, y, heading


@dataclass(frozen=True)
class Member:
    """A robot as it was added."""

    board: EmulatedBoard | None
    description: robots.RobotDescription
    """with the imperfections that it was added with"""
    model: Any = None
    """the VehicleModel of a robot without a board"""
    layout: Mapping[str, slice] = field(default_factory=dict)
    """where the readings of each device stand, by its name"""
    parts: Mapping[str, int] = field(default_factory=dict)
    """numbers of the devices' parts at its board, by their names"""


_kept: dict[int, tuple[object, ...]] = {}
"""What a simulation in C points to, by its address. Were it kept by the Sim, the collector of cycles, which takes
things apart in any order, could free a board before the simulation that runs it."""


def _layout(robot: Any, parts: Mapping[str, int]) -> dict[str, slice]:
    """Where the readings of each device of a robot (C `robot *`) with a board stand; `parts`: in order."""
    room = ffi.new("double[]", lib.PART_READINGS * max(len(parts), 1))
    counts = [lib.robot_read_parts(robot, number, room) for number in parts.values()]
    found = {
        name: slice(counts[0] - here, counts[0] - after)
        for name, here, after in zip(parts, counts, [*counts, 0][1:], strict=True)
    }
    return {name: where for name, where in found.items() if where.start < where.stop}


def rows_of(buffer: Any, width: int) -> Floats:
    """What a C buffer holds, as rows of that many doubles."""
    data = ffi.buffer(buffer.data, buffer.count)[:] if buffer.count else b""
    return np.frombuffer(data, dtype=np.float64).reshape(-1, width)


def _destroy(handle: Any) -> None:
    """Frees a simulation in C, and only then what it points to."""
    lib.sim_destroy(handle)
    _kept.pop(int(ffi.cast("uintptr_t", handle)), None)


class Sim:
    """An arena and the robots in it, in lockstep with their boards. Seconds and SI units.

    A run is a function of arena, seed, robots by number, boards and what is sent to them: neither the order in which
    robots are added nor the way a run is cut into calls matters.

    Attributes:
        arena, seed, noise: as given. is_recorded: the truth is kept. members: the robots, by number.
    """

    def __init__(
        self,
        arena: Arena,
        *,
        seed: int = 1,
        noise: bool = True,
        record: bool = True,
        step_cycles: int = STEP_CYCLES,
    ) -> None:
        """An arena without robots.

        Raises:
            ArenaError: it is no arena, or has too many moving obstacles.
            BoardError: a seed that is none, or a world step that does not divide the control tick.
        """
        if not isinstance(arena, Arena):
            raise ArenaError(f"simulation: got {shown(arena)}; expected an Arena, as load_arena gives it")
        noise = arguments.switch("simulation: noise", noise, BoardError)
        record = arguments.switch("simulation: record", record, BoardError)
        seed = whole("simulation: the seed", seed, BoardError, least=-(2**63), most=2**64 - 1)
        step_cycles = whole("simulation: step_cycles", step_cycles, BoardError, least=STEP_MINIMUM, most=TICK_CYCLES)
        if TICK_CYCLES % step_cycles:
            raise BoardError(f"a world step of {step_cycles} cycles does not divide the control tick of {TICK_CYCLES}")
        moving = int(lib.arena_moving_count(arena.handle))
        if moving > lib.SIM_OBSTACLES_MAXIMUM:
            raise ArenaError(
                f"arena {arena.name}: {moving} moving obstacles; a simulation takes {lib.SIM_OBSTACLES_MAXIMUM} at most"
            )
        self.arena, self.seed, self.noise, self.is_recorded = arena, seed, noise, record
        self._step_cycles = step_cycles
        handle = lib.sim_new(arena.handle, seed & (2**64 - 1), step_cycles, RECORD_CYCLES if record else 0, noise)
        if handle == ffi.NULL:
            raise MemoryError("simulation")
        self._due: list[tuple[int, Callable[[], object]]] = []  # cycle, and what is done then
        self._outlines: list[object] = []
        self.members: dict[int, Member] = {}
        _kept[int(ffi.cast("uintptr_t", handle))] = (arena, self.members, self._outlines)
        self._handle: Any = ffi.gc(handle, _destroy)

    @property
    def handle(self) -> Any:
        """The simulation in C.

        Raises:
            BoardError: it is closed.
        """
        if self._handle is None:
            raise BoardError("this simulation is closed; expected one that is open")
        return self._handle

    def __copy__(self) -> Sim:
        raise BoardError("a simulation cannot be copied; expected a new one, built alike")

    def __deepcopy__(self, memo: object) -> Sim:
        return self.__copy__()

    def add(
        self,
        board: EmulatedBoard | None,
        description: robots.RobotDescription,
        *,
        pose: Pose | None = None,
        number: int | None = None,
        without: Sequence[str] = (),
        imperfections: Mapping[str, float] | None = None,
    ) -> SimRobot:
        """Puts a robot at `pose` (x, y, heading; m, m, rad), or where the arena says.

        `number` is its name in the run and the key of its noise and its imperfections: the next one if None.
        `without`: its imperfections that are switched off, `imperfections`: magnitudes of others by name
        (robots/imperfections.py). `board` is None for a robot whose description has none: it gets motor signals, and
        gives readings once every world step.

        Raises:
            ArenaError: that place is not free.
            RobotError: a description that is none of a robot without a board.
            BoardError: the number is taken or negative, there are too many robots, an imperfection is none or out of
                its range, or the simulation runs already.
        """
        if self.cycle:
            raise BoardError("the simulation runs already; expected all of its robots before")
        if not isinstance(board, EmulatedBoard | None) or not isinstance(description, robots.RobotDescription):
            raise BoardError(
                f"got {shown(board)} and {shown(description)}; expected a board or None, and a description"
            )
        description = applied(description, without, imperfections, noise=self.noise)
        if number is None:
            number = max(self.members, default=-1) + 1
        number = whole("robot number", number, BoardError, least=0, most=NUMBER_MAXIMUM)
        if number in self.members:
            raise BoardError(f"robot number {number} is taken")
        if board is not None and board.is_in_use():
            raise BoardError(f"the {board.description} is in a simulation already; expected another one")
        if len(self.members) == lib.BODY_MAXIMUM:
            raise BoardError(f"a simulation takes {len(self.members)} robots at most")
        if description.has_board != (board is not None):
            has = "has a board" if description.has_board else "has no board"
            raise BoardError(f"robot {description.name!r} {has}; expected one that fits what it is added with")
        pose = self.arena.start if pose is None else checked_pose(f"arena {self.arena.name}: a robot's pose", pose)
        if board is None:
            self._add_vehicle(number, description, pose)
        else:
            self._add_robot(number, board, description, pose)
        return self.robot(number)

    def _add_robot(
        self,
        number: int,
        board: EmulatedBoard,
        description: robots.RobotDescription,
        pose: Pose,
    ) -> None:
        draw = Draw(self.seed, self.noise, number, description.unit, description.imperfections)
        corners = description.body.outline_m
        outline = collision_outline(f"robot {description.name!r}: body.outline_m", corners) if corners else ffi.NULL
        self._outlines.append(outline)  # bodies in C point to them
        body = body_parameters(description.body, draw, outline)
        status = lib.sim_add_robot(self.handle, number, board.address, body, *pose)
        self._check(status, pose, f"the {board.description}")
        self.members[number] = member = Member(board, description)
        me = weakref.ref(self)
        board.is_in_use = lambda: (sim := me()) is not None and sim._handle is not None
        robot = lib.sim_robot(self.handle, number)
        parts = join(robot, description, draw)
        self.members[number] = replace(member, parts=parts, layout=_layout(robot, parts))

    def _add_vehicle(self, number: int, description: robots.RobotDescription, pose: Pose) -> None:
        from sim_bridge.vehicles.model_file import vehicle_model

        model = vehicle_model(description, dt=self._step_cycles / CLOCK_HZ, noise=self.noise)
        status = lib.sim_add_vehicle(self.handle, number, model.handle, *pose)
        self._check(status, pose, f"robot {description.name!r}")
        model.in_use = True
        self.members[number] = Member(None, description, model, dict(model.names))

    def _check(self, status: int, pose: Pose, what: str) -> None:
        if status == lib.SIM_NOT_FREE:
            x, y, _ = pose
            raise ArenaError(
                f"arena {self.arena.name}: the robot cannot start at x = {x:g} m, y = {y:g} m: no free space"
            )
        done(status, what)

    def robot(self, number: int) -> SimRobot:
        """The robot of that number.

        Raises:
            BoardError: there is none.
        """
        if number not in self.members:
            raise BoardError(f"there is no robot number {number} in this simulation")
        return SimRobot(self, number)

    @property
    def robots(self) -> list[SimRobot]:
        """All of them, by increasing number."""
        return [self.robot(number) for number in sorted(self.members)]

    @property
    def cycle(self) -> int:
        """Up to where the simulation has run."""
        handle = self._handle
        cycle: int = (self.handle if handle is None else handle).now
        return cycle

    def at(self, cycle: int, do: Callable[[], object]) -> None:
        """What is done when that cycle has come, or next where it is past; it may let no time pass."""
        insort(self._due, (cycle, do), key=lambda one: one[0])

    @property
    def next_due(self) -> int:
        """The cycle for which something is due next; NEVER."""
        return self._due[0][0] if self._due else NEVER

    def do_due(self) -> None:
        """Does what is due by now."""
        while self.next_due <= self.cycle:
            self._due.pop(0)[1]()

    def run(self, cycles: int) -> None:
        """Runs for `cycles`, also past bytes from robots that are listened to.

        Raises:
            BoardError: a board's program crashed.
        """
        until = self.cycle + whole("cycles", cycles, BoardError, least=0, most=CYCLES_MAXIMUM)
        while self.cycle < until:
            self.run_until(until)

    def run_until(self, cycle: int) -> None:
        """Runs until that cycle, or until a robot speaks that is listened to (see `SimRobot.listen`); what is due
        meanwhile is done at its cycle.

        Raises:
            BoardError: a board's program crashed.
        """
        cycle = whole("run_until: the cycle", cycle, BoardError, least=0, most=NEVER)
        while True:  # in portions, or Ctrl-C would not be heard
            until = min(cycle, self.cycle + PORTION_CYCLES, max(self.next_due, self.cycle))
            self.check(lib.sim_run_until(self.handle, until))
            self.do_due()
            if until == cycle or self.cycle < until or any(robot.speaks for robot in self.robots):
                return

    def check(self, crashed: int) -> None:
        """Raises BoardError where a run has ended since the board of robot `crashed` - 1 crashed, or has not begun; and
        what a reaction to an edge has raised."""
        if crashed == lib.SIM_RUNS:
            raise BoardError("a reaction to an edge cannot let time pass; expected that of who runs the board")
        if crashed == lib.SIM_PAUSED:
            for member in self.members.values():
                if member.board is not None:
                    member.board.raise_ended()
        elif crashed:
            board = self.robot(crashed - 1).board
            board.raise_ended()
            whose = f" of robot {crashed}" if len(self.members) > 1 else ""
            ended = "was stopped" if board.is_strict else "crashed"
            raise BoardError(
                f"the {board.description}{whose} {ended} at {self.cycle / CLOCK_HZ:.3f} s: {board.fault()}"
            )

    @property
    def stood_still_s(self) -> float:
        """How long it has stood still in debuggers, by the wall clock."""
        return sum(member.board.stood_still_s for member in self.members.values() if member.board is not None)

    def place_shape(self, index: int, pose: Pose) -> None:
        """Puts a moving shape of the arena (0: the first one) at `pose` (m, m, rad), as it is now. It goes on along its
        way shifted by as much, and turned in itself; the direction of the way stays.

        Raises:
            ArenaError: there is no such shape, or a robot stands there.
        """
        shapes = len(self.arena.description.moving)
        if not shapes:
            raise ArenaError(f"arena {self.arena.name} has no moving shape to put elsewhere")
        index = whole("place_shape: the moving shape", index, ArenaError, least=0, most=shapes - 1)
        x, y, heading = checked_pose("place_shape: the pose", pose)
        if lib.sim_place_shape(self.handle, index, x, y, heading) != lib.SIM_OK:
            raise ArenaError(f"moving shape {index + 1} cannot stand at {x:.2f} m, {y:.2f} m: a robot is there")

    def shapes(self) -> tuple[Pose, ...]:
        """Truth: where the arena's moving shapes stand now (m, m, rad)."""
        return tuple((m.x, m.y, math.atan2(m.sine, m.cosine)) for m in self.movers())

    def movers(self) -> list[Any]:
        """Truth: the arena's moving shapes as they stand, C structs mover, up to a step ahead of `cycle`."""
        return [self.handle.movers[k] for k in range(self.handle.world.obstacles)]

    def drain(self, *, ended: bool = False) -> Group:
        """The streams of a record that tell of the arena's moving shapes since it was last drained. "waits": rows
        (shape, how long it has waited in all, s); if the run has `ended`, the last one of each shape is of now, so that
        it does not matter how often one drains. "shifts": rows (shape, by how much it is off its way from then on: m,
        m, rad). Empty without recording, and without moving shapes."""
        waits = [
            (time, _WAIT.pack(shape, waited))
            for shape, late in enumerate(self.lateness())
            for time, waited in list(zip(late.time.tolist(), late.waited.tolist(), strict=True))[
                : None if ended else -1
            ]
        ]
        shifts = [(shift.time, _SHIFT.pack(shift.shape, shift.x, shift.y, shift.heading)) for shift in self.shifts()]
        self.handle.waits.count = self.handle.shifts.count = 0
        return group_of({"waits": sorted(waits), "shifts": shifts})

    def shifts(self) -> list[Shift]:
        """Truth: when moving shapes were put elsewhere, oldest first; empty without recording."""
        return [Shift(time, int(shape), *pose) for time, shape, *pose in rows_of(self.handle.shifts, 5).tolist()]

    def lateness(self) -> list[Lateness]:
        """Truth: how far the clock of each of the arena's moving shapes was behind, from the start to now, since it had
        waited for robots; empty without recording."""
        if not self.is_recorded:
            return []
        table, now, found = rows_of(self.handle.waits, 3), self.handle.world_at / CLOCK_HZ, []
        for shape, mover in enumerate(self.movers()):
            time, _, late = table[table[:, 1] == shape].T
            found.append(Lateness(time=np.append(time, now), waited=np.append(late, mover.waited)))
        return found

    def hash(self) -> int:
        """Of the whole state of all bodies, by robot number: equal for runs that are equal bit for bit."""
        return int(lib.sim_hash(self.handle))

    def close(self) -> None:
        """Frees the simulation, then the boards. May be called twice."""
        handle, self._handle = self._handle, None
        if handle is None:
            return
        ffi.release(handle)
        for member in self.members.values():
            if member.board is not None:
                member.board.close()


class SimRobot:
    """One robot of a simulation: its line, its truth, its logs. Given by `Sim.add` and `Sim.robot`.

    Attributes:
        touched: called when somebody has put it elsewhere or has worked one of its devices.
    """

    def __init__(self, sim: Sim, number: int) -> None:
        self.sim, self.number = sim, number
        self._robot = lib.sim_robot(sim.handle, number)  # stays where it is until the simulation is closed
        self._received = ffi.addressof(self._robot, "received")
        self._room = ffi.new("uint8_t[]", ROOM)
        self._view = ffi.buffer(self._room)
        self.touched: Callable[[], object] = lambda: None
        self._displays: dict[str, int] | None = None  # numbers of parts that show letters, once somebody has asked

    @property
    def board(self) -> EmulatedBoard:
        """Its board.

        Raises:
            BoardError: it has none.
        """
        board = self.sim.members[self.number].board
        if board is None:
            raise BoardError(f"robot {self.description.name!r} has no board")
        return board

    @property
    def description(self) -> robots.RobotDescription:
        """What it was built from."""
        return self.sim.members[self.number].description

    @property
    def handle(self) -> Any:
        """The robot in C; raises as that of the simulation."""
        _ = self.sim.handle  # raises where it is closed
        return self._robot

    def receive(self) -> bytes:
        """Bytes that left the board since the last call."""
        data, count, _ = b"", ROOM, self.handle
        while count == ROOM:
            count = lib.buffer_take(self._received, self._room, ROOM)
            data += self._view[:count]
        return data

    def follow_line(self, off: float = 0.0) -> None:
        """From now on the outside's bit rate is always the board's own, as its registers say, but for that share of it;
        `received` says when each byte has come.

        Raises:
            BoardError: the robot has no board.
        """
        self._need_board("a line")
        self.handle.is_stamped = True
        if (share := self.board.extension("line off", "double")) is not None:
            share[0] = off
        lib.robot_line_rate(self.handle, 0)

    def received(self) -> tuple[bytes, list[int]]:
        """Bytes that left the board since the last call, and the cycle at which each one had come."""
        data, at = self.receive(), self.handle.received_at
        cycles = np.frombuffer(ffi.buffer(at.data + at.start, at.count)[:], "<u8").tolist() if at.count else []
        at.start = at.count = 0
        return data, cycles

    def send(self, data: bytes | bytearray | memoryview) -> None:
        """Bytes to the board, from now on.

        Raises:
            BoardError: they are none, or the robot has no board.
        """
        if not isinstance(data, bytes | bytearray | memoryview):
            raise BoardError(f"send: got {shown(data)}; expected bytes")
        data = bytes(data)
        self._need_board("bytes")
        lib.robot_send(self.handle, data, len(data))

    # ---- what its devices are and do ---------------------------------------------------------------------------------

    @property
    def layout(self) -> Mapping[str, slice]:
        """Where the readings of each device stand: of a robot with a board what its parts show of themselves."""
        return self.sim.members[self.number].layout

    @property
    def parts(self) -> Mapping[str, int]:
        """Numbers of the parts at its board, by the names of their devices."""
        return self.sim.members[self.number].parts

    def readings(self) -> tuple[float, ...]:
        """All readings, in SI units: now, and of some parts at a board of the time since they were last asked for."""
        vehicle = self.handle.vehicle
        if not vehicle:
            room = ffi.new("double[]", lib.PART_READINGS * max(len(self.parts), 1))
            return tuple(ffi.unpack(room, lib.robot_read_parts(self.handle, 0, room)))
        lib.vehicles_sense(vehicle, 0)
        count = vehicle.model.readings
        return tuple(ffi.unpack(vehicle.readings, count)) if count else ()

    def texts(self) -> dict[str, str]:
        """What displays at its board show, line by line: by device and number of the line, from 1."""
        room, found = ffi.new("uint8_t[]", lib.DISPLAY_LINES * lib.DISPLAY_LETTERS), {}
        if self._displays is None:
            shown = (
                (name, number, lib.robot_read_letters(self.handle, number, room)) for name, number in self.parts.items()
            )
            self._displays = {name: number for name, number, lines in shown if lines}
        for name, number in self._displays.items():
            for line in range(lib.robot_read_letters(self.handle, number, room)):
                codes = ffi.buffer(room)[line * lib.DISPLAY_LETTERS : (line + 1) * lib.DISPLAY_LETTERS]
                found[f"{name}_{line + 1}"] = letters_of(codes)
        return found

    def signals(self, left: float, right: float) -> None:
        """Motor signals from now on, of a robot without a board; what is beyond -1 to 1 is limited.

        Raises:
            BrainError: they are no finite numbers.
            BoardError: the robot is driven by its board.
        """
        if self.description.has_board:
            raise BoardError(f"robot {self.description.name!r} is driven by its board; expected bytes for it")
        try:
            status = lib.vehicles_send(self.handle.vehicle, 0, left, right)
        except (TypeError, OverflowError):
            status = lib.VEHICLE_BAD_NUMBER
        if status != lib.VEHICLE_OK:
            raise BrainError(f"motor signals {shown(left)}, {shown(right)}; expected two finite numbers")

    @property
    def ended(self) -> str:
        """Why a robot without a board can go no further, or ""."""
        vehicle = self.handle.vehicle
        return ENDS[vehicle.worlds[0].state.flag] if vehicle else ""

    def set_part(self, device: str, value: float) -> None:
        """Works a device at its board, such as a button (0, 1) or a knob (0 to 1).

        Raises:
            BoebotError: it has none that can be set so.
        """
        check_setting(self.description, device, arguments.number(f"{device} is set: the value", value, BoardError))
        done(lib.robot_set_part(self.handle, self.parts[device], value), device)
        self.touched()

    def fault(self, owner: str, kind: str, value: float, begin_cycle: int, end_cycle: int = NEVER) -> Callable[[], int]:
        """Lays a fault on a device at its board, a wheel ("wheel_left", "wheel_right"), the "battery" or the whole
        "robot", from a cycle (now at the earliest) up to another. `kind` and the unit of `value`: as `Device.FAULTS`
        and `BODY_FAULTS` have them. Returns what says how often it has fired: what went out was not what would have
        gone out.

        Raises:
            BoardError: the robot has no such fault, or one of its kind acts at the same time; a value or a span that is
                none.
        """
        self._need_board("parts that fail")
        where = f"fault {owner}.{kind}"
        parts = {**self.parts, **BODY_PLACES, **({"battery": 0} if self.handle.battery else {})}
        device = self.description.device.get(owner)
        kinds = BODY_FAULTS.get(owner, {} if device is None else device.FAULTS)
        if owner not in parts or kind not in kinds:
            raise BoardError(f"{where}: robot {self.description.name!r} has no such fault")
        one = kinds[kind]
        most = len(one.words) - 1 if one.words else one.most
        value = arguments.number(f"{where}: its value", value, BoardError, least=one.least, most=most)
        begin = max(whole(f"{where}: its begin", begin_cycle, BoardError, least=0, most=NEVER - 1), self.sim.cycle)
        end = whole(f"{where}: its end", end_cycle, BoardError, least=begin + 1, most=NEVER)
        which = getattr(lib, f"FAULT_{kind.upper()}")
        slot = lib.robot_fault(self.handle, parts[owner], which, value, begin, end)
        if slot == lib.SIM_BAD_ARGUMENT:
            raise BoardError(f"{where}: another one acts at the same time; expected one after the other")
        done(slot if slot < 0 else lib.SIM_OK, where)
        return lambda: int(lib.robot_fault_fired(self.handle, slot))

    # ---- its line ----------------------------------------------------------------------------------------------------

    def listen(self, cycle: int) -> None:
        """From that cycle on its bytes end a run of `Sim.run_until`."""
        cycle = whole("listen: the cycle", cycle, BoardError, least=0, most=NEVER)
        self.handle.listen_from = cycle

    def wait(self, cycles: int, quiet: int) -> None:
        """Lets that many cycles pass; after `quiet` of them (0: 1) only until a robot speaks that is listened to, as
        this one is then.

        Raises:
            BoardError: a board's program crashed.
        """
        sim = self.sim
        cycles = whole("wait: cycles", cycles, BoardError, least=0, most=CYCLES_MAXIMUM)
        quiet = whole("wait: quiet", quiet, BoardError, least=0, most=CYCLES_MAXIMUM) or 1
        if cycles <= PORTION_CYCLES and sim.next_due > sim.cycle + cycles:
            if crashed := lib.robot_wait(self.handle, cycles, quiet):
                sim.check(crashed)
        else:
            now = sim.cycle
            self.listen(now + quiet)
            sim.run_until(now + cycles)

    def run_to_edge(self, cycle: int, pins: Collection[int]) -> bool:
        """Runs until that cycle, also past bytes from robots that are listened to, or to an edge of one of its board's
        pins (board.h, `stops`): then time stands behind the instruction that it meets, and the result is True.

        Raises:
            BoardError: a board's program crashed, or others would be ahead of the edge.
        """
        sim, board = self.sim, self.board
        cycle = whole("run_to_edge: the cycle", cycle, BoardError, least=0, most=NEVER)
        if (count := sum(member.board is not None for member in sim.members.values())) > 1:
            raise BoardError(
                f"a run cannot end at an edge of one of {count} boards; expected the only one of its world"
            )
        board.stop_at(pins)
        try:
            while sim.cycle < cycle:
                ended = lib.sim_run_until(sim.handle, min(cycle, sim.cycle + PORTION_CYCLES))
                sim.check(ended)
                if ended == lib.SIM_PAUSED:
                    return True
            return False
        finally:
            board.stop_at(())

    @property
    def speaks(self) -> bool:
        """Bytes have come since it is listened to, and the line has been idle since."""
        return bool(lib.robot_speaks(self.handle))

    def line_rate(self, baud: int) -> None:
        """Bit rate of the outside's side of the serial line.

        Raises:
            BoardError: there is no such rate, or the robot has no board.
        """
        baud = whole("line_rate: the rate", baud, BoardError, least=1, most=BAUD_MAXIMUM)
        self._need_board("a line")
        lib.robot_line_rate(self.handle, baud)

    @property
    def last_byte_cycle(self) -> int:
        """At which the last byte from the board had come."""
        return int(self.handle.last_byte)

    @property
    def true_contacts(self) -> int:
        """Touches begun so far; apart by 0.1 s at least."""
        return int(self.handle.contacts)

    @property
    def supply_voltage(self) -> float:
        """Of the rail that the board runs on, V."""
        return float(self.handle.chassis.supply * lib.SUPPLY_NOMINAL_V)

    def body(self) -> Any:
        """The body's state now (a copy, as C struct body_state): pose, speeds, wheel angles, distance, contact."""
        return ffi.new("body_state *", self.handle.body.state)

    def truth_now(self) -> TruthNow:
        """What only a simulator knows, as it stands now."""
        body = self.body()
        return TruthNow((body.x, body.y, body.heading), self.true_contacts, self.sim.shapes())

    def place(self, x: float, y: float, heading: float) -> None:
        """Lifts the robot and puts it elsewhere, at rest (m, m, rad): see `robot_place` of loop/loop.h.

        Raises:
            ArenaError: that place is not free.
        """
        x, y, heading = checked_pose("place: the pose", (x, y, heading))
        if lib.robot_place(self.handle, x, y, heading) != lib.SIM_OK:
            raise ArenaError(
                f"a robot cannot stand at {x:.2f} m, {y:.2f} m: a wall, a moving shape or another robot is in the way"
            )
        self.touched()

    def _need_board(self, what: str) -> None:
        if not self.description.has_board:
            raise BoardError(f"robot {self.description.name!r} has no board, and so no {what}")

    def truth(self) -> dict[str, Floats]:
        """Columns `TRUTH`, one row every 10 ms, and two a cycle apart where it was put elsewhere; empty without
        recording."""
        return dict(zip(TRUTH, rows_of(self.handle.truth, len(TRUTH)).T, strict=True))

    def truth_to_now(self) -> dict[str, Floats]:
        """The same with a row of now at its end, of a robot whose run ends with a world step."""
        columns, body = self.truth(), self.body()
        half = self.description.body.track_width_m / 2
        left, right = body.speed - half * body.turn_rate, body.speed + half * body.turn_rate  # (2.18), (2.19)
        now = (self.sim.cycle / CLOCK_HZ, body.x, body.y, body.heading, body.speed, body.turn_rate, left, right)
        if not len(columns["time"]) or columns["time"][-1] >= now[0]:
            return columns
        row = dict(zip(TRUTH, (*now, float(body.touching != 0)), strict=True))
        return {name: np.append(values, row[name]) for name, values in columns.items()}

    def drain(self, *, to_now: bool = False) -> Group:
        """The stream "truth" of a record since it was last drained: rows of doubles, columns `TRUTH` without the time.
        Empty without recording. `to_now`: as `truth_to_now`."""
        if not self.sim.is_recorded:
            return {}
        time, *columns = (self.truth_to_now() if to_now else self.truth()).values()
        self.handle.truth.count = 0
        if not len(time):
            return {}
        data = np.column_stack(columns)
        return {"truth": Block(time, data.tobytes(), np.array([8 * len(columns)], dtype=np.uint32))}
