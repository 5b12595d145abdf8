"""Writes programs into an Uno through its boot loader, by avrdude (STK500 at 115,200 bit/s), which reads them back."""

from __future__ import annotations

import os
import queue
import re
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

from boebot import missing
from boebot.boards import is_live
from boebot.errors import BoardError, CallError
from boebot.image.program import BOOT_SECTIONS
from boebot.link.ports import holder_of

UPLOAD_BAUD = 115_200  # of the Uno's boot loader
ROOM = max(BOOT_SECTIONS)  # bytes of flash before the boot loader
BARS = 100  # marks that avrdude prints while it writes and reads back
LIFE = re.compile(rb"#|\navrdude: ")  # what it prints of what went well
SILENCE_S = 15.0  # of avrdude, which tries for minutes where a byte was lost
LEAST_S, PER_BYTE_S = 30.0, 0.005  # for all of it; a byte takes 0.25 ms on a computer that does nothing else
_PACKAGES = {"apt_get": "avrdude", "brew": "avrdude", "winget": "AVRDudes.AVRDUDE"}
_SIGNATURE = re.compile(r"device signature = 0x([0-9a-f]{6})(?: \(probably (\w+)\))?")
_DIFFERS = re.compile(r"(?is)verification.*(mismatch|error)|(mismatch|error).*verification")
_EXPECTED = "1e950f"  # ATmega328P (data sheet 28.3)


def write(
    flash: bytes, port: str, progress: Callable[[float], object] = lambda _: None, *, silence_s: float = SILENCE_S
) -> None:
    """Writes the flash from address 0 on, and reads it back; the EEPROM stays.

    Args:
        flash: what it will hold; what is erased at its end is left as it is.
        port: a serial port, a pseudo-terminal, or socket://HOST:PORT.
        progress: called with the percentage that is done.
        silence_s: in which nothing goes well, after which avrdude is ended.

    Raises:
        CallError: avrdude knows no such port.
        BoardError: the program is too large, avrdude is missing, the port is held or none, the board does not answer,
            is another chip, or did not keep the program. The port is free then, and another try may work.
    """
    if (said := _avrdude("w", flash, port, progress, silence_s)) is not None:
        raise BoardError(_why(port, said))


def holds(flash: bytes, port: str) -> bool:
    """Whether the board there has that in its flash from address 0 on, as it says. Nothing is written. Raises as
    `write`."""
    said = _avrdude("v", flash, port)
    if said is not None and not _DIFFERS.search(said):
        raise BoardError(_why(port, said))
    return said is None


def _avrdude(
    does: str,
    flash: bytes,
    port: str,
    progress: Callable[[float], object] = lambda _: None,
    silence_s: float = SILENCE_S,
) -> str | None:
    """Has avrdude write (w) the flash, or verify it (v): None, or all that it said where it failed."""
    flash = flash.rstrip(b"\xff")
    if len(flash) > ROOM:
        raise BoardError(f"the program has {len(flash)} bytes; expected {ROOM} at most, before the boot loader")
    if shutil.which("avrdude") is None:
        raise BoardError(missing.program("writing programs into boards", "avrdude", **_PACKAGES))
    path = _path(port)
    if holder := None if path.startswith("net:") else holder_of(path):
        raise BoardError(f"{port} is busy: {holder} has it open")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program.bin")
        program.write_bytes(flash)
        command = ["avrdude", "-p", "atmega328p", "-c", "arduino", "-b", str(UPLOAD_BAUD), "-P", path, "-D"]
        command += ["-U", f"flash:{does}:{program}:r"]
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        ) as tool:
            try:
                assert tool.stderr is not None
                said, is_late = _listen(tool.stderr, LEAST_S + len(flash) * PER_BYTE_S, silence_s, progress)
                if not is_late:
                    tool.wait()
            finally:  # Ctrl-C, too
                tool.kill()
    return said if is_late or tool.returncode else None


def _path(port: str) -> str:
    """The port as avrdude names it."""
    if not is_live(port) or port.startswith("rfc2217:"):
        raise CallError(f"programs cannot be written through {port!r}; expected a serial port or socket://HOST:PORT")
    if port.startswith("socket://"):
        if not re.fullmatch(r"socket://[^:/]+:\d{1,5}/?", port):
            raise CallError(f"{port!r} is no socket address; expected socket://HOST:PORT")
        return f"net:{port.removeprefix('socket://').rstrip('/')}"
    return port.removeprefix("serial:").partition("?")[0]


def _listen(
    stream: IO[bytes], limit_s: float, silence_s: float, progress: Callable[[float], object]
) -> tuple[str, bool]:
    """All that avrdude says until it ends or is too late, and whether it is. A thread reads: not every system can wait
    for a pipe for a while only."""
    parts: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(os.dup(stream.fileno()), parts.put), daemon=True).start()
    said, begun = b"", time.perf_counter()
    heard, marks = begun, 0
    while (now := time.perf_counter()) < min(begun + limit_s, heard + silence_s):
        try:
            data = parts.get(timeout=min(1.0, heard + silence_s - now))
        except queue.Empty:
            continue
        if not data:
            return said.decode("utf-8", "replace"), False
        said += data
        if marks != (marks := len(LIFE.findall(said))):
            heard = now
            progress(100 * min(said.count(b"#") / BARS, 1.0))
    return said.decode("utf-8", "replace"), True


def _read(pipe: int, to: Callable[[bytes], object]) -> None:
    """All that comes through a pipe, and then nothing, once."""
    with open(pipe, "rb", buffering=0) as stream:
        while data := stream.read(4096):
            to(data)
    to(b"")


def _why(port: str, said: str) -> str:
    """Why avrdude has failed, in a sentence."""
    words = said.lower()
    signature = _SIGNATURE.search(words)
    if signature and signature[1] != _EXPECTED:
        chip = f", as of a {signature[2]}" if signature[2] else ""
        return f"the board at {port} has the signature {signature[1]}{chip}; expected {_EXPECTED}, an ATmega328P"
    if _DIFFERS.search(said):
        return f"the board at {port} did not keep the program: what was read back differs; flash it again"
    if opening := re.search(r"cannot (?:open port|connect)[^:]*: (.+)|cannot resolve (.+)", said, re.IGNORECASE):
        return f"{port} cannot be opened: {(opening[1] or opening[2]).strip().lower()}"
    share = 100 * said.count("#") // BARS
    if "writing |" in words:
        return (
            f"the board at {port} stopped answering after {share} % of the upload: is its cable sound? flash it again"
        )
    return (
        f"the board at {port} does not answer; expected an Uno with its boot loader, and no other program at its port"
    )
