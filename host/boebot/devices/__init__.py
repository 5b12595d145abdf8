"""One file per device: wire value to SI value, with age and validity.

Each file has the small immutable view that a brain sees and the reader that makes it from a telemetry
message, or from that of the slow devices. A reader is made once per robot from the robot's description; it
holds the constants.

Messages of the slow devices come less often than telemetry: their readers are told how many ticks have passed since, so
that ages count on.
"""
