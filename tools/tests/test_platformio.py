"""PlatformIO with the project's own core directory: images, refusal to upload to just any port."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tools.tests import avr_program

PROJECT = Path(__file__).resolve().parents[2]
IMAGES = PROJECT / "build" / "images"


def pio(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([PROJECT / "tools" / "pio", *arguments], capture_output=True, text=True, check=False)


@pytest.mark.soak
def test_it_builds_the_images() -> None:
    done = pio("run")
    assert done.returncode == 0, done.stdout + done.stderr
    built = PROJECT / "build" / "platformio" / "build"
    for image in avr_program.IMAGES:
        for suffix in (".elf", ".hex"):
            assert (IMAGES / f"{image}{suffix}").read_bytes() == (built / image / f"firmware{suffix}").read_bytes()


def test_an_upload_without_a_port_is_refused() -> None:
    done = pio("run", "-e", "shieldbot", "-t", "upload")
    assert done.returncode != 0
    assert "name the robot's serial port: --upload-port" in done.stderr
