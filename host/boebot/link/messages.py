"""Every message of the protocol, from protocol/messages.toml: wire integers in, wire integers out.

Made by protocol/generate.py; do not edit.
"""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from typing import ClassVar, NamedTuple, Self

PROTOCOL_VERSION = 1
SCHEMA_HASH = 0xAE513ACD


class Whiskers(IntFlag):
    """Whiskers, debounced: a set bit is a pressed whisker."""

    LEFT = 1 << 0
    RIGHT = 1 << 1


class Infrared(IntFlag):
    """IR pairs at the last burst: a set bit is an object seen."""

    LEFT = 1 << 0
    RIGHT = 1 << 1


class Status(IntFlag):
    """State and faults of the board."""

    MOTORS_ENABLED = 1 << 0
    DEAD_MAN = 1 << 1
    STOPPED = 1 << 2
    ENCODER_LEFT_MASKED = 1 << 3
    ENCODER_RIGHT_MASKED = 1 << 4
    TICK_OVERRUN = 1 << 5
    RECEIVE_OVERRUN = 1 << 6
    WATCHDOG_RESET = 1 << 7


class Devices(IntFlag):
    """Devices switched on."""

    SERVOS = 1 << 0
    ENCODERS = 1 << 1
    WHISKERS = 1 << 2
    INFRARED = 1 << 3
    PING = 1 << 4
    BATTERY = 1 << 5
    LIGHT = 1 << 6
    ANALOG_INFRARED = 1 << 7
    COMPASS = 1 << 8
    TURRET = 1 << 9
    BUZZER = 1 << 10


# The robot's device behind each bit.
DEVICE_OF_BIT: dict[Devices, str] = {
    Devices.SERVOS: "servo_left",
    Devices.ENCODERS: "encoder_left",
    Devices.WHISKERS: "whisker_left",
    Devices.INFRARED: "infrared_left",
    Devices.PING: "ping",
    Devices.BATTERY: "battery",
    Devices.LIGHT: "light_left",
    Devices.ANALOG_INFRARED: "analog_infrared",
    Devices.COMPASS: "compass",
    Devices.TURRET: "turret",
    Devices.BUZZER: "buzzer",
}


class ResetCause(IntEnum):
    """Why the microcontroller started."""

    UNKNOWN = 0
    POWER = 1
    EXTERNAL = 2
    BROWN_OUT = 3
    WATCHDOG = 4


class ParameterStatus(IntEnum):
    """How a parameter request ended."""

    OK = 0
    UNKNOWN_PARAMETER = 1
    OUT_OF_RANGE = 2


class _HelloRequestFields(NamedTuple):
    protocol_version: int  # version that the host speaks


class HelloRequest(_HelloRequestFields):
    """Asks the board to say hello."""

    __slots__ = ()
    ID: ClassVar[int] = 0x01
    LENGTH: ClassVar[int] = 1
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<B")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _IdentifyFields(NamedTuple):
    pass


class Identify(_IdentifyFields):
    """Asks for the identity message."""

    __slots__ = ()
    ID: ClassVar[int] = 0x02
    LENGTH: ClassVar[int] = 0
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SetpointSignalFields(NamedTuple):
    left: int  # 0.0001 1
    right: int  # 0.0001 1
    time_to_live: int  # ms; motors stop when no newer set-point came within this time
    answers_tick: int  # low 16 bits of the tick whose observation this answers


class SetpointSignal(_SetpointSignalFields):
    """Motor signals: -1 full backward, 0 stop, +1 full forward."""

    __slots__ = ()
    ID: ClassVar[int] = 0x10
    LENGTH: ClassVar[int] = 8
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<hhHH")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SetpointSpeedFields(NamedTuple):
    left: int  # 0.0001 m/s
    right: int  # 0.0001 m/s
    time_to_live: int  # ms
    answers_tick: int  # low 16 bits of the tick whose observation this answers


class SetpointSpeed(_SetpointSpeedFields):
    """Wheel speeds along the ground, forward positive; the board turns them into pulses by its stored curve."""

    __slots__ = ()
    ID: ClassVar[int] = 0x11
    LENGTH: ClassVar[int] = 8
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<hhHH")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _StopFields(NamedTuple):
    pass


class Stop(_StopFields):
    """Stops the motors at once, until the next set-point."""

    __slots__ = ()
    ID: ClassVar[int] = 0x12
    LENGTH: ClassVar[int] = 0
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _GetParameterFields(NamedTuple):
    parameter: int  # number of the parameter


class GetParameter(_GetParameterFields):
    """Asks for one parameter."""

    __slots__ = ()
    ID: ClassVar[int] = 0x20
    LENGTH: ClassVar[int] = 1
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<B")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SetParameterFields(NamedTuple):
    parameter: int  # number of the parameter
    value: int  # in counts of the parameter's scale


class SetParameter(_SetParameterFields):
    """Sets one parameter until the next reset."""

    __slots__ = ()
    ID: ClassVar[int] = 0x21
    LENGTH: ClassVar[int] = 5
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<Bi")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _HelloFields(NamedTuple):
    protocol_version: int
    schema_hash: int  # CRC-32 of the normalised messages.toml
    tick_rate: int  # Hz
    devices: int  # devices
    reset_cause: int  # reset_cause
    pin_map: bytes  # name of the pin map that the image was built for


class Hello(_HelloFields):
    """Sent after every reset and on request: who speaks, and which contract."""

    __slots__ = ()
    ID: ClassVar[int] = 0x80
    LENGTH: ClassVar[int] = 28
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BIHIB16s")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _IdentityFields(NamedTuple):
    firmware_version: bytes
    compiler: bytes
    image_size: int  # B; bytes of flash that the image fills; 0 where there is no flash
    image_hash: int  # CRC-32 of those bytes as read back from flash; 0 where there is no flash


class Identity(_IdentityFields):
    """Which image runs."""

    __slots__ = ()
    ID: ClassVar[int] = 0x81
    LENGTH: ClassVar[int] = 44
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<12s24sII")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _ParameterFields(NamedTuple):
    parameter: int  # number of the parameter
    value: int  # in counts of the parameter's scale
    status: int  # parameter_status


class Parameter(_ParameterFields):
    """Answer to get_parameter and set_parameter: the value now in force."""

    __slots__ = ()
    ID: ClassVar[int] = 0x82
    LENGTH: ClassVar[int] = 6
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BiB")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _TelemetryFields(NamedTuple):
    tick: int  # control ticks since reset
    time: int  # us; board time at the start of this tick since reset; rolls over after 71.6 min
    encoder_left: int  # edges; edges since reset; signed only where the encoder knows direction
    encoder_right: int  # edges
    edge_period_left: int  # 16 us; time between the last two edges; 0: none within 0.5 s
    edge_period_right: int  # 16 us
    whiskers: int  # whiskers
    infrared: int  # infrared
    infrared_age: int  # ticks; age of the older IR reading; 255: never or older
    ping_echo: int  # us; length of the last echo pulse; 0: no echo
    ping_age: int  # ticks; ticks since that echo ended or was given up; 255: never or older
    pulse_left: int  # 0.0625 us; servo pulse in force; 0: no pulses
    pulse_right: int  # 0.0625 us
    status: int  # status
    setpoint_sequence: int  # sequence number of the last set-point that was accepted
    frames_bad: int  # frames refused since reset, modulo 256
    overruns: int  # control ticks overrun since reset, modulo 256


class Telemetry(_TelemetryFields):
    """Everything the board knows, once per control tick."""

    __slots__ = ()
    ID: ClassVar[int] = 0x90
    LENGTH: ClassVar[int] = 35
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<IIiiHHBBBHBHHHBBB")

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


Message = (
    HelloRequest
    | Identify
    | SetpointSignal
    | SetpointSpeed
    | Stop
    | GetParameter
    | SetParameter
    | Hello
    | Identity
    | Parameter
    | Telemetry
)

MESSAGES: dict[int, type[Message]] = {
    0x01: HelloRequest,
    0x02: Identify,
    0x10: SetpointSignal,
    0x11: SetpointSpeed,
    0x12: Stop,
    0x20: GetParameter,
    0x21: SetParameter,
    0x80: Hello,
    0x81: Identity,
    0x82: Parameter,
    0x90: Telemetry,
}

# id -> payload bytes
LENGTHS: dict[int, int] = {
    0x01: 1,
    0x02: 0,
    0x10: 8,
    0x11: 8,
    0x12: 0,
    0x20: 1,
    0x21: 5,
    0x80: 28,
    0x81: 44,
    0x82: 6,
    0x90: 35,
}


class ParameterSpec(NamedTuple):
    """A run-time parameter of the firmware."""

    id: int
    unit: str
    scale: float  # unit per count
    minimum: int  # counts
    maximum: int  # counts
    doc: str
    default_from: str = ""  # key of the robot description that gives the default


PARAMETERS: dict[str, ParameterSpec] = {
    "devices": ParameterSpec(0, "flags", 1.0, 0, 2047, "devices switched on, bits as in the devices flags"),
    "time_to_live_default": ParameterSpec(1, "ms", 1.0, 20, 2000, "time to live of a set-point that names none; also the longest silence at start"),
    "servo_left_centre": ParameterSpec(2, "us", 0.0625, 22400, 25600, "pulse at which the left servo stands still", "servo_left.centre_us"),
    "servo_right_centre": ParameterSpec(3, "us", 0.0625, 22400, 25600, "pulse at which the right servo stands still", "servo_right.centre_us"),
    "servo_left_gain": ParameterSpec(4, "us", 0.0625, -3200, 3200, "pulse offset at full forward signal, left; negative for a mirrored servo", "servo_left.gain_us"),
    "servo_right_gain": ParameterSpec(5, "us", 0.0625, -3200, 3200, "pulse offset at full forward signal, right; negative for a mirrored servo", "servo_right.gain_us"),
    "wheel_speed_maximum": ParameterSpec(6, "m/s", 0.0001, 100, 5000, "ground speed at full signal, for set-points in m/s", "body.wheel_speed_maximum_m_s"),
    "infrared_period": ParameterSpec(7, "ticks", 1.0, 2, 250, "ticks between two IR readings", "infrared.period_ticks"),
    "ping_period": ParameterSpec(8, "ticks", 1.0, 4, 250, "ticks between two Ping triggers", "ping.period_ticks"),
    "encoder_limit": ParameterSpec(9, "edges per tick", 1.0, 4, 200, "edges of one encoder line in one tick above which the line is masked until the tick ends"),
}
