"""What a logic analyser has recorded, a value change dump (IEEE 1364-2005, 18), as a wave for a pin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vcd.reader import TokenKind, VCDParseError, tokenize

from boebot.errors import CallError, did_you_mean
from sim_bridge.boards.board import Level

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12, "fs": 1e-15}
OF_VCD = {"0": Level.LOW, "1": Level.HIGH}  # x and z: nothing is driven


def read_wave(path: Path, signal: str | None = None) -> NDArray[np.float64]:
    """A signal of the file by its name, with the scopes that it is in where there are several of that name
    ("top.key"), and left out where there is one only: rows of a time (s) and a level
    (LOW, HIGH, or RELEASED for x and z), as `Pin.wave` takes them.

    Raises:
        CallError: the file cannot be read, is no dump, does not say its unit of time, or has no such signal of one bit.
    """
    names: dict[str, str] = {}  # code of each signal of one bit, by its name
    changes: dict[str, list[tuple[float, int]]] = {}
    scopes: list[str] = []
    unit_s, time_s = None, 0.0
    try:
        with path.open("rb") as file:
            for token in tokenize(file):
                if token.kind is TokenKind.TIMESCALE:
                    unit_s = token.timescale.magnitude * UNITS[token.timescale.unit.value]
                elif token.kind is TokenKind.SCOPE:
                    scopes.append(token.scope.ident)
                elif token.kind is TokenKind.UPSCOPE:
                    scopes.pop()
                elif token.kind is TokenKind.VAR and token.var.size == 1:
                    names[".".join((*scopes, token.var.ref_str))] = token.var.id_code
                elif token.kind is TokenKind.CHANGE_TIME:
                    if unit_s is None:
                        raise ValueError("it has no $timescale")
                    time_s = token.time_change * unit_s
                elif token.kind is TokenKind.CHANGE_SCALAR:
                    level = OF_VCD.get(token.scalar_change.value, Level.RELEASED)
                    changes.setdefault(token.scalar_change.id_code, []).append((time_s, level))
    except OSError as error:
        raise CallError(f"{path} cannot be read: {error.strerror}") from None
    except (VCDParseError, ValueError, IndexError) as error:
        raise CallError(f"{path} is no value change dump: {error}") from None
    meant = [signal] if signal in names else [name for name in names if f".{name}".endswith(f".{signal or name}")]
    if len({names[name] for name in meant}) != 1:
        asked = "names none" if signal is None else f"names {signal!r}"
        hint = "" if meant else did_you_mean(signal or "", names)
        raise CallError(f"{path} has the signals {', '.join(names) or 'none'}, the wave {asked}; expected one{hint}")
    return np.array(changes.get(names[meant[0]], []), float).reshape(-1, 2)
