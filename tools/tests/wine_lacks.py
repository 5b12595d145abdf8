"""sitecustomize.py of the Python under Wine: Wine 8 ends a reading of a serial port that gets no byte in time by an
error, Windows by success with no byte."""

from typing import Any

import serial.win32

_ERROR_TIMEOUT = 1460
win32: Any = serial.win32
_of_wine = win32.GetOverlappedResult


def _of_windows(*arguments: object) -> bool:
    return bool(_of_wine(*arguments)) or win32.GetLastError() == _ERROR_TIMEOUT


win32.GetOverlappedResult = _of_windows
