"""`boebot serve`: offers the emulated robot on a pty or a TCP port, at real-time pace, to any program."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from boebot import resources
from boebot.boards import BoardRequest, Visit, board_kinds, check_board, find_server
from boebot.cli import options, output, streams
from boebot.description.robots import load_robot
from boebot.errors import BoardError, BoebotError, CallError

if TYPE_CHECKING:
    from boebot.live.served_view import ServedView

_WORDS = {"came": "came; the board is reset", "went": "went", "refused": "was refused", "reset": "resets the board"}
_WORDS["notes"] = "notes"


@contextlib.contextmanager
def _unread() -> Iterator[None]:
    """What started this may have read where the robot is, and listen no more."""
    try:
        yield
    except OSError:
        streams.discard()


def serve(
    on: Annotated[str, typer.Option("--on", metavar="BOARD", help="avr or native.")] = "avr",
    pty: Annotated[bool, typer.Option("--pty", help="On a new pseudo-terminal, like a serial port.")] = False,
    tcp: Annotated[int | None, options.port("On this TCP port of loopback; 0: any.")] = None,
    bootloader: Annotated[
        bool,
        typer.Option(
            "--bootloader",
            help="An Uno into which programs are flashed, by avrdude, boebot flash or pio run -t upload.",
        ),
    ] = False,
    robot: options.RobotName = "shieldbot",
    arena: options.ArenaName = None,
    seed: options.Seed = 1,
    without: options.Without = None,
    imperfection: options.Imperfections = None,
    gdb: options.Gdb = None,
    view: options.ServedView = False,
    view_port: options.ViewPort = None,
    json: options.Json = False,
) -> None:
    """Offer the emulated robot to other programs, until Ctrl-C."""
    if pty == (tcp is not None):
        raise typer.BadParameter("give one of --pty and --tcp PORT")
    if view_port is not None and not view:
        raise BoebotError("--view-port is of a live view; expected --view with it")
    if on not in board_kinds():
        raise BoardError(
            f"there is no emulated board {on!r} to serve; expected {' or '.join(board_kinds()) or 'an installed one'}"
        )
    description = load_robot(robot)
    check_board(on, description)
    loader = resources.folder("images") / "bootloader.elf" if bootloader else None
    if loader is not None and on != "avr":
        raise CallError(f"a boot loader begins on an emulated Uno; expected --on avr, not {on}")
    request = BoardRequest(
        robot=description,
        arena=arena,
        seed=seed,
        realtime=True,
        record=view,
        without=options.names(without),
        imperfections=options.magnitudes(imperfection),
        bootloader=None if loader is None else str(loader),
        gdb=gdb,
        gdb_waits=False,
    )

    page: ServedView | None = None

    def announce(url: str) -> None:
        if json:
            output.print_json({"url": url, "board": on, "robot": request.robot.name})
        else:
            lines = [f"{request.robot.name} on {on} is at {url}"]
            if loader is not None:
                lines.append(f"flash it:  boebot flash FILE --on {url}")
            if description.takes_brain:
                lines.append(f"drive it:  boebot run wander --on {url}")
            lines.append("end it:    Ctrl-C")
            with _unread():
                output.line("\n".join(lines))

    def visit(event: Visit) -> None:
        if page is not None:
            page.visit(event)
        with _unread():
            if json:
                output.print_json({"event": event.what, "client": event.client, "why": event.why}, indent=None)
            else:
                output.line(f"{event.client} {_WORDS[event.what]}{event.why and f': {event.why}'}")

    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as stack:
        if view:
            from boebot.live.served_view import ServedView
            from boebot.live.session import show

            page = stack.enter_context(contextlib.closing(ServedView(request, on, port=view_port or 0)))
            show(page.url)
        look = None if page is None else page.look
        find_server()(on, request, tcp=tcp, announce=announce, visit=visit, running=lambda: True, look=look)
