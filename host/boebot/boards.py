"""Boards by URL: what the host asks of a board, emulated or real.

One URL names a board: an emulated one by its kind (`avr`, `native`: whatever the entry point group
`boebot.boards` offers), a real or served one by its port (`/dev/ttyACM0`, `COM3`,
`serial:/dev/ttyUSB0?baud=250000&reset=no`, `socket://localhost:5000`, `rfc2217://server:2217?baud=115200`), or by a
scheme of a guest's. The host library knows emulated boards only through the interfaces below; it never
imports the simulator.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol, cast

from boebot.arenas import Arena
from boebot.arenas.floor_plan import FloorPlan
from boebot.errors import BoardError, did_you_mean
from boebot.guests import PORTS, guests
from boebot.link.transport import Transport
from boebot.record.blocks import Group

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from boebot.description.robots import RobotDescription

    Floats = NDArray[np.float64]

BOARDS_GROUP = "boebot.boards"  # kind, or "direct" -> WorldFactory
DIRECT = "direct"  # what a robot without a board runs on
DIRECT_ARENA = "arsim"  # and where, unless somebody says otherwise
DEFAULT_BAUD = 500_000  # of a robot whose description names no serial line
RESET_CAUSES = ("external", "watchdog")  # that a fault can have
SERVERS_GROUP = "boebot.servers"  # any name -> Server


@dataclass(frozen=True, kw_only=True)
class BoardRequest:
    """The request for a board. Real boards heed `robot` only."""

    robot: RobotDescription
    arena: str | None = None  # bundled name or .toml file; None: that of `load_arena`, or DIRECT_ARENA
    seed: int = 1
    realtime: bool = False  # pace simulated time by the wall clock
    pose: tuple[float, float, float] | None = None  # x (m), y (m), heading (rad); None: the arena's own
    image: str | None = None  # firmware to load in place of the bundled one
    bootloader: str | None = None  # file of the boot loader in which an emulated Uno's resets begin
    record: bool = True  # keep the truth for the pictures
    pins: bool = False  # record the edges of an emulated board's pins
    noise: bool = True
    without: Sequence[str] = ()  # imperfections of this robot that are switched off, by name
    imperfections: Mapping[str, float] = field(default_factory=dict)  # magnitudes of others, by name
    notes: bool = False  # also of what a bench does not show (boards/avr/avr_checks.h); emulated ATmega328P only
    strict: bool = False  # the first such note ends the run as a fault
    gdb: int | None = None  # TCP port for avr-gdb at an emulated ATmega328P; 0: any free one
    gdb_waits: bool = True  # the program stands still until a debugger has come


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What really happened, for pictures and figures after a run (boebot.record.truth). No brain ever sees it.

    The series have one row per sample; `time` is on the clock of the session's transport (s).
    """

    time: Floats
    x: Floats  # m
    y: Floats  # m
    heading: Floats  # rad
    contact: NDArray[np.bool_]  # the body touches something
    left_speed: Floats | None = None  # m/s along the ground
    right_speed: Floats | None = None
    plan: FloorPlan = field(default_factory=FloorPlan)  # what stands and moves where it happened


Pose = tuple[float, float, float]  # x (m), y (m), heading (rad)


class TruthNow(NamedTuple):
    """What really is, now; no brain ever sees it. Up to a step of the world ahead of the transport's clock."""

    pose: Pose
    contacts: int
    """touches begun so far"""
    shapes: Sequence[Pose]
    """of the arena's moving shapes"""


@dataclass(frozen=True, kw_only=True)
class WatchdogReset:
    """Where a board's watchdog found the program that it reset."""

    cycle: int
    time_s: float  # on the clock of the session's transport
    address: int  # of the next instruction, in bytes of flash
    place: str  # function and source line, as in "in storage_task (storage.c:57)"; "" where the image does not say them

    def __str__(self) -> str:
        """In the words of a fault."""
        where = f"at address 0x{self.address:04X} in cycle {self.cycle} {self.place}".rstrip()
        return f"the watchdog reset the program, which it found {where}"


class PinNow(NamedTuple):
    """What is at a pin of a board."""

    does: int
    """what the program does to it: 0 low, 1 high, 2 released, 3 pulled up"""
    level: int
    """0 or 1, as it would be read"""
    share: float | None
    """of an output that goes up and down: of the time that it is high"""
    rate: float | None
    """how often it does (Hz)"""
    volts: float | None
    """as the program's converter has last sampled it"""


class Session(Protocol):
    """A robot, opened. `close` gives everything back; nothing else is called after it."""

    @property
    def description(self) -> str:
        """In a few words, such as "emulated ATmega328P"."""

    @property
    def arena(self) -> Arena | None:
        """Where the robot is; None where nobody knows (a real robot)."""

    def drain(self, *, ended: bool = False) -> Group:
        """The streams of a record that only a simulator knows, from where it was last drained (`Truth`); empty where
        nobody knows. `ended`: the run has ended now."""

    def truth_now(self) -> TruthNow | None:
        """What only a simulator knows, as it stands now; None where nobody knows. As all else of a session it is asked
        only while no time passes there."""

    def place(self, x: float, y: float, heading: float) -> None:
        """Lifts a simulated robot and puts it there (m, m, rad), at rest; its motors go on as they are told.

        Neither the board nor its odometry knows of it. Its sensors look from there from the next step of the world on.

        Raises:
            BoebotError: that place is not free, or the robot is real.
        """

    def place_shape(self, index: int, x: float, y: float, heading: float) -> None:
        """Puts a moving shape of the arena there, the first one if `index` is 0; it goes on along its way shifted by as
        much, and turned in itself.

        Raises:
            BoebotError: a robot stands there, or there is no such shape, or the robot is real.
        """

    @property
    def layout(self) -> Mapping[str, slice]:
        """Where the readings of each device stand, by its name in the robot's description."""

    def readings(self) -> tuple[float, ...]:
        """All readings now, in SI units."""

    def set_part(self, device: str, value: float) -> None:
        """Works a device of a simulated robot, from now on: 1 presses a button or closes a switch, 0 lets go of it; a
        knob is turned to a value from 0 to 1.

        Raises:
            BoebotError: the robot has no such device, or it cannot be set so.
        """

    def fault(self, owner: str, kind: str, value: float, begin_s: float, end_s: float) -> Callable[[], int]:
        """What is called `owner` (a device of the robot, or "board", "eeprom", ...) fails in that way (see
        boebot.running.faults) from `begin_s` to `end_s` on the clock of the session's transport (infinite: for good).
        Returns what says how often that has changed something so far.

        Raises:
            BoebotError: it cannot.
        """

    def counters(self) -> Mapping[str, float]:
        """What board and world counted, by name; may be empty."""

    def close(self) -> None:
        """Closes the board, and the world if it is this robot's alone."""


class BoardSession(Session, Protocol):
    """A board. `layout` and `readings` are of what is wired to it, as it shows itself to people; no program reads
    them."""

    @property
    def transport(self) -> Transport:
        """The bytes to and from the board."""

    def texts(self) -> Mapping[str, str]:
        """What displays at a simulated board show now, by names for people; empty of a real one."""

    def pins_now(self) -> Sequence[PinNow]:
        """Of each pin, by its Arduino number; empty where the board cannot be seen into."""

    def watchdog_resets(self) -> Sequence[WatchdogReset]:
        """Those so far, oldest first; empty where nobody sees into the board."""

    def notes(self) -> Sequence[str]:
        """Sentences on what the board's program asked for that the board does not do as the chip would, or the chip
        not as it seems, each with its place, once; empty of a board that cannot be seen into."""


class VehicleSession(Session, Protocol):
    """A simulated robot without a board."""

    @property
    def tick_s(self) -> float:
        """Seconds that one step lasts."""

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals, -1 to 1."""

    def stop(self) -> None:
        """No motor signals from now on."""

    @property
    def ended(self) -> str:
        """Why it can go no further, or ""."""


class World(Protocol):
    """The robots of one run, opened. A single one lets time pass itself, as it waits. Of several, time passes only in
    `advance`: a session that waits calls who turns the clock, and goes on once its robot has woken."""

    @property
    def sessions(self) -> Sequence[BoardSession | VehicleSession]:
        """One per robot, in the order of the requests: with a board for those whose description has one."""

    def on_wait(self, pause: Callable[[int], None]) -> None:
        """Who is called with the index of one of several robots when it waits, and returns once it has woken."""

    def advance(self) -> list[int]:
        """Lets time pass up to the earliest wake-up of a robot that waits; the indices of those that wake then."""

    def close(self) -> None:
        """Frees all boards and the world."""


WorldFactory = Callable[[Sequence[BoardRequest]], World]
"""What an entry point of the group `boebot.boards` loads to: opens robots in one simulated world, on its kind of board
or, of the name `direct`, without; arena, seed of the world and pace are the first request's. It raises a BoebotError
with one sentence if it cannot."""


class Visit(NamedTuple):
    """What a client of a served robot did, or what its board notes (`BoardSession.notes`)."""

    what: str
    """"came", "went", "refused", "reset" or "notes"."""
    client: str
    """Its address, or the process that has opened the pseudo-terminal; "the board"."""
    why: str = ""
    """Why it was refused or had to go; the note."""


class Server(Protocol):
    """What an entry point of the group `boebot.servers` loads to: offers an emulated robot to other programs."""

    def __call__(
        self,
        kind: str,
        request: BoardRequest,
        *,
        tcp: int | None,
        announce: Callable[[str], None],
        visit: Callable[[Visit], None],
        running: Callable[[], bool],
        look: Callable[[BoardSession, bytes], None] | None = None,
    ) -> None:
        """Serves an emulated board of that kind at real-time pace until `running()` is false: on a new pty,
        or on TCP port `tcp` of loopback (0: any free one). Calls `announce(url)` once clients may open that
        URL, `visit` when one comes, goes or is refused or the board notes something, and `look` about 20 times a
        second with the session and what the board has sent since; it returns at once, since the robot waits
        meanwhile."""


class LiveSession:
    """A board behind a port: a robot, or an emulated one that somebody serves. It is a `World` of one, too."""

    def __init__(self, transport: Transport, description: str) -> None:
        self.transport = transport
        self.description = description
        self.sessions = [self]

    def on_wait(self, pause: Callable[[int], None]) -> None:
        """Time passes by itself."""

    def advance(self) -> list[int]:
        """Of one robot never called."""
        return []

    arena = None

    def drain(self, *, ended: bool = False) -> Group:
        """Nobody knows where a real robot is."""
        return {}

    def truth_now(self) -> TruthNow | None:
        """Nor now."""
        return None

    def place(self, x: float, y: float, heading: float) -> None:
        """By hand only."""
        raise BoardError(f"the {self.description} is put elsewhere by hand: only a simulated robot can be put there")

    def place_shape(self, index: int, x: float, y: float, heading: float) -> None:
        """By hand only."""
        raise BoardError(f"what stands around the {self.description} is moved by hand: only a simulator can do it")

    layout: Mapping[str, slice] = {}

    def readings(self) -> tuple[float, ...]:
        """What is wired to a real board is not known."""
        return ()

    def texts(self) -> Mapping[str, str]:
        """Nor that."""
        return {}

    def pins_now(self) -> Sequence[PinNow]:
        """Nor these."""
        return ()

    def set_part(self, device: str, value: float) -> None:
        """By hand only."""
        raise BoardError(f"what is wired to the {self.description} is worked by hand: expected a simulated robot")

    def fault(self, owner: str, kind: str, value: float, begin_s: float, end_s: float) -> Callable[[], int]:
        """A real one fails by itself."""
        raise BoardError(f"{owner}.{kind} is of a simulated robot; expected a fault of serial line, cable or host")

    def counters(self) -> Mapping[str, float]:
        """A port counts nothing."""
        return {}

    def watchdog_resets(self) -> Sequence[WatchdogReset]:
        """Nobody sees into a real board; in which task it hung it says itself."""
        return ()

    def notes(self) -> Sequence[str]:
        """A real board does what it does."""
        return ()

    def close(self) -> None:
        """Closes the port."""
        self.transport.close()


def board_kinds() -> list[str]:
    """The emulated boards that are installed."""
    return [name for name in guests(BOARDS_GROUP) if name != DIRECT]


def open_world(url: str, requests: Sequence[BoardRequest]) -> World:
    """Opens the robots of a run, those with boards on the board, or the kind of board, that `url` names.

    Raises:
        BoardError: no such board, or it cannot be opened, or one that does not fit the robots; no such imperfection.
    """
    with_boards = [request.robot for request in requests if request.robot.has_board]
    if is_live(url) and len(requests) > 1:
        raise BoardError(f"several robots in one run are simulated; {url!r} is a port: run each robot by itself there")
    for robot in with_boards or [request.robot for request in requests]:
        check_board(url, robot)
    if is_live(url):
        (request,) = requests
        request.robot.expect_kit()
        if request.without or request.imperfections:
            raise BoardError(f"the robot at {url!r} is as it is built: imperfections are for simulated runs")
        if request.pose is not None:
            raise BoardError(f"the robot at {url!r} starts where it stands: a pose is for simulated runs")
        transport = open_port(url, request.robot.baud or DEFAULT_BAUD)
        return LiveSession(transport, f"board at {transport.name}")
    kind = guests(BOARDS_GROUP).get(url)
    if kind is None and url == DIRECT:
        raise BoardError("there is no world for a robot without a board: the simulator is not installed")
    if kind is None:
        raise BoardError(_unknown(url))
    factory: WorldFactory = kind.load()
    return factory(requests)


def open_board(url: str, request: BoardRequest) -> BoardSession:
    """Opens one board, to step it by hand; its `close` closes its world, too. Raises as `open_world`."""
    return cast(BoardSession, open_world(url, [request]).sessions[0])


def check_board(url: str, robot: RobotDescription) -> None:
    """Refuses to run a robot without a board on one, and one with a board without.

    Raises:
        BoardError: in one sentence.
    """
    if not robot.has_board and url != DIRECT:
        raise BoardError(f"robot {robot.name!r} has no board: it cannot run on {url!r}; expected {DIRECT!r}")
    if robot.has_board and url == DIRECT:
        raise BoardError(
            f"robot {robot.name!r} is driven by its board: it cannot run {DIRECT!r}; "
            f"expected one of {', '.join(board_kinds())}, or a port"
        )


def default_board(robots: Sequence[RobotDescription]) -> str:
    """What robots run on unless somebody says otherwise: those without boards need none."""
    return "native" if any(robot.has_board for robot in robots) else DIRECT


def find_server() -> Server:
    """Who offers emulated robots to other programs.

    Raises:
        BoardError: nobody does.
    """
    for point in guests(SERVERS_GROUP).values():
        server: Server = point.load()
        return server
    raise BoardError("there is nobody to serve an emulated robot: the simulator is not installed")


def is_live(url: str) -> bool:
    """Whether `url` names a port rather than an emulated board."""
    scheme = url.partition(":")[0]
    return scheme in guests(PORTS) or bool(re.match(r"(serial:|socket://|rfc2217://|/|COM\d+(\?|$)|\\\\\.\\)", url))


def open_port(url: str, baud: int) -> Transport:
    """Opens a port by URL.

        PORT or serial:PORT       its path, such as /dev/ttyACM0 or a pty's, or COM3
        socket://HOST:PORT        a TCP connection
        rfc2217://HOST:PORT       a serial port that another computer shares
        SCHEME:...                whatever a guest's scheme means

    Serial ports, shared ones too, take settings after a question mark, joined by `&`: `baud=RATE` (bit/s, else
    `baud`) and `reset=no` (do not reset the board by DTR; boebot.link.ports says how far that goes).

    Raises:
        BoardError: the URL is malformed, or the port is missing, busy, forbidden or refused.
    """
    if point := guests(PORTS).get(url.partition(":")[0]):
        opened: Transport = point.load()(url)
        return opened
    from boebot.link import ports  # not in a simulated run

    address, _, query = url.partition("?")
    if address.startswith("socket://"):
        if query:
            raise BoardError(f"{url!r} has a setting {query!r}; a socket address takes none")
        return ports.SocketPort(*_host_and_port(url, address, "socket"))
    settings = _settings(url, query)
    baud_given = "baud" in settings
    if baud_given:
        baud = int(settings["baud"])
    reset = settings.get("reset", "yes") == "yes"
    if address.startswith("rfc2217://"):
        host, number = _host_and_port(url, address, "rfc2217")
        return ports.open_rfc2217(host, number, baud, baud_given=baud_given, reset=reset)
    port = address.removeprefix("serial:")
    if not port:
        raise BoardError(f"{url!r} names no port; expected serial:PORT, as in serial:/dev/ttyUSB0")
    return ports.open_serial(port, baud, baud_given=baud_given, reset=reset)


_SETTINGS = {"baud": r"\d{1,9}", "reset": "yes|no"}


def _settings(url: str, query: str) -> dict[str, str]:
    """The settings of a serial port."""
    settings: dict[str, str] = {}
    for part in query.split("&") if query else []:
        key, _, value = part.partition("=")
        if key in settings or key not in _SETTINGS or not re.fullmatch(_SETTINGS[key], value):
            raise BoardError(f"{url!r} has the setting {part!r}; expected baud=RATE, reset=yes or reset=no, each once")
        settings[key] = value
    return settings


def _host_and_port(url: str, address: str, scheme: str) -> tuple[str, int]:
    match = re.fullmatch(scheme + r"://(\[[0-9a-fA-F:.]+\]|[^:/\[\]]+):(\d{1,5})/?", address)
    if match is None or not 0 < int(match[2]) < 65536:
        raise BoardError(f"{url!r} is no {scheme} address; expected {scheme}://HOST:PORT")
    return match[1].strip("[]"), int(match[2])


def _unknown(url: str) -> str:
    kinds = board_kinds()
    emulated = ", ".join(kinds) if kinds else "none: the simulator is not installed"
    schemes = "".join(f", {scheme}:..." for scheme in guests(PORTS))
    return (
        f"there is no board {url!r}; expected an emulated board ({emulated}), "
        f"a port such as /dev/ttyACM0 or serial:PORT, socket://HOST:PORT, rfc2217://HOST:PORT{schemes}"
        + did_you_mean(url, kinds)
    )
