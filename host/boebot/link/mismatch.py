"""How a board that speaks otherwise than this kit differs from it, in one sentence (PROTOCOL.md, "Session")."""

from __future__ import annotations

from collections.abc import Callable

from boebot.errors import BoebotError, ProtocolError
from boebot.link import messages

_MINORS = 16  # versions before 3 had none, and a number below


def version_name(version: int = messages.PROTOCOL_VERSION) -> str:
    """As in "3.0", of what a hello or an open carries."""
    major, minor = divmod(version, _MINORS)
    return f"{major}.{minor}" if major else str(minor)


def minor_of(hello: messages.Hello) -> int:
    """The minor version of the board."""
    return hello.protocol_version % _MINORS


def speaks_alike(hello: messages.Hello) -> bool:
    """Whether board and kit understand each other."""
    return (
        hello.protocol_version // _MINORS == messages.PROTOCOL_VERSION // _MINORS
        and hello.schema_hash == messages.SCHEMA_HASH
        and hello.tick_rate > 0
    )


def refusal(hello: messages.Hello, where: str, describe: Callable[[int], messages.Description]) -> ProtocolError:
    """Why the board at `where` that said this cannot be spoken with. `describe` asks it for message i of its table."""
    if hello.protocol_version // _MINORS != messages.PROTOCOL_VERSION // _MINORS:
        return ProtocolError(
            f"the board at {where} speaks protocol version {version_name(hello.protocol_version)}, this kit speaks "
            f"version {version_name()}; flash the firmware that came with this kit"
        )
    if hello.tick_rate == 0:
        return ProtocolError(f"the board at {where} says that it makes 0 control ticks in a second; expected more")
    return ProtocolError(
        f"the board at {where} was built with message schema {hello.schema_hash:08x}, this kit with "
        f"{messages.SCHEMA_HASH:08x}: {_difference(describe)}; flash the firmware that came with this kit"
    )


def _difference(describe: Callable[[int], messages.Description]) -> str:
    """The first message that board and kit understand differently."""
    ours = sorted(messages.MESSAGES)
    theirs: set[int] = set()
    unknown = 0
    index = 0
    while True:
        try:
            said = describe(index)
        except BoebotError:
            return "which message differs it does not say"
        if said.id == 0 or index >= said.count:
            break
        kind = messages.MESSAGES.get(said.id)
        if kind is None:
            unknown = said.id
        elif said.length != kind.LENGTH:
            return f"message {kind.NAME} (0x{said.id:02x}) has {said.length} bytes there, {kind.LENGTH} here"
        elif said.hash != messages.HASHES[said.id]:
            return f"the fields of message {kind.NAME} (0x{said.id:02x}) differ"
        theirs.add(said.id)
        index += 1
    missing = next((number for number in ours if number not in theirs), None)
    if missing is not None:
        return f"it does not know message {messages.MESSAGES[missing].NAME} (0x{missing:02x})"
    if unknown:
        return f"its message 0x{unknown:02x} is not known here"
    return "the messages agree, but flags, values or parameters differ"
