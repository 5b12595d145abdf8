"""Makes everything that follows from messages.toml and robots/*.toml, by Python's standard library alone.

    python protocol/generate.py            makes what is built, and is not in git
    python protocol/generate.py --pages    writes what is in git, for it is read there
    python protocol/generate.py --check    exits 1 and names each file in git that is stale

Built: the C headers in firmware/src/generated, the Python module host/boebot/link/messages.py, and the stub
host/boebot/devices/attributes.pyi. `make`, setup.py, PlatformIO and pytest begin with it; a file that would be the same
is left alone. In git: the golden vectors protocol/vectors/frames.json, and the tables of PROTOCOL.md. Each kind of file
has a module beside this one. Packages beside the core, and the simulated world, join by a folder generator/ with a file
<any>_files.py, which has the same two functions, `built` and `pages`, and `parts` of PROTOCOL.md.
"""

from __future__ import annotations

import sys

if sys.version_info < (3, 11):  # noqa: UP036  # PlatformIO may run on an older one
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    sys.exit(f"protocol/generate.py: expected Python 3.11 or newer; {sys.executable} is {version}")

import argparse
import importlib
import json
import os
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
GUESTS = sorted(ROOT.glob("*/*/generator/*_files.py"))
sys.path[:0] = [str(HERE), *(str(path.parent) for path in GUESTS)]

import attributes_stub  # noqa: E402
import c_headers  # noqa: E402
import device_header  # noqa: E402
import pin_headers  # noqa: E402
import protocol_page  # noqa: E402
import python_module  # noqa: E402
import robot_files  # noqa: E402
import schema  # noqa: E402
import vectors  # noqa: E402

GENERATED = ROOT / "firmware" / "src" / "generated"
GUESTS_MODULES = [importlib.import_module(path.stem) for path in GUESTS]


def built() -> dict[Path, str]:
    """Each file that is made when building, and its text."""
    spec = schema.load()
    images = [robot for robot in robot_files.load_all() if robot.has_image]
    headers = {
        "values.h": c_headers.values_header(spec),
        "crc21_table.h": c_headers.crc21_header(),
        "messages.h": c_headers.messages_header(spec),
        "parameters.h": c_headers.parameters_header(spec),
        "devices.h": device_header.devices_header(spec),
        "vectors.h": vectors.vectors_header(vectors.vectors(spec)),
        "pin_map.h": pin_headers.pin_map_header(images),
        **{pin_headers.pins_file(robot): pin_headers.pins_header(spec, robot) for robot in images},
    }
    return {
        **{GENERATED / name: text for name, text in headers.items()},
        ROOT / "host" / "boebot" / "link" / "messages.py": python_module.python_module(spec),
        attributes_stub.STUB: attributes_stub.stub(),
        **{path: text for guest in GUESTS_MODULES for path, text in guest.built(spec).items()},
    }


def pages() -> dict[Path, str]:
    """Each made file that is in git, and its text."""
    spec = schema.load()
    parts = {name: text for guest in GUESTS_MODULES for name, text in guest.parts(spec).items()}
    return {
        HERE / "vectors" / "frames.json": json.dumps(vectors.vectors(spec), indent=1) + "\n",
        HERE / "PROTOCOL.md": protocol_page.protocol_page(spec, parts),
        **{path: text for guest in GUESTS_MODULES for path, text in guest.pages(spec).items()},
    }


def stale(made: dict[Path, str]) -> list[Path]:
    """Those of the files that are missing or have another text."""
    return [path for path, text in made.items() if not path.is_file() or path.read_text("utf-8") != text]


def write(path: Path, text: str) -> None:
    """Writes a file as a whole, for others may read it now."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    partial.write_text(text, "utf-8")
    partial.replace(path)


def main() -> int:
    """Makes the files, or checks them."""
    parser = argparse.ArgumentParser(description="Makes everything that follows from the protocol's schema.")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--pages", action="store_true", help="write the files in git: PROTOCOL.md, vectors, DBC")
    choice.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file in git is stale")
    asked = parser.parse_args()
    made = pages() if asked.pages or asked.check else built()
    for path in stale(made):
        if asked.check:
            print(f"{path.relative_to(ROOT)} is stale; run: python protocol/generate.py --pages")
        else:
            write(path, made[path])
    if not asked.pages and not asked.check:
        for path in set(GENERATED.glob("*.h")) - set(made):  # of a pin map that is no more
            path.unlink(missing_ok=True)
    return 1 if asked.check and stale(made) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ValueError, OSError) as error:
        sys.exit(f"protocol/generate.py: {error}")
