"""Builds a wheel for each system that students have, on Linux: `make wheels`, or `python -m tools.wheels [TAG ...]`.

The compiler is `zig cc`, clang with the C libraries of all these systems in one package of PyPI (`ziglang`). setup.py
compiles as ever; BOEBOT_TARGET tells it for which system. Modules use Python's stable interface (abi3), so that one
wheel serves every Python from 3.11 on. What each wheel holds is listed at the end.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from zipfile import ZipFile

PROJECT = Path(__file__).resolve().parents[1]
BUILD = PROJECT / "build" / "wheels"
INCLUDE = BUILD / "include"
WHEELS = PROJECT / "dist"

# A wheel's tag and the system as clang names it. 2.17 is the oldest C library of a Linux that it runs on, 11.0 the
# oldest macOS: those of the packages that boebot needs are no older.
SYSTEMS = {
    "manylinux_2_17_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux_2_17_aarch64": "aarch64-linux-gnu.2.17",
    "win_amd64": "x86_64-windows-gnu",
    "macosx_11_0_x86_64": "x86_64-macos.11.0",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
}


def zig() -> str:
    """The compiler's program.

    Raises:
        SystemExit: it is not installed.
    """
    try:
        import ziglang
    except ImportError:
        raise SystemExit("wheels: no zig here, which compiles for other systems; run: make wheels") from None
    return str(Path(ziglang.__file__).parent / "zig")


def write_headers() -> None:
    """Python's headers with a pyconfig.h for all systems, and the import library of Windows's python3.dll.

    Of what the library names the linker takes only what a module uses; so it may name all that the headers declare.
    """
    shutil.rmtree(INCLUDE, ignore_errors=True)
    shutil.copytree(sysconfig.get_paths()["include"], INCLUDE, ignore=shutil.ignore_patterns("cpython", "internal"))
    shutil.copy(PROJECT / "tools" / "pyconfig.h", INCLUDE)
    declared = re.compile(r"PyAPI_(FUNC|DATA)\([^)]*\)\s*(\w+)")
    found = {match.groups() for path in INCLUDE.glob("*.h") for match in declared.finditer(path.read_text("utf-8"))}
    names = [f"{name} DATA" if kind == "DATA" else name for kind, name in sorted(found, key=lambda entry: entry[1])]
    (INCLUDE / "python3.def").write_text("\n".join(["LIBRARY python3.dll", "EXPORTS", *names, ""]), encoding="ascii")
    command = [zig(), "dlltool", "-m", "i386:x86-64", "-d", "python3.def", "-l", "python3.lib"]
    subprocess.run(command, cwd=INCLUDE, check=True)


def build(tag: str) -> Path:
    """The wheel for the system with that tag.

    Raises:
        SystemExit: it could not be built; the log's end is printed.
    """
    target = SYSTEMS[tag]
    compiler = f"{zig()} cc -target {target}"
    linker = f"{compiler} -shared -s"
    if "windows" in target:
        linker += f" {INCLUDE / 'python3.lib'}"
        linker += f" -Wl,--out-implib,{BUILD / 'unused.lib'}"  # a module is loaded, not linked with
    elif "macos" in target:
        linker += " -undefined dynamic_lookup"  # the Python that loads a module has what it asks for
    environment = os.environ | {
        "BOEBOT_TARGET": target,
        "CC": compiler,
        "CFLAGS": f"-g0 -I{INCLUDE}",
        "LDSHARED": linker,
        "ZIG_GLOBAL_CACHE_DIR": str(BUILD / "cache"),
        "ZIG_LOCAL_CACHE_DIR": str(BUILD / "cache"),
    }
    folder = BUILD / tag
    for made in folder.glob("lib*"):  # objects are kept
        shutil.rmtree(made)
    for old in WHEELS.glob(f"boebot-*-{tag}.whl"):
        old.unlink()
    command = [sys.executable, "setup.py", "--quiet", "build", "--build-base", str(folder)]
    command += ["bdist_wheel", "--plat-name", tag, "--bdist-dir", str(folder / "wheel"), "--dist-dir", str(WHEELS)]
    log = BUILD / f"{tag}.log"
    with log.open("w", encoding="utf-8") as output:
        done = subprocess.run(command, cwd=PROJECT, env=environment, stdout=output, stderr=subprocess.STDOUT)
    if done.returncode:
        print("\n".join(log.read_text(encoding="utf-8").splitlines()[-20:]), file=sys.stderr)
        raise SystemExit(f"wheels: {tag} could not be built (all of its output: {log.relative_to(PROJECT)})")
    (wheel,) = WHEELS.glob(f"boebot-*-abi3-{tag}.whl")
    return wheel


def contents(wheel: Path) -> str:
    """What is in a wheel and how large, one kind to a line."""
    with ZipFile(wheel) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist()}
        (metadata,) = (name for name in sizes if name.endswith(".dist-info/METADATA"))
        licence = re.search(r"^License-Expression: (.*)$", archive.read(metadata).decode(), re.M)
    assert licence is not None
    lines = [f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, {len(sizes)} files, licence {licence[1]}"]
    native = [name for name in sizes if name.endswith((".so", ".pyd", ".dll", ".dylib"))]
    lines += [f"  {sizes[name] / 1e3:7.0f} kB  {name}" for name in sorted(native)]
    kinds = {
        "firmware images": ("boebot/data/images/", ""),
        "arenas": ("boebot/arenas/bundled/", ".toml"),
        "robots": ("boebot/data/robots/", ".toml"),
        "Python files": ("", ".py"),
    }
    for kind, (begin, end) in kinds.items():
        names = [name for name in sizes if name.startswith(begin) and name.endswith(end)]
        shown = "" if kind == "Python files" else ": " + " ".join(Path(name).name for name in sorted(names))
        lines.append(f"  {sum(sizes[name] for name in names) / 1e3:7.0f} kB  {len(names)} {kind}{shown}")
    return "\n".join(lines)


def main(tags: list[str]) -> None:
    """Builds the wheels with those tags, all of them if none is named."""
    if unknown := set(tags) - set(SYSTEMS):
        raise SystemExit(f"wheels: no system {', '.join(sorted(unknown))}; known: {' '.join(SYSTEMS)}")
    BUILD.mkdir(parents=True, exist_ok=True)
    write_headers()
    for tag in tags or SYSTEMS:
        print(contents(build(tag)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
