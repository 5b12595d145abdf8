"""Which file knows which: imports of Python modules, includes and calls of C files, read from the sources of a tree."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.MULTILINE)
C_FUNCTION = re.compile(r"^(?!static\b|typedef\b)\w[\w *]*?\b(\w+)\([^;{}]*\)\s*\{", re.MULTILINE)
C_ROOMS = ("firmware/src", "sim_bridge", "host")
Graph = dict[str, set[str]]


def imported(source: Path) -> Iterator[str]:
    """Full names of the modules that a Python file imports."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def included(root: Path, folder: str) -> Iterator[tuple[Path, str]]:
    """Each C file below a folder with each header that it includes; those of the tree as path from its root."""
    bases = [root / name for name in ("sim_bridge", "host/boebot/arenas", "firmware/src", "firmware/include")]
    for source in sorted(path for kind in ("[ch]", "def") for path in (root / folder).rglob(f"[!_]*.{kind}")):
        for name in INCLUDE.findall(source.read_text(encoding="utf-8")):
            found = next((base / name for base in (source.parent, *bases) if (base / name).is_file()), None)
            yield source, str(found.resolve().relative_to(root)) if found else name


def c_modules(root: Path, folder: str) -> Graph:
    """A module is a .c file with the header of its name; tests and fuzzers are left out."""
    knows: Graph = {}
    for source, name in included(root, folder):
        relative = source.relative_to(root)
        if not {"tests", "test", "fuzz"} & set(relative.parts):
            knows.setdefault(str(relative.with_suffix("")), set()).add(str(Path(name).with_suffix("")))
    return {module: others - {module} for module, others in knows.items()}


def c_calls(folder: Path) -> Graph:
    """Of each .c file right in a folder those whose functions it calls."""
    texts = {source.name: c_code(source) for source in sorted(folder.glob("[!_]*.c"))}
    defined = {name: set(C_FUNCTION.findall(text)) for name, text in texts.items()}
    called = {name: set(re.findall(r"\b(\w+)\(", text)) - defined[name] for name, text in texts.items()}
    return {name: {other for other in texts if calls & defined[other]} for name, calls in called.items()}


def c_code(source: Path) -> str:
    """The text of a C file without its comments."""
    return re.sub(r"/\*.*?\*/", " ", source.read_text(encoding="utf-8"), flags=re.DOTALL)


def guests(root: Path) -> list[str]:
    """The packages beside the library."""
    return sorted(path.parent.name for path in (root / "host").glob("*/__init__.py") if path.parent.name != "boebot")


def python_modules(root: Path) -> dict[str, Path]:
    """Modules but tests and what only builds: full name -> file."""
    packages = [path.parent for path in (root / "host").glob("*/__init__.py")]
    found = {}
    for folder in (*packages, *(root / name for name in ("sim_bridge", "tools", "hil_tests/boebot_hil"))):
        for source in folder.rglob("*.py"):
            if "tests" not in source.relative_to(root).parts and not source.name.startswith("build_"):
                parts = source.relative_to(folder.parent).with_suffix("").parts
                found[".".join(parts).removesuffix(".__init__")] = source
    return found


def python_imports(modules: dict[str, Path]) -> Graph:
    """Modules that each one imports, also within functions and for type checkers."""
    return {name: _needed(source, modules) - {name} for name, source in modules.items()}


def _needed(source: Path, known: dict[str, Path]) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                found.add(name if name in known else node.module)
    return found & known.keys()


def closure(start: str, knows: Graph) -> set[str]:
    """All that a file knows, directly or by what it knows."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        new = knows.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def circles(knows: Graph) -> list[str]:
    """Those that lead back to themselves, directly or by others."""
    return sorted(name for name in knows if name in closure(name, knows))
