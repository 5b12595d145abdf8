"""Where the groups of a record are kept: in memory, on disk, in memory first and then on disk."""

from __future__ import annotations

import contextlib
import tempfile
import time as wall
from collections.abc import Iterator
from typing import IO, Protocol

from boebot.record.blocks import Group, Rows, group_of
from boebot.record.record_file import RecordError, RecordReader, RecordWriter

WAITING = 4  # groups at most that wait for a disk
PAUSE_S = 0.005  # between two looks whether it is done
IN_MEMORY_S = 2.0  # of the wall clock, that a run without a folder writes to no disk


class Keeper(Protocol):
    """Keeps the groups of a record, in their order."""

    def write(self, rows: Rows, time_s: float) -> None:
        """Keeps rows that end at that time of the run (s), as a group.

        Raises:
            RecordError: it cannot be kept.
        """

    def groups(self) -> Iterator[Group]:
        """All groups, oldest first."""


class InMemory:
    """In this process."""

    def __init__(self) -> None:
        self._groups: list[Group] = []

    def write(self, rows: Rows, time_s: float) -> None:
        """See `Keeper`."""
        self._groups.append(group_of(rows))

    def groups(self) -> Iterator[Group]:
        """See `Keeper`."""
        return iter(self._groups)


class OnDisk:
    """In an open file, which can be read once it is finished.

    Attributes:
        writer: for attachments.
    """

    def __init__(self, file: IO[bytes], name: str, *, waits: bool, sync: bool = True) -> None:
        """Into an empty file that is open for reading and writing; `name`: as errors call it. `waits`: for a slow disk;
        else rows wait for it in memory, as on a robot that must not wait."""
        self._file, self._name, self._waits = file, name, waits
        self.writer = RecordWriter(file, name, sync=sync)

    def write(self, rows: Rows, time_s: float) -> None:
        """See `Keeper`."""
        while self._waits and self.writer.waiting >= WAITING:
            wall.sleep(PAUSE_S)
        self.writer.write(rows, time_s)

    def finish(self) -> None:
        """Nothing is written any more. Raises RecordError where something could not be."""
        self.writer.finish()

    def groups(self) -> Iterator[Group]:
        """See `Keeper`; those up to where the disk was full, if it was."""
        return (kept.group for kept in RecordReader(self._file, self._name).groups())


class Finished:
    """On disk, by a run that is over."""

    def __init__(self, reader: RecordReader, name: str, *, up_to_damage: bool) -> None:
        """As of `RecordReader.groups`."""
        self._reader, self._name, self._up_to_damage = reader, name, up_to_damage

    def write(self, rows: Rows, time_s: float) -> None:
        """Raises TypeError: nothing is written there any more."""
        raise TypeError(f"the record {self._name} is finished")

    def groups(self) -> Iterator[Group]:
        """See `Keeper`; those that are sound."""
        return (kept.group for kept in self._reader.groups(up_to_damage=self._up_to_damage))


class Temporary:
    """In memory for the first seconds, then in a temporary file that vanishes with this object, however it ends."""

    def __init__(self, *, waits: bool = True) -> None:
        """`waits`: as of `OnDisk`."""
        self._waits = waits
        self._first: list[tuple[Group, float]] = []
        self._until_s = wall.perf_counter() + IN_MEMORY_S
        self._disk: OnDisk | None = None

    def write(self, rows: Rows, time_s: float) -> None:
        """See `Keeper`."""
        if self._disk is None and wall.perf_counter() < self._until_s:
            self._first.append((group_of(rows), time_s))
            return
        if self._disk is None:
            file = tempfile.TemporaryFile(prefix="boebot-", buffering=0)  # noqa: SIM115 (closed with this object)
            self._disk = OnDisk(file, "a temporary file", waits=self._waits, sync=False)
            for group, at_s in self._first:
                self._disk.write(group, at_s)
            self._first.clear()
        self._disk.write(rows, time_s)

    def groups(self) -> Iterator[Group]:
        """See `Keeper`."""
        if self._disk is None:
            return iter([group for group, _ in self._first])
        with contextlib.suppress(RecordError):  # the run has ended by it; what is there can be read
            self._disk.finish()
        return self._disk.groups()


class Shared:
    """One robot's part of a record of several robots.

    Its streams are named "robot-2/telemetry" there; those of the world have no such name, and are every robot's.
    """

    def __init__(self, keeper: Keeper, number: int) -> None:
        self._keeper, self._prefix = keeper, f"robot-{number}/"

    def write(self, rows: Rows, time_s: float) -> None:
        """See `Keeper`."""
        self._keeper.write({self._named(stream): some for stream, some in rows.items()}, time_s)

    def groups(self) -> Iterator[Group]:
        """See `Keeper`."""
        for group in self._keeper.groups():
            own = {
                stream.removeprefix(self._prefix): block
                for stream, block in group.items()
                if stream in WORLD or stream.startswith(self._prefix)
            }
            if own:
                yield own

    def _named(self, stream: str) -> str:
        return stream if stream in WORLD else self._prefix + stream


WORLD = ("waits", "shifts")  # streams of a world, not of one of its robots
