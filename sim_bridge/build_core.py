"""Builder of `sim_bridge._core`, by cffi's API mode, for setup.py: world, parts, loop, boards that need no emulator.

What Python may call is what stands between `/* python: begin */` and `/* python: end */` in the headers below, and all
that `boebot.arenas._arena` offers: arenas and rays are the same C in both.
"""

from __future__ import annotations

import os
import re
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

from cffi import FFI

# What headers cannot say in a form that cffi reads.
BEFORE = """
typedef struct { ...; } part_kind;
typedef struct { ...; } sensor_kind;
"""
AFTER = """
static const double WHISKER_HEIGHT_M, SUPPLY_NOMINAL_V;
static const int PART_READINGS;
typedef struct { body_state state; uint32_t id; ...; } body;
void body_init(body *self, const body_parameters *parameters, double reach);
void body_place(body *self, double x, double y, double heading);
void body_as_mover(const body *self, mover *out);
void body_step(body *bodies[], size_t count, const scene *around, double torques[][2], double dt);
double body_wheel_hold(const body *self, double dt);
int body_segment_touches(body *self, const scene *around, double x0, double y0, double x1, double y1,
                         double height);
typedef struct { size_t obstacles; mover *movers; ...; } world;
typedef struct { uint64_t step; int32_t flag; double energy; uint64_t contacts; ...; } vehicle_state;
typedef struct { world own; body body; vehicle_state state; ...; } vehicle;
struct vehicle_model { size_t readings; int drive, has_battery, noise, ends_at_collision; ...; };
struct vehicles {
  const vehicle_model *model;
  size_t state_size;
  vehicle *worlds;
  double *readings;
  unsigned char *brains;
  ...;
};
typedef struct { brown_out_parameters parameters; uint32_t resets, upsets; ...; } brown_out;
typedef struct { supply supply; ...; } battery;
typedef struct { motor_position motor; ...; } turret;
typedef struct { double supply; uint8_t driven[...]; ...; } chassis;
struct robot {
  body *body;
  vehicles *vehicle;
  chassis chassis;
  brown_out brown_out;
  battery *battery;
  double held_supply;
  int part_count;
  buffer received, received_at, truth;
  bool is_stamped;
  double sampled[...], held[...];
  edge_log edges;
  uint64_t last_byte, listen_from, reset_at, contacts;
  ...;
};
turret *robot_turret(const robot *self, uint8_t pin);
struct sim { world world; mover movers[...]; uint64_t now, world_at; buffer waits, shifts; ...; };
"""
SOURCES = [
    "world/*.c",
    "world/sensors/*.c",
    "vehicles/*.c",
    "parts/*.c",
    "boards/native/*.c",
    "loop/*.c",
]
UNMARKED = ["world/body_step.h", "loop/state.h"]  # what is declared here
ROOM = Path("sim_bridge")
LIBRARIES = ["-ldl"] if "linux" in os.environ.get("BOEBOT_TARGET", sys.platform) else []


def headers() -> list[str]:
    """Headers of this room that Python may call, each after those that it includes."""
    found: dict[str, None] = {}

    def visit(path: Path) -> None:
        text = path.read_text("utf-8")
        for name in re.findall(r'^#include "(.*)"', text, re.MULTILINE):
            for near in (path.parent / name, ROOM / name):
                if near.exists():
                    visit(near.resolve().relative_to(ROOM.resolve().parent))
                    break
        if "/* python: begin */" in text:
            found[path.relative_to(ROOM).as_posix()] = None

    for path in sorted(ROOM.rglob("*.h")):
        if not {"avr", "native", "tests"} & set(path.parts) or path.name == "native_board.h":
            visit(path)
    return list(found)


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    arena = SimpleNamespace(**runpy.run_path("host/boebot/arenas/build_arena.py"))
    names = headers()
    built = FFI()
    built.include(arena.ffi)
    built.cdef("\n".join([BEFORE, *(arena.declarations(ROOM / name) for name in names), AFTER]))
    built.set_source(
        "sim_bridge._core",
        "\n".join(f'#include "{name}"' for name in [*names, *UNMARKED]),
        sources=[*arena.SOURCES, *sorted(path.as_posix() for pattern in SOURCES for path in ROOM.glob(pattern))],
        include_dirs=[ROOM.as_posix(), arena.HERE.as_posix(), "firmware/src"],
        extra_compile_args=arena.COMPILE,
        extra_link_args=LIBRARIES,
    )
    return built


ffi = builder()
