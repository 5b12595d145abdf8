"""Files that people give: only plain ones are opened. A pipe would wait for ever, and a device has no end."""

from __future__ import annotations

import math
import stat
from pathlib import Path


def regular(path: Path, most: float = math.inf) -> Path:
    """The path, of a plain file of up to `most` bytes.

    Raises:
        OSError: it is none, or larger; `strerror` says it.
    """
    found = path.stat()
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(0, "it is a folder, no file")
    if not stat.S_ISREG(found.st_mode):
        raise OSError(0, "it is a pipe or a device, no file")
    if found.st_size > most:
        raise OSError(0, f"it has {found.st_size:,} bytes; expected at most {most:,}")
    return path
