"""Builder of `sim_bridge._core`, by cffi's API mode, for setup.py: world, parts, loop, boards that need no emulator.

What Python may call is what stands between `/* python: begin */` and `/* python: end */` in the headers below, and all
that `boebot.arenas._arena` offers: arenas and rays are the same C in both.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

from cffi import FFI

HEADERS = [
    "world/noise.h",
    "world/noise_block.h",
    "world/outline.h",
    "world/body.h",
    "world/body_step.h",
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
    "parts/logs.h",
    "loop/loop.h",
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
void body_as_mover(const body *self, mover *out);
int body_step(body *bodies[], size_t count, const scene *around, double torques[][2], double dt);
int body_advance(body *self, const scene *around, double torque_left, double torque_right, double dt);
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
    "loop/*.c",
]
ROOM = Path("sim_bridge")
LIBRARIES = [] if sys.platform in ("win32", "darwin") else ["-ldl"]


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    arena = SimpleNamespace(**runpy.run_path("host/boebot/arenas/build_arena.py"))
    built = FFI()
    built.include(arena.ffi)
    access = (ROOM / "boards/board_access.cdef").read_text("utf-8")
    built.cdef("\n".join([access, BEFORE, *(arena.declarations(ROOM / name) for name in HEADERS), AFTER]))
    built.set_source(
        "sim_bridge._core",
        "\n".join(f'#include "{name}"' for name in HEADERS),
        sources=[*arena.SOURCES, *sorted(path.as_posix() for pattern in SOURCES for path in ROOM.glob(pattern))],
        include_dirs=[ROOM.as_posix(), arena.HERE.as_posix(), "firmware/src"],
        extra_compile_args=arena.COMPILE,
        extra_link_args=[*arena.LINK, *LIBRARIES],
    )
    return built


ffi = builder()
