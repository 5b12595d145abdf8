"""PlatformIO with the project's own core directory: images, upload command, refusal to upload to just any port."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
IMAGES = PROJECT / "build" / "images"


def pio(*arguments: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ)
    if path is not None:
        environment["PATH"] = f"{path}{os.pathsep}{environment['PATH']}"
    return subprocess.run(
        [PROJECT / "tools" / "pio", *arguments], env=environment, capture_output=True, text=True, check=False
    )


def test_it_builds_the_images_that_everybody_loads() -> None:
    done = pio("run")
    assert done.returncode == 0, done.stdout + done.stderr
    built = PROJECT / "build" / "platformio" / "build"
    for environment, pin_map in (("uno", "shieldbot"), ("uno_quad", "shieldbot-quad"), ("uno_boebot", "boebot")):
        for suffix in (".elf", ".hex"):
            assert (IMAGES / f"{pin_map}{suffix}").read_bytes() == (
                built / environment / f"firmware{suffix}"
            ).read_bytes()


def test_an_upload_without_a_port_is_refused() -> None:
    done = pio("run", "-e", "uno", "-t", "upload")
    assert done.returncode != 0
    assert "name the robot's serial port: --upload-port" in done.stderr


def test_an_upload_writes_the_image_through_the_port_that_was_named(tmp_path: Path) -> None:
    recorded = tmp_path / "arguments.json"
    avrdude = tmp_path / "avrdude"
    avrdude.write_text(
        f"#!/usr/bin/env python3\nimport json, sys\njson.dump(sys.argv[1:], open({str(recorded)!r}, 'w'))\n",
        encoding="utf-8",
    )
    avrdude.chmod(0o755)
    done = pio("run", "-e", "uno", "-t", "upload", "--upload-port", "/dev/robot", path=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    hex_file = "build/platformio/build/uno/firmware.hex"
    expected = ["-p", "atmega328p", "-c", "arduino", "-b", "115200", "-P", "/dev/robot", "-D", "-U"]
    assert json.loads(recorded.read_text(encoding="utf-8")) == [*expected, f"flash:w:{hex_file}:i"]
