"""A robot in a simulated world as the host opens it: bytes, pins, truth.

`open_native` and `open_avr` are what the entry points of the group `boebot.boards` name. A session joins one emulated
board to a body in an arena, by the robot's description; the loop that advances both is C (loop.h), and Python is called
only where somebody reads or writes bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import robots
from boebot.boards import BoardRequest, Truth
from boebot.errors import ArenaError, BoardError
from sim_bridge import imperfections
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena, load_arena
from sim_bridge.boards.board import CLOCK_HZ, COUNTERS, ResetCause

TICK_CYCLES = 160_000  # of the firmware; a world step divides it
STEP_CYCLES = 16_000  # 1 ms
RECORD_CYCLES = 160_000  # 10 ms
EDGE = np.dtype(  # sim_edge of loop.h
    {"names": ["cycle", "pin", "level"], "formats": ["<u8", "u1", "u1"], "offsets": [0, 8, 9], "itemsize": 16}
)
TRUTH = ("time", "x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
LOOK = ("time", "kind", "x", "y", "heading", "beam", "reach", "distance")

Floats = NDArray[np.float64]


class EmulatedBoard:
    """A board by its address, and whatever must live as long as it does."""

    def __init__(self, address: int, description: str, release: Callable[[], None], keep: Any = None) -> None:
        """`release` frees the board.

        Raises:
            BoardError: the board was built for another version of this package.
        """
        self.address = address
        self.description = description
        self._release: Callable[[], None] | None = release
        self._keep = keep
        if lib.board_check(address) != lib.SIM_OK:
            self.close()
            raise BoardError(f"the {description} was built for another version of the simulator; build it again")

    def close(self) -> None:
        """Frees the board. May be called twice."""
        release, self._release = self._release, None
        if release is not None:
            release()


class Sim:
    """An arena with one robot in it, in lockstep with its board. Seconds and SI units."""

    def __init__(
        self,
        board: EmulatedBoard,
        robot: robots.RobotDescription,
        arena: Arena,
        *,
        seed: int = 1,
        noise: bool = True,
        record: bool = True,
        pose: tuple[float, float, float] | None = None,
        step_cycles: int = STEP_CYCLES,
    ) -> None:
        """Puts the robot at `pose` (x, y, heading), or where the arena says.

        Raises:
            ArenaError: that place is not free.
            BoardError: a world step that does not divide the control tick.
        """
        if step_cycles <= 0 or TICK_CYCLES % step_cycles:
            raise BoardError(f"a world step of {step_cycles} cycles does not divide the control tick of {TICK_CYCLES}")
        self.board, self.robot, self.arena = board, robot, arena
        x, y, heading = arena.start if pose is None else pose
        if not arena.is_free(x, y, robot.body.radius_m):
            raise ArenaError(f"arena {arena.name}: the robot cannot start at x = {x:g} m, y = {y:g} m: no free space")
        draw = imperfections.Draw(seed, noise)
        handle = lib.sim_new(arena.handle, seed & (2**64 - 1), step_cycles, RECORD_CYCLES if record else 0, noise)
        if handle == ffi.NULL:
            raise MemoryError("simulation")
        # the board outlives the simulation, whichever of the two Python lets go of first
        self.handle = ffi.gc(handle, lambda handle, board=board: lib.sim_destroy(handle))
        _done(lib.sim_add_robot(handle, board.address, imperfections.body_parameters(robot.body), x, y, heading))
        _done(lib.sim_add_battery(handle, 0, _battery_channel(robot), imperfections.battery_parameters()))
        for name, device in robot.device.items():
            if device.on:
                self._join(name, device, draw)
        self._bytes = ffi.new("uint8_t[]", 65536)
        self._count = ffi.new("size_t *")
        self._body = ffi.new("body_state *")

    def _join(self, name: str, device: robots.Device, draw: imperfections.Draw) -> None:
        """Joins a device to its pins; those without a part in the world are left alone."""
        side = lib.SIM_RIGHT if name.endswith("right") else lib.SIM_LEFT
        body = self.robot.body
        match device:
            case robots.ContinuousServo():
                servo = imperfections.servo_parameters(device, body, side, draw)
                _done(lib.sim_add_servo(self.handle, 0, side, robots.pin_number(device.pin), servo))
            case robots.Encoder():
                pin, edges = robots.pin_number(device.pin), device.edges_per_turn
                _done(lib.sim_add_encoder(self.handle, 0, side, pin, 255, edges))
            case robots.QuadratureEncoder():
                pin_a, pin_b = robots.pin_number(device.pin_a), robots.pin_number(device.pin_b)
                _done(lib.sim_add_encoder(self.handle, 0, side, pin_a, pin_b, device.edges_per_turn))
            case robots.Whisker():
                whisker = imperfections.whisker_parameters(device)
                _done(lib.sim_add_whisker(self.handle, 0, robots.pin_number(device.pin), whisker))
            case robots.InfraredPair():
                pair = imperfections.infrared_parameters(device)
                led, receiver = robots.pin_number(device.led_pin), robots.pin_number(device.receiver_pin)
                _done(lib.sim_add_infrared(self.handle, 0, led, receiver, pair))
            case robots.Ping():
                ping = imperfections.ping_parameters(device)
                _done(lib.sim_add_ping(self.handle, 0, robots.pin_number(device.pin), ping))

    @property
    def cycle(self) -> int:
        """Up to where the simulation has run."""
        return int(lib.sim_now(self.handle))

    def run(self, cycles: int, quiet: int = 0) -> None:
        """Runs for at most `cycles`; after `quiet` of them, until bytes have come and the line is idle.

        Raises:
            BoardError: the board's program crashed.
        """
        if lib.sim_run(self.handle, cycles, quiet):
            fault = lib.board_fault(self.board.address)
            why = "unknown fault" if fault == ffi.NULL else ffi.string(fault).decode()
            raise BoardError(f"the {self.board.description} crashed at {self.cycle / CLOCK_HZ:.3f} s: {why}")

    def receive(self) -> bytes:
        """Bytes that left the board since the last call."""
        count = lib.sim_receive(self.handle, 0, self._bytes, 65536)
        if not count:
            return b""
        data: bytes = ffi.buffer(self._bytes, count)[:]
        return data if count < 65536 else data + self.receive()

    def send(self, data: bytes) -> None:
        """Bytes to the board, from now on."""
        lib.sim_send(self.handle, 0, data, len(data))

    def body(self) -> Any:
        """The body's state (C struct body_state): pose, speeds, wheel angles, distance, contact."""
        lib.sim_body(self.handle, 0, self._body)
        return self._body

    def _rows(self, rows: Any, columns: tuple[str, ...]) -> dict[str, Floats]:
        count = self._count[0]
        size = count * len(columns) * 8
        table = np.frombuffer(ffi.buffer(rows, size)[:] if count else b"", dtype=np.float64)
        return dict(zip(columns, table.reshape(-1, len(columns)).T, strict=True))

    def truth(self) -> dict[str, Floats]:
        """Columns `TRUTH`, one row every 10 ms; empty without recording."""
        return self._rows(lib.sim_record(self.handle, 0, self._count), TRUTH)

    def looks(self) -> dict[str, Floats]:
        """Columns `LOOK`, one row per IR burst (kind 0) and Ping (kind 1); empty without recording."""
        return self._rows(lib.sim_looks(self.handle, 0, self._count), LOOK)

    def hash(self) -> int:
        """Of the body's whole state: equal for runs that are equal bit for bit."""
        return int(lib.sim_hash(self.handle))

    def close(self) -> None:
        """Frees the simulation, then the board."""
        ffi.release(self.handle)
        self.board.close()


def _done(status: int) -> None:
    """Robot descriptions are checked when they are loaded; what fails here is memory or a mistake of ours."""
    if status < 0:
        raise MemoryError(f"simulation: error {status}")


def _battery_channel(robot: robots.RobotDescription) -> int:
    for device in robot.device.values():
        if isinstance(device, robots.Battery) and device.on:
            return robots.pin_number(device.pin) - 14
    return 255


def _cycles(seconds: float) -> int:
    """As many cycles, but at least one of any time at all: a wait that lets no time pass would be repeated for ever."""
    return max(1, round(seconds * CLOCK_HZ)) if seconds > 0 else 0


class SimTransport:
    """The board's serial line, in this process. Time passes only while `read` waits."""

    realtime = False

    def __init__(self, sim: Sim, name: str, paced: bool = False) -> None:
        """`paced`: `read` also waits until as much time has passed on the wall."""
        self.name = name
        self._sim = sim
        self._handle = sim.handle
        self._pace = Pace(sim) if paced else None
        self._closed = False

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """Advances by `quiet_s`, then until bytes have come and the line is idle, at most by `wait_s` in all."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        self._sim.run(_cycles(wait_s), _cycles(quiet_s))
        if self._pace is not None:
            self._pace.wait()
        return self._sim.receive()

    def write(self, data: bytes) -> None:
        """Sends bytes, back to back from now on."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        lib.sim_send(self._handle, 0, data, len(data))

    def now(self) -> float:
        """Simulated time since power-on (s)."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        now: float = lib.sim_now(self._handle) / CLOCK_HZ
        return now

    def close(self) -> None:
        """Nothing is sent or received any more."""
        self._closed = True


class Pace:
    """Holds simulated time to the wall clock."""

    LAG_S = 0.5  # what cannot be caught up is forgotten

    def __init__(self, sim: Sim) -> None:
        self._sim = sim
        self._start = time.monotonic() - sim.cycle / CLOCK_HZ

    def due(self) -> int:
        """Cycles that the wall clock is ahead of the simulation."""
        ahead = time.monotonic() - self._start - self._sim.cycle / CLOCK_HZ
        if ahead > self.LAG_S:
            self._start += ahead
            ahead = 0.0
        return max(0, int(ahead * CLOCK_HZ))

    def wait(self) -> None:
        """Sleeps until the wall clock has caught up."""
        behind = self._sim.cycle / CLOCK_HZ + self._start - time.monotonic()
        if behind > 0:
            time.sleep(behind)
        elif behind < -self.LAG_S:
            self._start -= behind


class BoardPins:
    """The board's pins and what else a test reaches for.

    Pins by Arduino number 0..19 (A0 is 14); levels LOW 0, HIGH 1, RELEASED 2.
    """

    def __init__(self, sim: Sim) -> None:
        self._sim = sim
        self._handle = sim.handle
        self.reset_cycle = 0  # when the program last started

    @property
    def cycle(self) -> int:
        """Now, in cycles since power-on."""
        return self._sim.cycle

    def pin_log(self) -> NDArray[Any]:
        """The board's output edges (fields cycle, pin, level), the newest million, oldest first."""
        count = min(int(lib.sim_edges_seen(self._handle, 0)), 1 << 20)
        log = np.empty(count, dtype=EDGE)
        lib.sim_edges(self._handle, 0, ffi.from_buffer("sim_edge[]", log, require_writable=True), count)
        return log

    def output(self, pin: int) -> int:
        """What the firmware does to a pin now: LOW, HIGH, RELEASED or PULLED_UP (3)."""
        return int(lib.board_output(self._sim.board.address, pin))

    def drive(self, pin: int, level: int, at_cycle: int | None = None) -> None:
        """Takes a pin from its part and drives it from `at_cycle` on (now)."""
        at = self._sim.cycle + 64 if at_cycle is None else at_cycle
        self._check(lib.sim_drive(self._handle, 0, max(0, at), pin, level), f"pin {pin}, level {level}")

    def square_wave(self, pin: int, period: int, seconds: float) -> None:
        """Takes a pin from its part; its level changes every half `period` (cycles) for that long."""
        status = lib.sim_wave(self._handle, 0, pin, period // 2, round(seconds * CLOCK_HZ))
        self._check(status, f"square wave of {period} cycles on pin {pin}")

    def press_whisker(self, pin: int, pressed: bool | None) -> None:
        """Holds a whisker pressed or free; None: as the world says."""
        held = -1 if pressed is None else int(pressed)
        self._check(lib.sim_hold_whisker(self._handle, 0, pin, held), f"whisker on pin {pin}")

    def answer_ping(self, echo_us: float | None) -> None:
        """Every trigger is answered by a pulse of that length (us), or by none at all; see `ask_world`."""
        echo = -2 if echo_us is None else round(echo_us * CLOCK_HZ / 1e6)
        self._check(lib.sim_answer_ping(self._handle, 0, echo), "Ping")

    def ask_world(self) -> None:
        """The Ping measures distances again."""
        self._check(lib.sim_answer_ping(self._handle, 0, -1), "Ping")

    def place(self, x: float, y: float, heading: float) -> None:
        """Puts the robot elsewhere, at rest (m, m, rad).

        Raises:
            ArenaError: that place is not free.
        """
        if lib.sim_place(self._handle, 0, x, y, heading) != lib.SIM_OK:
            raise ArenaError(f"the robot cannot be put at x = {x:g} m, y = {y:g} m: no free space")

    def reset(self, cause: str = "external") -> None:
        """Resets the microcontroller: power, external, brown_out or watchdog."""
        self.reset_cycle = self._sim.cycle
        lib.board_reset(self._sim.board.address, ResetCause[cause.upper()])

    def line_rate(self, baud: int) -> None:
        """Bit rate of the host's side of the serial line."""
        lib.board_line_rate(self._sim.board.address, baud)

    def counters(self) -> dict[str, int]:
        """What the board counted since power-on."""
        values = ffi.new("uint64_t[9]")
        lib.board_read_counters(self._sim.board.address, values)
        return dict(zip(COUNTERS, (int(value) for value in values), strict=True))

    @staticmethod
    def _check(status: int, what: str) -> None:
        if status != lib.SIM_OK:
            raise BoardError(f"{what}: the robot has no such thing")


class SimSession:
    """An opened simulated robot (BoardSession of boebot.boards)."""

    def __init__(self, sim: Sim, kind: str, paced: bool = False) -> None:
        self.sim = sim
        self.arena = sim.arena
        self.description = f"{sim.board.description} in arena {sim.arena.name}"
        self.transport = SimTransport(sim, kind, paced)
        self.board = BoardPins(sim)
        self._closed = False

    def truth(self) -> Truth | None:
        """What happened so far; None without recording."""
        columns = self.sim.truth()
        if not len(columns["time"]):
            return None
        return Truth(
            time=columns["time"],
            x=columns["x"],
            y=columns["y"],
            heading=columns["heading"],
            contact=columns["contact"] > 0,
            left_speed=columns["left"],
            right_speed=columns["right"],
            arena_name=self.arena.name,
            outlines=self.arena.outlines,
        )

    def looks(self) -> dict[str, Floats]:
        """Where the range sensors looked from and what they saw: columns `LOOK`."""
        return self.sim.looks()

    def counters(self) -> Mapping[str, float]:
        """Counters of the board, and `contacts`, `distance` (m), `time` (s), `load` (share of cycles executed)."""
        board = self.board.counters()
        cycle = self.sim.cycle
        return {
            **board,
            "contacts": float(lib.sim_contacts(self.sim.handle, 0)),
            "distance": float(self.sim.body().distance),
            "time": cycle / CLOCK_HZ,
            "load": board["executed_cycles"] / cycle if cycle else 0.0,
            "supply_voltage": float(lib.sim_supply_voltage(self.sim.handle, 0)),
        }

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        if self._closed:
            return
        self._closed = True
        self.transport.close()
        self.sim.close()


def native_library(pin_map: str) -> Path:
    """The firmware for this computer.

    Raises:
        BoardError: it was not built.
    """
    folder = Path(__file__).resolve().parent / "images"
    for suffix in (".so", ".dll"):
        path = folder / f"firmware-{pin_map}{suffix}"
        if path.is_file():
            return path
    raise BoardError(f"there is no firmware for this computer for pin map {pin_map!r}; build it with `make setup`")


def native_board(library: Path) -> EmulatedBoard:
    """A native board that runs that firmware library.

    Raises:
        BoardError: it is no firmware library.
    """
    error = ffi.new("char[]", 512)
    board = lib.native_board_create(str(library).encode(), error, 512)
    if board == ffi.NULL:
        raise BoardError(f"{library.name}: {ffi.string(error).decode(errors='replace')}")
    address = int(ffi.cast("uintptr_t", board))
    return EmulatedBoard(address, "emulated native board", lambda: lib.board_destroy(address))


def avr_board(image: Path) -> EmulatedBoard:
    """An emulated ATmega328P that runs that ELF file.

    Raises:
        BoardError: the emulator is not installed, or the file is no such image.
    """
    from sim_bridge.boards import avr

    board = avr.create(image)
    return EmulatedBoard(board.pointer, "emulated ATmega328P", board.close, keep=board)


def open_native(request: BoardRequest) -> SimSession:
    """Opens the native board: the firmware's own C on this computer."""
    library = native_library(request.robot.pin_map) if request.image is None else _file(request.image)
    return _open(request, "native", lambda: native_board(library))


def open_avr(request: BoardRequest) -> SimSession:
    """Opens the emulated ATmega328P with the image that would be flashed."""
    if request.image is None:
        from boebot import resources

        image = resources.folder("images") / f"{request.robot.pin_map}.elf"
        if not image.is_file():
            raise BoardError(f"there is no firmware image {image.name}; build it with `make firmware`")
    else:
        image = _file(request.image)
    return _open(request, "avr", lambda: avr_board(image))


def _file(image: str) -> Path:
    path = Path(image)
    if not path.is_file():
        raise BoardError(f"there is no firmware image {image}")
    return path


def _open(request: BoardRequest, kind: str, make: Callable[[], EmulatedBoard]) -> SimSession:
    arena = load_arena(request.arena)
    board = make()
    try:
        sim = Sim(
            board,
            request.robot,
            arena,
            seed=request.seed,
            noise=request.noise,
            record=request.record,
            pose=request.start_pose,
            step_cycles=round(float(request.options.get("world_step_s", 0.001)) * CLOCK_HZ),
        )
    except Exception:
        board.close()
        raise
    uart = request.robot.device.get("uart")
    if isinstance(uart, robots.Uart):
        lib.board_line_rate(board.address, uart.baud)
    return SimSession(sim, kind, request.realtime)
