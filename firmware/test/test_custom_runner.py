"""How `pio test` reads the output of our unit tests: they are written with doctest, and its header is the system's
(Debian package doctest-dev) where there is one; elsewhere PlatformIO fetches it."""

from __future__ import annotations

from pathlib import Path

from platformio.test.runners.doctest import DoctestTestRunner

SYSTEM_HEADERS = [Path("/usr/include/doctest/doctest.h"), Path("/usr/local/include/doctest/doctest.h")]


class CustomTestRunner(DoctestTestRunner):  # type: ignore[misc]
    """Doctest without a download."""

    EXTRA_LIB_DEPS = None if any(header.exists() for header in SYSTEM_HEADERS) else DoctestTestRunner.EXTRA_LIB_DEPS
