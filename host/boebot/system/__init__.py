"""What operating systems do differently, one file for each kind: posix.py (Linux, macOS; its docstrings hold for both)
and windows.py. What they share is called where it is needed."""

import sys

if sys.platform == "win32":
    from boebot.system.windows import (
        LOCK,
        NEW_GROUP,
        end_group,
        folder_kept,
        host_clock,
        lock,
        lock_folder,
        raw_keyboard,
    )
else:
    from boebot.system.posix import LOCK, NEW_GROUP, end_group, folder_kept, host_clock, lock, lock_folder, raw_keyboard

__all__ = ["LOCK", "NEW_GROUP", "end_group", "folder_kept", "host_clock", "lock", "lock_folder", "raw_keyboard"]
