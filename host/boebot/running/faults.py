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
from collections.abc import Callable, Mapping

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
"""Owners on the host's side of the line."""

_SIDE = re.compile(r"_(left|middle|right|\d+)$")

Fired = Callable[[], int]
"""How often a fault has changed something so far."""

OWNERS: Mapping[str, Mapping[str, FaultKind]] = {
    "serial": {
        "dropped": FaultKind("bytes are lost, this share of them", default=0.01, harmless=0.0),
        "doubled": FaultKind("bytes come twice, this share of them", default=0.01, harmless=0.0),
        "repeated": FaultKind("whole frames come twice, this share of them", default=0.1, harmless=0.0),
        "flipped": FaultKind("bits are wrong, this share of them", default=1e-4, harmless=0.0),
        "delayed": FaultKind("bytes come later by this", "s", default=0.1, most=10.0, harmless=0.0),
        "stalled": FaultKind("bytes are held back until END, and come all at once", when="until END"),
        "rate": FaultKind("the host's bit rate is off by this share", default=0.03, least=-0.1, most=0.1, harmless=0.0),
    },
    "cable": {"out": FaultKind("the serial cable is out: nothing passes")},
    "host": {
        "stopped": FaultKind("the host's program stands still until END", when="until END"),
        "killed": FaultKind("the host's program ends, and leaves the board to itself", when="once"),
        "slow": FaultKind("each step of the brain takes longer by this", "s", default=0.1, most=10.0, harmless=0.0),
    },
    "board": {
        "reset": FaultKind("the microcontroller is reset", words=RESET_CAUSES, when="once"),
        "brown_out": FaultKind("the 5 V rail falls to this", "V", default=2.5, most=5.0, harmless=5.0),
    },
    "eeprom": {"corrupted": FaultKind("bytes get other values", default=1.0, least=1.0, most=1024.0, when="once")},
}

AT_A_PORT = {f"{owner}.{kind}" for owner in HOST for kind in OWNERS[owner]} - {"serial.rate"}
"""Of a real board, too."""


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


def read(what: str | Fault, robot: RobotDescription) -> Fault:
    """A fault, as people write it or as a `Fault`, checked for a robot, with its default value where it has none.

    Raises:
        CallError: it is none, or the robot cannot have it.
    """
    if isinstance(what, Fault):
        return _checked(what, _kind(what.name, robot, str(what))[0])
    head, sign, span = what.rpartition("@")
    name, equals, value = head.partition("=")
    start, dots, end = span.partition("..")
    kind, _ = _kind(name if sign else what, robot, what)
    try:
        if not sign:
            raise BoebotError("it says no time")
        takes_none = kind.default is None and not kind.words
        if equals and (takes_none or not value):
            raise BoebotError(f"{name} takes no value" if takes_none else "there is no value behind its =")
        given = None if not equals else value if kind.words else parse(value, kind.unit)
        fault = Fault(name, given, parse(start, "s"), parse(end, "s") if dots else None)
    except BoebotError as error:
        raise CallError(f"fault {what!r}: {error}; {EXPECTED}") from None
    return _checked(fault, kind)


def _checked(fault: Fault, kind: FaultKind) -> Fault:
    """As `read` returns it. Raises CallError."""
    value, name = fault.value, fault.name
    if value is None:
        value = kind.words[0] if kind.words else kind.default
    elif kind.words:
        if value not in kind.words:
            raise CallError(f"fault {fault}: {value!r} is none of {', '.join(kind.words)}")
    elif kind.default is None:
        raise CallError(f"fault {fault}: {name} takes no value")
    elif not isinstance(value, float | int) or not kind.least <= value <= kind.most:
        expected = f"expected {kind.least:g} to {kind.most:g} {kind.unit}".rstrip()
        raise CallError(f"fault {fault}: its value is {value}; {expected}")
    elif value == kind.harmless:
        raise CallError(f"fault {fault} changes nothing; expected another value than {value:g}")
    if not (fault.begin_s >= 0.0 and math.isfinite(fault.begin_s)):
        raise CallError(f"fault {fault} begins at {fault.begin_s:g} s; expected a time of the run, from 0 s on")
    if fault.end_s is None and kind.when == "until END":
        raise CallError(f"fault {fault} never ends; expected an END, as in {name}@3s..4s")
    if fault.end_s is not None and kind.when == "once":
        raise CallError(f"fault {fault}: {name} happens at one time; expected no END")
    if fault.end_s is not None and not fault.begin_s < fault.end_s < math.inf:
        raise CallError(f"fault {fault} ends at {fault.end_s:g} s; expected a finite time later than its begin")
    return Fault(name, value, fault.begin_s, fault.end_s)


def _kind(name: str, robot: RobotDescription, fault: str) -> tuple[FaultKind, tuple[str, ...]]:
    """As of `known`. Raises CallError where the robot cannot have it."""
    there = known(robot)
    if name in there:
        return there[name]
    owner = name.partition(".")[0]
    near = [one for one in there if one.partition(".")[0] == owner]
    others = f"expected one of {', '.join(near)}" if near else "boebot faults lists all"
    hint = did_you_mean(name, there) or f"; {others}"
    raise CallError(f"fault {fault!r}: robot {robot.name!r} has no {name!r}{hint}")


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
    kind, owners = _kind(fault.name, robot, str(fault))
    fault = _checked(fault, kind)
    owner, _, name = fault.name.partition(".")
    value = float(kind.words.index(str(fault.value)) if kind.words else fault.value or 0.0)
    span = fault.begin_s + offset_s, math.inf if fault.end_s is None else fault.end_s + offset_s
    fired = [] if fault.name in AT_A_PORT else [session.fault(one, name, value, *span) for one in owners]
    if owner in HOST:
        fired.append(bad_line().add(fault.name, value, *span))
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
