"""What the documentation says is run: code blocks as they stand, commands as they stand, links and options checked."""

from __future__ import annotations

import re
import shlex
from functools import cache
from pathlib import Path

import pytest
from PIL import Image

import copied_process

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("protocol/*.md")])
NO_DISPLAY = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "BROWSER": ""}  # a live view opens no browser
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"`(boebot [^`]+)`")


def blocks(language: str) -> list[tuple[Path, str]]:
    return [(page, code) for page in PAGES for name, code in BLOCK.findall(page.read_text()) if name == language]


def names(rows: list[tuple[Path, str]]) -> list[str]:
    return [f"{page.name}: {text.splitlines()[0][:50]}" for page, text in rows]


@cache
def help_of(*command: str) -> str:
    shown = copied_process.command([*command, "--help"], ROOT, {"COLUMNS": "200", "TERM": "dumb"})
    assert shown.returncode == 0, f"there is no command boebot {' '.join(command)}"
    return re.sub(r"\x1b\[[0-9;]*m", "", shown.stdout)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the pages' first comments name, as a reader would have saved them."""
    folder = tmp_path_factory.mktemp("reader")
    for _, code in [*blocks("python"), *blocks("toml")]:
        if match := re.match(r"# (\w+\.(?:py|toml)):", code):
            (folder / match[1]).write_text(code)
    return folder


@pytest.mark.parametrize(("page", "code"), blocks("python"), ids=names(blocks("python")))
def test_python_block_runs(page: Path, code: str, workspace: Path) -> None:
    done = copied_process.python(code, workspace)
    assert done.returncode == 0, f"{page.name}:\n{done.stderr}"


LONGEST_S = 10.0

SHELL_LINES = [
    (page, line)
    for page, code in blocks("")
    for line in code.splitlines()
    if line.startswith("boebot ") and "/dev/" not in line
]


@pytest.mark.parametrize(("page", "line"), SHELL_LINES, ids=names(SHELL_LINES))
def test_command_of_a_block_runs(page: Path, line: str, workspace: Path) -> None:
    words = shlex.split(line, comments=True)[1:]
    if "--view" in words and "--speed" not in words:
        words += ["--speed", "max"]  # nobody watches
    if words[0] == "run" and "--seconds" in words:
        place = words.index("--seconds") + 1
        if words[place].isdigit():
            words[place] = str(min(float(words[place]), LONGEST_S))
    if words[0] == "experiment":
        words += ["--jobs", "1"]  # more processes: host/boebot_course/tests/test_command.py
    done = copied_process.command(words, workspace, NO_DISPLAY)
    assert done.returncode == 0, f"{page.name}: {line}\n{done.stderr}"


INLINE = sorted({(page, command) for page in PAGES for command in COMMAND.findall(page.read_text())})


@pytest.mark.parametrize(("page", "command"), INLINE, ids=names(INLINE))
def test_command_in_a_sentence_exists_with_its_options(page: Path, command: str) -> None:
    words = shlex.split(command)[1:]
    shown = help_of(words[0])
    if re.search(r"^Commands:", shown, re.MULTILINE):
        shown = help_of(*words[:2])
    for option in (word for word in words[1:] if word.startswith("--") and word != "--help"):
        assert re.search(rf"{re.escape(option)}\b", shown), f"{page.name}: {command}: no option {option}"


TARGET = re.compile(r"(?:`|^)make (\w+)", re.MULTILINE)  # as code, not in a sentence
TARGETS = sorted({(page, name) for page in PAGES for name in TARGET.findall(page.read_text())})


@pytest.mark.parametrize(("page", "target"), TARGETS, ids=[f"{page.name}: make {name}" for page, name in TARGETS])
def test_make_target_exists(page: Path, target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE), f"{page.name}: make {target}"


@pytest.mark.parametrize("name", ["demo", "echoes"])
def test_picture_is_of_this_kit(name: str, workspace: Path, tmp_path: Path) -> None:
    """A picture of the README says what the same run gives now; `make pictures` renews it."""
    recipe = next(
        line for line in (ROOT / "Makefile").read_text().splitlines() if re.search(rf"--out \S*\b{name}$", line)
    )
    command = [*shlex.split(recipe.split("boebot", 1)[1])[:-1], str(tmp_path)]
    assert copied_process.command(command, workspace).returncode == 0
    shown, now = (Image.open(file).info for file in (ROOT / "docs" / "images" / f"{name}.png", tmp_path / "run.png"))
    assert (shown["Title"], shown["Description"]) == (now["Title"], now["Description"])


def test_film_is_long_and_small_enough() -> None:
    file = ROOT / "docs" / "images" / "live.gif"
    with Image.open(file) as film:
        assert getattr(film, "n_frames", 1) > 60 and file.stat().st_size < 2_000_000


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name}: {target} is not there"
