"""A variable of the program that runs on an emulated board: its value in RAM, read and set by its name in the source.

What RAM holds may be older than what the program works with, which it keeps in registers for a while; and a variable of
several bytes that is set between two of the program's accesses to it is half old and half new there. `volatile` ones
are read and written where the source says so.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.errors import CallError
from boebot.image.data import Variable
from sim_bridge.boards.board import BoardMemory


class Symbol:
    """A variable of a board's memory."""

    __slots__ = ("_before", "_memory", "variable")

    def __init__(
        self, memory: BoardMemory, variable: Variable, before: Callable[[str], object] = lambda name: None
    ) -> None:
        """`before`: called with its name before it is set. Raises CallError where the image does not say its size."""
        if variable.dtype.itemsize == 0:
            raise CallError(
                f"{variable.name} is of a type whose size the image does not say; expected another variable"
            )
        self.variable, self._memory, self._before = variable, memory, before

    @property
    def value(self) -> Any:
        """A number, an array of numpy, or bytes of what is neither."""
        return self[()]

    @value.setter
    def value(self, value: Any) -> None:
        """Raises CallError where it does not fit."""
        self[()] = value

    def __getitem__(self, index: Any) -> Any:
        """An element of an array, or a part of it, that cannot be written to. Raises CallError: there is none."""
        return _plain(self._element(self._cells(), index))

    def __setitem__(self, index: Any, value: Any) -> None:
        """Raises CallError where there is none, or it does not fit."""
        cells = self._cells().copy()
        before = self._element(cells, index)
        kind, shape = before.dtype, np.shape(before)
        is_text = isinstance(value, bytes) and kind.itemsize == len(shape) == 1
        cell_values = np.frombuffer(value.ljust(shape[0], b"\0"), kind) if is_text else value  # as C has it
        look: Any = {"f": np.isfinite, "V": np.shape}.get(kind.kind, np.asarray)
        try:
            with np.errstate(over="ignore"):
                cells[index] = cell_values
            fits = np.shape(cell_values) == shape and np.array_equal(look(cells[index]), look(cell_values))
        except (OverflowError, ValueError, TypeError):
            fits = False
        if not fits:
            numbers = kind.kind in "iu" and f"{np.iinfo(kind).min} to {np.iinfo(kind).max}"
            expected = (f"an array {shape} of " if shape else "") + (numbers or f"a value of type {kind}")
            raise CallError(f"{self.variable.name}: {value!r} does not fit; expected {expected}")
        self._before(self.variable.name)
        self._memory.write_memory(self.variable.address, cells.tobytes())

    def _cells(self) -> NDArray[Any]:
        """The variable as its bytes are now, not to be written to: that would not reach the program."""
        kind = self.variable.dtype
        data = self._memory.read_memory(self.variable.address, kind.itemsize)
        return np.frombuffer(data, kind.base).reshape(kind.shape)

    def _element(self, cells: NDArray[Any], index: Any) -> Any:
        try:
            return cells[index]
        except IndexError as error:
            raise CallError(f"{self.variable.name}[{index!r}]: {str(error).rstrip('.')}; expected an element") from None


def _plain(value: Any) -> Any:
    """As Python has it, where numpy has one number."""
    return value.tobytes() if isinstance(value, np.void) else value.item() if isinstance(value, np.generic) else value
