"""`boebot flash [FILE]`: writes a program into a board, and says what answers then."""

from __future__ import annotations

import contextlib
import math
import sys
import time
import zlib
from pathlib import Path
from typing import Annotated

import typer
from serial.tools import list_ports

from boebot import flashing, missing, resources
from boebot.boards import BoardRequest, open_port
from boebot.brains import load_program
from boebot.cli import options, output
from boebot.cli.board_link import board_link
from boebot.description.robots import RobotDescription, load_robot
from boebot.errors import BoardError, CallError
from boebot.image.program import Program, read_program
from boebot.link.frame import text
from boebot.link.ports import BAUD_MAX, BAUD_MIN

FIRST_LINE_S = 6.0  # from the reset; a boot loader waits for one to three of them


def flash(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE",
            help="Sketch, folder of one, PlatformIO project, ELF or HEX file. Else the kit's firmware for the robot.",
        ),
    ] = None,
    on: Annotated[
        str | None, typer.Option("--on", metavar="PORT", help="Where the board is, if there are several.")
    ] = None,
    robot: options.RobotName = "shieldbot",
    baud: Annotated[
        int, typer.Option("--baud", metavar="RATE", min=BAUD_MIN, max=BAUD_MAX, help="At which a program prints.")
    ] = 9600,  # of most sketches
) -> None:
    """Write the kit's firmware or a program of your own into a board, and say what answers."""
    description = load_robot(robot)
    if file is None and not description.takes_brain:
        raise CallError(f"robot {description.name!r} runs programs of your own; expected one: boebot flash FILE")
    port = on or _only_port()
    path = _program(file, description)
    program = read_program(path)
    name = path.name
    with output.progress_bar(f"writing {name}", 100, unit=" %") as progress:
        flashing.write(program.flash, port, progress)
    size = len(program.flash.rstrip(b"\xff"))
    output.line(f"{name}: {size:,} bytes written into the board at {port}, and read back")
    if kits := _kits(program, description):
        _shake_hands(port, kits, program)
    else:
        _show_first_line(port, baud)


def _only_port() -> str:
    """The USB port, as an Uno has it, if there is one; of several the one that is chosen at the terminal.

    Raises:
        BoardError: there is none.
        CallError: there are several, and no terminal to ask at.
    """
    ports: list[str] = sorted(port.device for port in list_ports.comports() if port.vid is not None)
    if len(ports) == 1:
        return ports[0]
    if not ports:
        raise BoardError("there is no board at a USB port: is it plugged in? Another port is named by --on")
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise CallError(f"there are several USB ports, {', '.join(ports)}; expected --on with one of them")
    for number, port in enumerate(ports, 1):
        output.line(f"{number}  {port}", sys.stderr)
    chosen: int = typer.prompt("Which one has the board that is to be written", type=int, err=True)
    if not 1 <= chosen <= len(ports):
        raise CallError(f"there is no port {chosen}; expected 1 to {len(ports)}")
    return ports[chosen - 1]


def _program(file: Path | None, robot: RobotDescription) -> Path:
    """The ELF or HEX file, built of a sketch if it has to be."""
    if file is None:
        image = resources.folder("images") / f"{robot.pin_map}.elf"
        if not image.is_file():
            raise BoardError(f"there is no firmware image {image.name}; {missing.built('firmware')}")
        return image
    with output.progress_bar(f"building {file}", math.inf) as progress:
        loaded = load_program(str(file), progress)
    if loaded is None or loaded.path is None:
        raise CallError(f"{file} is no program; expected a sketch, its folder, or an .elf or .hex file")
    return loaded.path


def _kits(program: Program, robot: RobotDescription) -> RobotDescription | None:
    """The robot that the kit's firmware which this is is for; None: it is another program."""
    for image in resources.folder("images").glob("*.elf"):
        if image.stem != "bootloader" and read_program(image).flash == program.flash:
            return robot if robot.pin_map == image.stem else load_robot(image.stem)
    return None


def _shake_hands(port: str, robot: RobotDescription, program: Program) -> None:
    with board_link(port, BoardRequest(robot=robot, record=False)) as (link, where):
        identity = link.identity()
        size = identity.image_size
        runs, written = identity.image_hash, zlib.crc32(program.flash[:size])
        if not size or runs != written:
            raise BoardError(f"the {where} says it runs an image of CRC-32 {runs:08x}; expected {written:08x}")
        version, pins = text(identity.firmware_version), text(identity.pin_map)
        output.line(f"it answers: firmware {version}, pin map {pins}, image of {size:,} bytes, CRC-32 {runs:08x}")


def _show_first_line(port: str, baud: int) -> None:
    said, end = b"", time.perf_counter() + FIRST_LINE_S
    with contextlib.closing(open_port(port, baud)) as line:
        while b"\n" not in said.lstrip() and time.perf_counter() < end:
            said += line.read(0.1)
    first = said.strip().partition(b"\n")[0].strip()
    words = first.decode("utf-8", "replace")[:200]
    if first and "\ufffd" not in words and words.replace("\t", "").isprintable():
        output.line(f"it prints: {words}")
    elif first:
        output.line(f"what it prints is no text at {baud} bit/s; expected --baud with the rate of its Serial.begin()")
    else:
        output.line(f"it has printed nothing in {FIRST_LINE_S:g} s at {baud} bit/s")
