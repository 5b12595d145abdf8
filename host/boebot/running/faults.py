"""Faults of a run by name, time and value, as `boebot run --fault NAME[=VALUE]@START[..END]` has them: which a robot
can have, how they are read, and who carries them out.

A name is `owner.kind`. Owners are devices of the robot that say how they fail (`Device.FAULTS`), as `whisker_left` or
all of a group, `whiskers`; and what belongs to no device: the serial line, the cable, the host, the board and more of
`OWNERS`. Times are of the run, as its page shows them. All faults of a run are handed over before the first step of its
brain, each with its span, so that none hangs on the steps.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping

from boebot.boards import RESET_CAUSES, BoardSession, VehicleSession
from boebot.description.robots import RobotDescription
from boebot.devices.device import FaultKind
from boebot.devices.faults import BODY_FAULTS
from boebot.errors import BoebotError, CallError, did_you_mean
from boebot.link.bad_line import BadLine
from boebot.quantity import parse
from boebot.record.interventions import Fault

EXPECTED = "expected NAME[=VALUE]@START[..END], as in ping.missing@3s..5s"
HOST = ("serial", "cable", "host")
"""Owners on the host's side of the line: of any board, also a real one."""

_SIDE = re.compile(r"_(left|middle|right|\d+)$")
NEED_END = ("serial.stalled", "host.stopped")
"""What holds something back until then."""

Fired = Callable[[], int]
"""How often a fault has changed something so far."""

OWNERS: Mapping[str, Mapping[str, FaultKind]] = {
    "serial": {
        "dropped": FaultKind("bytes are lost, this share of them", default=0.01),
        "doubled": FaultKind("bytes come twice, this share of them", default=0.01),
        "repeated": FaultKind("whole frames come twice, this share of them", default=0.1),
        "flipped": FaultKind("bits are wrong, this share of them", default=1e-4),
        "delayed": FaultKind("bytes come later by this", "s", default=0.1, most=10.0),
        "stalled": FaultKind("bytes are held back until END, and come all at once"),
        "rate": FaultKind("the host's bit rate is off by this share", default=0.03, least=-0.1, most=0.1),
    },
    "cable": {"out": FaultKind("the serial cable is out: nothing passes")},
    "host": {
        "stopped": FaultKind("the host's program stands still until END"),
        "killed": FaultKind("the host's program ends, and leaves the board to itself", lasts=False),
        "slow": FaultKind("each step of the brain takes longer by this", "s", default=0.1, most=10.0),
    },
    "board": {
        "reset": FaultKind("the microcontroller is reset", words=RESET_CAUSES, lasts=False),
        "brown_out": FaultKind("the 5 V rail falls to this", "V", default=2.5, most=5.0),
    },
    "eeprom": {"corrupted": FaultKind("bytes get other values", default=1.0, least=1.0, most=1024.0, lasts=False)},
}


def known(robot: RobotDescription) -> dict[str, tuple[FaultKind, tuple[str, ...]]]:
    """Those that a robot can have, by name, and whose they are: of a group of devices all of it."""
    found: dict[str, tuple[FaultKind, tuple[str, ...]]] = {}
    devices = {name: (device.FAULTS, device.GROUP) for name, device in robot.device.items() if device.on}
    others = {
        name: (kinds, "") for name, kinds in {**OWNERS, **BODY_FAULTS}.items() if name != "battery" or robot.supply
    }
    for name, (kinds, group) in {**devices, **others}.items() if robot.has_board else ():
        for owner in dict.fromkeys((name, group or _SIDE.sub("", name))):
            for one, kind in kinds.items():
                _, whose = found.get(f"{owner}.{one}", (kind, ()))
                found[f"{owner}.{one}"] = kind, (*whose, name)
    return found


def read(text: str, robot: RobotDescription) -> Fault:
    """A fault as people write it, checked for a robot.

    Raises:
        CallError: it is none, or the robot cannot have it.
    """
    what, sign, span = text.rpartition("@")
    name, equals, value = what.partition("=")
    start, dots, end = span.partition("..")
    kind = _kind(name if sign else text, robot, text)
    try:
        if not sign:
            raise BoebotError("it says no time")
        given = None if not equals else value if kind.words else parse(value, kind.unit)
        fault = Fault(name, given, parse(start, "s"), parse(end, "s") if dots else None)
    except BoebotError as error:
        raise CallError(f"fault {text!r}: {error}; {EXPECTED}") from None
    return checked(fault, robot)


def checked(fault: Fault, robot: RobotDescription) -> Fault:
    """The fault with its default value where it has none.

    Raises:
        CallError: the robot cannot have it.
    """
    kind, value = _kind(fault.name, robot, str(fault)), fault.value
    if value is None:
        value = kind.words[0] if kind.words else kind.default
    elif kind.words:
        if value not in kind.words:
            raise CallError(f"fault {fault}: {value!r} is none of {', '.join(kind.words)}")
    elif kind.default is None:
        raise CallError(f"fault {fault}: {fault.name} takes no value")
    elif not isinstance(value, float | int) or not kind.least <= value <= kind.most:
        expected = f"expected {kind.least:g} to {kind.most:g} {kind.unit}".rstrip()
        raise CallError(f"fault {fault}: its value is {value}; {expected}")
    if not (fault.begin_s >= 0.0 and math.isfinite(fault.begin_s)):
        raise CallError(f"fault {fault} begins at {fault.begin_s:g} s; expected a time of the run, from 0 s on")
    if fault.end_s is None and fault.name in NEED_END:
        raise CallError(f"fault {fault} never ends; expected an END, as in {fault.name}@3s..4s")
    if fault.end_s is not None and not kind.lasts:
        raise CallError(f"fault {fault}: {fault.name} happens at one time; expected no END")
    if fault.end_s is not None and not fault.begin_s < fault.end_s:
        raise CallError(f"fault {fault} ends at {fault.end_s:g} s; expected a time later than its begin")
    return Fault(fault.name, value, fault.begin_s, fault.end_s)


def _kind(name: str, robot: RobotDescription, fault: str) -> FaultKind:
    """Raises CallError where the robot cannot have it."""
    there = known(robot)
    if name in there:
        return there[name][0]
    owner = name.partition(".")[0]
    near = [one for one in there if one.partition(".")[0] == owner]
    hint = did_you_mean(name, there) or (
        f"; expected one of {', '.join(near)}" if near else "; boebot faults lists all"
    )
    raise CallError(f"fault {fault!r}: robot {robot.name!r} has no {name!r}{hint}")


def faults_of(
    given: Iterable[str | Fault], robot: RobotDescription, number: int, count: int, seconds: float
) -> list[Fault]:
    """Those of a run that are of its robot of that number, from 1 to `count`: all that name no other as in
    "2:NAME@START".

    Raises:
        CallError: one of them is none, or never begins.
    """
    found = []
    for one in given:
        if isinstance(one, Fault):
            fault = checked(one, robot)
        else:
            whose, _, text = one.rpartition(":")
            if whose and whose not in map(str, range(1, count + 1)):
                raise CallError(f"fault {one!r}: there is no robot {whose} in the run; expected 1 to {count}")
            if whose not in ("", str(number)):
                continue
            fault = read(text, robot)
        if fault.begin_s >= seconds:
            raise CallError(f"fault {fault} is never: the run ends at {seconds:g} s; expected an earlier START")
        found.append(fault)
    return found


def inject(
    fault: Fault,
    robot: RobotDescription,
    session: BoardSession | VehicleSession,
    bad_line: Callable[[], BadLine],
    offset_s: float = 0.0,
) -> Fired:
    """Hands a fault over to who carries it out.

    Args:
        robot: that has it.
        session: of that robot.
        bad_line: gives what damages the line to its board from then on; called for what is on the host's side.
        offset_s: time of the session's transport at the run's time 0.

    Raises:
        BoebotError: it cannot be here.
    """
    fault = checked(fault, robot)
    owner, _, name = fault.name.partition(".")
    kind, owners = known(robot)[fault.name]
    value = float(kind.words.index(str(fault.value)) if kind.words else fault.value or 0.0)
    span = fault.begin_s + offset_s, math.inf if fault.end_s is None else fault.end_s + offset_s
    if fault.name == "serial.rate":
        session.fault(owner, name, value, *span)
    if owner in HOST:
        return bad_line().add(fault.name, value, *span)
    fired = [session.fault(one, name, value, *span) for one in owners]
    return lambda: sum(one() for one in fired)


class UnfiredError(BoebotError):
    """A fault of a run has changed nothing."""

    exit_code = 3
    brief = "fault did not fire"


def unfired(fired: Mapping[str, int]) -> UnfiredError | None:
    """Of the faults of a run that changed nothing; None: all did. `fired`: how often each did."""
    none = [name for name, count in fired.items() if not count]
    if not none:
        return None
    which = f"fault {none[0]}" if len(none) == 1 else f"faults {', '.join(none)}"
    return UnfiredError(f"{which} did not fire: nothing happened then that it could change")
