"""`boebot doctor URL`: what is there, what it reads, what it should read, and where to look if it does not; or who is
there, or what both ends of the link count. Nothing moves."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import typer
from serial.tools import list_ports

import boebot
from boebot import resources
from boebot.boards import BoardRequest, board_kinds, is_live
from boebot.cli import options, output
from boebot.cli.board_link import board_link, show_identity, watch_link
from boebot.description.board_parameters import configure
from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.device import Checkup
from boebot.devices.latest import Latest
from boebot.errors import BoebotError
from boebot.guests import PORTS, guests
from boebot.link import finding, messages
from boebot.link.frame import text
from boebot.link.link import Link
from boebot.link.ports import holder_of, remedy

EXIT_WRONG = 1
SETTLE_S = 0.5  # until all sensors have been read
LISTEN_S = 1.0
_TELEMETRY_SHARE = 0.9  # of what should come in that time


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    part: str
    reads: str
    expected: str = ""
    hint: str = ""
    """What to do; empty: all is well."""


def doctor(
    url: Annotated[
        str | None,
        typer.Argument(
            metavar="URL",
            help="avr, native, or a port: /dev/ttyACM0, socket://HOST:PORT; without it the only port that there is.",
        ),
    ] = None,
    robot: options.RobotName = "shieldbot",
    identity: Annotated[
        bool, typer.Option("--identity", help="Say who is there: firmware, compiler, image, devices, parameters.")
    ] = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", help="Watch the link until Ctrl-C: counters of both ends, round trips, the board's clock."
        ),
    ] = False,
    seconds: Annotated[float | None, options.time("With --watch: end after this time.", least=0)] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON in place of the table; with --watch an object every second.")
    ] = False,
) -> None:
    """Examine port, firmware and each device of a robot that stands still; say what is not as it should be.

    Exit code: 0 all is well; 1 something is not. With --identity or --watch: 0.
    """
    if (identity and watch) or (seconds is not None and not watch):
        raise typer.BadParameter("expected one of --identity and --watch, and --seconds with --watch")
    description = load_robot(robot)
    if not description.has_board:
        raise BoebotError(f"robot {description.name!r} has no board: there is nothing to examine")
    description.expect_kit()
    if identity or watch:
        if url is None:
            ports = _ports()
            if len(ports) != 1:
                raise BoebotError(f"expected the URL of a board: {_which(ports)}")
            (url,) = ports
        if identity:
            show_identity(url, description, json)
        else:
            with contextlib.suppress(KeyboardInterrupt):
                watch_link(url, description, math.inf if seconds is None else seconds, json)
        return
    checks = list(_checks(url, description))
    wrong = [check for check in checks if check.hint]
    if json:
        output.print_json({"well": not wrong, "checks": [asdict(check) | {"well": not check.hint} for check in checks]})
    else:
        _show(checks)
        count = len(wrong)
        output.line(f"{count} of {len(checks)} to be looked at" if count else f"all {len(checks)} are well")
    if wrong:
        raise typer.Exit(EXIT_WRONG)


def _checks(url: str | None, robot: RobotDescription) -> Iterator[Check]:
    """From the kit to the last device, as far as each leads on to the next.

    Raises:
        BoebotError: there is no such board.
    """
    python = sys.version.split()[0]
    yield Check("kit", f"boebot {boebot.__version__}, protocol {finding.version_name()}, Python {python}")
    if url is None:
        ports = _ports()
        if len(ports) != 1:
            yield Check("ports", ", ".join(ports) or "none", "one", _which(ports))
            return
        (url,) = ports
    for check in _port(url):
        yield check
        if check.hint:
            return
    try:
        with board_link(url, BoardRequest(robot=robot, record=False)) as (link, where):
            yield Check("board", where, "a board that says hello")
            yield from _firmware(link, robot)
            pin_map = text(link.identity().pin_map)
            fits = pin_map == robot.pin_map
            yield Check("pin map", pin_map, robot.pin_map, "" if fits else "flash its image, or name another --robot")
            if fits:
                yield from _running(link, configure(link, robot))
    except BoebotError as error:
        if not is_live(url):
            raise
        yield Check("link", str(error), "an answer", "is the robot on, its cable sound, its firmware flashed?")


def _ports() -> list[str]:
    return sorted(port.device for port in list_ports.comports())


def _which(ports: list[str]) -> str:
    if ports:
        return "name one: boebot doctor PORT"
    emulated = "".join(f", or boebot doctor {kind}" for kind in board_kinds())
    return f"is the robot plugged in? then boebot doctor PORT{emulated}"


def _port(url: str) -> Iterator[Check]:
    """A serial port of this computer: whether it is there, may be opened, and is free."""
    path = url.removeprefix("serial:").partition("?")[0]
    if os.name != "posix" or not is_live(url) or "://" in path or url.partition(":")[0] in guests(PORTS):
        return
    if not os.access(path, os.F_OK):
        yield Check("port", "missing", path, f"is it plugged in? those there are: {', '.join(_ports()) or 'none'}")
        return
    yield Check("port", path, path)
    is_allowed = os.access(path, os.R_OK | os.W_OK)
    yield Check("permission", "given" if is_allowed else "denied", "given", "" if is_allowed else remedy(path))
    holder = holder_of(path)
    yield Check("held by", holder or "nobody", "nobody", f"end {holder}" if holder else "")


def _firmware(link: Link, robot: RobotDescription) -> Iterator[Check]:
    """What the board runs, and why it was started."""
    hello, identity = link.open(), link.identity()
    version = text(identity.firmware_version)
    yield Check("firmware", f"{version}, {text(identity.compiler)}, for {text(hello.robot)}")
    image = resources.folder("images") / f"{robot.pin_map}.elf"
    if identity.image_size and image.is_file():
        from boebot.image.elf import read_image  # it takes a while

        code = read_image(image).code
        runs, ours = (identity.image_size, identity.image_hash), (len(code), zlib.crc32(code))
        reads, expected = (f"{size} bytes, CRC-32 {crc:08x}" for size, crc in (runs, ours))
        yield Check(
            "image", reads, f"{expected}, the kit's", "" if runs == ours else "if it is not meant, flash the kit's"
        )
    cause = hello.reset_cause
    hint = "the firmware hung there: --watch names the task" if finding.by_watchdog(cause) else ""
    if cause == messages.ResetCause.BROWN_OUT:
        hint = "the supply was too low: charge or change the battery"
    yield Check("last reset", finding.reset_in_words(cause), "power or external", hint)


def _running(link: Link, robot: RobotDescription) -> Iterator[Check]:
    """What comes from the board in a second: the line, the supply, each device."""
    hello = link.open()
    tick_s = 1.0 / hello.tick_rate
    _listen(link, SETTLE_S)
    good, bad = link.counters().good, link.counters().bad
    heard = _listen(link, LISTEN_S)
    counts = link.counters()
    good, bad = counts.good - good, counts.bad - bad
    yield Check("line", f"{bad} of {good + bad} frames damaged", "none", "look at the cable" if bad else "")
    expected = round(LISTEN_S / (hello.telemetry_period * tick_s))
    enough = len(heard) >= _TELEMETRY_SHARE * expected
    hint = "" if enough else "frames are lost, or this computer is busy"
    yield Check("telemetry", f"{len(heard)} in {LISTEN_S:g} s", f"{expected}", hint)
    if not heard:
        return
    newest, _ = heard[-1]
    late = (newest.overruns - heard[0][0].overruns) % 256
    yield Check("ticks", f"{late} overrun", "0", "a task of the firmware takes too long" if late else "")
    least = link.parameters.get("supply_minimum")
    low = f"charge or change the battery; below {least:g} V the motors do not run"
    volts = newest.supply / 1000
    yield Check("supply", f"{volts:.2f} V", f"at least {least:g} V", low if volts < least else "")
    equipment = Equipment(robot, tick_s)
    for name, reader in equipment.readers.items():
        readings = [reader(sample, slow) for sample, slow in heard]
        found: Checkup = robot.device[name].checkup(readings)
        stale = "" if readings[-1].valid else "no fresh reading of it comes from the board: is it switched on there?"
        yield Check(name, found.reads, found.expected, found.hint or stale)


def _listen(link: Link, seconds: float) -> list[tuple[messages.Telemetry, Latest]]:
    """The telemetry of that time, with the newest messages of the slow devices then."""
    end = link.transport.now() + seconds
    heard: list[tuple[messages.Telemetry, Latest]] = []
    while (left := end - link.transport.now()) > 0:
        for payload, *_ in link.poll(min(left, 0.05)):
            sample = messages.Telemetry.unpack(payload)
            newest: dict[type, Any] = {kind: kind.unpack(data) for kind, data in link.devices.latest.items()}
            heard.append((sample, Latest(newest, sample.tick)))
    return heard


def _show(checks: list[Check]) -> None:
    """A row for each, and the hints below."""
    rows = (["look" if check.hint else "well", check.part, check.reads, check.expected] for check in checks)
    output.print_columns(("", "", "reads", "should read"), rows)
    for check in checks:
        if check.hint:
            output.line(f"{check.part}: {check.hint}")
