"""Beginners' slips, of which Python says nothing, or nothing clear: slips.toml lists what shows each, and what is said
of it."""

from __future__ import annotations

import dis
import inspect
import re
import sys
import time
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

_COMMANDS = {"drive", "drive_speed", "stop", "forward", "turn", "wait", "wait_until"}
_BRAIN = "boebot.brain.brain"  # not imported here: most scripts need no more of the kit than they name


@cache
def _table() -> list[dict[str, str]]:
    import tomllib  # few processes need it

    slips: list[dict[str, str]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))["slip"]
    return slips


def of_sign(sign: str, **values: object) -> str:
    """The sentence of what the kit has noticed itself."""
    return next(slip["sentence"] for slip in _table() if slip.get("sign") == sign).format(**values)


def of_error(error: BaseException, text: str) -> str:
    """What is said after an error's text; "": nothing."""
    kinds = {kind.__name__ for kind in type(error).__mro__}
    for slip in _table():
        if slip.get("error") in kinds and (found := re.search(slip["text"], text)):
            return "; " + found.expand(slip["sentence"])
    return ""


def has_no_truth(reading: type) -> None:
    """Readings of that class have no truth and compare with readings alone: as tuples they would be true, and equal to
    no number, text or None."""

    def refuse(self: Any) -> bool:
        values = ", ".join(f".{name}" for name in self._fields if name not in ("age", "valid"))
        raise TypeError(of_sign("truth", reading=type(self).__name__, values=values))

    def guarded(compare: Callable[[Any, object], bool]) -> Callable[[Any, object], bool]:
        return lambda self, other: compare(self, other) if isinstance(other, tuple) else refuse(self)

    for name, method in (("__bool__", refuse), ("__eq__", guarded(tuple.__eq__)), ("__ne__", guarded(tuple.__ne__))):
        setattr(reading, name, method)


def uncalled(function: object) -> tuple[str, int | None]:
    """A command of the robot that this function names and does not call, as in a line `robot.stop`, and the number of
    the line; ("", None): it has none."""
    code = getattr(function, "__code__", None)
    pairs = () if code is None else pairwise(dis.get_instructions(code))
    dropped = [one for one, after in pairs if (one.opname, after.opname) == ("LOAD_ATTR", "POP_TOP")]
    found = (one for one in dropped if one.argval in _COMMANDS)
    return next(((one.argval, one.positions and one.positions.lineno) for one in found), ("", None))


def sleeps(function: object) -> bool:
    """That function, or a function or method that it names, calls something named sleep, or it is time.sleep."""
    owner, known = getattr(function, "__self__", None), getattr(function, "__globals__", {})
    named = [known.get(name, inspect.getattr_static(owner, name, None)) for name in _names(function)]
    return any(one is time.sleep or "sleep" in _names(one) for one in (function, *named))


def _names(function: object) -> tuple[str, ...]:
    """Of all that it uses and has not made itself."""
    return getattr(getattr(function, "__code__", None), "co_names", ())


def say_unrun() -> None:
    """Says so at the end of a script that defines a brain and runs no robot."""
    main, script = vars(sys.modules["__main__"]), Path(*sys.argv[:1])
    is_script = (main.get("__name__"), main.get("__spec__")) == ("__main__", None)
    has_run = {"boebot.boards", "multiprocessing"} & sys.modules.keys()  # perhaps in other processes
    if not is_script or has_run or hasattr(sys, "ps1") or hasattr(sys, "last_type"):
        return  # somebody types there, or it has failed
    for name in ("step", "main", "brain"):
        code: Any = getattr(one := main.get(name), "__code__", None)
        is_own = code is not None and Path(code.co_filename).name == script.name
        if (is_own and code.co_varnames[: code.co_argcount] == ("robot",)) or type(one).__module__ == _BRAIN:
            print(f"boebot: {of_sign('unrun', file=script, name=name)}", file=sys.stderr)
