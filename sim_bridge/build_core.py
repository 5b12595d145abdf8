"""Builder of `sim_bridge._core`: world, parts, loop and the boards that need no emulator, by cffi's API mode.

What Python may call is what stands between `/* python: begin */` and `/* python: end */` in the headers below. setup.py
uses `ffi`; by itself `python sim_bridge/build_core.py` builds the extension in place.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from cffi import FFI

HEADERS = [
    "world/numbers.h",
    "world/noise.h",
    "world/noise_block.h",
    "world/paths.h",
    "world/arena.h",
    "world/scene.h",
    "world/scan.h",
    "world/outline.h",
    "world/body.h",
    "world/motor_regulated.h",
    "world/motor_dc.h",
    "world/motor_position.h",
    "world/servo_motor.h",
    "world/supply.h",
    "world/sensors/beam.h",
    "world/sensors/infrared_proximity.h",
    "world/sensors/infrared_pair.h",
    "world/sensors/sharp_infrared.h",
    "world/sensors/sonar.h",
    "world/sensors/laser.h",
    "world/sensors/compass.h",
    "world/sensors/accelerometer.h",
    "world/sensors/light.h",
    "world/sensors/odometer.h",
    "world/sensors/quadrature.h",
    "world/sensors/table_noise.h",
    "world/sensors/unit.h",
    "world/sensors/sample_hold.h",
    "vehicles/model.h",
    "vehicles/vehicle.h",
    "vehicles/wander.h",
    "parts/whisker.h",
    "parts/compass.h",
    "parts/encoder.h",
    "parts/light_sensor.h",
    "parts/battery.h",
    "parts/brown_out.h",
    "boards/script_board.h",
    "boards/board_access.h",
    "boards/native/native_board.h",
    "logs.h",
    "loop.h",
]
# What headers cannot say in a form that cffi reads.
BEFORE = """
board *native_board_create(const char *library_path, char *error, size_t error_size);
"""
AFTER = """
static const double WHISKER_HEIGHT_M;
typedef struct { body_state state; uint32_t id; ...; } body;
void body_init(body *self, const body_parameters *parameters, double reach);
void body_place(body *self, double x, double y, double heading);
int body_step(body *bodies[], size_t count, const scene *around, double torques[][2], double dt);
int body_advance(body *self, const scene *around, double torque_left, double torque_right, double dt);
void body_as_mover(const body *self, mover *out);
double body_wheel_hold(const body *self, double dt);
int body_segment_touches(body *self, const scene *around, double x0, double y0, double x1, double y1,
                         double height);
"""
SOURCES = [
    "world/*.c",
    "world/sensors/*.c",
    "vehicles/*.c",
    "parts/*.c",
    "boards/board_access.c",
    "boards/script_board.c",
    "boards/native/*.c",
    "logs.c",
    "loop*.c",
]
WINDOWS = sys.platform == "win32"
WHOLE_PROGRAM = "-flto=auto"


def links_whole_program() -> bool:
    """Whether the compiler optimises across files when it links; the sanitizers' build goes without."""
    if WINDOWS or os.environ.get("BOEBOT_SANITIZE") == "1":
        return False
    compiler = shlex.split(os.environ.get("CC") or str(sysconfig.get_config_var("CC") or "cc"))
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text("int probe(void) { return 0; }\n", encoding="utf-8")
        command = [*compiler, WHOLE_PROGRAM, "-shared", "-fPIC", str(source), "-o", str(source.with_suffix(".so"))]
        try:
            return subprocess.run(command, capture_output=True, check=False).returncode == 0
        except OSError:
            return False


# Nothing but the module's entry is seen from outside: what is called within the library may be inlined there. Nobody
# asks for errno or floating-point traps: without them loops become vectors, with the same results.
INSIDE = [
    "-std=gnu11",
    "-fvisibility=hidden",
    "-fno-math-errno",
    "-fno-trapping-math",
    *([WHOLE_PROGRAM] if links_whole_program() else []),
]
# No fused multiply-add: the same bits on every machine.
COMPILE = ["/O2", "/fp:precise"] if WINDOWS else [*INSIDE, "-O2", "-ffp-contract=off"]
LIBRARIES = [] if WINDOWS or sys.platform == "darwin" else ["-ldl"]
LINK = [*([] if WINDOWS else COMPILE), *LIBRARIES]  # code is made when linking, and by the same rules


def declarations(header: Path) -> str:
    """What a header offers to Python."""
    return "\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", header.read_text("utf-8"), re.S))


def builder(root: Path) -> FFI:
    """The extension, with its sources named from `root`."""
    here = Path(__file__).resolve().parent
    built = FFI()
    access = (here / "boards/board_access.cdef").read_text("utf-8")
    built.cdef("\n".join([access, BEFORE, *(declarations(here / name) for name in HEADERS), AFTER]))
    built.set_source(
        "sim_bridge._core",
        "\n".join(f'#include "{name}"' for name in HEADERS),
        sources=sorted(
            (root / path.relative_to(here)).as_posix() for pattern in SOURCES for path in here.glob(pattern)
        ),
        include_dirs=[root.as_posix(), (root.parent / "firmware" / "src").as_posix()],
        extra_compile_args=COMPILE,
        extra_link_args=LINK,
    )
    return built


ffi = builder(Path("sim_bridge"))


def main() -> None:
    """Builds below build/core and puts the extension into the package."""
    room = Path(__file__).resolve().parent
    folder = room.parent / "build" / "core"
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)
    built = builder(room).compile(tmpdir=".", verbose="-v" in sys.argv)
    for stale in room.glob("_core.*.so"):
        stale.unlink()
    shutil.copy(built, room / ("_core.pyd" if WINDOWS else "_core.abi3.so"))  # as setup.py names it


if __name__ == "__main__":
    main()
