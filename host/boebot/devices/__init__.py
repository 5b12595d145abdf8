"""One file per kind of device, under the name of the device: its keys in robot files, its pins, how wire values become
a reading in SI units with age and validity, its columns in the record, what it looks like.

What a board's devices say comes with telemetry in every tick, or in other messages, less often: then ages count
on from message to message (`latest`). A robot without a board has readings at each step (`readings`).
"""
