"""What every kind of device has: keys in robot files, pins, a reading, columns in the record, a drawing.

A kind is one class in a file of this folder; a robot's description names its devices and gives each a kind by `type`.
Everything else follows: `robot.<name>`, the keys that a file may have and their checks, run.csv, pictures. Two kinds
may stand for one device, on a board with pins and in a robot without a board by the notes' model; a brain reads both
alike.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, NamedTuple, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot import slips
from boebot.devices.drawing import spot
from boebot.devices.latest import NEVER, Latest, fresh_ticks
from boebot.link.messages import DevicesTelemetry

if TYPE_CHECKING:
    from boebot.devices.drawing import Item, Sweeps

LARGEST = 1e12  # of any number of a robot without a board: products of some of them stay finite
Positive = Annotated[float, msgspec.Meta(gt=0, le=LARGEST)]
NotNegative = Annotated[float, msgspec.Meta(ge=0, le=LARGEST)]
Finite = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST)]
Angle = Annotated[float, msgspec.Meta(ge=-1e4, le=1e4)]
Opening = Annotated[float, msgspec.Meta(ge=0, le=math.pi)]
BeamRays = Annotated[int, msgspec.Meta(ge=1, le=32)]
Share = Annotated[float, msgspec.Meta(gt=0, le=1)]
Point = tuple[Finite, Finite]

ANALOG_PINS = tuple(range(14, 20))

FIVE_VOLTS: Final = "5 V"
GROUND: Final = "ground"
PACK: Final = "pack +"
SERVO_POWER: Final = "servo power"  # 5 V, or the pack's plus: by the robot's supply

BREADBOARD: Final = "breadboard"
SERVO_PORTS: Final = range(10, 14)  # pins that the Board of Education Shield has three-pin sockets for


class Wire(NamedTuple):
    """One wire between a board and a device."""

    pin: str
    """Where it begins: the key of a pin in the robot's file, such as "led_pin", or one of the supplies above."""
    to: str
    """The terminal of the device where it ends."""
    colour: str = ""
    """In the device's own cable; empty: the wire is yours, and so is its colour."""
    part: str = ""
    """What is in it, such as "220 Ω"; empty: nothing."""


Reader = Callable[[Any, Any], Any]
"""Makes a reading of an observation's `sample` and `slow`."""


def pin_number(pin: int | str) -> int:
    """The Arduino number 0..19 of a pin written as 0..13 or "A0".."A5".

    Raises:
        ValueError: there is no such pin.
    """
    if isinstance(pin, str) and len(pin) == 2 and pin[0] == "A" and pin[1] in "012345":
        return 14 + int(pin[1])
    if isinstance(pin, int) and not isinstance(pin, bool) and 0 <= pin <= 13:
        return pin
    raise ValueError(f"there is no pin {pin!r}; expected 0..13 or 'A0'..'A5'")


def pin_name(number: int) -> str:
    """How the board's print names pin `number`: "0".."13", "A0".."A5"."""
    return str(number) if number < 14 else f"A{number - 14}"


class Place(NamedTuple):
    """Where a device is: what its reader needs to know besides its own keys."""

    name: str
    """Of the device, in the robot's description."""
    devices: Mapping[str, Device]
    """All of the robot."""
    wheel_radius_m: float
    """m"""
    tick_s: float
    """s, the control tick of the board, or the time step of a robot without one."""
    message_ticks: int
    """Ticks from one message of the board's slow devices to the next."""
    where: slice
    """Where its readings stand among those of a robot without a board."""


class Column(NamedTuple):
    """One column of run.csv; its heading is the device's name, `name` and `unit`."""

    name: str
    """Of the field of the reading, as a brain reads it."""
    unit: str
    """As in headings: "m", "rad"."""
    values: NDArray[Any]
    """One entry per tick."""
    digits: int | None
    """None: whole numbers."""


class Readout(NamedTuple):
    """What one device said over time, for people to read: one entry per tick; NaN: nothing, or not known yet."""

    device: str
    """Its name."""
    unit: str
    """As people write it: "ms", "°"."""
    digits: int
    """After the point."""
    values: NDArray[np.float64]
    """in that unit"""
    ages: NDArray[np.float64]
    """s"""


class Checkup(NamedTuple):
    """How a device's readings compare with what they should be while the robot stands still, for `boebot doctor`."""

    reads: str
    """In words, with units."""
    expected: str
    """What they should be, in the same words."""
    hint: str = ""
    """What may be wrong, and what to look at; empty: the readings are as expected."""


class FaultKind(NamedTuple):
    """A way in which a simulated device can fail, as `boebot run --fault NAME[=VALUE]@START[..END]` has it."""

    does: str
    """What happens then, in a few words, as in "the contact is stuck"."""
    unit: str = ""
    """Of VALUE: "s", "us", "Hz", "V"; empty: a share or a number."""
    default: float | None = None
    """VALUE where none is said; None, and no `words`: it takes none."""
    least: float = 0.0
    """VALUE at least."""
    most: float = 1.0
    """And at most."""
    words: tuple[str, ...] = ()
    """VALUE by name, the first one the default; the simulator gets its index."""
    when: Literal["a span", "until END", "once"] = "a span"
    """From START to END, or to the end of the run; where it needs an END; or at START alone."""
    harmless: float | None = None
    """VALUE that changes nothing, if there is one."""


class Run(Protocol):
    """A run after its end, as devices make their columns of it (`boebot.record`)."""

    raw: NDArray[np.void]
    """A board's telemetry: a structured array of the message's fields, one entry per tick. Of a robot without a board
    its readings, in the column "values"."""

    def held(self, kind: type) -> Held:
        """A board's other messages of that kind."""

    def values(self, device: str) -> NDArray[np.float64]:
        """Readings of a device of a robot without a board, shape (ticks, readings of the device)."""

    def ages(self, device: str) -> NDArray[np.float64]:
        """Their ages (s); 0: of the tick itself."""


class Held(NamedTuple):
    """Messages of one kind, each of which holds until the next has come."""

    messages: list[Any]
    """Oldest first."""
    newest: NDArray[np.intp]
    """For each tick of telemetry the index of the newest message then; -1: none."""
    since_s: NDArray[np.float64]
    """Seconds since that; NaN: none."""


class Device(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True, tag_field="type"):
    """What every kind of device has. `on = false` reserves its pins and leaves it switched off; `plugged = false`: of a
    simulated robot's board it is switched on, but its plug is out."""

    on: bool = True
    plugged: bool = True

    READING: ClassVar[type | None] = None  # of what a brain reads; None: a brain does not meet it
    GROUP: ClassVar[str] = ""  # name of all devices of its kind together, in a brain's NEEDS
    NAMES: ClassVar[tuple[str, ...]] = ()  # its usual ones; the only ones that the kit's firmware knows
    PINS: ClassVar[dict[str, str]] = {}  # key of the pin -> role in the firmware's names ("" = the device itself)
    NEEDS: ClassVar[dict[str, str]] = {}  # unit of the chip -> who may share it ("" = nobody)
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {}  # key of the pin -> the pins that the kit's firmware can use
    CHIP_PINS: ClassVar[dict[str, tuple[int, ...]]] = {}  # and those that any program can, such as analog inputs
    HEARS: ClassVar[frozenset[str]] = frozenset()  # keys of pins that it only listens at: others may be there, too
    WIRES: ClassVar[tuple[Wire, ...]] = ()  # of a board's device: between board and device
    CONNECTOR: ClassVar[str] = BREADBOARD  # where they are plugged in
    COLUMNS: ClassVar[tuple[tuple[str, str, int | None], ...]] = ()
    """Field of the reading, unit and digits of its column in run.csv."""
    SHOWN: ClassVar[tuple[str, str, float, int] | None] = None
    """What pages show of it as a number: name of the column, unit, factor, digits."""
    SIGN: ClassVar[tuple[str, str] | None] = None
    """What pages show of it as a lamp and a lane: name of the column that is true or false, and its colour."""

    CONTROL: ClassVar[Literal["", "button", "switch", "slider"]] = ""
    """How a person works it, and a page offers that; a slider from 0 to 1, the others 0 or 1."""

    FAULTS: ClassVar[Mapping[str, FaultKind]] = {}
    """How it can fail where it is simulated, by name."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if cls.READING is not None:
            slips.has_no_truth(cls.READING)

    def fault(self) -> tuple[str, str] | None:
        """A key that does not fit the others, and the rest of the sentence about it; None: all fit."""
        return None

    def pins(self) -> dict[str, int]:
        """Role of each pin ("" for a device with one pin) and its Arduino number; without those that it leaves out."""
        there = {role: getattr(self, key) for key, role in self.PINS.items()}
        return {role: pin_number(pin) for role, pin in there.items() if pin is not None}

    def wires(self) -> tuple[Wire, ...]:
        """Its wires; none without a board."""
        return self.WIRES

    @property
    def connector(self) -> str:
        """Where its wires are plugged in on the board."""
        return self.CONNECTOR

    def reader(self, place: Place) -> Reader:
        """What makes its reading; for kinds that have one."""
        raise NotImplementedError

    def checkup(self, readings: Sequence[Any]) -> Checkup:
        """Judges the readings of about a second, oldest first and at least one, of a robot that stands still; for kinds
        that a board has and a brain reads. That the newest is not valid is for the caller to judge."""
        raise NotImplementedError

    @property
    def wired_to(self) -> str:
        """Its pins in words, as the board's print names them: "pin 5", "pins A4 and A5"."""
        pins = [pin_name(number) for number in self.pins().values()]
        return f"pin {pins[0]}" if len(pins) == 1 else f"pins {' and '.join(pins)}"

    def has_messages(self, devices: Mapping[str, Device]) -> bool:
        """Whether it speaks in messages besides telemetry, among these devices of its robot's board."""
        return False

    def columns(self, place: Place, run: Run) -> list[Column]:
        """Its columns of run.csv: one per entry of COLUMNS, each of which is one reading of the device, unless its kind
        says more."""
        values = run.values(place.name)
        return [Column(field, unit, values[:, i], digits) for i, (field, unit, digits) in enumerate(self.COLUMNS)]

    def readout(self, place: Place, run: Run, columns: Mapping[str, Column]) -> Readout | None:
        """What pages show of it as a number."""
        if self.SHOWN is None:
            return None
        name, unit, factor, digits = self.SHOWN
        ages = columns["age"].values if "age" in columns else run.ages(place.name)
        return Readout(place.name, unit, digits, columns[name].values * factor, ages)

    def sign(self) -> tuple[str, str] | None:
        """`SIGN`, of this one."""
        return self.SIGN

    def drawing(self, name: str) -> list[Item]:
        """What it looks like from above, in the robot's frame: where it sits, and which way it looks, unless its kind
        says more. `name`: of the device."""
        position, heading = getattr(self, "position_m", None), getattr(self, "heading_rad", None)
        return [] if position is None else spot(position, heading)

    def sweeps(self, place: Place, run: Run) -> Sweeps | None:
        """The area that it measured, at each tick; None: it measures none."""
        return None


class AnyServo(Device, frozen=True, kw_only=True):
    """What servos of both kinds share: the cable, and the timer that makes their pulses."""

    pin: int | str

    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    HEARS: ClassVar[frozenset[str]] = frozenset({"pin"})
    WIRES: ClassVar[tuple[Wire, ...]] = (
        Wire("pin", "signal", "white"),
        Wire(SERVO_POWER, "power", "red"),
        Wire(GROUND, "ground", "black"),
    )
    NEEDS: ClassVar[dict[str, str]] = {"Timer1 compare A": "servo edges"}
    ONLY_PINS: ClassVar[dict[str, tuple[int, ...]]] = {"pin": (8, 9, 10, 11, 12, 13)}
    DOES: ClassVar[str]  # what it does by pulses, for people

    @property
    def connector(self) -> str:
        """See `Device`."""
        (pin,) = self.pins().values()
        return f"servo port {pin}" if pin in SERVO_PORTS else "three-pin header"

    def checkup(self, readings: Sequence[Any]) -> Checkup:
        """See `Device`."""
        expected = f"no pulses, as nothing {self.DOES}"
        if readings[-1].pulse_us is None:
            return Checkup("no pulses", expected)
        return Checkup(f"{readings[-1].pulse_us:.0f} µs", expected, f"something {self.DOES}: the board's own brain?")


class SlowDevice(Device, frozen=True, kw_only=True):
    """A device of a board whose readings come in a message besides telemetry."""

    MESSAGE: ClassVar[type] = DevicesTelemetry
    AGE: ClassVar[str] = ""  # field of the message: ticks since the device was read; empty: as old as the message
    PERIOD_TICKS: ClassVar[int] = 1  # from one reading to the next

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        fresh, name, tick_s = fresh_ticks(self.PERIOD_TICKS, place.message_ticks), place.name, place.tick_s

        def read(_: object, slow: Latest) -> Any:
            message, since = slow.of(self.MESSAGE)
            before = getattr(message, self.AGE) if self.AGE else 0
            if before >= NEVER:
                return self.reading(message, name, math.inf, False)
            return self.reading(message, name, (before + since) * tick_s, before + since <= fresh)

        return read

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Any:
        """The reading of the device of that name in a message: so old (s; infinite: never read), and whether that is
        young enough."""
        raise NotImplementedError

    def has_messages(self, devices: Mapping[str, Device]) -> bool:
        """It does."""
        return True

    def columns(self, place: Place, run: Run) -> list[Column]:
        """One per entry of COLUMNS, and the age."""
        if "values" in (run.raw.dtype.names or ()):  # of a program's run: what its part shows of itself
            return super().columns(place, run)
        held = run.held(self.MESSAGE)
        reader = self.reader(place)
        readings = [reader(None, Latest({self.MESSAGE: message}, message.tick)) for message in held.messages]

        def array(values: list[float | None]) -> NDArray[np.float64]:
            found = np.array([*values, None], dtype=np.float64)  # None becomes NaN
            found[np.isinf(found)] = np.nan  # never measured
            return found[held.newest]

        found = [
            Column(field, unit, array([getattr(reading, field) for reading in readings]), digits)
            for field, unit, digits in self.COLUMNS
        ]
        return [*found, Column("age", "s", array([reading.age for reading in readings]) + held.since_s, 3)]


class VehicleDevice(Device, frozen=True, kw_only=True):
    """A device of a robot without a board: no pins. `on = false` leaves it out."""

    def reader(self, place: Place) -> Reader:
        """See `Device`."""
        where, first = place.where, place.where.start
        return lambda sample, _: self.reading(sample.values[where], sample.ages[first])

    def reading(self, values: Sequence[float], age: float) -> Any:
        """Its reading by its values among the robot's readings, so old (s)."""
        raise NotImplementedError


class Sensor(VehicleDevice, frozen=True, kw_only=True):
    """What every sensor of a robot without a board has: between two samples the last one stands, with its age (rule S4
    of section 1.3)."""

    period_s: NotNegative = 0.0  # 0: every step
    reading_s: NotNegative = 0.0
    """what a reading takes the robot's hardware; sensors without a `period_s` are read one after another in each step,
    and with the brain's step they have to fit into it (section 3.2); 0: no time is said"""


@cache
def kinds() -> tuple[type[Device], ...]:
    """All kinds of devices: the tagged classes in the files of this folder."""
    package = importlib.import_module(__package__)
    modules = [importlib.import_module(f"{__package__}.{file.name}") for file in pkgutil.iter_modules(package.__path__)]
    return tuple(
        one
        for module in modules
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, Device) and one.__module__ == module.__name__ and _is_tagged(one)
    )


def _is_tagged(kind: type[Device]) -> bool:
    """What kinds share is in classes that say no tag: theirs is the name of the class."""
    return kind.__struct_config__.tag != kind.__name__
