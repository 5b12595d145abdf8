"""Arduino's library Servo, which Debian's framework lacks: its two files come from PyPI's package `arduino-servo`.

That package can be downloaded but not installed, for its set-up is of Python 2. So pip, with whatever index, proxy and
cache the user has set, downloads it, checks its SHA-256, unpacks it, fails, and is asked to leave what it has unpacked.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from boebot.errors import BoebotError
from boebot.sketch import cache

PACKAGE = "arduino-servo==0.1"
SHA256 = "a9e67d8004fa85ec6ae87a2b019b774b80265c7a978d32602721d2254ac3b251"
FILES = ("Servo.cpp", "Servo.h")
WAIT_S = 120  # most; pip's own waits are bounded below
_INCLUDED = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*[<"]Servo\.h[>"]', re.MULTILINE)


def is_needed(files: Mapping[str, bytes]) -> bool:
    """One of these files, by their paths, includes Servo.h, and none is it."""
    return any(map(_INCLUDED.search, files.values())) and "Servo.h" not in map(os.path.basename, files)


def libraries() -> Path:
    """The folder with the folder of the library; downloaded the first time.

    Raises:
        BoebotError: it cannot be had.
    """
    folder = cache() / "libraries"
    if all((folder / "Servo" / name).is_file() for name in FILES):
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache()) as scratch:
        wanted = Path(scratch, "wanted.txt")
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n", encoding="utf-8")
        pip = [sys.executable, "-m", "pip", "download", "--no-clean", "--no-deps", "--no-build-isolation"]
        pip += [
            "--retries",
            "1",
            "--timeout",
            "10",
            "--dest",
            scratch,
            "--require-hashes",
            "--requirement",
            str(wanted),
        ]
        ended = subprocess.run(
            pip,
            env=os.environ | {"TMPDIR": scratch},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=WAIT_S,
            check=False,
        )
        found = {name: next(Path(scratch).glob(f"**/Servo/{name}"), None) for name in FILES}
        new = Path(scratch, "Servo")
        new.mkdir()
        for name, path in found.items():
            if path is None:
                why = [line for line in ended.stderr.splitlines() if line.startswith("ERROR: ")] or ["no answer"]
                raise BoebotError(
                    f"the library Servo, package {PACKAGE}, cannot be had: {why[0].removeprefix('ERROR: ')}; expected "
                    "a network the first time, or its two files in libraries/Servo beside the sketch"
                )
            shutil.copyfile(path, new / name)
        new.replace(folder / "Servo")
    return folder
