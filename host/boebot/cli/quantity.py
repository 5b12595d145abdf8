"""Quantities (boebot.quantity) as options of the command line."""

from __future__ import annotations

import math
from collections.abc import Callable

import typer

from boebot.errors import BoebotError
from boebot.quantity import parse as parse


def parser(unit: str, least: float = -math.inf) -> Callable[[str | float], float]:
    """What typer reads an option with that is a quantity, in `unit`, and at least `least`."""

    def read(given: str | float) -> float:
        """Of the command line's text; a default is a number already."""
        try:
            number = parse(given, unit) if isinstance(given, str) else float(given)
        except BoebotError as error:
            raise typer.BadParameter(str(error)) from None
        if number < least:
            raise typer.BadParameter(f"{number:g} {unit} is too small; expected at least {least:g} {unit}")
        return number

    return read
