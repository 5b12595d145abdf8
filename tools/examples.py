"""Types of the examples: mypy on the Python blocks of the documentation, its notebooks, and what `boebot new` writes.

python -m tools.examples

Each becomes a file in build/examples. Unlike the sources they need not heed None: a reader knows what a run has.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

from boebot.cli.new import template

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "build" / "examples"
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OPTIONS = ("--config-file=", "--disallow-untyped-defs", "--no-strict-optional", "--ignore-missing-imports",
           "--no-error-summary", "--cache-dir", str(ROOT / "build" / "mypy_examples_cache"))  # fmt: skip


def examples() -> dict[str, str]:
    """Each by the name of its file."""
    pages = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "protocol").glob("*.md")])
    found = {
        re.sub(r"\W", "_", f"{page.stem}_{number}") + ".py": code
        for page in pages
        for number, code in enumerate(BLOCK.findall(page.read_text(encoding="utf-8")), 1)
    }
    for notebook in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
        code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
        found[f"notebook_{notebook.stem.replace('-', '_')}.py"] = "\n".join(code)
    return found | {f"new_{kind}.py": template(kind, kind) for kind in ("step", "main", "brain")}


def main() -> int:
    """The exit code of mypy."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in FOLDER.glob("*.py"):
        old.unlink()
    for name, code in examples().items():
        (FOLDER / name).write_text(code, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", *OPTIONS, *sorted(path.name for path in FOLDER.glob("*.py"))]
    return subprocess.run(command, cwd=FOLDER, check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main())
