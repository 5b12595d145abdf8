#!/usr/bin/env python3
"""Brings simavr, the AVR emulator's instruction core, into build/simavr.

simavr (GPL-3) travels in the registry crate `simavr-ffi`. The ordinary cargo client downloads it, with
whatever mirror and proxy settings the user has; this script asks cargo for it, checks its SHA-256 and unpacks
it. No source of simavr is kept in this repository. Needs cargo 1.82 or newer (Debian 12: apt package
`cargo-web`).
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

CRATE = "simavr-ffi"
VERSION = "1.2.7"
SHA256 = "e0e32d831504846abb067b9606891830404a0f847a328086e4b81abbba442c09"

ROOT = Path(__file__).resolve().parent.parent
DESTINATION = ROOT / "build" / "simavr"
SOURCES = DESTINATION / f"{CRATE}-{VERSION}" / "vendor" / "simavr" / "simavr"
MARK = DESTINATION / "fetched"  # holds the SHA-256 of what was unpacked


class FetchError(Exception):
    """simavr cannot be had; the text says why and what to do."""


def cargo_home() -> Path:
    """The folder in which cargo keeps what it downloads."""
    return Path(os.environ.get("CARGO_HOME") or Path.home() / ".cargo")


def cached_crate() -> Path | None:
    """The crate file in cargo's cache, if it is there and is the right one."""
    for crate in sorted((cargo_home() / "registry" / "cache").glob(f"*/{CRATE}-{VERSION}.crate")):
        if hashlib.sha256(crate.read_bytes()).hexdigest() == SHA256:
            return crate
    return None


def download() -> Path:
    """Lets cargo download the crate into its cache."""
    cargo = shutil.which("cargo")
    if cargo is None:
        raise FetchError("cargo is not installed; simavr comes by it (Debian 12: apt install cargo-web).")
    # outside the repository, so that cargo looks for no workspace there
    command = [cargo, "info", f"{CRATE}@{VERSION}"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tempfile.gettempdir())
    crate = cached_crate()
    if crate is None:
        reason = result.stderr.strip().splitlines()
        raise FetchError(
            f"cargo could not bring {CRATE} {VERSION} with the expected SHA-256"
            + (f": {reason[-1].strip()}" if reason else ".")
        )
    return crate


def unpack(crate: Path) -> None:
    """Unpacks the crate below build/simavr."""
    shutil.rmtree(DESTINATION, ignore_errors=True)
    DESTINATION.mkdir(parents=True)
    with tarfile.open(crate, "r:gz") as archive:
        # refuse links and paths that lead elsewhere, where this Python can
        archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, path: member)
        archive.extractall(DESTINATION)
    if not (SOURCES / "sim" / "sim_core.c").is_file():
        raise FetchError(f"{crate.name} does not hold simavr where it was expected.")
    MARK.write_text(SHA256 + "\n", encoding="ascii")


def is_fetched() -> bool:
    """Whether the right sources are unpacked already."""
    return MARK.is_file() and MARK.read_text(encoding="ascii").strip() == SHA256 and SOURCES.is_dir()


def main() -> int:
    """Fetches simavr unless it is there."""
    if is_fetched():
        return 0
    try:
        unpack(cached_crate() or download())
    except (FetchError, OSError, tarfile.TarError) as error:
        print(f"fetch_simavr: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
