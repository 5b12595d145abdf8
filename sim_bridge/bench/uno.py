"""An Uno as a test has it: its pins, its serial line, what lies in it, what is around it, and what was measured; on the
emulated board, or, as far as that goes, on a board behind a port.

The plugin gives it as the fixture `uno` (plugin.py). Without pytest: `with open_uno("avr", Wanted(image=path)) as uno`.
Times are the board's (s), and a wait is over when what it waits for has happened, however the run is cut.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from boebot import flashing
from boebot.arguments import number
from boebot.boards import is_live, open_port
from boebot.description.robots import load_robot
from boebot.devices.uart import Uart
from boebot.errors import BoardError, CallError
from boebot.image.program import read_program
from sim_bridge.bench.bench import Bench
from sim_bridge.bench.measured import Measurement
from sim_bridge.bench.serial import Line, Serial
from sim_bridge.bench.waiting import Cannot
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import avr_image

if TYPE_CHECKING:
    from boebot.boards import TruthNow
    from sim_bridge.sim import SimRobot

AVR, NATIVE = "avr", "native"
UCSR0B, RXEN0 = 0xC1, 0x10  # of the data space: the receiver is on (ATmega328P data sheet 20.11.3)
START_S = 2.0  # from a real board's reset to its program, at most: boot loaders wait for 1.4 s and less
ALLOWANCE_S = 0.1  # of a wait on a port: USB, and a computer that has more to do (chosen)
LONGEST_S = 86_400.0
BOARD_GUARD_CYCLES = 64  # that what comes to a board is ahead of it (boards/board.h)


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What a test asks for.

    Attributes:
        image: the program, an ELF or HEX file; None: the kit's firmware for the robot.
        robot, arena: what is around the board; no robot: nothing is.
        seed, noise: of that world.
        baud: of this end of the serial line; None: always the board's own rate, at a port the robot's.
        motors: whether the program may turn motors, of which those of a real robot are kept still.
    """

    image: Path | None = None
    robot: str | None = None
    arena: str = "empty"
    seed: int = 1
    noise: bool = False
    baud: int | None = None
    motors: bool = True


class Uno:
    """One board under test.

    Attributes:
        serial: its serial line.
        measured: what `measure` was told, oldest first.
    """

    def __init__(self, on: str, wanted: Wanted, line: Line, bench: Bench | None) -> None:
        """`bench`: None of a board behind a port."""
        self._on, self._wanted, self._bench_or_none = on, wanted, bench
        self.serial = Serial(line)
        self.measured: list[Measurement] = []

    def bench(self, what: str) -> Bench:
        """The bench that the board is on.

        Raises:
            Cannot: the board is behind a port, where nobody reaches `what`.
        """
        if self._bench_or_none is None:
            raise Cannot(f"a test cannot reach the {what} of a board at a port")
        return self._bench_or_none

    def _memory(self, what: str) -> Bench:
        bench = self.bench(what)
        if self._on != AVR:
            raise Cannot(f"the {self._on} board has no {what}: its program is this computer's")
        return bench

    # ---- time --------------------------------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Since power-on (s); of a board behind a port since it was opened."""
        return self.serial.now()

    def run(self, seconds: float) -> None:
        """Lets time pass."""
        seconds = number("run: the time", seconds, CallError, least=0, most=LONGEST_S)
        self.serial.listen(seconds)
        self.serial.line.waited_for(self.serial.line.transport.now())

    def reset(self, cause: str = "external") -> None:
        """Resets the microcontroller: power, external, brown_out or watchdog."""
        self.bench("reset line").pins.reset(cause)

    # ---- what is at the board ----------------------------------------------------------------------------------------

    @property
    def robot(self) -> SimRobot:
        """The robot around the board: `place`, `set_part`, `readings`, `texts`.

        Raises:
            CallError: the test has none.
        """
        return self._in_world("robot").robot

    @property
    def world(self) -> TruthNow:
        """What really is, now: the robot's `pose` (m, m, rad), its `contacts` so far, the arena's moving `shapes`."""
        return self._in_world("world").robot.truth_now()

    def _in_world(self, what: str) -> Bench:
        bench = self.bench(what)
        if self._wanted.robot is None:
            raise CallError(f"uno.{what}: the board is on no robot; expected one in the mark: robot='shieldbot'")
        return bench

    # ---- what was measured -------------------------------------------------------------------------------------------

    def measure(
        self,
        name: str,
        value: float,
        unit: str = "",
        *,
        low: float | None = None,
        high: float | None = None,
        marginal: float = 0.0,
    ) -> None:
        """Notes a value for the report. Outside of its limits the test fails when it has ended; nearer than `marginal`
        to one, it passes and is shown."""
        self.measured.append(Measurement.of(name, value, unit, low, high, marginal))

    def save_pins(self, path: Path) -> bool:
        """Writes what all pins did so far, for viewers of logic signals; False: of this board that is not known."""
        if self._bench_or_none is None:
            return False
        from boebot.record.record import Record
        from boebot.view import vcd

        bench = self._bench_or_none
        record, what = Record.of(bench.streams()), str(self._wanted.image or self._wanted.robot)
        vcd.write_boards([(bench.robot.description, record)], what, path)
        return True

    # ---- its end -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Gives board and world, or the port, back. May be called twice."""
        if self._bench_or_none is not None:
            self._bench_or_none.close()
        else:
            self.serial.line.transport.close()

    def __enter__(self) -> Uno:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class BenchLine:
    """The serial line of a board on a bench, as a transport."""

    name, realtime = "bench", False

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What comes in that time."""
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """The same, byte by byte with the end of its stop bit (s)."""
        del quiet_s
        self._bench.run_until(self._bench.now + round(wait_s * CLOCK_HZ))
        data, cycles = self._bench.received()
        return [(cycle / CLOCK_HZ, bytes([byte])) for cycle, byte in zip(cycles, data, strict=True)]

    def write(self, data: bytes) -> None:
        """Sends bytes from now on."""
        self._bench.send(data, self._bench.now + BOARD_GUARD_CYCLES)

    def now(self) -> float:
        """Since power-on (s)."""
        return self._bench.now / CLOCK_HZ

    def close(self) -> None:
        """It ends with its bench."""


# ---- opening ---------------------------------------------------------------------------------------------------------


def open_uno(on: str, wanted: Wanted, *, flash: bool = False, motors: bool = False) -> Uno:
    """A board, powered on: `on` is avr, native or a port.

    Args:
        flash: the program may be written into a board at a port; else it has to be there already.
        motors: those of a board at a port may turn.

    Raises:
        Cannot: that kind of board cannot run the image.
        BoebotError: in one sentence: the image is none, the robot or arena is not there, the port is held.
    """
    if is_live(on):
        if wanted.motors and not motors:
            raise Cannot("the program may turn motors; expected --uno-motors, or motors=False in the mark")
        return _at_port(on, wanted, flash)
    if on not in (AVR, NATIVE):
        raise CallError(f"there is no board {on!r}; expected {AVR}, {NATIVE} or a port such as /dev/ttyACM0")
    if on == NATIVE and wanted.image is not None:
        raise Cannot(f"the native board is the kit's own firmware; it cannot run {wanted.image.name}")
    if wanted.image is None and wanted.robot is None:
        raise CallError("there is nothing to test; expected image= or robot=, or both")
    bench = Bench(
        wanted.image, on=on, robot=wanted.robot, arena=wanted.arena, seed=wanted.seed, noise=wanted.noise
    )  # fmt: skip
    if wanted.baud is not None:
        bench.robot.line_rate(wanted.baud)
    elif on == AVR:
        bench.robot.follow_line()
    line = Line(BenchLine(bench), waited_for=_marks(bench))
    if on == AVR:
        line.is_heard = lambda: bool(bench.pins.read_memory(UCSR0B, 1)[0] & RXEN0)
        line.not_heard = "the program has not switched its receiver on (Serial.begin)"
    return Uno(on, wanted, line, bench)


def _marks(bench: Bench) -> Callable[[float], None]:
    def mark(at_s: float) -> None:
        bench.mark = round(at_s * CLOCK_HZ)

    return mark


_holds: dict[str, bytes] = {}
"""The flash of each board behind a port, as this process has seen or written it."""


def _at_port(url: str, wanted: Wanted, may_flash: bool) -> Uno:
    """A board behind a port, which opening has reset where the port can."""
    robot = None if wanted.robot is None else load_robot(wanted.robot)
    uart = None if robot is None else robot.device.get("uart")
    baud = uart.baud if wanted.baud is None and isinstance(uart, Uart) else wanted.baud
    if baud is None:
        raise CallError(f"{url} does not know the program's bit rate; expected it in the mark: baud=9600")
    image = wanted.image or avr_image(robot.pin_map if robot else "")
    flash = read_program(image).flash
    if _holds.get(url) != flash:
        if may_flash:
            flashing.write(flash, url)
        elif not flashing.holds(flash, url):
            raise BoardError(f"the board at {url} has another program than {image.name}; expected it, or --uno-flash")
        _holds[url] = flash
    transport = open_port(url, baud)
    opened_s = transport.now()
    line = Line(transport, allowance_s=ALLOWANCE_S)
    uno = Uno(url, wanted, line, None)
    line.is_heard = lambda: bool(uno.serial.heard) or transport.now() > opened_s + START_S
    return uno
