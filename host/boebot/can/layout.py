"""Which bytes of a message stand in which CAN frame, from protocol/messages.toml by protocol/can_layout.py.

Made by protocol/generate.py; do not edit.
"""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from typing import NamedTuple

ROUND = 0
SESSION = 1
SEQUENCE = 2
TIME_TO_LIVE = 3
PART = 4
NODE_SHIFT = 5
TIME_TO_LIVE_MS = 10  # one count of a set-point's time to live
ISO_TP_TO_BOARD = 0x51E
ISO_TP_TO_HOST = 0x51F


class Layout(NamedTuple):
    """The CAN frames of one message."""

    length: int  # bytes of the payload
    identifiers: tuple[int, ...]  # at node 0, one for each frame
    choices: tuple[bytes, ...]  # each frame's bytes, see below
    payload: bytes  # its bytes by their places in the frames' data, one after another, and NULs behind
    session: int  # where its byte stands there; -1: nowhere
    is_set_point: bool


LAYOUTS: dict[int, Layout] = {
    0x01: Layout(9, (0x600, ), (bytes([0, 1, 2, 3, 5, 6, 7]), ), bytes([0, 1, 2, 3, 7, 4, 5, 6, 7]), -1, False),  # open
    0x03: Layout(5, (0x602, ), (bytes([0, 1, 2, 3]), ), bytes([0, 1, 2, 3, 4]), -1, False),  # describe
    0x80: Layout(44, (0x601, 0x603, 0x605, 0x607, 0x609, 0x60B, 0x60D, 0x60F, ), (bytes([44, 49, 0, 1, 2, 3, 4]), bytes([44, 50, 5, 6, 7, 9, 10, 11]), bytes([44, 51, 13, 14, 15, 16, 17]), bytes([44, 52, 18, 19, 20, 21, 22, 23]), bytes([44, 53, 24, 25, 26, 27]), bytes([44, 54, 28, 29, 30, 31, 32, 33]), bytes([44, 55, 34, 35, 36, 37, 38, 39]), bytes([44, 56, 40, 41, 42, 43]), ), bytes([2, 3, 4, 5, 6, 9, 10, 11, 58, 12, 13, 14, 58, 17, 18, 19, 20, 21, 24, 25, 26, 27, 28, 29, 32, 33, 34, 35, 38, 39, 40, 41, 42, 43, 46, 47, 48, 49, 50, 51, 54, 55, 56, 57]), -1, False),  # hello
    0x82: Layout(8, (0x611, ), (bytes([0, 1, 2, 3, 4, 5, 6, 7]), ), bytes([0, 1, 2, 3, 4, 5, 6, 7]), -1, False),  # description
    0x08: Layout(1, (0x002, ), (bytes([0]), ), bytes([0]), -1, False),  # stop
    0x09: Layout(4, (0x604, ), (bytes([0, 1, 2]), ), bytes([0, 1, 2, 3]), -1, False),  # close
    0x10: Layout(8, (0x100, ), (bytes([0, 1, 2, 3, 11, 6, 9, 10]), ), bytes([0, 1, 2, 3, 4, 8, 5, 8]), 6, True),  # setpoint_signal
    0x11: Layout(8, (0x102, ), (bytes([0, 1, 2, 3, 11, 6, 9, 10]), ), bytes([0, 1, 2, 3, 4, 8, 5, 8]), 6, True),  # setpoint_speed
    0x12: Layout(4, (0x104, ), (bytes([7, 2, 5, 6]), ), bytes([0, 4, 1, 4]), 2, True),  # setpoint_coast
    0x18: Layout(3, (0x106, ), (bytes([0, 1, 2, 4]), ), bytes([0, 1, 2]), 3, False),  # turret
    0x19: Layout(4, (0x108, ), (bytes([0, 1, 2, 3, 5]), ), bytes([0, 1, 2, 3]), 4, False),  # buzzer
    0x25: Layout(3, (0x500, ), (bytes([0, 1, 2, 4]), ), bytes([0, 1, 2]), 3, False),  # get_parameter
    0x21: Layout(7, (0x502, ), (bytes([0, 1, 2, 3, 4, 5, 6, 8]), ), bytes([0, 1, 2, 3, 4, 5, 6]), 7, False),  # set_parameter
    0x22: Layout(2, (0x504, ), (bytes([0, 1, 3]), ), bytes([0, 1]), 2, False),  # save_parameters
    0x23: Layout(2, (0x506, ), (bytes([0, 1, 3]), ), bytes([0, 1]), 2, False),  # reset_parameters
    0x24: Layout(3, (0x202, ), (bytes([0, 1, 2, 4]), ), bytes([0, 1, 2]), 3, False),  # arm
    0x28: Layout(2, (0x200, ), (bytes([0, 1, 3]), ), bytes([0, 1]), 2, False),  # acknowledge
    0x30: Layout(2, (0x204, ), (bytes([0, 1, 3]), ), bytes([0, 1]), 2, False),  # clock_probe
    0x88: Layout(1, (0x003, ), (bytes([0]), ), bytes([0]), -1, False),  # stopped
    0x90: Layout(39, (0x301, 0x303, 0x305, 0x307, 0x309, 0x30B, 0x30D, ), (bytes([0, 1, 2, 3, 4, 5, 6, 7]), bytes([0, 45, 8, 9, 10, 11]), bytes([0, 46, 12, 13, 14, 15, 16, 17]), bytes([0, 47, 18, 19, 20, 21, 22]), bytes([0, 48, 23, 24, 25, 26, 27, 28]), bytes([0, 49, 29, 30, 31, 32, 33, 34]), bytes([0, 50, 35, 36, 37, 38, 40]), ), bytes([0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 16, 17, 18, 19, 20, 21, 24, 25, 26, 27, 28, 31, 32, 33, 34, 35, 36, 39, 40, 41, 42, 43, 44, 47, 48, 49, 50]), 51, False),  # telemetry
    0x91: Layout(22, (0x40F, 0x411, 0x413, 0x415, ), (bytes([22, 27, 0, 1, 2, 3, 4, 5]), bytes([22, 28, 6, 7, 8, 9, 10, 11]), bytes([22, 29, 12, 13, 14, 15, 16, 17]), bytes([22, 30, 18, 19, 20, 21, 23]), ), bytes([2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 18, 19, 20, 21, 22, 23, 26, 27, 28, 29]), 30, False),  # counters
    0x92: Layout(31, (0x401, 0x403, 0x405, 0x407, 0x409, ), (bytes([0, 1, 2, 3, 4, 5, 6, 7]), bytes([0, 37, 8, 9, 10, 11, 12, 13]), bytes([0, 38, 14, 15, 16, 17, 18, 19]), bytes([0, 39, 20, 21, 22, 23, 24, 25]), bytes([0, 40, 26, 27, 28, 29, 30, 32]), ), bytes([0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 18, 19, 20, 21, 22, 23, 26, 27, 28, 29, 30, 31, 34, 35, 36, 37, 38]), 39, False),  # devices_telemetry
    0x94: Layout(11, (0x40B, 0x40D, ), (bytes([0, 1, 2, 3, 4, 5, 6, 7]), bytes([0, 17, 8, 9, 10, 12]), ), bytes([0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12]), 13, False),  # line_telemetry
    0x93: Layout(3, (0x417, ), (bytes([0, 1, 2, 4]), ), bytes([0, 1, 2]), 3, False),  # task_time
    0xA0: Layout(7, (0x205, ), (bytes([0, 1, 2, 3, 4, 5, 6, 8]), ), bytes([0, 1, 2, 3, 4, 5, 6]), 7, False),  # answer
    0xA1: Layout(9, (0x201, 0x203, ), (bytes([9, 14, 0, 1, 2, 3, 4]), bytes([9, 15, 5, 6, 7, 8, 10]), ), bytes([2, 3, 4, 5, 6, 9, 10, 11, 12]), 13, False),  # event
    0xB0: Layout(6, (0x207, ), (bytes([0, 1, 2, 3, 4, 5, 7]), ), bytes([0, 1, 2, 3, 4, 5]), 6, False),  # clock_answer
}
