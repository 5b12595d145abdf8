"""Commands on the record of a run: `boebot plot`."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from command import boebot


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two seconds on the native board."""
    import boebot as library

    folder = tmp_path_factory.mktemp("runs") / "run"
    library.run("wander", seconds=2, out=folder)
    return folder


def test_columns_are_drawn(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "plot", str(folder), "ping_distance_m", "true_x_m")
    assert (code, err) == (0, "") and "plot.png" in out
    with Image.open("plot.png") as picture:
        assert picture.info["Title"] == "wander on shieldbot" and picture.width > picture.height
        two = picture.height
    assert boebot(capsys, "plot", str(folder), "tick", "--out", "one.png")[0] == 0
    with Image.open("one.png") as picture:
        assert picture.height < two


@pytest.mark.parametrize(
    ("column", "sentence"),
    [
        ("true_x_mm", "the run has no column 'true_x_mm'; expected one of time_s, tick"),
        ("true_x_mm", "did you mean 'true_x_m'?"),
        ("contact", "'contact' was renamed; expected true_contact"),
        ("command", "column 'command' has words, not numbers"),
    ],
)
def test_unknown_column_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, folder: Path, column: str, sentence: str
) -> None:
    picture = tmp_path / "plot.png"
    code, out, err = boebot(capsys, "plot", str(folder), column, "--out", str(picture))
    assert code != 0 and out == "" and sentence in " ".join(err.split()) and "Traceback" not in err
    assert not picture.exists()
