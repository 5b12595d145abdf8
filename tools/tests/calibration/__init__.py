"""Calibration of the emulated board: one program of many small measurements whose results the data sheet gives.

The program times itself by Timer 1 and sends what it found over its UART, so that the same image runs in the emulator
and on a robot's board. `python -m tools.tests.calibration` prints the table.
"""
