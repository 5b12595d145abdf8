"""Settings for all tests: how many random cases; the same ones each time unless `make fuzz` asks for new."""

from __future__ import annotations

import os

from hypothesis import settings

EXAMPLES = os.environ.get("BOEBOT_EXAMPLES")
SANITIZED = "BOEBOT_SANITIZED" in os.environ

# Sanitizers make each example some five times as slow; what they look for shows in a few.
settings.register_profile("same every time", max_examples=15 if SANITIZED else 100, deadline=None, derandomize=True)
settings.register_profile("fuzz", max_examples=int(EXAMPLES or 100), deadline=None, print_blob=True)
settings.load_profile("fuzz" if EXAMPLES else "same every time")
