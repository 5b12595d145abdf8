"""Every message of the protocol, from protocol/messages.toml: wire integers in, wire integers out.

Made by protocol/generate.py; do not edit.
"""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from typing import ClassVar, NamedTuple, Self

PROTOCOL_VERSION = 0x30  # 3.0
SCHEMA_HASH = 0x0A648E33


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
    LATCHED = 1 << 2
    ENCODER_LEFT_MASKED = 1 << 3
    ENCODER_RIGHT_MASKED = 1 << 4
    TICK_OVERRUN = 1 << 5
    RECEIVE_OVERRUN = 1 << 6
    WATCHDOG_RESET = 1 << 7
    SUPPLY_LOW = 1 << 8
    SAVING = 1 << 9
    FALLBACK = 1 << 10


class Devices(IntFlag):
    """Devices switched on."""

    SERVO = 1 << 0
    ENCODER = 1 << 1
    WHISKER = 1 << 2
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
    Devices.SERVO: "servo_left",
    Devices.ENCODER: "encoder_left",
    Devices.WHISKER: "whisker_left",
    Devices.INFRARED: "infrared_left",
    Devices.PING: "ping",
    Devices.BATTERY: "battery",
    Devices.LIGHT: "light_left",
    Devices.ANALOG_INFRARED: "analog_infrared",
    Devices.COMPASS: "compass",
    Devices.TURRET: "turret",
    Devices.BUZZER: "buzzer",
}


class _Values(IntEnum):
    """Values by name; one that a later minor version has added is called by its number."""

    @classmethod
    def _missing_(cls, value: object) -> _Values | None:
        if not isinstance(value, int):
            return None
        unknown = int.__new__(cls, value)
        unknown._name_, unknown._value_ = f"UNKNOWN_{value}", value
        return unknown


class ResetCause(_Values):
    """Why the microcontroller started."""

    UNKNOWN = 0
    POWER = 1
    EXTERNAL = 2
    BROWN_OUT = 3
    WATCHDOG = 4
    WATCHDOG_IN_WHISKER = 5
    WATCHDOG_IN_SAFETY = 6
    WATCHDOG_IN_ANALOG = 7
    WATCHDOG_IN_LIGHT = 8
    WATCHDOG_IN_EVENTS = 9
    WATCHDOG_IN_ENCODER = 10
    WATCHDOG_IN_INFRARED = 11
    WATCHDOG_IN_PING_ECHO = 12
    WATCHDOG_IN_PING = 13
    WATCHDOG_IN_TELEMETRY = 14
    WATCHDOG_IN_REQUESTS = 15
    WATCHDOG_IN_SESSION = 16
    WATCHDOG_IN_SUPPLY = 17
    WATCHDOG_IN_COUNTERS = 18
    WATCHDOG_IN_STORAGE = 19
    WATCHDOG_IN_TURRET = 20
    WATCHDOG_IN_BUZZER = 21
    WATCHDOG_IN_COMPASS = 22
    WATCHDOG_IN_DEVICES = 23
    WATCHDOG_IN_FALLBACK = 24


class Task(_Values):
    """The tasks of the firmware, from firmware/src/tasks.def."""

    WHISKER = 0
    SAFETY = 1
    ANALOG = 2
    LIGHT = 3
    EVENTS = 4
    ENCODER = 5
    INFRARED = 6
    PING_ECHO = 7
    PING = 8
    TELEMETRY = 9
    REQUESTS = 10
    SESSION = 11
    SUPPLY = 12
    COUNTERS = 13
    STORAGE = 14
    TURRET = 15
    BUZZER = 16
    COMPASS = 17
    DEVICES = 18
    FALLBACK = 19


class Latch(_Values):
    """Why the motors are latched off."""

    NONE = 0
    START = 1
    STOP_COMMAND = 2
    SESSION_ENDED = 3
    SUPPLY_LOW = 4


class AnswerStatus(_Values):
    """How a numbered request ended."""

    OK = 0
    UNKNOWN_PARAMETER = 1
    OUT_OF_RANGE = 2
    SUPPLY_LOW = 3
    STORAGE_FAILED = 4
    LATCHED_AGAIN = 5
    BUSY = 6


class PingStatus(_Values):
    """What the Ping's last measurement was."""

    OFF = 0
    OK = 1
    NOTHING_NEAR = 2
    ABSENT = 3
    TOO_NEAR = 4


class CompassStatus(_Values):
    """How the last exchange with the compass ended."""

    OFF = 0
    OK = 1
    NO_ANSWER = 2
    BUS_STUCK = 3
    FAILED = 4


class EventKind(_Values):
    """What happened, and what `value` is."""

    WHISKERS = 0
    LATCH = 1
    DEAD_MAN = 2
    FALLBACK = 3


class _OpenFields(NamedTuple):
    protocol_version: int  # of the host: 16 x version + minor
    board_nonce: int  # as in the hello that this answers; another one is refused
    host_nonce: int  # drawn by the host for each session


class Open(_OpenFields):
    """Opens a session with the seed (board_nonce XOR host_nonce), or confirms the one that has it."""

    __slots__ = ()
    ID: ClassVar[int] = 0x01
    NAME: ClassVar[str] = "open"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 9
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BII")
    OFFSETS: ClassVar[dict[str, int]] = {"protocol_version": 0, "board_nonce": 1, "host_nonce": 5}

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
    """Asks for the identity."""

    __slots__ = ()
    ID: ClassVar[int] = 0x02
    NAME: ClassVar[str] = "identify"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 0
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<")
    OFFSETS: ClassVar[dict[str, int]] = {}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _DescribeFields(NamedTuple):
    index: int  # type: ignore[assignment]  # 0, 1, ... in order of ids
    board_nonce: int  # as in the last hello; another one is refused


class Describe(_DescribeFields):
    """Asks how the board understands one message, to name what differs when the schema hashes do."""

    __slots__ = ()
    ID: ClassVar[int] = 0x03
    NAME: ClassVar[str] = "describe"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 5
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BI")
    OFFSETS: ClassVar[dict[str, int]] = {"index": 0, "board_nonce": 1}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _HelloFields(NamedTuple):
    protocol_version: int  # of the board: 16 x version + minor
    schema_hash: int  # CRC-32 of what all of this version have in common
    board_nonce: int  # what the next open must name: another one after every start, opening and end of a session
    session: int  # seed of the session that is open; 0: none
    tick_rate: int  # Hz
    session_time_out: int  # ms; silence of the host after which a session ends
    telemetry_period: int  # ticks; ticks between two telemetry messages, as the baud rate allows
    boot_counter: int  # number of this start: 1 + the earlier ones that ran for 10 s
    reset_cause: int  # reset_cause
    parameters_saved: int  # 1: the parameters in force at start came from the EEPROM; 0: they are the image's defaults
    devices: int  # devices
    robot: bytes  # name of the robot that the image was built for


class Hello(_HelloFields):
    """Who speaks, which contract, which session. Sent on its own (see Session) and in answer to open."""

    __slots__ = ()
    ID: ClassVar[int] = 0x80
    NAME: ClassVar[str] = "hello"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 44
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BIIIHHBIBBI16s")
    OFFSETS: ClassVar[dict[str, int]] = {"protocol_version": 0, "schema_hash": 1, "board_nonce": 5, "session": 9, "tick_rate": 13, "session_time_out": 15, "telemetry_period": 17, "boot_counter": 18, "reset_cause": 22, "parameters_saved": 23, "devices": 24, "robot": 28}

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
    pin_map: bytes  # name of the pin map that the image was built for
    image_size: int  # B; bytes of flash that the image fills; 0 where there is no flash
    image_hash: int  # CRC-32 of those bytes as read back from flash; 0 where there is no flash


class Identity(_IdentityFields):
    """Which image runs."""

    __slots__ = ()
    ID: ClassVar[int] = 0x81
    NAME: ClassVar[str] = "identity"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 60
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<12s24s16sII")
    OFFSETS: ClassVar[dict[str, int]] = {"firmware_version": 0, "compiler": 12, "pin_map": 36, "image_size": 52, "image_hash": 56}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _DescriptionFields(NamedTuple):
    index: int  # type: ignore[assignment]
    count: int  # type: ignore[assignment]  # messages that the board knows
    id: int
    length: int  # B; of the payload
    hash: int  # of the message, as in the table


class Description(_DescriptionFields):
    """How the board understands one message. An index beyond the last gives id 0."""

    __slots__ = ()
    ID: ClassVar[int] = 0x82
    NAME: ClassVar[str] = "description"
    DELIVERY: ClassVar[str] = "handshake"
    LENGTH: ClassVar[int] = 8
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BBBBI")
    OFFSETS: ClassVar[dict[str, int]] = {"index": 0, "count": 1, "id": 2, "length": 3, "hash": 4}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _StopFields(NamedTuple):
    token: int  # comes back in stopped


class Stop(_StopFields):
    """Stops the motors at once and latches them off until armed again."""

    __slots__ = ()
    ID: ClassVar[int] = 0x08
    NAME: ClassVar[str] = "stop"
    DELIVERY: ClassVar[str] = "stop"
    LENGTH: ClassVar[int] = 1
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<B")
    OFFSETS: ClassVar[dict[str, int]] = {"token": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _CloseFields(NamedTuple):
    session: int  # the session's seed; another one is refused


class Close(_CloseFields):
    """The host leaves: the session ends at once. Not acknowledged."""

    __slots__ = ()
    ID: ClassVar[int] = 0x09
    NAME: ClassVar[str] = "close"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 4
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<I")
    OFFSETS: ClassVar[dict[str, int]] = {"session": 0}

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
    time_to_live: int  # ms; from the start of the answered tick; 0: the parameter time_to_live
    answers_tick: int  # low 16 bits of the tick whose observation this answers


class SetpointSignal(_SetpointSignalFields):
    """Motor signals: -1 full backward, 0 hold still, +1 full forward."""

    __slots__ = ()
    ID: ClassVar[int] = 0x10
    NAME: ClassVar[str] = "setpoint_signal"
    DELIVERY: ClassVar[str] = "set_point"
    LENGTH: ClassVar[int] = 8
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<hhHH")
    OFFSETS: ClassVar[dict[str, int]] = {"left": 0, "right": 2, "time_to_live": 4, "answers_tick": 6}

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
    time_to_live: int  # ms; from the start of the answered tick; 0: the parameter time_to_live
    answers_tick: int  # low 16 bits of the tick whose observation this answers


class SetpointSpeed(_SetpointSpeedFields):
    """Wheel speeds along the ground, forward positive; the board turns them into pulses by its stored curve."""

    __slots__ = ()
    ID: ClassVar[int] = 0x11
    NAME: ClassVar[str] = "setpoint_speed"
    DELIVERY: ClassVar[str] = "set_point"
    LENGTH: ClassVar[int] = 8
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<hhHH")
    OFFSETS: ClassVar[dict[str, int]] = {"left": 0, "right": 2, "time_to_live": 4, "answers_tick": 6}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SetpointCoastFields(NamedTuple):
    time_to_live: int  # ms; from the start of the answered tick; 0: the parameter time_to_live
    answers_tick: int  # low 16 bits of the tick whose observation this answers


class SetpointCoast(_SetpointCoastFields):
    """No pulses: the servos free-wheel. Nothing is latched."""

    __slots__ = ()
    ID: ClassVar[int] = 0x12
    NAME: ClassVar[str] = "setpoint_coast"
    DELIVERY: ClassVar[str] = "set_point"
    LENGTH: ClassVar[int] = 4
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HH")
    OFFSETS: ClassVar[dict[str, int]] = {"time_to_live": 0, "answers_tick": 2}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _TurretFields(NamedTuple):
    angle: int  # 0.0001 rad; counter-clockwise positive, 0 straight ahead
    hold: int  # 1: turn there and hold; 0: no pulses, the servo is free


class Turret(_TurretFields):
    """Angle of the turret, or no pulses. Refused while latched. Whatever stops the motors releases the turret."""

    __slots__ = ()
    ID: ClassVar[int] = 0x18
    NAME: ClassVar[str] = "turret"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 3
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<hB")
    OFFSETS: ClassVar[dict[str, int]] = {"angle": 0, "hold": 2}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _BuzzerFields(NamedTuple):
    frequency: int  # Hz; 40 to 8000; 0: silence
    duration: int  # 0.01 s
    token: int  # another one for each tone; the last tone's again changes nothing. 0 at the start of a session


class Buzzer(_BuzzerFields):
    """A tone, in place of the one that sounds. Whatever stops the motors silences it."""

    __slots__ = ()
    ID: ClassVar[int] = 0x19
    NAME: ClassVar[str] = "buzzer"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 4
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HBB")
    OFFSETS: ClassVar[dict[str, int]] = {"frequency": 0, "duration": 2, "token": 3}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _GetParameterFields(NamedTuple):
    number: int  # of the request: 1 for the first of a session, then one more each
    parameter: int  # number of the parameter


class GetParameter(_GetParameterFields):
    """Asks for one parameter."""

    __slots__ = ()
    ID: ClassVar[int] = 0x25
    NAME: ClassVar[str] = "get_parameter"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 3
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HB")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0, "parameter": 2}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SetParameterFields(NamedTuple):
    number: int  # of the request
    parameter: int  # number of the parameter
    value: int  # in counts of the parameter's scale


class SetParameter(_SetParameterFields):
    """Sets one parameter until the next reset."""

    __slots__ = ()
    ID: ClassVar[int] = 0x21
    NAME: ClassVar[str] = "set_parameter"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 7
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HBi")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0, "parameter": 2, "value": 3}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _SaveParametersFields(NamedTuple):
    number: int  # of the request


class SaveParameters(_SaveParametersFields):
    """Writes all parameters to the EEPROM; answered when they are written and read back."""

    __slots__ = ()
    ID: ClassVar[int] = 0x22
    NAME: ClassVar[str] = "save_parameters"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 2
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<H")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _ResetParametersFields(NamedTuple):
    number: int  # of the request


class ResetParameters(_ResetParametersFields):
    """All parameters to the image's defaults; what is saved stays until save_parameters."""

    __slots__ = ()
    ID: ClassVar[int] = 0x23
    NAME: ClassVar[str] = "reset_parameters"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 2
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<H")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _ArmFields(NamedTuple):
    number: int  # of the request
    latches: int  # as in the telemetry that the host knows; refused (latched_again) if there has been another since


class Arm(_ArmFields):
    """Ends the latch: set-points that answer a later tick move the motors. Refused while the supply is low or not yet measured."""

    __slots__ = ()
    ID: ClassVar[int] = 0x24
    NAME: ClassVar[str] = "arm"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 3
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HB")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0, "latches": 2}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _AcknowledgeFields(NamedTuple):
    number: int  # of the event


class Acknowledge(_AcknowledgeFields):
    """The event of this number has arrived."""

    __slots__ = ()
    ID: ClassVar[int] = 0x28
    NAME: ClassVar[str] = "acknowledge"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 2
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<H")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _ClockProbeFields(NamedTuple):
    token: int  # comes back in clock_answer


class ClockProbe(_ClockProbeFields):
    """Asks for the board's time, at once. Also keeps the session open."""

    __slots__ = ()
    ID: ClassVar[int] = 0x30
    NAME: ClassVar[str] = "clock_probe"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 2
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<H")
    OFFSETS: ClassVar[dict[str, int]] = {"token": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _StoppedFields(NamedTuple):
    token: int  # of the stop


class Stopped(_StoppedFields):
    """Answer to stop: the motors are latched off."""

    __slots__ = ()
    ID: ClassVar[int] = 0x88
    NAME: ClassVar[str] = "stopped"
    DELIVERY: ClassVar[str] = "stop"
    LENGTH: ClassVar[int] = 1
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<B")
    OFFSETS: ClassVar[dict[str, int]] = {"token": 0}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _TelemetryFields(NamedTuple):
    tick: int  # control ticks since reset
    time: int  # us; board time at the start of this tick, since its clock started (about 0.2 s after a reset); rolls over after 71.6 min
    encoder_left: int  # edges; edges since reset; signed only where the encoder knows direction
    encoder_right: int  # edges
    edge_period_left: int  # 16 us; time between the last two edges; 0: none within 0.5 s
    edge_period_right: int  # 16 us
    whiskers: int  # whiskers
    infrared: int  # infrared
    infrared_age: int  # ticks; age of the older IR reading; 255: never or older
    ping_echo: int  # us; length of the last echo pulse where ping_status is ok, else 0
    ping_age: int  # ticks; ticks since that measurement ended or was given up; 255: never or older
    ping_status: int  # ping_status
    pulse_left: int  # 0.0625 us; servo pulse in force; 0: no pulses
    pulse_right: int  # 0.0625 us
    supply: int  # 0.001 V; supply voltage against the bandgap; 0: not yet measured
    status: int  # status
    latch: int  # latch
    latches: int  # times that the motors were latched off since reset, repeated stops included, modulo 256
    setpoint_sequence: int  # sequence number of the last set-point that was accepted
    overruns: int  # control ticks overrun since reset, modulo 256


class Telemetry(_TelemetryFields):
    """Everything the board knows, once per control tick or less often where the line is slow."""

    __slots__ = ()
    ID: ClassVar[int] = 0x90
    NAME: ClassVar[str] = "telemetry"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 39
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<IIiiHHBBBHBBHHHHBBBB")
    OFFSETS: ClassVar[dict[str, int]] = {"tick": 0, "time": 4, "encoder_left": 8, "encoder_right": 12, "edge_period_left": 16, "edge_period_right": 18, "whiskers": 20, "infrared": 21, "infrared_age": 22, "ping_echo": 23, "ping_age": 25, "ping_status": 26, "pulse_left": 27, "pulse_right": 29, "supply": 31, "status": 33, "latch": 35, "latches": 36, "setpoint_sequence": 37, "overruns": 38}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _CountersFields(NamedTuple):
    good: int  # frames accepted
    bad: int  # frames refused: length, checksum, stuffing or seed
    unknown: int  # whole frames of messages that came with a later minor version, and are ignored
    resynchronised: int  # times that a good frame followed bad ones
    retransmitted: int  # events sent again
    duplicate: int  # requests that came again and were only answered
    overrun: int  # ticks in which received bytes were lost
    dropped: int  # messages not sent for want of room on the line
    late: int  # set-points refused because newer ones had come or their observation was too old
    refused: int  # whole messages refused for what they ask: out of range, out of order, while latched
    deferred: int  # events that had to wait for room in the queue, where changes of the same kind merge


class Counters(_CountersFields):
    """What the board's end of the link has counted since reset, modulo 65536; sent in turn with task_time."""

    __slots__ = ()
    ID: ClassVar[int] = 0x91
    NAME: ClassVar[str] = "counters"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 22
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HHHHHHHHHHH")
    OFFSETS: ClassVar[dict[str, int]] = {"good": 0, "bad": 2, "unknown": 4, "resynchronised": 6, "retransmitted": 8, "duplicate": 10, "overrun": 12, "dropped": 14, "late": 16, "refused": 18, "deferred": 20}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _DevicesTelemetryFields(NamedTuple):
    tick: int  # control ticks since reset
    supply: int  # 0.001 V; supply voltage, the analog readings' reference; 0: not yet measured
    infrared_zone_left: int  # at how many of the sweep's five frequencies an object is seen
    infrared_zone_right: int
    infrared_zone_age: int  # ticks; age of the sweep's last burst; 255: never or older
    battery: int  # voltage at the battery's pin in 1/1024 of the supply
    battery_age: int  # ticks; 255: never or older
    analog_infrared: int  # voltage at the sensor's pin in 1/1024 of the supply
    analog_infrared_age: int  # ticks; 255: never or older
    light_left: int  # us; decay time of the light sensor, shorter in brighter light; 0: none; 14000: so long or longer
    light_right: int  # us
    light_age: int  # ticks; since the end of the measurement; 255: never or older
    compass_x: int  # field along the sensor's axes, raw counts; -4096: overflow
    compass_y: int
    compass_z: int
    compass_age: int  # ticks; 255: never or older
    compass_status: int  # compass_status
    turret_pulse: int  # 0.0625 us; turret servo's pulse in force; 0: no pulses
    buzzer_token: int  # of the last tone that was begun in this session


class DevicesTelemetry(_DevicesTelemetryFields):
    """The slow devices: sent every devices_period ticks or less often where the line is slow, while one of them is on."""

    __slots__ = ()
    ID: ClassVar[int] = 0x92
    NAME: ClassVar[str] = "devices_telemetry"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 31
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<IHBBBHBHBHHBhhhBBHB")
    OFFSETS: ClassVar[dict[str, int]] = {"tick": 0, "supply": 4, "infrared_zone_left": 6, "infrared_zone_right": 7, "infrared_zone_age": 8, "battery": 9, "battery_age": 11, "analog_infrared": 12, "analog_infrared_age": 14, "light_left": 15, "light_right": 17, "light_age": 19, "compass_x": 20, "compass_y": 22, "compass_z": 24, "compass_age": 26, "compass_status": 27, "turret_pulse": 28, "buzzer_token": 30}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _TaskTimeFields(NamedTuple):
    task: int  # task
    longest: int  # 0.0625 us; from call to return, interrupts on top included; 65535: so long or longer; 0: it took no time, as on the native board


class TaskTime(_TaskTimeFields):
    """How long one of the firmware's tasks took at most since the session was opened; one task after another, then the counters, every 4 ticks or less often."""

    __slots__ = ()
    ID: ClassVar[int] = 0x93
    NAME: ClassVar[str] = "task_time"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 3
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<BH")
    OFFSETS: ClassVar[dict[str, int]] = {"task": 0, "longest": 1}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _AnswerFields(NamedTuple):
    number: int  # of the request
    status: int  # answer_status
    value: int  # of get_parameter and set_parameter, refused or not: the value in force, in counts of the parameter's scale; else, and where it is busy or the parameter unknown, 0


class Answer(_AnswerFields):
    """Answer to a numbered request."""

    __slots__ = ()
    ID: ClassVar[int] = 0xA0
    NAME: ClassVar[str] = "answer"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 7
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HBi")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0, "status": 2, "value": 3}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _EventFields(NamedTuple):
    number: int  # of the event: 1 for the first of a session, then one more each
    kind: int  # event_kind
    value: int  # its meaning stands at each event_kind
    time: int  # us; board time


class Event(_EventFields):
    """Something happened. Sent again until acknowledged."""

    __slots__ = ()
    ID: ClassVar[int] = 0xA1
    NAME: ClassVar[str] = "event"
    DELIVERY: ClassVar[str] = "exactly_once"
    LENGTH: ClassVar[int] = 9
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HBHI")
    OFFSETS: ClassVar[dict[str, int]] = {"number": 0, "kind": 2, "value": 3, "time": 5}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


class _ClockAnswerFields(NamedTuple):
    token: int  # of the probe
    time: int  # us; board time at which the probe was worked on


class ClockAnswer(_ClockAnswerFields):
    """Answer to clock_probe."""

    __slots__ = ()
    ID: ClassVar[int] = 0xB0
    NAME: ClassVar[str] = "clock_answer"
    DELIVERY: ClassVar[str] = "telemetry"
    LENGTH: ClassVar[int] = 6
    STRUCT: ClassVar[struct.Struct] = struct.Struct("<HI")
    OFFSETS: ClassVar[dict[str, int]] = {"token": 0, "time": 2}

    def pack(self) -> bytes:
        """The payload."""
        return self.STRUCT.pack(*self)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """The message in a payload of exactly its length."""
        return cls(*cls.STRUCT.unpack(payload))


Message = (
    Open
    | Identify
    | Describe
    | Hello
    | Identity
    | Description
    | Stop
    | Close
    | SetpointSignal
    | SetpointSpeed
    | SetpointCoast
    | Turret
    | Buzzer
    | GetParameter
    | SetParameter
    | SaveParameters
    | ResetParameters
    | Arm
    | Acknowledge
    | ClockProbe
    | Stopped
    | Telemetry
    | Counters
    | DevicesTelemetry
    | TaskTime
    | Answer
    | Event
    | ClockAnswer
)

MESSAGES: dict[int, type[Message]] = {
    0x01: Open,
    0x02: Identify,
    0x03: Describe,
    0x80: Hello,
    0x81: Identity,
    0x82: Description,
    0x08: Stop,
    0x09: Close,
    0x10: SetpointSignal,
    0x11: SetpointSpeed,
    0x12: SetpointCoast,
    0x18: Turret,
    0x19: Buzzer,
    0x25: GetParameter,
    0x21: SetParameter,
    0x22: SaveParameters,
    0x23: ResetParameters,
    0x24: Arm,
    0x28: Acknowledge,
    0x30: ClockProbe,
    0x88: Stopped,
    0x90: Telemetry,
    0x91: Counters,
    0x92: DevicesTelemetry,
    0x93: TaskTime,
    0xA0: Answer,
    0xA1: Event,
    0xB0: ClockAnswer,
}

# id -> hash of the message
HASHES: dict[int, int] = {
    0x01: 0xE0471814,
    0x02: 0xBD434780,
    0x03: 0xDDE1C4B0,
    0x80: 0xECA6681B,
    0x81: 0xF379E8B5,
    0x82: 0xACE09C27,
    0x08: 0xF533989A,
    0x09: 0x0C4FA8AA,
    0x10: 0xEFBA28FD,
    0x11: 0xFCEB8D85,
    0x12: 0xD86ACD27,
    0x18: 0x76F31EB3,
    0x19: 0xB81D6D3F,
    0x25: 0xEE5C19C7,
    0x21: 0x885FEFDB,
    0x22: 0x1DEAD58C,
    0x23: 0x5C7C21EE,
    0x24: 0x7A25B50E,
    0x28: 0x306E772C,
    0x30: 0x1011476B,
    0x88: 0x24E076A5,
    0x90: 0x421C7CB9,
    0x91: 0x87F975A3,
    0x92: 0xA1006857,
    0x93: 0x9EADF1CF,
    0xA0: 0x90997173,
    0xA1: 0x515D19B5,
    0xB0: 0xFC092B76,
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
    since: int = 0  # minor version


PARAMETERS: dict[str, ParameterSpec] = {
    "devices": ParameterSpec(0, "flags", 1.0, 0, 2047, "devices switched on, bits as in the devices flags"),
    "time_to_live": ParameterSpec(1, "ms", 1.0, 20, 2000, "time to live of a set-point that names none"),
    "servo_left_centre": ParameterSpec(2, "us", 0.0625, 22400, 25600, "pulse at which the left servo stands still", "servo_left.centre_us"),
    "servo_right_centre": ParameterSpec(3, "us", 0.0625, 22400, 25600, "pulse at which the right servo stands still", "servo_right.centre_us"),
    "servo_left_gain": ParameterSpec(4, "us", 0.0625, -3200, 3200, "pulse offset at full forward signal, left; negative for a mirrored servo", "servo_left.gain_us"),
    "servo_right_gain": ParameterSpec(5, "us", 0.0625, -3200, 3200, "pulse offset at full forward signal, right; negative for a mirrored servo", "servo_right.gain_us"),
    "wheel_speed_maximum": ParameterSpec(6, "m/s", 0.0001, 100, 5000, "ground speed at full signal, for set-points in m/s", "body.wheel_speed_maximum_m_s"),
    "infrared_period": ParameterSpec(7, "ticks", 1.0, 2, 250, "ticks between two IR readings", "infrared.period_ticks"),
    "ping_period": ParameterSpec(8, "ticks", 1.0, 4, 250, "ticks between two Ping triggers", "ping.period_ticks"),
    "encoder_limit": ParameterSpec(9, "edges per tick", 1.0, 4, 200, "edges of one encoder line in one tick above which the line is masked until the tick ends"),
    "encoder_counts": ParameterSpec(10, "edges", 1.0, 1, 4096, "edges of one encoder line in a turn of its wheel", "encoder_left.edges_per_turn"),
    "wheel_radius": ParameterSpec(11, "m", 1e-05, 500, 20000, "radius of the wheels; the board only keeps it", "body.wheel_radius_m"),
    "track_width": ParameterSpec(12, "m", 1e-05, 2000, 60000, "distance between the wheels; the board only keeps it", "body.track_width_m"),
    "telemetry_period": ParameterSpec(13, "ticks", 1.0, 1, 100, "ticks between two telemetry messages, where the baud rate allows it"),
    "session_time_out": ParameterSpec(14, "ms", 1.0, 200, 1500, "silence of the host after which the session ends and the motors are latched off"),
    "retry_time": ParameterSpec(15, "ms", 1.0, 0, 2000, "time after which an unacknowledged event is sent again; 0: follows from tick and baud rate"),
    "supply_minimum": ParameterSpec(16, "V", 0.001, 0, 5500, "supply below which motors and EEPROM writes are refused; 0: never", "supply.minimum_v"),
    "bandgap": ParameterSpec(17, "V", 0.001, 1000, 1200, "this chip's bandgap voltage, against which the supply is measured"),
    "baud_rate": ParameterSpec(18, "bit/s", 100.0, 96, 10000, "rate of the serial line after the next reset: 9600, 19200, 38400, 57600, 115200, 250000, 500000 or 1000000", "uart.baud"),
    "infrared_sweep": ParameterSpec(19, "flag", 1.0, 0, 1, "1: bursts go through 38, 39, 40, 41 and 42 kHz in five ticks and count zones; 0: 38 kHz only"),
    "devices_period": ParameterSpec(20, "ticks", 1.0, 1, 100, "ticks between two devices_telemetry messages, where the baud rate allows it"),
    "turret_centre": ParameterSpec(21, "us", 0.0625, 16000, 32000, "pulse at which the turret looks straight ahead", "turret.centre_us"),
    "turret_gain": ParameterSpec(22, "us/rad", 0.0625, -16000, 16000, "pulse for each radian of the turret to the left; negative for a servo that turns the other way", "turret.gain_us_per_rad"),
    "start_beep": ParameterSpec(23, "s", 0.01, 0, 100, "length of the tone at each start, so that a reset is heard; 0: none"),
    "encoder_gap": ParameterSpec(24, "us", 1.0, 0, 65535, "one line: an edge sooner after the last that counts does not count; two lines: it gives no period; 0: every edge counts", "robot.encoder_gap_us"),
    "fallback_after": ParameterSpec(25, "ms", 1.0, 0, 65535, "silence of the host after which the board's own brain takes over; 0: never"),
    "fallback_at_start": ParameterSpec(26, "flag", 1.0, 0, 1, "1: the board's own brain may also take over after a reset, before any host has armed the motors; 0: not"),
}
