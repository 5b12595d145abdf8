"""How long the tasks of the board's firmware take, by the board's own clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from boebot.errors import BoardError
from boebot.link import messages

if TYPE_CHECKING:
    from boebot.link.link import Link

_ROUND_PERIODS = 4 * (len(messages.Task) + 1)  # of telemetry: each task's time and the counters, a message in four
_ROUNDS = 4  # in which each task's time came at least once, or something is wrong
_LOOK_S = 0.05
_NAMES = tuple(task.name.lower() for task in messages.Task)


class TaskTimes:
    """The longest time of each task since the session was opened. The board sends one after another, all of them in
    0.9 s where the line is fast.

    Attributes:
        cycles: by the task's name, in 1/16 us, interrupts on top included; 65535: that or longer; 0: it took no time,
            as on the native board (where only the Ping's pulse does); None: not yet known.
    """

    def __init__(self) -> None:
        self.session_opened()

    def session_opened(self) -> None:
        """Begins anew."""
        self.cycles: dict[str, int | None] = dict.fromkeys(_NAMES)

    def receive(self, payload: bytes, _: float) -> None:
        """Takes a `task_time`. A task that this kit does not know is left out."""
        task, longest = messages.TaskTime.unpack(payload)
        if task < len(_NAMES):
            self.cycles[_NAMES[task]] = longest


def measure(link: Link, seconds: float, progress: Callable[[float], object] = lambda _: None) -> dict[str, int]:
    """Lets the board of a link work for a time; returns the longest times then, since the session was opened.
    Telemetry and events that come meanwhile are dropped.

    Args:
        link: with an open session.
        seconds: by the transport's clock. The board sends the times of one task after another, so that it takes up to
            0.9 s longer, or more where the line is slow.
        progress: called with the share of it that is over, 0 to 1.

    Raises:
        BoardError: the board has not sent all of them, in four times the time that it needs; or as `Link.poll`.
    """
    round_s = _ROUND_PERIODS * link.session.telemetry_s
    begun = link.transport.now()
    least, most = seconds + round_s, seconds + _ROUNDS * round_s
    while (passed := link.transport.now() - begun) < least or (
        None in link.task_times.cycles.values() and passed < most
    ):
        progress(min(passed / least, 1.0))
        link.poll(_LOOK_S)
        link.events.fetch()
    missing = [name for name, cycles in link.task_times.cycles.items() if cycles is None]
    if missing:
        raise BoardError(
            f"the board at {link.transport.name} did not send the times of its tasks {', '.join(missing)} within "
            f"{most:.1f} s; expected one task after another"
        )
    return {name: cycles for name, cycles in link.task_times.cycles.items() if cycles is not None}
