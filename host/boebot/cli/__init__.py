"""The `boebot` command: one file per sub-command.

Exit codes: 0 done; 1 something the user can mend, said in one sentence; 2 wrong usage; 130 interrupted.
"""

from __future__ import annotations

import signal
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Annotated, NoReturn

import typer

from boebot.cli import info, new, run, serve, teleop
from boebot.errors import BoebotError
from boebot.link import messages

EXIT_ERROR, EXIT_INTERRUPTED = 1, 130

app = typer.Typer(
    name="boebot",
    help="Drive a Boe-Bot class robot, or its emulated twin, by a brain written in Python.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run")(run.run)
app.command("serve")(serve.serve)
app.command("info")(info.info)
app.command("teleop")(teleop.teleop)
app.command("new")(new.new)


def _version(wanted: bool) -> None:
    if wanted:
        try:
            installed = version("boebot")
        except PackageNotFoundError:
            installed = "not installed"
        print(
            f"boebot {installed} (protocol {messages.PROTOCOL_VERSION}, schema {messages.SCHEMA_HASH:08x}, "
            f"Python {sys.version.split()[0]})"
        )
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    del version


def main() -> NoReturn:
    """Runs the command; every error that people can make ends as one sentence."""
    signal.signal(signal.SIGTERM, _interrupt)  # motors are stopped and the record is written then, too
    try:
        code = app(standalone_mode=False)
    except BoebotError as error:
        print(f"boebot: {error}", file=sys.stderr)
        code = EXIT_ERROR
    except (KeyboardInterrupt, typer.Abort):
        code = EXIT_INTERRUPTED
    except BrokenPipeError:  # what reads our output has closed it, as `head` does
        sys.stderr.close()
        code = EXIT_ERROR
    except Exception as error:
        # wrong usage; its class is click's, which some releases of typer carry inside
        show, code = getattr(error, "show", None), getattr(error, "exit_code", None)
        if show is None:
            raise
        show()
    if code == EXIT_INTERRUPTED:
        print("boebot: interrupted", file=sys.stderr)
    sys.exit(code if isinstance(code, int) else 0)


def _interrupt(*_: object) -> NoReturn:
    raise KeyboardInterrupt
