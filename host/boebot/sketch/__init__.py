"""Programs as people write them for an Arduino: a sketch or a PlatformIO project becomes an ELF file.

`find` says what a path is and which files belong to it, `build` has PlatformIO build it, `servo` brings the one library
that Debian's framework lacks, and `core_directory` spares PlatformIO its registry. All that is built lies in `cache`.
"""

from __future__ import annotations

import os
from pathlib import Path


def cache() -> Path:
    """The folder of what is built: BOEBOT_CACHE, or `boebot` in the user's folder for such things. It can be deleted at
    any time."""
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    return Path(os.environ.get("BOEBOT_CACHE") or Path(home, "boebot")).absolute()
