"""The one error of this package."""

from __future__ import annotations


class AnalysisError(Exception):
    """An image cannot be read or followed, or something in it has no bound. The text is one sentence."""
