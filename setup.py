"""Builds what is not Python: the simulated world, the emulated boards, the firmware for this computer. Before anything
else it makes what follows from the protocol and the robots' files (protocol/generate.py).

* `boebot.link._codec`: the firmware's frame code for the host (host/boebot/link/build_codec.py).
* `boebot.arenas._arena`: arenas and rays (host/boebot/arenas/build_arena.py).
* `sim_bridge._core`: world, parts and loop (sim_bridge/build_core.py).
* `sim_bridge.boards.avr._avr`: the emulated ATmega328P (sim_bridge/boards/avr/build_avr.py).
* `sim_bridge/images/firmware-<pin map>.so`: the firmware's own C, one library per pin map.

A wheel also carries the robots and the AVR images. BOEBOT_TARGET names another system to compile for
(tools/wheels.py, which also says with which compiler). BOEBOT_SANITIZE=1, for the makers' tests, builds all C with
the address and undefined-behaviour sanitizers, and every warning about ours is an error.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from setuptools import find_namespace_packages, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
os.chdir(ROOT)

if subprocess.run([sys.executable, "protocol/generate.py"], check=False).returncode:
    sys.exit(1)

FIRMWARE = Path("firmware/src")
LIBRARIES = Path("sim_bridge/images")
PIN_HEADERS = FIRMWARE.glob("generated/pins_*.h")
PIN_MAPS = sorted(path.stem.removeprefix("pins_").replace("_", "-") for path in PIN_HEADERS)

# Packages beside the library, which join it by entry points.
GUESTS = ("avr_timing", "boebot_campaign", "boebot_can", "boebot_course", "boebot_timing")
WITH_PARTS = [*GUESTS, *(f"{name}.*" for name in GUESTS)]

# What a wheel carries beside its modules: folder in the package <- (folder in the checkout, patterns).
WHEEL_DATA = {
    "boebot/data/robots": ("protocol/robots", ("*.toml",)),
    "boebot/data/images": ("build/images", ("*.elf", "*.hex")),
    "boebot/data/protocol": ("protocol", ("boebot.dbc",)),
}

# The system that is compiled for, as clang names it: x86_64-windows-gnu ...; "": this one. What follows from a system
# follows from this, since wheels for all of them are built on Linux.
TARGET = os.environ.get("BOEBOT_TARGET", "")
WINDOWS, MACOS = "windows" in TARGET, "macos" in TARGET
MODULE_SUFFIX = ".pyd" if WINDOWS else ".abi3.so"
LIBRARY_SUFFIX = ".dll" if WINDOWS else ".dylib" if MACOS else ".so"
GCC_ONLY = ("-fvect-cost-model=", "-fno-gcse", "-fno-tree-")  # wheels are compiled by clang

CFFI_MODULES = [
    f"{script}:ffi"
    for script in (
        "host/boebot/link/build_codec.py",
        "host/boebot/arenas/build_arena.py",
        "sim_bridge/build_core.py",
        "sim_bridge/boards/avr/build_avr.py",
    )
    if Path(script).exists()
]

SANITIZERS = [
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
    "-fno-omit-frame-pointer",
    "-O1",
    "-g1",
]
WARNINGS = [  # but for conversions, which clang looks at (tools/warnings.sh): gcc is wrong about them under sanitizers
    *("-Wall", "-Wextra", "-Wno-unused-parameter", "-Wshadow"),
    *("-Wstrict-prototypes", "-Wmissing-prototypes", "-Werror"),
]
SANITIZE = SANITIZERS if os.environ.get("BOEBOT_SANITIZE") == "1" else []
DEBUGGING = SANITIZE or ["-g0"]  # Python's own flags have -g, a sixth of the time that compiling takes


def firmware_sources() -> list[str]:
    """The firmware without what belongs to the microcontroller: start-up and AVR hardware layer."""
    return sorted(
        str(path)
        for path in FIRMWARE.rglob("*.c")
        if path != FIRMWARE / "main.c" and "avr" not in path.relative_to(FIRMWARE).parts
    )


def headers() -> list[str]:
    """Every header of ours, and frame.c, which the codec includes: a change of one compiles anew what may need it."""
    ends, folders = ("*.h", "*.def"), (Path("sim_bridge"), Path("host"), FIRMWARE)
    found = [FIRMWARE / "link" / "frame.c", *(path for one in folders for end in ends for path in one.rglob(end))]
    return sorted(str(path) for path in found)


class BuildExt(build_ext):
    """Compiles on all processors and only what has changed, then links one firmware library per pin map."""

    def finalize_options(self) -> None:
        """pip installs a checkout from an empty folder, for which all would be compiled anew: its objects are used."""
        super().finalize_options()
        if self.editable_mode:
            build: Any = self.get_finalized_command("build")
            self.build_temp = f"{build.build_base}/temp.{build.plat_name}-{sys.implementation.cache_tag}"

    def get_ext_filename(self, fullname: str) -> str:
        """Modules are of Python's stable interface; setuptools knows only this system's suffix for one."""
        if TARGET:
            return f"{Path(*fullname.split('.'))}{MODULE_SUFFIX}"
        return str(super().get_ext_filename(fullname))  # type: ignore[no-untyped-call]

    def build_extensions(self) -> None:
        self.compiler.compile = self.compile_in_parallel(self.compiler.compile)
        for extension in self.extensions:
            extension.depends = [*extension.depends, *headers(), "setup.py"]
            flags = [*extension.extra_compile_args, *DEBUGGING]
            extension.extra_compile_args = [flag for flag in flags if not (TARGET and flag.startswith(GCC_ONLY))]
            extension.extra_link_args = [*extension.extra_link_args, *SANITIZE]
        super().build_extensions()
        for pin_map in PIN_MAPS:
            self.build_firmware_library(pin_map)

    def compile_in_parallel(self, compile_some: Callable[..., list[str]]) -> Callable[..., list[str]]:
        """A compile method for the compiler that takes each source by itself and skips what is up to date."""
        newest_header = max(Path(name).stat().st_mtime for name in [*headers(), "setup.py"])

        def compile_one(source: str, output_dir: str, options: dict[str, Any]) -> list[str]:
            objects: list[str] = self.compiler.object_filenames([source], output_dir=output_dir)
            changed = max(newest_header, Path(source).stat().st_mtime)
            if all(Path(name).exists() and Path(name).stat().st_mtime > changed for name in objects):
                return objects
            by_cffi = source.startswith(self.build_temp)  # it hands arguments over: long, and quick as it stands
            more = ["-O1"] if by_cffi else WARNINGS if SANITIZE else []
            flags = [*(options.get("extra_postargs") or []), *more]
            return compile_some([source], output_dir=output_dir, **{**options, "extra_postargs": flags})

        def compile_all(sources: list[str], output_dir: str, **options: Any) -> list[str]:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                results = list(pool.map(lambda source: compile_one(source, output_dir, options), sources))
            return [name for result in results for name in result]

        return compile_all

    def build_firmware_library(self, pin_map: str) -> None:
        sources = firmware_sources()
        if not sources:
            return
        library = Path(self.build_lib, LIBRARIES, f"firmware-{pin_map}{LIBRARY_SUFFIX}")
        objects = self.compiler.compile(
            sources,
            output_dir=str(Path(self.build_temp, "firmware", pin_map)),
            macros=[(f"PIN_MAP_{pin_map.replace('-', '_').upper()}", None)],
            include_dirs=[str(FIRMWARE)],
            extra_postargs=["-std=gnu11", "-O2", "-fvisibility=hidden", *DEBUGGING],
        )
        if library.exists() and all(library.stat().st_mtime > Path(name).stat().st_mtime for name in objects):
            return
        library.parent.mkdir(parents=True, exist_ok=True)
        self.compiler.link_shared_object(
            objects,
            str(library),
            export_symbols=["firmware_board_api"],
            extra_postargs=SANITIZE,
        )

    def copy_extensions_to_source(self) -> None:
        super().copy_extensions_to_source()
        for library in Path(self.build_lib, LIBRARIES).glob("firmware-*"):
            LIBRARIES.mkdir(exist_ok=True)
            # A new file, not new bytes in a file that a running program may have mapped.
            (LIBRARIES / library.name).unlink(missing_ok=True)
            shutil.copy2(library, LIBRARIES / library.name)


class BuildPy(build_py):
    """Copies the data that a wheel carries; a checkout reads them where they are."""

    def find_package_modules(self, package: str, package_dir: str) -> list[tuple[str, str, str]]:
        """Without the scripts that describe the extensions to cffi."""
        found = super().find_package_modules(package, package_dir)  # type: ignore[no-untyped-call]
        return [entry for entry in found if not entry[1].startswith("build_")]

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        for target, (source, patterns) in WHEEL_DATA.items():
            files = [path for pattern in patterns for path in sorted(Path(source).glob(pattern))]
            if not files:
                print(f"setup.py: nothing in {source}; this wheel goes without it", file=sys.stderr)
                continue
            folder = Path(self.build_lib, target)
            folder.mkdir(parents=True, exist_ok=True)
            for path in files:
                shutil.copyfile(path, folder / path.name)


setup(
    license_expression="MIT",
    license_files=["LICENSE"],
    cmdclass={"build_ext": BuildExt, "build_py": BuildPy},
    package_dir={name: f"host/{name}" for name in ("boebot", *GUESTS)}
    | {"sim_bridge": "sim_bridge", "boebot_hil": "hil_tests/boebot_hil"},
    packages=[
        *find_namespace_packages("host", include=["boebot", "boebot.*"], exclude=["*.data*", "boebot.arenas.geometry"]),
        "boebot_hil",  # the only tests that are installed: they prove any board
        *find_namespace_packages("host", include=WITH_PARTS, exclude=["*.tests*", "*.generator"]),
        *find_namespace_packages(
            ".",
            include=["sim_bridge", "sim_bridge.*"],
            exclude=[f"sim_bridge.{folder}*" for folder in ("tests", "fuzz", "world", "parts", "images")],
        ),
    ],
    package_data={
        "": ["py.typed", "*.pyi", "*.html", "*.css", "*.js"],
        "boebot": ["slips.toml", "sketch/platforms/**/*.json", "sketches/*/*.ino"],
        "boebot.brains": ["*.toml"],
        "boebot.cli": ["*.txt"],
        "boebot.imperfections": ["*.toml"],
        "boebot.arenas.bundled": ["*.toml", "*.json"],
    },
    include_package_data=False,
    cffi_modules=CFFI_MODULES,
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
    zip_safe=False,
)
