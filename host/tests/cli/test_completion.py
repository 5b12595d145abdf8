"""The list of commands comes at once, and the shell completes commands, options and names."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from boebot.arenas import arena_names
from boebot.brains import bundled
from boebot.cli import app, options
from command import boebot


def test_list_of_commands_needs_none_of_them() -> None:
    script = (
        "import sys; sys.argv = ['boebot', '--help']\n"
        "from boebot import cli\n"
        "try: cli.main()\n"
        "finally: print(sorted({name.partition('.')[0] for name in sys.modules}), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert all(name in done.stdout for name in app.all_commands())
    for heavy in ("numpy", "matplotlib", "mcap", "msgspec", "serial", "rich", "sim_bridge"):
        assert f"'{heavy}'" not in done.stderr, heavy


@pytest.mark.parametrize(
    "words",
    [
        "list",
        "experiment nonesuch",
        "run wander --seconds 0.1",
        "faults",
        "timing --no-measure",
        "show arena room --json",
    ],
)
def test_a_command_that_draws_nothing_does_without_matplotlib(words: str) -> None:
    script = (
        f"import sys; sys.argv = ['boebot', *{words.split()}]; sys.modules['matplotlib'] = None\n"
        "from boebot import cli; cli.main()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert "matplotlib" not in done.stderr and done.returncode == (2 if "nonesuch" in words else 0), done.stderr


@pytest.mark.parametrize("name", app.all_commands())
def test_command_says_of_itself_what_the_list_says(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, name, "--help")
    assert (code, err) == (0, "")
    assert app.described(name).line.rstrip(".") in " ".join(out.split())


def test_shell_completes_commands_options_names_and_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "worm.py").touch()
    (tmp_path / "words.txt").touch()
    (tmp_path / "wood").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("_BOEBOT_COMPLETE", "complete_bash")

    def completed(*words: str) -> list[str]:
        """What bash is told of the last word."""
        monkeypatch.setenv("COMP_WORDS", "\n".join(["boebot", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        code, out, err = boebot(capsys)
        assert (code, err) == (0, "")
        return out.split()

    assert completed("re") == ["report", "replay"]
    assert completed("run", "--ro") == ["--robot", "--robots", "--row"]
    assert completed("run", "w") == ["wander", "wood/", "worm.py"]
    assert completed("run", "--arena", "") == [*arena_names(), "wood/"]
    assert completed("parameters", "s") == ["set", "save"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_script_for_each_shell(shell: str, tmp_path: Path) -> None:
    environment = os.environ | {"_BOEBOT_COMPLETE": f"source_{shell}"}
    done = subprocess.run([sys.executable, "-m", "boebot"], env=environment, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and f"complete_{shell}" in done.stdout
    if (found := shutil.which(shell)) is not None:
        script = tmp_path / "script"
        script.write_text(done.stdout)
        read = subprocess.run([found, "-n", str(script)], capture_output=True, text=True, timeout=60)
        assert (read.returncode, read.stderr) == (0, "")


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_with_its_script() -> None:
    script = (
        'eval "$(_BOEBOT_COMPLETE=source_bash boebot)"\n'
        "set -- $(complete -p boebot)\n"
        "while [ $1 != -F ]; do shift; done\n"
        "COMP_WORDS=(boebot re) COMP_CWORD=1\n"
        "$2 boebot\n"
        'echo "${COMPREPLY[@]}"\n'
    )
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = os.environ | {"PATH": path}
    done = subprocess.run(["bash", "-c", script], env=environment, capture_output=True, text=True, timeout=60)
    assert (done.stdout.split(), done.stderr) == (["report", "replay"], "")


def test_bundled_brains_are_completed_without_being_read() -> None:
    assert set(bundled()) <= set(options.complete_brains(""))
