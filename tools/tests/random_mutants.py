"""A hundred random faults in the product, and whether its tests notice: what a change of the tests is measured by.

    python -m tools.tests.random_mutants make --seed 1 --count 100     chooses them, writes random_mutants.json
    python -m tools.tests.random_mutants run before [--room R] [--only ID]...
    python -m tools.tests.random_mutants show                          counts; what was caught before, but not after

`make` picks lines of the product at random, by the rooms' weights, and changes one thing in each: a comparison, an
operator, a constant, a condition, what is returned, the order of two arguments, or it deletes a statement. No texts,
annotations, errors' messages, generated files. Of C it keeps what compiles without a warning to other machine code.

`run` works on a copy of the last commit (or --commit) under build/mutants (or --tree), set up the first time. It writes
one mutant, builds, runs the tests of its room until one fails, those files first that name its module most often, and
restores the file. What failed must then pass, or `run` ends. The result is noted under `before` (or `after`) in
random_mutants.json. Stop it with Ctrl-C; the next call goes on. For two processors: two shells, each with its rooms
(--room) and its --tree.

A mutant is found by its line and the lines around it, if need be in another file. One that is not found is `moved`:
point `file`, `above`, `before`, `after` and `below` to the new place, or take it out of the list.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import json
import os
import random
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tools.house import ROOT, sources
from tools.tests.mutations import KINDS, mutation

LIST = Path(__file__).with_suffix(".json")
PYTEST = 'build/venv/bin/python -m pytest -q -x -m "not wall_clock and not soak"'
UNITS = "tools/pio test -e native_sanitized -e native_boebot -e native_line"

OUTCOMES = ("caught by ", "survived", "moved", "no end of ")
# How pytest, PlatformIO and faulthandler (after a crash, or 180 s) name the test that failed.
FAILED = re.compile(
    r"^(?:FAILED|ERROR) (.+?)(?: - |$)|^(\S+\.cpp:\d+: .*): $|/(test_\w+\.py\", line \d+ in test_\w+)",
    re.MULTILINE,
)

Mutant = dict[str, Any]


class Room(NamedTuple):
    """A room's share of the mutants in percent, its files (the first room that fits), its tests, as patterns."""

    weight: int
    files: str
    tests: str
    units: bool = False  # of the firmware


WHOLE = "hil_tests/boebot_hil/test_*.py protocol/tests/test_board_protocol.py sim_bridge/tests/circle/test_*.py"
ROOMS = {
    "firmware": Room(20, "firmware/src/", f"{WHOLE} sim_bridge/tests/firmware/test_*.py", units=True),
    "timing": Room(
        8,
        "host/avr_timing/|host/boebot_timing/",
        "host/avr_timing/tests/test_*.py host/boebot_timing/tests/test_*.py",
    ),
    "sim_bridge": Room(26, "sim_bridge/(?!fuzz)", "sim_bridge/tests/**/test_*.py"),
    "arenas": Room(8, "host/boebot/arenas/", "sim_bridge/tests/**/test_*.py"),
    "link": Room(
        6,
        "host/boebot/link/|host/boebot/boards",
        f"{WHOLE} host/tests/link/test_*.py host/tests/test_boards.py sim_bridge/tests/test_serve*.py",
    ),
    "boebot": Room(
        28,
        "host/boebot(_course|_can)?/",
        "host/tests/**/test_*.py host/boebot_course/tests/**/test_*.py host/boebot_can/tests/**/test_*.py",
    ),
    "protocol": Room(4, "protocol/", "protocol/tests/test_*.py"),
}


def make(seed: int, count: int) -> None:
    """Writes a new list."""
    chance = random.Random(seed)
    lines: dict[str, list[tuple[str, int]]] = {room: [] for room in ROOMS}
    for name in sources():
        room = next((room for room, row in ROOMS.items() if re.match(row.files, name)), None)
        if room and name.endswith((".py", ".c", ".h")):
            lines[room] += [(name, line + 1) for line in range((ROOT / name).read_bytes().count(b"\n"))]
    mutants: list[Mutant] = []
    for room, row in ROOMS.items():
        for number in range(1, row.weight * count // 100 + 1):
            kind, found = chance.choice(KINDS), None
            while found is None:
                place = chance.choice(lines[room])
                found = mutation(*place, kind, chance)
            lines[room].remove(place)
            begin = {"id": f"{room}-{number}", "room": room, "file": place[0], "kind": kind}
            mutants.append({**begin, **found._asdict(), "results": {}, "seconds": {}, "commits": {}})
            print(f"{room}-{number} {place[0]}:{place[1]} {kind}", flush=True)
    content = {"seed": seed, "mutants": mutants}
    LIST.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


@contextlib.contextmanager
def kept() -> Iterator[dict[str, Any]]:
    """The list, written again at the end; several calls of `run` may share it."""
    with LIST.open("r+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        content = json.load(file)
        yield content
        file.seek(0)
        file.truncate()
        file.write(json.dumps(content, indent=1) + "\n")


def place(mutant: Mutant, tree: Path) -> tuple[Path, str] | None:
    """The file that has the mutant's line, and its text with the mutant; None if there is not exactly one place."""
    named = tree / mutant["file"]
    listed = subprocess.run(["git", "ls-files"], cwd=tree, capture_output=True, text=True, check=True).stdout.split()
    files = [named, *(tree / name for name in listed if name.endswith(named.suffix) and name != mutant["file"])]
    for above, below in ((mutant["above"], mutant["below"]), (mutant["above"], ""), ("", mutant["below"])):
        for path in filter(Path.is_file, files):
            text = path.read_text(encoding="utf-8")
            if text.count(above + mutant["before"] + below) == 1:
                return path, text.replace(above + mutant["before"] + below, above + mutant["after"] + below)
    return None


def ended(command: str, tree: Path, seconds: float) -> tuple[int | None, str]:
    """A command's exit code, None if it did not end within the time, and what it printed."""
    started = subprocess.Popen(
        command, cwd=tree, shell=True, text=True, errors="replace", stdout=-1, stderr=-2, start_new_session=True
    )
    try:
        output, _ = started.communicate(timeout=seconds)
        return started.returncode, output
    except subprocess.TimeoutExpired:
        return None, ""
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(started.pid, signal.SIGKILL)


def tested(room: Room, tree: Path, module: str, limit: float) -> tuple[str, str]:
    """Builds and tests a room. Returns the result, and the command that repeats what failed."""
    end = time.perf_counter() + limit
    named = re.compile(rf"\b{re.escape(module)}\b")
    files = sorted({path for pattern in room.tests.split() for path in tree.glob(pattern)})
    files.sort(key=lambda path: -len(named.findall(path.read_text(encoding="utf-8"))))
    tests = " ".join(path.relative_to(tree).as_posix() for path in files)
    stages = [(UNITS, "a unit test")] if room.units else []
    for command, what in [*stages, ("make setup", "the build"), (f"{PYTEST} {tests}", "a test")]:
        code, output = ended(command, tree, end - time.perf_counter())
        if code is None:
            return f"no end of {what} within {limit:.0f} s", ""
        if code and (failed := FAILED.search(output)):
            again = f"{PYTEST} {shlex.quote(failed[1])}" if failed[1] else command
            return f"caught by {what}: {failed[failed.lastindex or 0]}", again
        if code:
            return f"caught by {what}: {(output.strip().splitlines() or [''])[-1][:200]}", command
    return "survived", ""


def run(when: str, tree: Path, rooms: list[str], only: list[str], limit: float, commit: str) -> None:
    """Runs what is not run; see above."""
    os.nice(15)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**32, 2**32))  # a mutant may write without end
    commit = updated(tree, commit)
    mutants = [one for one in listed() if not rooms or one["room"] in rooms]
    if only:
        waiting = [one for one in mutants if one["id"] in only]
    else:
        waiting = [one for one in mutants if one["results"].get(when, "moved") == "moved"]
    begin = time.perf_counter()
    for number, mutant in enumerate(waiting):
        start = time.perf_counter()
        if found := place(mutant, tree):
            path, text = found
            original = path.read_text(encoding="utf-8")
            try:
                path.write_text(text, encoding="utf-8")
                result, again = tested(ROOMS[mutant["room"]], tree, path.stem, limit)
            finally:
                path.write_text(original, encoding="utf-8")
            seconds = round(time.perf_counter() - start)
            if again and ended(f"make setup && {again}", tree, limit)[0]:
                sys.exit(f"{mutant['id']}: {result}; without the mutant, too; expected that it passes")
        else:
            result, seconds = "moved", 0
        with kept() as content:
            one = next(one for one in content["mutants"] if one["id"] == mutant["id"])
            one["results"][when], one["seconds"][when], one["commits"][when] = result, seconds, commit
        left = (time.perf_counter() - begin) / (number + 1) * (len(waiting) - number - 1)
        print(f"{number + 1}/{len(waiting)}, {left / 60:.0f} min left: {mutant['id']} {result}", flush=True)


def updated(tree: Path, commit: str) -> str:
    """Brings the copy to a commit and sets it up; returns the commit's hash. Ends the program if that fails."""
    found = subprocess.run(
        ["git", "rev-parse", "--short=8", commit], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    if not tree.exists():
        subprocess.run(["git", "clone", "--quiet", "--shared", ROOT, tree], check=True)
    subprocess.run(["git", "checkout", "--quiet", "--force", "--detach", found.strip()], cwd=tree, check=True)
    print(f"Preparing {tree}", flush=True)
    if subprocess.run(["make", "--silent", "setup"], cwd=tree, check=False).returncode:
        sys.exit(f"{tree}: `make setup` failed")
    return found.strip()


def listed() -> list[Mutant]:
    """The mutants of the list."""
    mutants: list[Mutant] = json.loads(LIST.read_text(encoding="utf-8"))["mutants"]
    return mutants


def show() -> None:
    """Prints how many had which result, by room, and what was caught before, but not afterwards."""
    for when in ("before", "after"):
        for room in ROOMS:
            results = [one["results"].get(when, "not run") for one in listed() if one["room"] == room]
            counts = Counter(next((kind for kind in OUTCOMES if one.startswith(kind)), one) for one in results)
            print(f"{when:8}{room:12}" + ", ".join(f"{counts[kind]:3} {kind.strip()}" for kind in sorted(counts)))
    for one in listed():
        before, after = (one["results"].get(when, "not run") for when in ("before", "after"))
        if before.startswith("caught") and not after.startswith(("caught", "not run")):
            print(f"{one['id']} {one['file']}: {before}; afterwards: {after}")


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make")
    making.add_argument("--seed", type=int, default=1)
    making.add_argument("--count", type=int, default=100)
    running = commands.add_parser("run")
    running.add_argument("when", choices=("before", "after"))
    running.add_argument("--room", choices=ROOMS, action="append", default=[])
    running.add_argument("--only", metavar="ID", action="append", default=[])
    running.add_argument("--commit", default="HEAD")
    running.add_argument("--tree", type=Path, default=ROOT / "build/mutants/tree")
    running.add_argument("--limit", type=float, default=1800, metavar="SECONDS", help="for a mutant")
    commands.add_parser("show")
    asked = parser.parse_args()
    if asked.command == "make":
        make(asked.seed, asked.count)
    elif asked.command == "run":
        run(asked.when, asked.tree.resolve(), asked.room, asked.only, asked.limit, asked.commit)
    else:
        show()
    return 0


if __name__ == "__main__":
    sys.exit(main())
