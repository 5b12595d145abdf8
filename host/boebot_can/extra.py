"""The packages of the extra `boebot[can]`, imported where they are used: `import can` takes half a second."""

from __future__ import annotations

from typing import Any

from boebot.errors import BoardError
from boebot.missing import imported

_PACKAGES = {"can": "python-can", "isotp": "can-isotp"}


def import_extra(module: str) -> Any:
    """The module.

    Raises:
        BoardError: the package is not installed.
    """
    return imported(module, "CAN", _PACKAGES[module], "can", BoardError)
