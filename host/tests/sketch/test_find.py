"""What a path is: a sketch with its files, a project, or neither."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from boebot.errors import BoebotError
from boebot.sketch.find import Sketch, find


def write(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
    return folder


def files(path: Path) -> set[str]:
    return set(find(path).files)


def test_a_folder_with_a_file_of_its_name_is_one_sketch(tmp_path: Path) -> None:
    of_it = {"robot.ino", "turn.ino", "old.pde", "a.h", "b.cpp", "src/deep/c.c", "libraries/Foo/src/Foo.h"}
    of_it |= {"libraries/Foo/library.properties"}
    others = {"notes.txt", ".hidden.ino", "other/d.cpp", "libraries/Foo/examples/x/x.ino", "libraries/.git/e.h"}
    folder = write(tmp_path / "robot", *of_it, *others)
    assert files(folder) == files(folder / "robot.ino") == of_it
    assert find(folder).name == "robot.ino"


def test_another_file_is_a_sketch_by_itself(tmp_path: Path) -> None:
    folder = write(tmp_path / "all", "one.ino", "two.ino", "a.h", "src/b.c", "libraries/Foo/Foo.cpp")
    assert files(folder / "two.ino") == {"two.ino", "a.h", "libraries/Foo/Foo.cpp"}
    (folder / "one.ino").unlink()
    assert files(folder) == {"two.ino", "a.h", "src/b.c", "libraries/Foo/Foo.cpp"}  # the only one


def test_a_project_is_one(tmp_path: Path) -> None:
    folder = write(tmp_path / "car", "platformio.ini", "car.ino")
    assert find(folder) == Sketch(name="car", folder=folder.resolve(), shown=folder) == find(folder / "platformio.ini")


@pytest.mark.parametrize(
    ("names", "path", "code", "sentence"),
    [
        ([], ".", 2, r"is neither a sketch nor a PlatformIO project; expected an .ino file or platformio.ini"),
        (["a.ino", "b.ino"], ".", 2, "holds several sketches, a.ino, b.ino; expected one of them, or one named here"),
        (["a$b.ino"], "a$b.ino", 2, r"a\$b.ino cannot be built: expected a file name without \$, quotes, ; and"),
        (["other.ini"], "other.ini", 2, "there is no sketch"),
        ([], "no.ino", 2, "there is no sketch .*no.ino; expected an .ino file, or a folder with one"),
        (["a.ino/b.ino"], "pipe.ino", 2, "there is no sketch"),
        (["big.ino"], "big.ino", 1, r"big.ino cannot be read: it has 8,000,000 bytes; expected at most 4,194,304"),
    ],
)
def test_what_is_none_is_one_sentence(tmp_path: Path, names: list[str], path: str, code: int, sentence: str) -> None:
    folder = write(tmp_path / "here", *names)
    folder.mkdir(exist_ok=True)
    if names == ["big.ino"]:
        os.truncate(folder / "big.ino", 8_000_000)
    os.mkfifo(folder / "pipe.ino")
    with pytest.raises(BoebotError, match=sentence) as raised:
        find(folder / path)
    assert raised.value.exit_code == code
