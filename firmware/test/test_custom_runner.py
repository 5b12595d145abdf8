"""How `pio test` runs our unit tests: they are written with doctest. Its header is the system's (Debian's
doctest-dev) where there is one; elsewhere PlatformIO fetches it."""

from __future__ import annotations

from pathlib import Path

from platformio.test.runners.doctest import DoctestTestRunner

SYSTEM_HEADERS = [Path("/usr/include/doctest/doctest.h"), Path("/usr/local/include/doctest/doctest.h")]


class CustomTestRunner(DoctestTestRunner):  # type: ignore[misc]
    """Doctest without a download."""

    if any(header.exists() for header in SYSTEM_HEADERS):
        EXTRA_LIB_DEPS = None
