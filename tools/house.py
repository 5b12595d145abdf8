"""The shape of the sources at an older commit and now: lines by room, files by device, loose modules, circles, figures.

python -m tools.house COMMIT [--page FILE] [--figures-before FILE]

Prints Markdown tables. With --page they replace what follows the line `<!-- printed -->` of a page. Figures are those
of docs/reference/figures.md in both trees; --figures-before names another page of `make bench` for the older one, as
figures are best compared when they were measured in the same hour.
"""

from __future__ import annotations

import argparse
import io
import re
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from avr_timing.closed_pipe import exit_as
from tools import imports

ROOT = Path(__file__).resolve().parents[1]
CODE = re.compile(r"\.(py|c|h|def|cdef|sh|js|html|cpp|pyi|css)$")
DEVICE = re.compile(r"\.(py|c|h|def|toml|ini|js|html)$")
TESTS = re.compile(r"(^|/)tests?/|(^|/)(test_\w+|conftest)\.py$|^hil_tests/(?!calibration)|vectors")
GENERATED = re.compile(r"generated/|host/boebot/link/messages\.py$|attributes\.pyi$|^docs/")
DATA = re.compile(r"(^|/)robots/\w+\.toml$|arenas/bundled/|^tools/")  # robots, arenas, and what measures
DEVICES = ("accelerometer", "compass", "buzzer", "turret")
ROOMS = ("firmware", "protocol", "host", "sim_bridge", "hil_tests", "tools")
MARK = "<!-- printed -->\n"


def main() -> int:
    """Exit code: 0, or 2 where the commit is unknown."""
    parser = argparse.ArgumentParser("python -m tools.house", description="The sources at a commit and now, compared.")
    parser.add_argument("commit", help="the older tree")
    parser.add_argument("--page", type=Path, help=f"page whose end, after {MARK.strip()}, is printed anew")
    parser.add_argument("--figures-before", type=Path, metavar="FILE", help="page of the older tree's `make bench`")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        before = Path(name).resolve()
        packed = subprocess.run(["git", "archive", given.commit], cwd=ROOT, capture_output=True, check=False)
        if packed.returncode:
            print(f"git knows no commit {given.commit} here", file=sys.stderr)
            return 2
        with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
            archive.extractall(before, filter="data")
        figures = given.figures_before or before / "docs/reference/figures.md"
        text = "\n".join(compared(before, figures))
    if given.page:
        page = given.page.read_text(encoding="utf-8")
        given.page.write_text(page[: page.index(MARK) + len(MARK)] + "\n" + text + "\n", encoding="utf-8")
    else:
        print(text)
    return 0


def compared(before: Path, figures: Path) -> Iterator[str]:
    """Lines of Markdown."""
    files = sources(before), sources(ROOT)
    yield from ("## Product code", "", "| room | lines before | now |", "| --- | ---: | ---: |")
    lines = lines_by_room(before, files[0]), lines_by_room(ROOT, files[1])
    for room in sorted(lines[0] | lines[1]):
        yield f"| {room} | {lines[0][room]:,} | {lines[1][room]:,} |"
    yield f"| all | {lines[0].total():,} | {lines[1].total():,} |"
    yield from ("", "## Devices", "", "| files that name a device | before | now |", "| --- | ---: | ---: |")
    for device in DEVICES:
        yield f"| {device} | {naming(before, files[0], device)} | {naming(ROOT, files[1], device)} |"
    yield from ("", "## Modules", "", "| what | before | now |", "| --- | ---: | ---: |")
    for folder in ("host/boebot", "sim_bridge"):
        yield f"| loose in `{folder}` | {loose(files[0], folder)} | {loose(files[1], folder)} |"
    yield f"| C modules in circles | {c_circles(before)} | {c_circles(ROOT)} |"
    yield f"| Python modules in circles | {python_circles(before)} | {python_circles(ROOT)} |"
    yield from ("", "## Figures", "", "| row of `make bench` | unit | before | now |", "| --- | --- | ---: | ---: |")
    old, new = rows(figures), rows(ROOT / "docs/reference/figures.md")
    yield from (f"| {name} | {unit} | {old[name][0]} | {value} |" for name, (value, unit) in new.items() if name in old)


def sources(root: Path) -> list[str]:
    """Hand-written files of the product, as paths from the tree's root: no tests, docs and what is generated."""
    if (root / ".git").exists():
        listed = subprocess.run(
            ["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True
        ).stdout.split()
        files = [name for name in listed if (root / name).is_file()]
    else:
        files = [path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file()]
    return [name for name in files if not TESTS.search(name) and not GENERATED.search(name)]


def lines_by_room(root: Path, files: list[str]) -> Counter[str]:
    """Lines of code."""
    found: Counter[str] = Counter()
    for name in files:
        if CODE.search(name):
            found[room(name)] += len((root / name).read_text(encoding="utf-8").splitlines())
    return found


def room(name: str) -> str:
    """The folder that a file is counted for: packages of host and sim_bridge, and where they lie loose."""
    first, *rest = name.split("/")
    if first not in ROOMS:
        return "other"
    if first in ("host", "sim_bridge", "firmware"):
        depth = 3 if first == "host" else 2
        return "/".join([first, *rest[:-1]][:depth])
    return first


def naming(root: Path, files: list[str], device: str) -> int:
    """How many files name a device; robots, arenas and what measures are left out."""
    counted = (name for name in files if DEVICE.search(name) and not DATA.search(name))
    return sum(device in (root / name).read_text(encoding="utf-8").lower() for name in counted)


def loose(files: list[str], folder: str) -> int:
    """Modules in Python and C that lie in the folder itself."""
    return sum(re.fullmatch(rf"{folder}/(?!__)\w+\.(py|c)", name) is not None for name in files)


def c_circles(root: Path) -> int:
    """C modules that know themselves by others."""
    return sum(len(imports.circles(imports.c_modules(root, folder))) for folder in imports.C_ROOMS)


def python_circles(root: Path) -> int:
    """Python modules that import themselves by others."""
    return len(imports.circles(imports.python_imports(imports.python_modules(root), types=False)))


def rows(page: Path) -> dict[str, tuple[str, str]]:
    """Value and unit by name of a page of figures; `portable` was the name of what is now the only build."""
    found = {}
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and len(cells) == 6 and cells[0] not in ("name", "---"):
            found[cells[0].replace(", portable", "")] = cells[1], cells[3]
    return found


if __name__ == "__main__":
    exit_as(main)
