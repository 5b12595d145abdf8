"""Where somebody could look at something: in a notebook, or in a browser."""

from __future__ import annotations

import contextlib
import os
import sys
import webbrowser
from typing import Any


def published(html: str, plain: str) -> bool:
    """Shown below the cell of a notebook, as HTML and in words; False: this is none, but a script or a terminal."""
    ipython = sys.modules.get("IPython")
    shell: Any = None if ipython is None else ipython.get_ipython()
    if getattr(shell, "kernel", None) is None:
        return False
    shell.display_pub.publish({"text/html": html, "text/plain": plain})
    return True


def browse(address: str) -> None:
    """Opens it in the browser, where one can show something; on Linux and the like the environment says so."""
    variables = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    if sys.platform in ("win32", "darwin") or any(map(os.environ.get, variables)):
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(address)
