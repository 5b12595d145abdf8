"""The folder of a sweep: what was run, and the rows so far. Other campaigns keep their plan alike.

    sweep.json      the plan, the kit's version, and hashes of what follows
    points.npy      the design's points
    files/          brains, robots and arenas as they were, a folder for each
    parts/          0000812-0000851.parquet: rows 812 to 851. What is done is read from these names alone.
                    0000812-0000851.begun: a line for each row that was begun, while the part is not there
    rows.parquet    all rows in order, when all are done; the parts are gone then

A file gets its name when it is whole and on the disk, so that a folder can be trusted whenever its writers have died.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import shutil
import uuid
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import msgspec
import numpy as np

import boebot
from boebot import missing, system
from boebot.errors import BoebotError
from boebot.link.messages import SCHEMA_HASH
from boebot.record.run_folder import make_folder, unwritable
from boebot.running.sources import sources
from boebot.running.tasks import Request
from boebot_campaign import designs
from boebot_campaign.plan import Plan

if TYPE_CHECKING:
    import pandas

NAME, POINTS, FILES, PARTS, ROWS = "sweep.json", "points.npy", "files", "parts", "rows.parquet"
GROUP_ROWS = 65_536  # of rows.parquet, which is written group by group
_SAME = "expected it as it was then, or another --out"
_P = TypeVar("_P", bound=Plan)


class Kept(msgspec.Struct, Generic[_P], frozen=True, kw_only=True, omit_defaults=True):
    """What sweep.json says, and its like.

    Attributes:
        version: of the kit, with its protocol.
        names: for each brain, robot and arena that was given as a file: where its copy is, below the folder.
        hashes: SHA-256 of each copy, and of the points, by the same kind of path.
    """

    version: str
    plan: _P
    names: dict[str, str] = {}
    hashes: dict[str, str] = {}


class Folder:
    """A sweep's folder, of which sweep.json is there, and what is in it so far."""

    def __init__(self, path: Path) -> None:
        """Raises BoebotError: there is no sweep."""
        self.path = path.absolute()
        self.kept = loaded(path / NAME, Plan)
        self.plan = self.kept.plan
        self.parts, self.rows = self.path / PARTS, self.path / ROWS

    @cached_property
    def points(self) -> np.ndarray:
        """Of the design; read after `check`."""
        return np.asarray(np.load(self.path / POINTS))

    @cached_property
    def stamp(self) -> str:
        """Another one for each sweep."""
        return _digest((self.path / NAME).read_bytes())

    @property
    def is_whole(self) -> bool:
        """All rows are there, in one file."""
        return self.rows.is_file()

    def place(self, name: str | None) -> str | None:
        """Where the copy of a file is that the plan names; a bundled name is its own."""
        copy = self.kept.names.get(name or "")
        return name if copy is None else str(self.path / copy)

    def done(self) -> list[tuple[int, int]]:
        """First row, and the one after the last, of each part that is there, in order."""
        stems = (path.stem.split("-") for path in self.parts.glob("[0-9]*-[0-9]*.parquet"))
        return sorted((int(first), int(last) + 1) for first, last in stems)

    def undone(self, begin: int = 0, end: int | None = None) -> list[tuple[int, int]]:
        """The gaps between them, from row `begin` to before `end`."""
        gaps, at, stop = [], begin, self.plan.count if end is None else end
        for first, after in [] if self.is_whole else [*self.done(), (stop, stop)]:
            if min(first, stop) > at:
                gaps.append((at, min(first, stop)))
            at = max(at, after)
        return gaps

    def part(self, first: int, end: int) -> Path:
        """The file of those rows."""
        return self.parts / f"{first:07}-{end - 1:07}.parquet"

    def check(self) -> None:
        """Raises BoebotError where a copy is not what it was."""
        for name, digest in self.kept.hashes.items():
            copy = self.path / name
            if not copy.is_file() or _digest(copy.read_bytes()) != digest:
                raise BoebotError(f"{copy} has changed since the sweep began; {_SAME}")

    def merge(self) -> None:
        """Makes rows.parquet of the parts, some rows at a time; a row that two parts have is taken once."""
        if not self.is_whole:
            write_whole(self.rows, self._merge)
        shutil.rmtree(self.parts, ignore_errors=True)

    def _merge(self, path: Path) -> None:
        writer: Any = None
        waiting, left = [], self.plan.count
        for table in self._tables():
            waiting.append(table)
            left -= len(table)
            if sum(map(len, waiting)) >= GROUP_ROWS or left == 0:
                writer = writer or _arrow("pyarrow.parquet").ParquetWriter(path, table.schema, write_page_checksum=True)
                writer.write_table(_arrow().concat_tables(waiting))
                waiting = []
        writer.close()

    def _tables(self, columns: Sequence[str] | None = None) -> Iterator[Any]:
        """Of each part, in order, without the rows that one before it has."""
        at = 0
        for first, end in self.done():
            if end > at:
                yield _read(self.part(first, end), end - first, columns).slice(max(at - first, 0))
                at = end

    def table(self, columns: Sequence[str] | None = None) -> Any:
        """The rows so far, with some of the columns or all: a pyarrow.Table. Raises BoebotError: a file is damaged."""
        if self.is_whole:
            return _read(self.rows, self.plan.count, columns)
        try:
            if tables := list(self._tables(columns)):
                return _arrow().concat_tables(tables)
        except BoebotError:
            if not self.is_whole:
                raise
        if self.is_whole:  # the parts have just been merged
            return self.table(columns)
        raise BoebotError(f"the sweep in {self.path} has no row yet; expected one that has begun")

    def steady(self, columns: Sequence[str]) -> Callable[[list[str]], Any]:
        """Gives a table of some of these columns, of the same rows each time, also while the sweep goes on."""
        return self.table if self.is_whole else self.table(columns).select

    def to_pandas(self) -> pandas.DataFrame:
        """The rows so far, by their number."""
        return self.table().to_pandas().set_index("row")

    def statuses(self) -> dict[str, int]:
        """How many rows there are of each status."""
        counts = self.table(["status"])["status"].value_counts().to_pylist()
        return {one["values"]: one["counts"] for one in counts}


def loaded(file: Path, kind: type[_P]) -> Kept[_P]:
    """What a campaign of that kind has begun with. Raises BoebotError: it has not, or the file is damaged."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=Kept[kind])  # type: ignore[valid-type]
    except FileNotFoundError:
        raise BoebotError(f"{file.parent} holds no {file.name}; expected a folder that boebot has made") from None
    except (OSError, ValueError, msgspec.DecodeError) as error:
        raise BoebotError(f"{file} cannot be read ({error}); expected it whole, or another --out") from None


@lru_cache(maxsize=2)
def opened(path: Path, stamp: str) -> Folder:
    """The folder, read once a process: for workers. `stamp`: its `Folder.stamp`, of the sweep that is meant."""
    del stamp
    return Folder(path)


@contextlib.contextmanager
def held(path: Path, name: str, before: Collection[str] = ()) -> Iterator[bool]:
    """Makes a campaign's folder, and says whether the file `name` is in it, before which `before` are written; no other
    campaign writes there in the block.

    Raises:
        BoebotError: another one does, or it holds other things.
    """
    make_folder(path)
    with writing(path):
        lock = system.lock_folder(path)
    try:
        there = {entry.name for entry in path.iterdir() if not entry.name.startswith(".")}
        if name not in there and (others := there - set(before)):
            raise BoebotError(f"{path} holds {min(others)!r} and no {name}; expected an empty folder or a new one")
        yield name in there
    finally:
        os.close(lock)


@contextlib.contextmanager
def locked(path: Path, plan: Plan, points: np.ndarray | None = None) -> Iterator[Folder]:
    """The folder of that plan, made or taken up again; no other sweep writes there in the block. `points`: of the plan,
    in place of those of its design.

    Raises:
        BoebotError: another one does, or it holds other things, or a sweep of another plan, version or file.
    """
    with held(path, NAME, (FILES, POINTS, PARTS)) as is_begun:
        with writing(path):
            _take_up(path, plan, points) if is_begun else _make(path, plan, points)
        yield Folder(path)


def _make(path: Path, plan: Plan, points: np.ndarray | None) -> None:
    names, files = _sources(plan)
    shutil.rmtree(path / FILES, ignore_errors=True)
    for name, data in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(path / name, lambda part, data=data: part.write_bytes(data))  # type: ignore[misc]
    (path / PARTS).mkdir(exist_ok=True)
    if points is None:
        points = designs.points(plan.design, plan.points, len(plan.axes), plan.first_seed % 2**32)
    np.save(raw := io.BytesIO(), points)
    write_whole(path / POINTS, lambda part: part.write_bytes(raw.getvalue()))
    hashes = {name: _digest((path / name).read_bytes()) for name in (*files, POINTS)}
    keep(path / NAME, Kept(version=version(), plan=plan, names=names, hashes=hashes))


def keep(file: Path, kept: Kept[Any]) -> None:
    """Writes what a campaign begins with. Raises BoebotError: it cannot be written."""
    write_whole(file, lambda part: part.write_bytes(msgspec.json.format(msgspec.json.encode(kept))))


def compare(path: Path, kept: Kept[_P], plan: _P) -> None:
    """Raises BoebotError where the folder was begun with another version or plan."""
    if kept.version != version():
        raise BoebotError(f"{path} is of boebot {kept.version}, this is {version()}; {_SAME}")
    for key in reversed(plan.__struct_fields__):  # a kind's own first, of which those before may have been made
        if _portable(getattr(plan, key)) != _portable(getattr(kept.plan, key)):
            raise BoebotError(f"the plan has changed since {path} was begun, in {key}; {_SAME}")


def _take_up(path: Path, plan: Plan, points: np.ndarray | None) -> None:
    """Checks that it is the same sweep; removes what writers have left that died."""
    folder = Folder(path)
    compare(path, folder.kept, plan)
    folder.check()
    if points is not None and not np.array_equal(points, folder.points):
        raise BoebotError(f"the points have changed since {path} was begun; {_SAME}")
    _, files = _sources(plan)
    for name, digest in folder.kept.hashes.items():
        if name != POINTS and (name not in files or _digest(files[name]) != digest):
            original = next((one for one, copy in folder.kept.names.items() if copy == name), Path(name).name)
            raise BoebotError(f"{original} has changed since {path} was begun; {_SAME}")
    for left in (*folder.parts.glob(".*.tmp"), *folder.parts.glob("*.begun"), *path.glob(".*.tmp")):
        left.unlink(missing_ok=True)
    folder.parts.mkdir(exist_ok=True)


def _portable(value: Any) -> Any:
    """Of a plan; files without their folders, which may have moved."""
    return [Path(one).name if isinstance(one, str) else one for one in value] if isinstance(value, list) else value


def _sources(plan: Plan) -> tuple[dict[str, str], dict[str, bytes]]:
    """`Kept.names`, and the files by their paths below the folder."""
    names: dict[str, str] = {}
    files: dict[str, bytes] = {}
    lists = {"brain": plan.brains, "robot": plan.robots, "arena": [*plan.arenas, *plan.test_arenas]}
    for kind, given in lists.items():
        for number, name in enumerate(given):
            if not Path(name).is_absolute():
                continue
            request = Request.single(**{"brain": plan.brains[0], "robot": plan.all_robots[0], kind: name})
            with system.folder_kept():  # a brain may change it as it is loaded
                found = sources(request, request.tasks())
            below = f"{FILES}/{kind}-{number}"
            names[name] = f"{below}/{Path(name).name}"
            for one, data in found.items():
                if one.startswith(f"{kind}/"):
                    files[below + one.removeprefix(kind)] = data
    return names, files


def version() -> str:
    """Of the kit, as far as rows may depend on it; of a checkout that was edited it is the same."""
    return f"{boebot.__version__} (schema {SCHEMA_HASH:08x})"


def _arrow(module: str = "pyarrow") -> Any:
    return missing.imported(module, "a sweep", "pyarrow", "sweep")


def _read(path: Path, count: int, columns: Sequence[str] | None) -> Any:
    """The table of a file of that many rows. `parquet.read_table` would import pandas, where it is, which takes a
    second. Raises BoebotError: it is damaged."""
    parquet = _arrow("pyarrow.parquet")
    try:
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            if file.metadata.num_rows != count:
                raise ValueError(f"it has {file.metadata.num_rows} rows in place of {count}")
            return file.read(columns and list(columns))
    except Exception as error:  # whatever pyarrow makes of such bytes
        raise BoebotError(f"{path} cannot be read ({error}); remove it, and the same sweep runs its rows") from None


def write_part(path: Path, table: Any) -> None:
    """A part, whole or not at all. Raises BoebotError: the folder cannot be written to."""
    write_whole(path, lambda part: _arrow("pyarrow.parquet").write_table(table, part, write_page_checksum=True))


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Files of a sweep, into that folder. Raises BoebotError in place of an OSError."""
    try:
        yield
    except OSError as error:
        raise unwritable(path, error, "the sweep's files") from None


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Under a name that no other writer has; on the disk before it gets its own."""
    part = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        with writing(path.parent):
            write(part)
            with part.open("rb+") as file:
                os.fsync(file.fileno())
            part.replace(path)
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
