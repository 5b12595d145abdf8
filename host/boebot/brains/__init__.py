"""Bundled brains, and how a brain is found and loaded.

A brain is a Python file with a function `step(robot)`, or with a class `Brain` that has a method
`step(self, robot)`. It may also say `PERIOD = 0.1` (seconds from step to step) and `NEEDS = ["whiskers", "ping"]`
(devices without which it cannot work).
"""

from __future__ import annotations

import contextlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from boebot.brain import Brain
from boebot.errors import BrainError
from boebot.robot import Robot

FOLDER = Path(__file__).resolve().parent


@dataclass(frozen=True)
class LoadedBrain:
    """A brain ready to run."""

    name: str
    step: Callable[[Robot], object]
    period: float | None = None
    """Seconds from step to step, if the brain says so."""
    needs: tuple[str, ...] = ()
    path: Path | None = None
    """The brain's file, if it came from one."""
    brain: Brain | None = None
    """The brain of processes, if it is one."""


def bundled() -> list[str]:
    """Names of the bundled brains."""
    return sorted(path.stem for path in FOLDER.glob("*.py") if not path.stem.startswith("_"))


def load_brain(source: object) -> LoadedBrain:
    """The brain in a file, of a bundled name, or the function, class or object itself.

    Raises:
        BrainError: it is not there, does not compile, fails while it is loaded, or is no brain.
    """
    if isinstance(source, str | Path):
        path = _find(source)
        module = _execute(path)
        return _from_module(module, path)
    if isinstance(source, ModuleType):
        return _from_module(source, Path(source.__file__) if source.__file__ else None)
    if isinstance(source, type):
        return _from_object(_construct(source, None), source.__name__, None)
    step = getattr(source, "step", None)
    if callable(step):
        return _from_object(source, type(source).__name__, None)
    if callable(source):
        name = getattr(source, "__name__", "brain")
        _check_step(source, name)
        return LoadedBrain(name, source, _period(source, name), _needs(source, name))
    raise BrainError(f"{source!r} is no brain; expected a name, a Python file, or something with step(robot)")


def place(error: BaseException, path: Path | None) -> str:
    """Where in the brain's own file the error arose: "wander.py, line 12", or "" if it cannot be told."""
    if isinstance(error, SyntaxError) and error.filename and path is not None and Path(error.filename) == path:
        return f"{path}, line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    inside = [frame for frame in frames if path is not None and frame.filename == str(path)]
    if not inside and path is None:  # from a script or notebook: the outermost frame outside the kit
        package = str(FOLDER.parent)
        inside = [frame for frame in frames if not frame.filename.startswith(package)][:1]
    return f"{inside[-1].filename}, line {inside[-1].lineno}" if inside else ""


def explain(error: BaseException, path: Path | None) -> str:
    """One sentence: the place in the brain's file, what kind of error, and the first line of its text."""
    where = place(error, path) or str(path or "the brain")
    what = str(error.msg if isinstance(error, SyntaxError) else error).strip().partition("\n")[0]
    if isinstance(error, SyntaxError | BrainError):
        return f"{where}: {what}"
    return f"{where}: {type(error).__name__}" + (f": {what}" if what else "")


def _find(source: str | Path) -> Path:
    path = Path(source)
    if path.suffix == ".py" or len(path.parts) > 1:
        if path.is_file():
            return path.resolve()
        raise BrainError(f"there is no brain file {path}")
    bundled_path = FOLDER / f"{source}.py"
    if str(source) in bundled() and bundled_path.is_file():
        return bundled_path
    hint = f"; did you mean {path}.py?" if Path(f"{path}.py").is_file() else ""
    raise BrainError(
        f"there is no brain {str(source)!r}; expected a bundled one ({', '.join(bundled())}) or a Python file{hint}"
    )


def _execute(path: Path) -> ModuleType:
    """Runs the brain's file as a module of its own, afresh."""
    name = f"boebot_brain_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BrainError(f"{path} is no Python file; a brain's file ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with _neighbours(path.parent):
            code = compile(path.read_bytes(), str(path), "exec", dont_inherit=True)
            exec(code, module.__dict__)
    except KeyboardInterrupt:
        raise
    except (Exception, SystemExit) as error:
        raise BrainError(explain(error, path)) from error
    return module


@contextlib.contextmanager
def _neighbours(folder: Path) -> Iterator[None]:
    """Lets a brain import files beside it, as a script may."""
    entry = str(folder)
    sys.path.insert(0, entry)
    try:
        yield
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(entry)


def _from_module(module: ModuleType, path: Path | None) -> LoadedBrain:
    name = path.stem if path is not None else module.__name__
    where = str(path or name)
    period, needs = _period(module, where), _needs(module, where)
    kind = getattr(module, "Brain", None)
    if isinstance(kind, type):
        made = _from_object(_construct(kind, path), where, path)
        return LoadedBrain(name, made.step, period or made.period, needs or made.needs, path)
    step = getattr(module, "step", None)
    if callable(step):
        _check_step(step, where)
        return LoadedBrain(name, step, period, needs, path)
    raise BrainError(f"{where} has neither a function step(robot) nor a class Brain with step(self, robot)")


def _from_object(brain: object, name: str, path: Path | None) -> LoadedBrain:
    step = getattr(brain, "step", None)
    if not callable(step):
        raise BrainError(f"{name}: class {type(brain).__name__} has no method step(self, robot)")
    _check_step(step, name)
    composed = brain if isinstance(brain, Brain) else None
    return LoadedBrain(name, step, _period(brain, name), _needs(brain, name), path, composed)


def _check_step(step: Callable[..., object], where: str) -> None:
    """Refuses a step whose body would never run, for a call of it only makes a coroutine or a generator."""
    whole = (step, getattr(step, "__call__", step))  # noqa: B004
    if any(inspect.iscoroutinefunction(part) for part in whole):
        raise BrainError(f"{where}: step is an async function; expected a plain one, def step(robot)")
    if any(inspect.isgeneratorfunction(part) or inspect.isasyncgenfunction(part) for part in whole):
        raise BrainError(f"{where}: step contains yield; expected a function that returns, def step(robot)")


def _construct(kind: type, path: Path | None) -> Any:
    try:
        return kind()
    except Exception as error:
        raise BrainError(explain(error, path)) from error


def _period(owner: object, where: str) -> float | None:
    period = getattr(owner, "PERIOD", None)
    if period is None:
        return None
    if isinstance(period, bool) or not isinstance(period, int | float) or not period > 0:
        raise BrainError(f"{where}: PERIOD is {period!r}; expected seconds from step to step")
    return float(period)


def _needs(owner: object, where: str) -> tuple[str, ...]:
    needs = getattr(owner, "NEEDS", ())
    if isinstance(needs, str):
        return (needs,)
    if not isinstance(needs, list | tuple | set | frozenset) or not all(isinstance(need, str) for need in needs):
        raise BrainError(f'{where}: NEEDS is {needs!r}; expected a list of device names such as ["whiskers", "ping"]')
    return tuple(needs)
