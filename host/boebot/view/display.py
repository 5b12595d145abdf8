"""Where somebody could look at something: in a notebook, or in a browser."""

from __future__ import annotations

import os
import sys
from typing import Any


def kernel_shell() -> Any:
    """IPython's shell, where it is that of a kernel of Jupyter: a notebook shows what it publishes. Else None, as in a
    terminal."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return None if getattr(shell, "kernel", None) is None else shell


def has_display() -> bool:
    """A browser can show something; on Linux and the like the environment says so."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))
