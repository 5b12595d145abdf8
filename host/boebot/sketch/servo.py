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
        wanted, new = Path(scratch, "wanted.txt"), Path(scratch, "new")
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n", encoding="utf-8")
        pip = [sys.executable, "-m", "pip", "download", "--no-clean", "--no-deps", "--no-build-isolation"]
        pip += ["--retries", "1", "--timeout", "10", "--dest", scratch, "--require-hashes", "-r", str(wanted)]
        settings = os.environ | {"TMPDIR": scratch}
        try:
            ended = subprocess.run(
                pip, env=settings, stdin=subprocess.DEVNULL, capture_output=True, timeout=WAIT_S, check=False
            )
            said = ended.stderr.decode("utf-8", "replace").splitlines()
        except subprocess.TimeoutExpired:
            said = [f"pip does not end within {WAIT_S} s"]
        new.mkdir()
        for name in FILES:
            path = next(Path(scratch).glob(f"pip-*/**/Servo/{name}"), None)
            if path is None:
                why = next((line for line in said if line.startswith("ERROR: ")), (said or ["pip says nothing"])[-1])
                raise BoebotError(
                    f"the library Servo, package {PACKAGE}, cannot be had: {why.removeprefix('ERROR: ')}; expected a "
                    f"network the first time, or its files {' and '.join(FILES)} in libraries/Servo beside the sketch"
                )
            shutil.copyfile(path, new / name)
        shutil.rmtree(folder / "Servo", ignore_errors=True)  # a part of it may be there
        new.replace(folder / "Servo")
    return folder
