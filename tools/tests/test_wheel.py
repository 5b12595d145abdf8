"""The wheel that `make wheel` builds: installed without a network, it runs without a compiler.

The packages it depends on come from build/wheelhouse, which `make test` fills.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from zipfile import ZipFile

import pytest

PROJECT = Path(__file__).resolve().parents[2]


def without_network(command: list[str]) -> list[str]:
    """The command in a network namespace without a network; a warning where this system makes none."""
    unshare = shutil.which("unshare") or "unshare"
    for isolate in ([unshare, "--net"], [unshare, "--net", "--map-root-user"]):
        if (
            shutil.which(unshare)
            and subprocess.run([*isolate, "true"], capture_output=True, check=False).returncode == 0
        ):
            return [*isolate, *command]
    warnings.warn("no network namespaces on this system: the wheel is tested with the network on", stacklevel=2)
    return command


@pytest.fixture(scope="module")
def wheel() -> Path:
    """Made anew, beside what an earlier one has left: modules whose sources are gone."""
    for folder in (PROJECT / "build").glob("lib.*"):
        (folder / "sim_bridge" / "gone.py").touch()
        (folder / "sim_bridge" / "_gone.abi3.so").touch()
    subprocess.run(["make", "wheel"], cwd=PROJECT, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = (PROJECT / "dist").glob("boebot-*-linux_*.whl")
    return wheel


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty environment with the wheel in it."""
    environment = tmp_path_factory.mktemp("wheel") / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    pip = [sys.executable, "-m", "pip", "--python", str(environment / "bin" / "python"), "--quiet"]
    offline = ["--no-index", "--no-compile", "--find-links", str(PROJECT / "build" / "wheelhouse")]
    subprocess.run(without_network([*pip, "install", *offline, f"{wheel}[hil]"]), check=True)
    return environment


def test_a_wheel_has_what_there_are_sources_of(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        names = archive.namelist()
    assert "sim_bridge/sim.py" in names and not [name for name in names if "gone" in name]
    assert sorted(name for name in names if name.rpartition("/")[2].startswith("_") and name.endswith(".so")) == [
        "boebot/arenas/_arena.abi3.so",
        "boebot/link/_codec.abi3.so",
        "sim_bridge/_core.abi3.so",
        "sim_bridge/boards/avr/_avr.abi3.so",
    ]


def test_an_installed_wheel_names_a_library_that_is_damaged(installed: Path, tmp_path: Path) -> None:
    for name in ("_core", "_avr", "firmware-shieldbot"):
        (file,) = installed.glob(f"lib/python*/site-packages/sim_bridge/**/{name}.*so")
        whole = file.read_bytes()
        file.unlink()
        file.write_bytes(whole[: len(whole) // 2])
        command = [str(installed / "bin" / "boebot"), "run", "wander", "--on", "avr" if name == "_avr" else "native"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        file.unlink()
        file.write_bytes(whole)
        assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
        assert f"{file} cannot be loaded" in done.stderr and ": it is cut short; " in done.stderr
        assert done.stderr.endswith("; type `pip install --force-reinstall boebot`\n")


@pytest.mark.parametrize(
    ("brain", "board"),
    [("wander", "native"), ("demo", "avr"), pytest.param("clearway", "native", marks=pytest.mark.soak)],
)
def test_an_installed_wheel_runs_bundled_brains(installed: Path, tmp_path: Path, brain: str, board: str) -> None:
    out = tmp_path / "out"
    command = [str(installed / "bin" / "boebot"), "run", brain, "--on", board, "--seconds", "5"]
    command += ["--out", str(out)]
    bare = {"PATH": str(installed / "bin"), "HOME": str(tmp_path), "LANG": os.environ.get("LANG", "C.UTF-8")}
    done = subprocess.run(without_network(command), cwd=tmp_path, env=bare, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert {"record.mcap", "run.png", "replay.html"} <= {path.name for path in out.iterdir()}
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["ticks"] > 450, "100 a second"


def test_an_installed_wheel_says_what_only_a_checkout_can(installed: Path, tmp_path: Path) -> None:
    """A robot of one's own whose pin map no bundled firmware has."""
    shieldbot = (PROJECT / "protocol" / "robots" / "shieldbot.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(
        shieldbot.replace('pin_map = "shieldbot"', 'pin_map = "mine"'), encoding="utf-8"
    )
    for arguments in (["run", "wander", "--on", "native"], ["run", "wander", "--on", "avr"], ["timing"]):
        command = [str(installed / "bin" / "boebot"), *arguments, "--robot", "mine.toml"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode in (1, 2)
        assert "; only a checkout of boebot can build it with `make " in done.stderr
        assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("command", "extra"),
    [
        ("run wander --on can:virtual:lab", "can"),
        ("can bridge native --can virtual:lab", "can"),
        ("run {sketch}", "firmware"),
        ("report {run} --quiet --as foxglove", "foxglove"),
        ("report {run} --quiet --as can.log", "can"),
    ],
)
def test_an_installed_wheel_names_the_extra_that_is_missing(
    installed: Path, tmp_path: Path, command: str, extra: str
) -> None:
    boebot = str(installed / "bin" / "boebot")
    if "{run}" in command:
        made = [boebot, "run", "wander", "--seconds", "0.1", "--quiet", "--out", "made"]
        subprocess.run(made, cwd=tmp_path, check=True)
    words = command.format(run="made", sketch=PROJECT / "host/boebot/sketches/whiskers").split()
    done = subprocess.run([boebot, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.endswith(f", which is not installed: pip install 'boebot[{extra}]'\n"), done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_an_installed_wheel_has_the_sketches(installed: Path, tmp_path: Path) -> None:
    for command in (["list", "sketches"], ["new", "whiskers", "--sketch"]):
        subprocess.run([str(installed / "bin" / "boebot"), *command], cwd=tmp_path, check=True, capture_output=True)
    assert "Servo.h" in (tmp_path / "whiskers" / "whiskers.ino").read_text(encoding="utf-8")


def test_an_installed_wheel_tests_boards_and_programs(installed: Path, tmp_path: Path) -> None:
    """The kit's own tests, and a user's with the fixture `uno`."""
    (tmp_path / "test_mine.py").write_text(
        "import pytest\n\n@pytest.mark.uno(robot='shieldbot')\ndef test_says_hello(uno):\n"
        "    uno.serial.expect(b'\\x00', within=0.5)\n"
    )
    for command in (["boebot", "test", "--on", "native", "-k", "handshake"], ["pytest", "test_mine.py"]):
        program = str(installed / "bin" / command[0])
        done = subprocess.run([program, *command[1:]], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0 and " passed" in done.stdout, done.stdout + done.stderr
