"""The C of this folder, compiled with the firmware's frame.c for one end of the link and loaded.

A protection of the frame can be taken away: from a copy of frame.c before it is compiled, or from the sender. That is
how tests show what each of them is there for.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import cffi

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FIRMWARE = ROOT / "firmware" / "src"
SOURCES = ("channel.c", "c_decoder.c", "wrong_bits.c")
BUILT = ROOT / "build" / "error_rates"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")
FLAGS = ("-std=gnu11", "-O2", *WARNINGS, "-shared", "-fPIC")
# The end that receives -> what compiles frame.c for it.
ENDS = {"board": (), "host": ("-DFRAME_OF_HOST",)}


class Ablation(NamedTuple):
    """How to build the frame without one of its protections.

    Attributes:
        replaced: texts of frame.c and what stands in their places.
        flags: for the compiler.
    """

    replaced: tuple[tuple[str, str], ...] = ()
    flags: tuple[str, ...] = ()


ABLATIONS = {
    "checksum": Ablation((("check[0] == right[0] && check[1] == right[1] && check[2] == right[2]", "check != right"),)),
    "exact length": Ablation((("right == (int16_t)length", "length <= FRAME_ACCEPTED_MAX"),)),
    "stuffing": Ablation((("&& unstuff(bytes, stuffed)", "&& (unstuff(bytes, stuffed), true)"),)),
    "session seed": Ablation(
        (
            ("FRAME_SEED : seed", "FRAME_SEED : FRAME_SEED + 0u * seed"),
            (": decoder->seed;", ": FRAME_SEED + 0u * decoder->seed;"),
        )
    ),
    "rest": Ablation((("rest || ", "(rest && false) || "),)),
    "delimiter": Ablation((("  decoder->count = 0;\n  decoder->begins", "  decoder->begins"),)),
    "leading delimiter": Ablation((), ("-DCHANNEL_WITHOUT_LEADING_DELIMITER",)),
}


def frame_source(without: str) -> str:
    """The text of frame.c, if wanted without one of its protections.

    Raises:
        ValueError: frame.c does not hold what is to be replaced.
    """
    text = (FIRMWARE / "link" / "frame.c").read_text(encoding="utf-8")
    for before, after in (ABLATIONS[without] if without else Ablation()).replaced:
        if text.count(before) != 1:
            raise ValueError(f"without {without}: frame.c does not hold {before!r} once; tell ABLATIONS what it holds")
        text = text.replace(before, after)
    return text


@cache
def ffi() -> cffi.FFI:
    """The declarations of interface.cdef."""
    declared = cffi.FFI()
    declared.cdef((HERE / "interface.cdef").read_text(encoding="utf-8"))
    return declared


def new(declaration: str, value: object = None) -> Any:
    """A new C object of that kind, for example "channel *"; zero, or as `value` says."""
    return ffi().new(declaration, value)


@cache
def library(end: str, without: str = "") -> Any:
    """The functions of interface.cdef, compiled for the receiver at `end`.

    Args:
        end: "board" or "host".
        without: the protection to take away, one of ABLATIONS; "" for none.
    """
    ablation = ABLATIONS[without] if without else Ablation()
    folder = BUILT / "-".join([end, *without.split()])
    folder.mkdir(parents=True, exist_ok=True)
    frame = folder / "frame.c"
    frame.write_text(frame_source(without), encoding="utf-8")
    return ffi().dlopen(str(compiled(folder, [*ENDS[end], *ablation.flags], frame)))


def compiled(folder: Path, flags: list[str], frame: Path) -> Path:
    """The shared library; compiled anew only when a source has changed, and never while another process reads it."""
    sources = [*(HERE / name for name in SOURCES), frame]
    seen = [*sources, *HERE.glob("*.h"), *(FIRMWARE / "generated").glob("[cm]*.h"), *(FIRMWARE / "link").glob("*.h")]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in seen) + repr(flags).encode()).hexdigest()[:16]
    target = folder / f"{digest}.so"
    if not target.exists():
        partial = folder / f"{digest}.{os.getpid()}.so"
        includes = [f"-I{HERE}", f"-I{FIRMWARE}"]
        command = ["cc", *FLAGS, *flags, *includes, *map(str, sources), "-lm", "-o", str(partial)]
        subprocess.run(command, check=True)
        partial.replace(target)
    return target
