"""Prints the Python packages that a purpose needs, as pyproject.toml declares them, one to a line.

    python tools/requirements.py build|run|can|firmware|foxglove|test|check ...

`build` is what setup.py needs, `run` what the installed distribution needs; the others are its extras. The
exact versions are in requirements.lock, which pip takes as --constraint.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]


def requirements(purpose: str) -> list[str]:
    declared = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    purposes: dict[str, list[str]] = {
        **declared["project"]["optional-dependencies"],
        "build": declared["build-system"]["requires"],
        "run": declared["project"]["dependencies"],
    }
    if purpose not in purposes:
        raise SystemExit(f"requirements.py: unknown purpose {purpose!r}; known: {' '.join(sorted(purposes))}")
    return purposes[purpose]


if __name__ == "__main__":
    print("\n".join(name for purpose in sys.argv[1:] for name in requirements(purpose)))
