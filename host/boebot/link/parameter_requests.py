"""The parameters of a board: read, set, saved and reset by requests, in their units."""

from __future__ import annotations

import math
from collections.abc import Callable

from boebot.errors import BoebotError, expected_one
from boebot.link import finding, messages
from boebot.link.delivery import REQUEST_LIMIT_S, SAVE_LIMIT_S, RequestKind, check
from boebot.link.line import Line
from boebot.link.session import Session

_BUSY_AGAIN_S = 0.05  # while the EEPROM is being written


def parameter_spec(name: str) -> messages.ParameterSpec:
    """The parameter of that name.

    Raises:
        BoebotError: there is none.
    """
    spec = messages.PARAMETERS.get(name)
    if spec is None:
        raise BoebotError(f"there is no parameter {name!r}; {expected_one(name, messages.PARAMETERS)}")
    return spec


def parameter_counts(name: str, value: float) -> int:
    """The value, in the parameter's unit, as it goes over the wire.

    Raises:
        BoebotError: there is no such parameter, or it cannot be that.
    """
    spec = parameter_spec(name)
    counts = round(value / spec.scale) if math.isfinite(value) else spec.maximum + 1
    if not spec.minimum <= counts <= spec.maximum:
        raise BoebotError(
            f"parameter {name} cannot be {value:g} {spec.unit}; "
            f"expected {spec.minimum * spec.scale:g} to {spec.maximum * spec.scale:g}"
        )
    return counts


class BoardParameters:
    """The parameters of the board behind one link. All methods raise BoardError where the board does not answer or
    refuses, as `Link.request` does."""

    def __init__(
        self,
        line: Line,
        session: Session,
        request: Callable[..., messages.Answer],
        wait: Callable[[float], None],
    ) -> None:
        """`request`: as `Link.request`; `wait`: as of `Session`."""
        self._line = line
        self._session = session
        self._request = request
        self._wait = wait

    @property
    def names(self) -> list[str]:
        """Of the parameters that the board knows: those of its minor version."""
        assert self._session.hello is not None, "a session is open"
        minor = finding.minor_of(self._session.hello)
        return [name for name, spec in messages.PARAMETERS.items() if spec.since <= minor]

    def get(self, name: str) -> float:
        """The value of a parameter, in its unit."""
        spec = parameter_spec(name)
        answer = self._request(messages.GetParameter, spec.id, what=f"send parameter {name}")
        check(answer, self._line.transport.name, f"refuses parameter {name}")
        return answer.value * spec.scale

    def set(self, name: str, value: float) -> float:
        """Sets a parameter until the board's next reset; returns the value now in force, in its unit."""
        spec, counts = parameter_spec(name), parameter_counts(name, value)
        asked, refused = f"set parameter {name}", f"refuses parameter {name}"
        return self._change(messages.SetParameter, spec.id, counts, what=asked, refused=refused).value * spec.scale

    def save(self) -> None:
        """Writes all parameters to the board's EEPROM, so that they outlast resets and power cuts.

        Raises:
            BoardError: the supply is low, what was written does not read back; or as `Link.request`.
        """
        self._change(messages.SaveParameters, what="save its parameters", limit_s=SAVE_LIMIT_S)

    def reset(self) -> None:
        """All parameters to the image's defaults; those that are saved stay saved."""
        self._change(messages.ResetParameters, what="reset its parameters")

    def _change(
        self, kind: RequestKind, *arguments: int, what: str, refused: str = "", limit_s: float = REQUEST_LIMIT_S
    ) -> messages.Answer:
        """As `Link.request`, but asks again while the board writes its EEPROM, and raises unless it agrees: `refused`
        says what the board does then, or else that it did not do `what`."""
        now = self._line.now
        end = now() + SAVE_LIMIT_S
        while True:
            answer = self._request(kind, *arguments, what=what, limit_s=limit_s)
            if answer.status != messages.AnswerStatus.BUSY or now() >= end:
                break
            again = now() + _BUSY_AGAIN_S
            while now() < again:
                self._wait(again)
        check(answer, self._line.transport.name, refused or f"did not {what}")
        return answer
