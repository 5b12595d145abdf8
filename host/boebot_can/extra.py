"""The packages of the extra `boebot[can]`, imported where they are used: `import can` takes half a second."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from boebot.errors import BoardError

_PACKAGES = {"can": "python-can", "isotp": "can-isotp"}


def import_extra(module: str) -> Any:
    """The module.

    Raises:
        BoardError: the package is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        if error.name is not None and error.name.partition(".")[0] == module:
            raise BoardError(
                f"CAN needs the package {_PACKAGES[module]}, which is not installed; "
                "expected: pip install 'boebot[can]'"
            ) from None
        raise BoardError(f"CAN needs the package {_PACKAGES[module]}, which cannot be loaded: {error}") from None
