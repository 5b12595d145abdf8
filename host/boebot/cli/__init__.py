"""The `boebot` command: one file per sub-command.

Exit codes: 0 done; 1 something the user can mend, said in one sentence; 2 wrong usage; 3 a fault of the run changed
nothing; 130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import threading
from typing import NoReturn

from boebot.cli import streams
from boebot.errors import BoebotError, InterruptedRunError, printable
from boebot.running import interrupts
from boebot.running.interrupts import SIGNALS

EXIT_ERROR, EXIT_INTERRUPTED = 1, 130


def main() -> NoReturn:
    """Runs the command; every error that people can make ends as one sentence."""
    code: object
    interrupts.first = None
    others = set(threading.enumerate())
    try:
        for number in SIGNALS:  # motors are stopped and the record is written at each of them
            if signal.getsignal(number) != signal.SIG_IGN:  # as `nohup` wants it
                signal.signal(number, interrupts.interrupt)
        streams.open_closed()
        streams.accept_all_characters()
        code = _run()
        if not _is_interrupted(code):
            _await(others)
    except KeyboardInterrupt as error:
        code = _interrupted("interrupted", error)
    except Exception as error:
        if interrupts.first is None:
            raise
        code = _interrupted("interrupted", error)  # an import that Ctrl-C cut may end as any other error
    if _is_interrupted(code) and any(not one.daemon for one in set(threading.enumerate()) - others):
        interrupts.leave(interrupts.exit_code())  # a brain's thread may never end
    if _is_interrupted(code):
        for number in SIGNALS:  # Python's end takes a while, in which one more would kill it
            signal.signal(number, signal.SIG_IGN)
    exec("")  # where Ctrl-C fell into an exec of a text, as classes are made by, CPython would end by the signal itself
    sys.exit(code if isinstance(code, int) else 0)


def _is_interrupted(code: object) -> bool:
    """It is the exit code of a program that was asked to end."""
    return code == interrupts.exit_code()


def _await(others: set[threading.Thread]) -> None:
    """Waits for a brain's threads, all but the `others`. Python would do so as it ends, and take no Ctrl-C then."""
    for thread in set(threading.enumerate()) - others:
        if not thread.daemon:
            thread.join()


def _run() -> object:
    """The exit code of the command."""
    # imported only here, so that Ctrl-C meanwhile is no traceback
    import typer

    from boebot.cli.app import app

    try:
        try:
            code = app(standalone_mode=False, prog_name="boebot")
        finally:
            streams.finish()
    except InterruptedRunError as error:
        return _interrupted(str(error), error)
    except BoebotError as error:
        _say(str(error), error)
        return error.exit_code
    except typer.Abort:
        raise KeyboardInterrupt from None
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EBADF) and error.filename is None:
            streams.discard()
            _say(f"the output cannot be written: {os.strerror(error.errno).lower()}", error)
            return EXIT_ERROR
        if error.errno not in (errno.EPIPE, errno.EIO):
            raise
        sys.stderr.close()  # what reads our output has closed it, as `head` does, or the terminal has gone
        return EXIT_ERROR
    except Exception as error:
        # wrong usage; its class is click's, which some releases of typer carry inside
        show = getattr(error, "show", None)
        if show is None:
            raise
        show()
        return getattr(error, "exit_code", None)
    if code == EXIT_INTERRUPTED:  # some releases of typer make this of a KeyboardInterrupt
        raise KeyboardInterrupt
    return code


def _interrupted(sentence: str, error: BaseException) -> int:
    _say(sentence, error)
    return interrupts.exit_code()


def _say(sentence: str, error: BaseException) -> None:
    """The sentence, and what else went wrong, on standard error; the terminal may have gone."""
    with contextlib.suppress(OSError, ValueError):
        for text in (sentence, *getattr(error, "__notes__", ())):
            print(f"boebot: {printable(text)}", file=sys.stderr)
