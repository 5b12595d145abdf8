"""Bundled brains, and how a brain is found and loaded.

A brain is a Python file with one of

    def step(robot: Robot) -> None: ...      # called every PERIOD
    def main(robot: MainRobot) -> None: ...  # runs once from top to bottom (boebot.brain.main_brain)
    class Brain: ...                         # with a method step(self, robot); made afresh for each run
    brain = Brain([Wander(), Avoid()])       # a boebot.brain.Brain: processes chosen by utility

or a TOML file that composes such processes (boebot.brain.composition). A Python file may also say `PERIOD = 0.1`
(seconds from step to step) and `NEEDS = ["whiskers", "ping"]` (devices without which it cannot work); a brain of
processes knows both by itself. `ROBOT = "shieldbot-line"` and `ARENA = "office"`, in a TOML file `robot` and `arena`,
name the bundled ones of a run that names neither.

Files are read anew for each run and each robot, with the modules beside them that they import as they are loaded; what
a step imports is found as in the script. A Brain object that is handed over is run itself, so that its maker can read
its `steps` and `switches` afterwards: with each new run it begins afresh, and it drives one robot at a time.
"""

from __future__ import annotations

import contextlib
import importlib.util
import inspect
import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from sysconfig import get_path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from boebot import arguments, slips
from boebot.errors import BrainError, CallError, as_utf8, did_you_mean
from boebot.pausable_thread import leave_copy
from boebot.robot import Robot
from boebot.sketches import NAMES as SKETCH_NAMES

if TYPE_CHECKING:  # what a brain of one function does without is imported where it is needed
    from boebot.brain import Brain
    from boebot.brain.main_brain import MainBrain

FOLDER = Path(__file__).resolve().parent
_OTHERS = (FOLDER.parent, *map(get_path, ("stdlib", "purelib", "platlib")))  # the kit, Python, other packages
_NOBODYS = ("<frozen ", *(f"{folder}{os.sep}" for folder in _OTHERS))  # what files begin with that are not the user's
PYTHON, TOML = ".py", ".toml"  # what brains are written in
PROGRAMS = (".elf", ".hex")  # for the board: they drive a robot in place of a brain
SKETCHES = (".ino", ".pde", ".ini")  # of which one is built
_loading = threading.RLock()  # a process has one table of modules, whatever its threads load
if hasattr(os, "register_at_fork"):  # of another thread's lock a copy of the process would wait forever
    os.register_at_fork(after_in_child=_loading._at_fork_reinit)  # type: ignore[attr-defined]
_executing: set[tuple[Path, int]] = set()  # files that are being loaded, each with its thread
_beside: dict[Path, dict[str, ModuleType]] = {}  # what each brain's file has imported, as it was last loaded


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
    """The brain of processes behind `step`, if it is one: its `steps` and `switches` record the run."""
    main: MainBrain | None = None
    """What runs `main(robot)` behind `step`, if that is the brain."""
    sources: Mapping[str, bytes] = field(default_factory=dict)
    """Of a program that was built of a sketch: its files by name."""
    robot: str | None = None
    """The bundled robot, and `arena` the bundled arena, of a run that names neither."""
    arena: str | None = None

    @property
    def is_program(self) -> bool:
        """It is a program for the board, and there is no brain."""
        return self.path is not None and self.path.suffix.lower() in PROGRAMS

    @property
    def is_over(self) -> bool:
        """It has done what it is for, and the run may end: its `main` has returned."""
        return self.main is not None and self.main.is_over

    @property
    def notices(self) -> Sequence[str]:
        """What a user should know of the run, in sentences."""
        return () if self.main is None else self.main.notices

    def end(self) -> None:
        """The run has ended: lets go of what the brain still holds."""
        if self.main is not None:
            self.main.end()

    @property
    def odometry(self) -> str | None:
        """What the poses in the brain came from in this run: "odometer", "encoders", or "commands" where the robot
        has neither; None: nothing in it kept a pose."""
        if self.brain is None:
            return None if self.main is None else self.main.odometry_source
        from boebot.cognition import Odometry

        poses = [one for one in self.brain.processes if isinstance(one, Odometry) and one.name in self.brain.begun]
        return ", ".join(dict.fromkeys(one.source for one in poses)) or None


def bundled() -> list[str]:
    """Names of the bundled brains."""
    return sorted(bundled_files())


def bundled_files() -> dict[str, Path]:
    """Name -> file of each bundled brain."""
    return {path.stem: path for path in FOLDER.iterdir() if path.suffix in (PYTHON, TOML) and path.stem[0] != "_"}


def names_program(source: object) -> bool:
    """That is meant to be a program for the board: an ELF or HEX file, or a sketch or a folder, of which one is built.
    The name of a bundled brain means that brain."""
    if not isinstance(source, str | Path) or str(source) in bundled_files():
        return False
    return Path(source).suffix.lower() in (*PROGRAMS, *SKETCHES) or os.path.isdir(source)  # noqa: PTH112 (no error where it is too long)


def load_program(source: object, progress: Callable[[float], object] | None = None) -> LoadedBrain | None:
    """The program for the board in a file, or built of a sketch or project; None: that names no such thing.
    `progress`: is called with the seconds that a build has taken.

    Raises:
        CallError: it is not there.
        BoebotError: it cannot be built, as `boebot.sketch.build.built` says.
    """
    if isinstance(source, LoadedBrain) and source.is_program:
        return source
    if not isinstance(source, str | Path) or not names_program(source):
        return None
    path = Path(source)
    if path.suffix.lower() not in PROGRAMS:
        from boebot.sketch.build import built

        made = built(path, progress)
        return LoadedBrain(made.name, lambda robot: None, path=made.elf, sources=made.sources)
    if not path.is_file():
        raise CallError(f"there is no program {path}; expected an ELF or HEX file")
    return LoadedBrain(as_utf8(path.name), lambda robot: None, path=path.resolve())


def program_state(path: Path) -> object:
    """What the program in a file, or of a sketch or project, depends on: another one where it is to be loaded again.
    Raises as `load_program`."""
    from boebot.sketch.find import below, find

    if path.suffix.lower() in PROGRAMS:
        return path
    found = find(path)
    times = [(one, one.stat().st_mtime_ns) for one in below(found.folder, ("",)) if not found.files]  # of a project
    return path, *found.files.items(), *times


def load_brain(source: object) -> LoadedBrain:
    """The brain in a file, of a bundled name, or the function, class, object or module itself.

    Raises:
        BrainError: it is not there, does not compile, fails while it is loaded, or is no brain.
    """
    if isinstance(source, LoadedBrain):
        return source
    if isinstance(source, str | Path):
        path = _find(source)
        if path.suffix == TOML:
            from boebot.brain import composition
            from boebot.description import toml_files

            table = toml_files.read(path, BrainError)
            made = _from_object(composition.composed(table, path.name), as_utf8(path.stem), path)
            named: dict[str, Any] = {key: table[key] for key in ("robot", "arena") if key in table}
            for key, name in named.items():
                _check_bundled(name, toml_files.where(table, path.name, key), key)
            return replace(made, **named)
        source = _execute(path)
    if isinstance(source, ModuleType):
        file = getattr(source, "__file__", None)
        found = _from_module(source, Path(file) if file else None)
        robot, arena = getattr(source, "ROBOT", None), getattr(source, "ARENA", None)
        _check_bundled(robot, source.__name__, "ROBOT")
        _check_bundled(arena, source.__name__, "ARENA")
        return replace(found, robot=robot, arena=arena)
    if isinstance(source, type):
        return _from_object(_construct(source, None), source.__name__, None)
    from boebot.brain import Brain, Process

    step = getattr(source, "step", None)
    if isinstance(source, Process):
        raise BrainError(f"{source.name!r} is one process; expected a brain of it, Brain([{type(source).__name__}()])")
    if callable(step):
        return _from_object(source, "brain" if type(source) is Brain else type(source).__name__, None)
    if callable(source):
        name = getattr(source, "__name__", "brain")
        if name == "main" and _takes_one(source):
            return _from_main(source, "main", name, source, None)
        _check_function(source, name, "step")
        return LoadedBrain(name, source, _period(source, name), _needs(source, name))
    raise BrainError(
        f"{arguments.shown(source)} is no brain; expected a name, a Python or TOML file, a boebot.brain.Brain, or "
        "something with step(robot)"
    )


def is_users(file: str) -> bool:
    """A file of code is the user's own: not the kit's, Python's, or a package's."""
    return not file.startswith(_NOBODYS)


def place(error: BaseException, path: Path | None) -> str:
    """Where in the user's own files the error arose: "wander.py, line 12", or "" if that is not known.

    The innermost line of the brain's file. Of a brain from a script or a notebook, or one whose fault is in a file that
    it imports: of the first file that is the user's.
    """
    if isinstance(error, SyntaxError) and error.filename and path is not None and Path(error.filename) == path:
        return f"{path}, line {error.lineno}"
    frames = [(frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    names = [name for name, _ in frames]
    outside = [name for name in names if is_users(name)]
    theirs = str(path) if str(path) in names else next(iter(outside), None)
    lines = [line for name, line in frames if name == theirs]
    return f"{theirs}, line {lines[-1]}" if lines else ""


def part(error: BaseException) -> str:
    """The part of a brain of processes in which the error arose: "process 'avoid'", "state variable 'near'", or ""."""
    from boebot.brain import Process, StateVariable

    for frame, _ in traceback.walk_tb(error.__traceback__):
        code = frame.f_code
        owner = frame.f_locals.get(code.co_varnames[0]) if code.co_argcount else None
        if isinstance(owner, Process):
            return f"process {owner.name!r}"
        if isinstance(owner, StateVariable):
            return f"state variable {owner.name!r}"
    return ""


def explain(error: BaseException, path: Path | None) -> str:
    """One sentence: the place in the brain's file, the process, what kind of error, and the first line of its text."""
    what = _first_line(error)
    if not isinstance(error, SyntaxError | BrainError):
        what = type(error).__name__ + (f": {what}" if what else "")
    slip = slips.of_error(error, _first_line(error))
    return locate(error, path, what.partition("; its devices")[0] + slip if slip else what)


def locate(error: BaseException, path: Path | None, sentence: str) -> str:
    """The sentence with the error's place, and the process where it arose, before it."""
    inside = part(error)
    name = inside.partition(" '")[2].rstrip("'")
    if inside and (repr(name) in sentence or sentence.startswith(f"{name}: ")):  # it says so itself
        inside = ""
    return ": ".join(filter(None, (place(error, path) or str(path or "the brain"), inside, sentence)))


def _first_line(error: BaseException) -> str:
    try:
        return str(error.msg if isinstance(error, SyntaxError) else error).strip().partition("\n")[0]
    except Exception:  # an exception class of the user's may have its own faults
        return ""


def _find(source: str | Path) -> Path:
    path = Path(source)
    if names_program(source):
        raise BrainError(f"{path} is a program for a board; expected a brain, a Python or TOML file")
    if path.suffix in (PYTHON, TOML) or len(path.parts) > 1:
        if path.is_file():
            return path.resolve()
        raise BrainError(f"there is no brain file {path}; expected a Python or TOML file")
    files = bundled_files()
    if str(source) in files:
        return files[str(source)]
    meant = next((f"{path}{suffix}" for suffix in (PYTHON, TOML) if Path(f"{path}{suffix}").is_file()), None)
    hint = f"; did you mean {meant}?" if meant else did_you_mean(str(source), files)
    if str(source) in SKETCH_NAMES:
        hint = f"; the bundled sketch of that name is copied by: boebot new {source} --sketch"
    raise BrainError(
        f"there is no brain {str(source)!r}; expected a bundled one ({', '.join(bundled())}) or a Python or TOML "
        f"file{hint}"
    )


def _execute(path: Path) -> ModuleType:
    """Runs the brain's file as a new module."""
    if (loading := (path, threading.get_ident())) in _executing:
        raise BrainError(slips.of_sign("itself", file=path.name))
    bundled = path.parent == FOLDER
    name = f"{__name__}.{path.stem}" if bundled else f"boebot_brain_{path.stem}"  # pickles name a class by its module
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BrainError(f"{path} is no brain file; a brain's file ends in .py or .toml")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        process = os.getpid()
        _executing.add(loading)
        with _loading, _neighbours(path):
            code = compile(path.read_bytes(), str(path), "exec", dont_inherit=True)
            exec(code, module.__dict__)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # also SystemExit, and what the brain itself derives from it
        raise BrainError(explain(error, path)) from error
    finally:
        _executing.remove(loading)
        leave_copy(process)
    return module


def beside(path: Path) -> set[Path]:
    """The user's Python files in a brain's folder, and below, that are loaded: by the brain's own file, as it was last
    loaded, or by others of this process."""
    modules = {**sys.modules, **_beside.get(path, {})}.items()
    files = {Path(file).resolve() for name, module in modules if name != "__main__" and (file := _file(module))}
    return {file for file in files if file.suffix == PYTHON and file.is_relative_to(path.parent) and file.is_file()}


@contextlib.contextmanager
def _neighbours(path: Path) -> Iterator[None]:
    """Lets a brain import files beside it, as a script may, and as they are now. What other brains have imported, or
    this one before, has no part in it; nor have the script's own modules of those names. They come back afterwards."""
    entry = str(path.parent)
    of = {id(module): brain.parent for brain, modules in _beside.items() for module in modules.values()}
    there = {one.name.partition(".")[0] for one in path.parent.iterdir()} & sys.modules.keys()
    scripts = {name for name in there if id(sys.modules[name]) not in of and _is_another(name, path.parent)}
    hidden = {
        name: sys.modules.pop(name)
        for name, module in ([*sys.modules.items()] if of or scripts else [])
        if id(module) in of or name.partition(".")[0] in scripts
    }
    before, old = {*sys.modules}, [*sys.modules.values()]  # some have two names, as __mp_main__
    sys.path.insert(0, entry)
    importlib.invalidate_caches()
    try:
        yield
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(entry)
        new = {name: sys.modules[name] for name in sys.modules.keys() - before if not name.startswith("boebot_brain_")}
        _beside[path] = {name: one for name, one in new.items() if _file(one) and id(one) not in map(id, old)}
        for name, module in _beside[path].items():
            _forget(module)
            if name.partition(".")[0] in scripts:
                del sys.modules[name]
        for name, module in hidden.items():
            if of.get(id(module)) != path.parent:
                sys.modules.setdefault(name, module)


def _file(module: object) -> str:
    """Of a user's module, or of a package that has none its folder; of others ""."""
    file = getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ())), None)
    return file if isinstance(file, str) and is_users(file) else ""


def _is_another(name: str, folder: Path) -> bool:
    """A user's module, no part of a package, from elsewhere has the name of one in that folder."""
    if "." in name or name == "__main__" or not (file := _file(sys.modules.get(name))):
        return False
    there = [folder / f"{name}.py", *(folder / name).glob("*.py")]
    return any(map(Path.is_file, there)) and not any(Path(file).resolve() in (one, one.parent) for one in there)


def _forget(module: ModuleType) -> None:
    """Removes its .pyc where an edit within the same second would not show."""
    with contextlib.suppress(AttributeError, OSError, TypeError):
        source, made = Path(str(module.__file__)), Path(str(module.__cached__))
        if made.stat().st_mtime - source.stat().st_mtime < 2.0:  # s
            made.unlink()


def _from_module(module: ModuleType, path: Path | None) -> LoadedBrain:
    name = as_utf8(path.stem) if path is not None else module.__name__
    where = str(path or name)
    period, needs = _period(module, where), _needs(module, where)
    made = _made(module, where, path)
    main, step = getattr(module, "main", None), getattr(module, "step", None)
    if callable(main) and _takes_one(main):
        if callable(step) or made is not None:
            second = "a function step(robot)" if callable(step) else "a brain of a class or of processes"
            raise BrainError(f"{where} has both a function main(robot) and {second}; expected one of them")
        return _from_main(main, name, where, module, path)
    if made is not None:
        return replace(made, name=name, period=period or made.period, needs=tuple(dict.fromkeys(needs + made.needs)))
    if callable(step):
        _check_function(step, where, "step")
        return LoadedBrain(name, step, period, needs, path)
    if callable(main):
        raise BrainError(f"{where}: main takes no robot; expected def main(robot)")
    from boebot.brain import Brain

    other = next((key for key, value in vars(module).items() if isinstance(value, Brain)), None)
    hint = f"; it has a Brain called {other}, expected the name brain" if other else ""
    raise BrainError(f"{where} {slips.of_sign('no step')}{hint}")


def _made(module: ModuleType, where: str, path: Path | None) -> LoadedBrain | None:
    """Of the module's `brain = Brain([...])`, or of its class Brain."""
    brain, kind = getattr(module, "brain", None), getattr(module, "Brain", None)
    if brain is None and kind is None:
        return None
    from boebot.brain import Brain

    if isinstance(brain, Brain):
        if callable(getattr(module, "step", None)):
            raise BrainError(
                f"{where} has both a function step(robot) and a brain = Brain([...]); expected one of them"
            )
        return _from_object(brain, where, path)
    if isinstance(kind, type) and kind is not Brain:  # that one was imported
        return _from_object(_construct(kind, path), where, path)
    return None


def _from_object(brain: object, name: str, path: Path | None) -> LoadedBrain:
    step = getattr(brain, "step", None)
    if not callable(step):
        raise BrainError(f"{name}: class {type(brain).__name__} has no method step(self, robot)")
    _check_function(step, name, "step")
    from boebot.brain import Brain

    composed = brain if isinstance(brain, Brain) else None
    return LoadedBrain(name, step, _period(brain, name), _needs(brain, name), path, composed)


def _from_main(main: Callable[..., object], name: str, where: str, owner: object, path: Path | None) -> LoadedBrain:
    """Of a function main(robot); `owner` has its PERIOD and NEEDS."""
    _check_function(main, where, "main")
    from boebot.brain.main_brain import MainBrain

    runs = MainBrain(main)
    return LoadedBrain(name, runs.step, _period(owner, where), _needs(owner, where), path, main=runs)


def _takes_one(function: Callable[..., object]) -> bool:
    """It can be called with a robot; a `main()` without parameters is a script's own."""
    try:
        inspect.signature(function).bind(None)
    except (TypeError, ValueError):
        return False
    return True


def _check_function(function: Callable[..., object], where: str, name: str) -> None:
    """Refuses a step or main whose body would never run: one that cannot be called with the robot, or a call of which
    only makes a coroutine or a generator."""
    whole = (function, getattr(function, "__call__", function))  # noqa: B004
    if any(inspect.iscoroutinefunction(part) for part in whole):
        raise BrainError(f"{where}: {slips.of_sign('async', name=name)}")
    if any(inspect.isgeneratorfunction(part) or inspect.isasyncgenfunction(part) for part in whole):
        raise BrainError(f"{where}: {slips.of_sign('yield', name=name)}")
    command, line = slips.uncalled(function)
    if command:
        raise BrainError(f"{where}, line {line}: {slips.of_sign('uncalled', name=name, command=command)}")
    try:
        inspect.signature(function).bind("the robot")
    except TypeError as error:
        raise BrainError(f"{where}: {slips.of_sign('no robot', name=name, why=error)}") from None
    except ValueError:  # a function in C that does not say its arguments
        pass


def _construct(kind: type, path: Path | None) -> Any:
    try:
        return kind()
    except (Exception, SystemExit) as error:
        raise BrainError(explain(error, path)) from error


def _period(owner: object, where: str) -> float | None:
    period = getattr(owner, "PERIOD", None)
    if period is None:
        return None
    if isinstance(period, bool) or not isinstance(period, int | float) or not period > 0:
        raise BrainError(f"{where}: PERIOD is {period!r}; expected seconds from step to step")
    return float(period)


def _check_bundled(name: object, where: str, what: str) -> None:
    """Of the robot or arena that a brain is for."""
    if name is None or (isinstance(name, str) and not name.endswith(TOML)):
        return
    raise BrainError(f"{where}: {what} is {name!r}; expected the name of a bundled one")


def _needs(owner: object, where: str) -> tuple[str, ...]:
    needs = getattr(owner, "NEEDS", ())
    if isinstance(needs, str):
        return (needs,)
    if not isinstance(needs, list | tuple | set | frozenset) or not all(isinstance(need, str) for need in needs):
        raise BrainError(f'{where}: NEEDS is {needs!r}; expected a list of device names such as ["whiskers", "ping"]')
    return tuple(needs)
