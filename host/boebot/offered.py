"""What a package offers: all that it imports from its own files. `import Avoid as Avoid` says so to type checkers."""

from __future__ import annotations

import sys


def offered(package: str) -> list[str]:
    """Its `__all__`."""
    names = vars(sys.modules[package]).items()
    return sorted(name for name, one in names if getattr(one, "__module__", "").startswith(f"{package}."))
