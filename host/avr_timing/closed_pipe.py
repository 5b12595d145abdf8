"""The end of a program whose output may not be read to its end, as behind `| head -1`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import NoReturn


def exit_as(main: Callable[[], int | None]) -> NoReturn:
    """Runs a program, and ends with its exit code; with 1, and without a traceback, where its reader left."""
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:
        code = 1
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at exit
    sys.exit(code)
