"""How long a Python thread may compute before it must let another one run, while a board is connected.

A thread that waits for the link gets Python's global lock back only when the one that computes gives it away: by
default after 5 ms, with a live port open after 1 ms. docs/decisions/0003-port-thread.md has figures and cost.
"""

from __future__ import annotations

import sys
import threading

INTERVAL_S = 0.001
_HALF_S = 0.5e-6  # Python cuts to whole microseconds

_lock = threading.Lock()
_users = 0
_before_s = 0.0
_ours_s = 0.0


def shorten() -> None:
    """A port was opened: threads switch after INTERVAL_S, unless they do so sooner already."""
    global _users, _before_s, _ours_s
    with _lock:
        _users += 1
        if _users == 1:
            _before_s = sys.getswitchinterval()
            sys.setswitchinterval(min(INTERVAL_S, _before_s) + _HALF_S)
            _ours_s = sys.getswitchinterval()


def restore() -> None:
    """A port was closed; after the last one all is as before, unless somebody else has changed it meanwhile."""
    global _users
    with _lock:
        _users -= 1
        if _users == 0 and sys.getswitchinterval() == _ours_s:
            sys.setswitchinterval(_before_s + _HALF_S)
