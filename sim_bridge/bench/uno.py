"""An Uno as a test has it: its pins, its serial line, what lies in it, what is around it, and what was measured; on the
emulated board, or, as far as that goes, on a board behind a port.

The plugin gives it as the fixture `uno` (plugin.py). Without pytest: `with open_uno("avr", Wanted(image=path)) as uno`.
Times are the board's (s), and a wait is over when what it waits for has happened, however the run is cut.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot import flashing
from boebot.arguments import number, shown, whole
from boebot.boards import is_live, open_port
from boebot.description.robots import load_robot
from boebot.errors import BoardError, BoebotError, CallError
from boebot.image.program import read_program
from boebot.link.bad_line import BadLine
from boebot.record.blocks import merged
from boebot.record.record import Record
from boebot.running.faults import AT_A_PORT, OWNERS, inject, read, unfired
from boebot.running.program_driver import append_parts
from boebot.showing import Showing
from sim_bridge.bench.bench import BARE, Bench
from sim_bridge.bench.buses import I2c, Spi
from sim_bridge.bench.measured import Measurement
from sim_bridge.bench.pins import Pin
from sim_bridge.bench.serial import Line, Serial
from sim_bridge.bench.waiting import LONGEST_S, Cannot
from sim_bridge.boards.avr import AvrBoard
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import avr_image
from sim_bridge.pins import RXEN0

if TYPE_CHECKING:
    from boebot.boards import TruthNow
    from sim_bridge.bench.cycles import Cycles, FunctionCycles
    from sim_bridge.bench.symbols import Symbol
    from sim_bridge.sim import SimRobot

AVR, NATIVE = "avr", "native"
Limit = float | None
STACK_POINTER, RAM_END = 0x5D, 0x8FF  # of the data space; nothing has been called (ATmega328P data sheet 7.5)
START_S = 2.0  # from a real board's reset to its program, at most: boot loaders wait for 1.4 s and less
ALLOWANCE_S = 0.1  # of a wait on a port: USB, and a computer that has more to do (chosen)
TICK_S, TICK_CYCLES = 0.01, 160_000  # of the record
ROUNDING_S = 1e-6  # of a time that somebody has printed
CHANNELS = [f"A{channel}" for channel in range(6)]


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What a test asks for.

    Attributes:
        image: the program, an ELF or HEX file; None: the kit's firmware for the robot.
        robot, arena: what is around the board; no robot: nothing is.
        seed, noise: of that world.
        baud: of this end of the serial line; None: always the board's own rate, at a port the robot's.
        motors: whether the program may turn motors, of which those of a real robot are kept still.
        cycles: functions of the program whose calls are measured. faults: what fails, as `Uno.fault` has it.
        cover: which instructions are executed is kept.
    """

    image: Path | None = None
    robot: str | None = None
    arena: str = "empty"
    seed: int = 1
    noise: bool = False
    baud: int | None = None
    motors: bool = True
    cycles: Sequence[str] = ()
    faults: Sequence[str] = ()
    cover: bool = False


class Uno:
    """One board under test.

    Attributes:
        serial: its serial line.
        measured: what `measure` was told, oldest first.
        recorded: cycles of the functions that the mark names; None: of none.
    """

    def __init__(self, on: str, wanted: Wanted, line: Line, bench: Bench | None) -> None:
        """`bench`: None of a board behind a port."""
        self._on, self._wanted, self._bench_or_none = on, wanted, bench
        self.serial = Serial(line)
        self.measured: list[Measurement] = []
        self._pins: dict[int | str, Pin] = {}
        self._robot = load_robot(wanted.robot or "shieldbot") if bench is None else bench.robot.description
        self._fired: dict[str, Callable[[], int]] = {}
        self._record, self._showing = Record(), Showing()
        self._showing.is_kept = True
        if bench is not None:
            bench.forget = self.serial.forget
        if bench is not None and wanted.robot is not None:
            bench.at(TICK_CYCLES, self._put_aside)
        self.recorded: Cycles | None = None

    def __repr__(self) -> str:
        image = self._wanted.image.name if self._wanted.image else self._wanted.robot
        return f"<Uno: {image} on {self._on}, {self.now:.6f} s>"

    def begin(self) -> None:
        """Before time passes: what is to fail and to be recorded. Raises as `open_uno`."""
        wanted = self._wanted
        for fault in wanted.faults:
            self.fault(fault)
        if wanted.cycles:
            from sim_bridge.bench.cycles import Cycles

            self.recorded = Cycles(self.avr("cycles"), self.elf(), wanted.cycles)
        if wanted.cover and self._on == AVR:
            self.avr("coverage").cover()

    def bench(self, what: str) -> Bench:
        """The bench that the board is on.

        Raises:
            Cannot: the board is behind a port, where nobody reaches `what`.
        """
        if self._bench_or_none is None:
            raise Cannot(f"a test cannot reach the {what} of a board at a port")
        return self._bench_or_none

    def avr(self, what: str) -> AvrBoard:
        """The emulated ATmega328P. Raises Cannot where the board is another, of which `what` is not known."""
        board = self.bench(what).robot.board
        if not isinstance(board, AvrBoard):
            raise Cannot(f"the {self._on} board shows no {what}: its program is one of this computer")
        return board

    def elf(self) -> Path:
        """The file that says what lies where in the program. Raises CallError: it is a HEX file, which does not."""
        if (elf := self.avr("symbols").elf) is None:
            name = self._wanted.image.name if self._wanted.image else "the program"
            raise CallError(f"{name} has no symbols; expected the ELF file that it was made from")
        return elf

    # ---- time --------------------------------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Since power-on (s); of a board behind a port since it was opened."""
        return self.serial.now()

    def run(self, seconds: float) -> None:
        """Lets time pass."""
        seconds = number("run: the time", seconds, CallError, least=0, most=LONGEST_S)
        self.serial.listen(seconds)
        self.serial.line.mark(self.serial.line.transport.now())

    def reset(self, cause: str = "external") -> None:
        """Resets the microcontroller: power, external, brown_out or watchdog. What it has said before is no answer."""
        self.bench("reset line").pins.reset(cause)
        self.bench("reset line").acted()

    # ---- what is at the board ----------------------------------------------------------------------------------------

    def pin(self, pin: int | str) -> Pin:
        """A pin, by its name on the board's print: 0..13, "A0".."A5"; driven, looked at and waited for (pins.py).

        Raises:
            CallError: there is no such pin.
            Cannot: the board is behind a port.
        """
        return self._pins.setdefault(pin, Pin(self.bench("pins"), pin))

    def analog(self, channel: int | str) -> Analog:
        """An analog input, 0..5 or "A0".."A5": `uno.analog(0).set(2.5)`, in volts."""
        channel = CHANNELS.index(channel) if channel in CHANNELS else channel
        return Analog(self.bench("analog inputs"), whole("analog: the channel", channel, CallError, least=0, most=5))

    @cached_property
    def i2c(self) -> I2c:
        """The two-wire bus, for devices in Python (buses.py)."""
        self.avr("I2C bus")
        return I2c(self.bench("I2C bus").robot)

    @cached_property
    def spi(self) -> Spi:
        """The SPI, likewise."""
        self.avr("SPI")
        return Spi(self.bench("SPI").robot)

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

    # ---- what is in the program --------------------------------------------------------------------------------------

    def symbol(self, name: str) -> Symbol:
        """A variable of the program: `.value`, read or set, `[index]` of an array; a structure is its bytes.

        Raises:
            CallError: the image has no symbols. AnalysisError: it has no such variable.
        """
        from boebot.image.data import read_variables
        from sim_bridge.bench.symbols import Symbol

        return Symbol(self.bench("memory").pins, read_variables(self.elf()).find(str(name)), self._before_set)

    def _before_set(self, name: str) -> None:
        """Raises CallError where the program has not come to main, before which all variables get their values."""
        bench = self.bench("memory")
        stack = int.from_bytes(bench.pins.read_memory(STACK_POINTER, 2), "little")
        if stack == RAM_END or bench.pins.cycle == bench.pins.reset_cycle:
            raise CallError(
                f"{name} is set before the program begins, which gives it its first value then; expected a wait for "
                "what the program does, or uno.run(0.01)"
            )
        bench.acted()

    def cycles(self, function: str) -> FunctionCycles:
        """What calls of a function took so far: `.shortest`, `.longest`, and the `.bound` where there is one.

        Raises:
            CallError: the mark does not name it. BoardError: no call of it has ended.
        """
        self.avr("cycles")
        if self.recorded is None:
            raise CallError(f"cycles of {function} are not recorded; expected cycles=({function!r},) in the mark")
        return self.recorded[function]

    # ---- what fails --------------------------------------------------------------------------------------------------

    def fault(self, what: str) -> None:
        """Lets something fail, in words as of `boebot run --fault`: NAME[=VALUE]@START[..END], by the board's time.

        Raises:
            CallError: there is no such fault here.
            Cannot: the board is behind a port, where only the line and the host can fail.
        """
        if not isinstance(what, str):
            raise CallError(f"fault: got {shown(what)}; expected a text, as 'board.reset@20ms'")
        owner = what.partition(".")[0]
        if owner == "host":
            raise CallError(f"fault {what!r}: the host is the test itself; expected its line's, as 'cable.out@1s..2s'")
        if self._robot.name == BARE and owner not in OWNERS:
            raise CallError(f"fault {what!r}: the board is on no robot; expected one in the mark: robot='shieldbot'")
        fault = read(what, self._robot)
        if fault.begin_s < self.now - ROUNDING_S - self.serial.line.allowance_s:
            raise CallError(f"fault {fault} is past: it is {self.now:g} s; expected a later START")
        bench = self._bench_or_none if fault.name in AT_A_PORT else self.bench("parts")
        session: Any = bench and bench.session
        self._fired[str(fault)] = inject(fault, self._robot, session, self._bad_line, self.serial.opened_s)
        if bench is not None:
            if owner == "board":
                bench.at(round(fault.begin_s * CLOCK_HZ), bench.acted)
            bench.acted()
            bench.session.sim.do_due()  # what begins now

    def _bad_line(self) -> BadLine:
        self.serial.line.transport = line = BadLine.around(self.serial.line.transport, self._wanted.seed)
        return line

    def unfired(self) -> str:
        """In sentences: those that changed nothing so far, and pins that program and test drive against each other."""
        said = [str(unfired({name: fired() for name, fired in self._fired.items()}) or "")]
        return "\n".join(filter(None, [*said, *(pin.take() for pin in self._pins.values())]))

    # ---- what was measured -------------------------------------------------------------------------------------------

    def measure(
        self, name: str, value: float, unit: str = "", *, low: Limit = None, high: Limit = None, marginal: float = 0.0
    ) -> None:
        """Notes a value for the report. Outside of its limits the test fails when it has ended; nearer than `marginal`
        to one, it passes and is shown."""
        self.measured.append(Measurement.of(name, value, unit, low, high, marginal))

    def save_pins(self, path: Path) -> None:
        """Writes what all pins did so far, for viewers of logic signals; nothing of a board at a port."""
        if (bench := self._bench_or_none) is None:
            return
        from boebot.view import vcd

        record, what = Record.of(bench.streams()), str(self._wanted.image or self._wanted.robot)
        vcd.write_boards([(bench.robot.description, record)], what, path)

    def _put_aside(self) -> None:
        """What the robot's parts show, every 10 ms."""
        bench = self.bench("robot")
        tick = bench.now // TICK_CYCLES
        append_parts(self._record, self._showing, bench.session, bench.now / CLOCK_HZ, tick)
        bench.at((tick + 1) * TICK_CYCLES, self._put_aside)

    def save_record(self, folder: Path) -> None:
        """Writes the record of the test as that of a run, for `boebot report`, where there is a robot."""
        if self._bench_or_none is None or self._wanted.robot is None:
            return
        from boebot.record.recording import Recording
        from boebot.record.run import Run
        from boebot.record.run_folder import RunFolder

        bench, image = self._bench_or_none, self._wanted.image
        recording = Recording(1)
        (record,) = recording.records
        self._showing.end()
        for row in self._showing.take():
            self._record.append(*row)
        record.put(merged([*self._record.groups(), bench.streams(), bench.robot.drain()]))
        for time_s, byte in self.serial.stamped():
            record.append("to_host", time_s, byte)
        run = Run(
            brain=image.name if image else "the kit's firmware",
            robot=self._robot,
            board=self._on,
            description=bench.session.description,
            arena=bench.session.arena.name,
            seed=self._wanted.seed,
            period=TICK_S,
            tick=TICK_S,
            record=record,
            world=bench.session.arena,
            run_time=self.now,
            layout=bench.session.layout,
            program=hashlib.sha256(file.read_bytes()).hexdigest() if (file := image or bench.board.elf) else None,
        )
        with RunFolder(folder) as run_folder:
            recording.begin(run_folder, [run], {}, {}, waits=True)
            record.keep(self.now)
            if (error := recording.end([run])) is not None:
                raise error

    # ---- its end -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Gives board and world, or the port, back. May be called twice."""
        (self._bench_or_none or self.serial.line.transport).close()

    def __enter__(self) -> Uno:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass(frozen=True)
class Analog:
    """The analog input of that number."""

    bench: Bench
    channel: int

    def set(self, volts: float) -> None:
        """The voltage there from now on."""
        self.bench.pins.analog(self.channel, volts)
        self.bench.acted()


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
    if is_live(on) and wanted.motors and not motors:
        raise Cannot("the program may turn motors; expected --uno-motors, or motors=False in the mark")
    uno = _at_port(on, wanted, flash) if is_live(on) else _on_bench(on, wanted)
    try:
        uno.begin()
    except BoebotError:
        uno.close()
        raise
    return uno


def _on_bench(on: str, wanted: Wanted) -> Uno:
    if on == NATIVE and wanted.image is not None:
        raise Cannot(f"the native board is the kit's own firmware; it cannot run {wanted.image.name}")
    if wanted.image is None and wanted.robot is None:
        raise CallError("there is nothing to test; expected image= or robot= in @pytest.mark.uno(...), or both")
    around: dict[str, Any] = {"robot": wanted.robot, "arena": wanted.arena, "seed": wanted.seed, "noise": wanted.noise}
    bench = Bench(wanted.image, on=on, **around)
    transport = bench.session.transport
    if wanted.baud is not None:
        try:
            transport.set_baud(wanted.baud)
        except BoebotError:
            bench.close()
            raise
    elif on == AVR:
        transport.follow()

    def mark(at_s: float) -> None:
        bench.mark = round(at_s * CLOCK_HZ)

    def rates() -> str:
        if wanted.baud is None or on != AVR:
            return ""
        rate = CLOCK_HZ / bench.pins.bit_cycles()
        return f"; the program's rate is {rate:.0f} bit/s, the mark says baud={wanted.baud}"

    not_heard = "the program has not switched its receiver on (Serial.begin)"
    return Uno(on, wanted, Line(transport, lambda: bench.pins.uses_line(RXEN0), not_heard, rates, mark), bench)


_holds: dict[str, bytes] = {}
"""The flash of each board behind a port, as this process has seen or written it."""


def _at_port(url: str, wanted: Wanted, flash: bool) -> Uno:
    """A board behind a port, which opening has reset where the port can."""
    robot = None if wanted.robot is None else load_robot(wanted.robot)
    baud = robot.baud if wanted.baud is None and robot is not None else wanted.baud
    if baud is None:
        raise CallError(f"{url} does not know the program's bit rate; expected it in the mark: baud=9600")
    if wanted.image is not None or flash:  # the kit's firmware that is there says itself which it is
        image = wanted.image or avr_image(robot.pin_map if robot else "")
        program = read_program(image).flash
        if _holds.get(url) != program:
            if flash:
                flashing.write(program, url)
            elif not flashing.holds(program, url):
                raise BoardError(
                    f"the board at {url} has another program than {image.name}; expected it, or --uno-flash"
                )
            _holds[url] = program
    transport = open_port(url, baud)
    line = Line(transport, starts_s=transport.now() + START_S, allowance_s=ALLOWANCE_S)
    uno = Uno(url, wanted, line, None)
    line.is_heard = lambda: bool(uno.serial.heard) or transport.now() > line.starts_s
    return uno
