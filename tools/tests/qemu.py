"""The firmware's images in QEMU, an emulator of other authors: each says hello and answers `identify`, and no more is
asked.

`python -m tools.tests.qemu [IMAGE.elf ...]`; `make soak` does it with all images. QEMU 7.2 (Debian:
qemu-system-misc) has no Timer2, pin changes, EEPROM, converter or watchdog, and its SLEEP never ends.
"""

from __future__ import annotations

import argparse
import os
import select
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from boebot.link import frame, messages
from tools.tests.avr_program import IMAGES, ROOT

QEMU = ["qemu-system-avr", "-M", "uno", "-nographic", "-monitor", "none", "-serial", "stdio", "-bios"]
WAIT_S = 30.0
HELLOS = 2  # before it is asked: the first comes at the start, the next one from the main loop


class SilentError(Exception):
    """The image did not say what it should; the text says what was heard."""


def identity(elf: Path) -> messages.Identity:
    """What an image says of itself; its serial line is the emulator's input and output.

    Raises:
        SilentError: no hello, or no identity.
        OSError: QEMU is not there.
    """
    decoder, hellos = frame.Decoder(), 0
    command = [*QEMU, str(elf)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            end = time.perf_counter() + WAIT_S
            while select.select([process.stdout], [], [], max(0.0, end - time.perf_counter()))[0]:
                data = os.read(process.stdout.fileno(), 4096)
                if not data:
                    break
                for number, _, payload in decoder.feed(data):
                    if number == messages.Identity.ID:
                        return messages.Identity.unpack(payload)
                    hellos += number == messages.Hello.ID
                    if hellos == HELLOS:
                        process.stdin.write(frame.encode(messages.Identify.ID, 0, b""))
                        process.stdin.flush()
        finally:
            process.kill()
    raise SilentError(f"no identity within {WAIT_S:g} s, after {hellos} hellos")


def check(elf: Path) -> str:
    """One line about the answer.

    Raises:
        SilentError: no answer, or another image's.
    """
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder, "image.bin")
        subprocess.run(["avr-objcopy", "-O", "binary", str(elf), str(binary)], check=True)
        begun = time.perf_counter()
        answer = identity(elf)
        size, crc = binary.stat().st_size, zlib.crc32(binary.read_bytes())
    if (answer.image_size, answer.image_hash) != (size, crc):
        raise SilentError(f"it says {answer.image_size} B, {answer.image_hash:08x}; the image has {size} B, {crc:08x}")
    took = time.perf_counter() - begun
    return f"{answer.pin_map.rstrip(bytes(1)).decode()}, {size:,} B, CRC-32 {crc:08x}, after {took:.1f} s"


def main() -> int:
    """Asks each image."""
    built = [ROOT / "build" / "images" / f"{name}.elf" for name in IMAGES]
    parser = argparse.ArgumentParser(prog="python -m tools.tests.qemu", description=(__doc__ or "").split(":")[0])
    parser.add_argument("images", nargs="*", type=Path, default=built, metavar="IMAGE.elf")
    failed = 0
    for elf in parser.parse_args().images:
        try:
            said = check(elf)
        except (SilentError, OSError, subprocess.CalledProcessError) as error:
            said, failed = f"FAILED: {error}", 1
        print(f"{elf.name} in QEMU: {said}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
