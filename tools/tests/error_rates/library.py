"""The C of this folder, compiled with the firmware's frame.c for one end of the link and loaded.

A protection of the frame can be left out: in a copy of frame.c before it is compiled, or in the sender. So tests show
what each of them is for.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import cffi

from tools.tests.planted import changed_text

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
FIRMWARE = ROOT / "firmware" / "src"
SOURCES = (HERE / "channel.c", HERE / "wrong_bits.c")
BUILT = ROOT / "build" / "error_rates"
FLAGS = ("-std=gnu11", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-shared", "-fPIC")
# The end that receives -> what compiles frame.c for it.
ENDS = {"board": (), "host": ("-DFRAME_OF_HOST",)}
# A protection -> texts of frame.c and what replaces them; the leading delimiter is left out by the sender.
ABLATIONS = {
    "checksum": {"check[0] == right[0] && check[1] == right[1] && check[2] == right[2]": "check != right"},
    "exact length": {"right == (int16_t)length": "length <= FRAME_ACCEPTED_MAX"},
    "stuffing": {"&& unstuff(bytes, stuffed)": "&& (unstuff(bytes, stuffed), true)"},
    "session seed": {
        "FRAME_SEED : seed": "FRAME_SEED : FRAME_SEED + 0u * seed",
        ": decoder->seed;": ": FRAME_SEED + 0u * decoder->seed;",
    },
    "delimiter": {"  decoder->count = 0;\n  decoder->begins": "  decoder->begins"},
    "leading delimiter": {},
}


@cache
def ffi() -> cffi.FFI:
    """The headers' declarations."""
    declared = cffi.FFI()
    for name in ("channel.h", "wrong_bits.h"):
        text = (HERE / name).read_text(encoding="utf-8")
        declared.cdef(re.sub(r"^#(?!define \w+ \d).*", "", text, flags=re.MULTILINE))
    return declared


def new(declaration: str, value: object = None) -> Any:
    """A new C object of that kind, for example "channel *"; zero, or as `value` says."""
    return ffi().new(declaration, value)


@cache
def library(end: str, without: str = "") -> Any:
    """The headers' functions, compiled for the receiver at `end`.

    Args:
        end: "board" or "host".
        without: the protection to leave out, one of ABLATIONS; "" for none.
    """
    folder = BUILT / "-".join([end, *without.split()])
    folder.mkdir(parents=True, exist_ok=True)
    frame = folder / "frame.c"
    changes = ABLATIONS[without] if without else {}
    frame.write_text(changed_text(FIRMWARE / "link" / "frame.c", changes), encoding="utf-8")
    leading = ["-DCHANNEL_WITHOUT_LEADING_DELIMITER"] if without == "leading delimiter" else []
    return ffi().dlopen(str(compiled(folder, [*ENDS[end], *leading], frame)))


def compiled(folder: Path, flags: list[str], frame: Path) -> Path:
    """The shared library; compiled anew only when a source has changed, and never while another process reads it."""
    sources = [*SOURCES, frame]
    seen = [*sources, *HERE.glob("*.h"), *(FIRMWARE / "generated").glob("[cm]*.h"), *(FIRMWARE / "link").glob("*.h")]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in seen) + repr(flags).encode()).hexdigest()[:16]
    target = folder / f"{digest}.so"
    if not target.exists():
        partial = folder / f"{digest}.{os.getpid()}.so"
        command = ["cc", *FLAGS, *flags, f"-I{HERE}", f"-I{FIRMWARE}", *map(str, sources), "-lm", "-o", str(partial)]
        subprocess.run(command, check=True)
        partial.replace(target)
    return target
