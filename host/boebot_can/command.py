"""`boebot can bridge`: puts a board, emulated or real, on a CAN bus. `boebot can dbc`: the CAN database of the
protocol's messages."""

from __future__ import annotations

import contextlib
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from boebot.boards import BoardRequest, is_live, open_board
from boebot.cli import options, output
from boebot.description.robots import load_robot
from boebot.record.run_folder import write_whole
from boebot_can import COMMAND, database
from boebot_can.bridge import Bridge
from boebot_can.bus import Bus, BusName, PythonCanBus
from boebot_can.extra import import_extra
from boebot_can.socketcand_server import SocketcandBus

app = typer.Typer(help=COMMAND.line, no_args_is_help=True, add_completion=False, **options.SETTINGS)


@app.command()
def bridge(
    board: Annotated[
        str,
        typer.Argument(
            metavar="BOARD",
            help="avr, native, or a port: /dev/ttyACM0, serial:PORT, socket://HOST:PORT.",
        ),
    ] = "native",
    can: Annotated[
        str | None,
        typer.Option(
            "--can", metavar="BUS", help="A bus of python-can, INTERFACE:CHANNEL[?KEY=VALUE&...], as in socketcan:can0."
        ),
    ] = None,
    socketcand: Annotated[
        int | None, options.port("A new bus, which CAN tools join at this TCP port of loopback; 0: any.")
    ] = None,
    node: Annotated[int, typer.Option("--node", metavar="N", min=1, max=7, help="The board's number on the bus.")] = 1,
    robot: options.RobotName = "shieldbot",
    arena: options.ArenaName = None,
    seed: options.Seed = 1,
    without: options.Without = None,
    imperfection: options.Imperfections = None,
    json: options.Json = False,
) -> None:
    """Put a board on a CAN bus: every message both ways, until Ctrl-C."""
    if (can is None) == (socketcand is None):
        raise typer.BadParameter("give one of --can BUS and --socketcand PORT")
    import_extra("isotp")
    name = None if can is None else BusName.parse(can)
    description = load_robot(robot)
    request = BoardRequest(
        robot=description,
        arena=arena,
        seed=seed,
        realtime=True,
        record=False,
        without=options.names(without),
        imperfections=options.magnitudes(imperfection),
    )
    with contextlib.ExitStack() as stack:
        session = open_board(board, request)
        stack.callback(session.close)
        transport = session.transport
        bus: Bus = PythonCanBus(name) if name is not None else SocketcandBus(socketcand or 0, transport.now)
        stack.callback(bus.close)
        made = Bridge(transport, bus, node)
        if name is not None:
            made.listen()
        made.wait_for_board()
        url = f"can:{bus.name}" + ("" if node == 1 else f"{'&' if '?' in bus.name else '?'}node={node}")
        if json:
            output.print_json({"url": url, "board": transport.name, "node": node}, indent=None)
        else:
            what = f"the board at {board}" if is_live(board) else f"{description.name} on {board}"
            output.line(f"{what} is node {node} on {bus.name}")
            output.line(f"drive it:   boebot run wander --on '{url}'")
            if isinstance(bus, SocketcandBus):
                output.line(f"watch it:   python -m can.viewer {_joining(bus.port)}")
            output.line("end it:     Ctrl-C")
        with contextlib.suppress(KeyboardInterrupt):
            made.run(lambda: True)
        counted = asdict(made.counters())
        if isinstance(bus, SocketcandBus):
            counted |= {"dropped": bus.dropped, "rubbish": bus.rubbish}
        counted["error_frames"] = bus.errors
        if json:
            output.print_json(counted, indent=None)
        else:
            output.line(", ".join(f"{name.replace('_', ' ')} {count:,}" for name, count in counted.items()))


def _joining(port: int) -> str:
    """How python-can's tools join our bus."""
    return f"-i socketcand -c can0 --bus-kwargs host=localhost port={port}"


@app.command()
def dbc(
    out: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="Where to write it; without it: standard output.")
    ] = None,
    node: Annotated[int, typer.Option("--node", metavar="N", min=1, max=7, help="The board's number on the bus.")] = 1,
    json: options.Json = False,
) -> None:
    """Write the CAN database of a robot's messages, for CAN tools."""
    text = database.of_node(node)
    if out is None:
        output.line(text.rstrip("\n"))
    else:
        write_whole(out, lambda part: part.write_text(text, "utf-8"))
        if json:
            output.print_json({"file": str(out), "node": node})
        else:
            output.line(f"wrote {out}, for node {node}")
