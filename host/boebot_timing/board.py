"""The board's column of `boebot timing`: what a connected board measures of its own tasks, if it runs the judged
image."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.cli import output
from boebot.errors import BoardError, TimingError
from boebot.link import messages

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription
    from boebot.link.link import Link

_ROUND_PERIODS = 4 * (len(messages.Task) + 1)  # of telemetry: each task's time and the counters, a message in four
_ROUNDS = 4  # in which each task's time came at least once, or something is wrong
_LOOK_S = 0.05


def maxima(
    port: str, robot: RobotDescription, image: Path, seconds: float, loaded: Path | None = None
) -> Mapping[str, int]:
    """What a board measures of its tasks in a session of `seconds`, in cycles by their names. Nothing moves.

    Args:
        image: the one that is judged.
        loaded: what an emulated board is to run; None: its own.

    Raises:
        BoardError: there is no board at the port, or it does not answer.
        TimingError: the board runs another image.
        AnalysisError: the image cannot be read.
    """
    from boebot.boards import BoardRequest
    from boebot.cli.board_link import board_link
    from boebot.image.elf import read_image

    code = read_image(image).code
    request = BoardRequest(
        robot=robot, record=False, realtime=True, image=None if loaded is None else str(loaded.resolve())
    )
    with board_link(port, request) as (link, _):
        check_image(link.identity(), code, image.name, port)
        with output.progress_bar(f"listening to {port}", 100, unit=" %") as watch:
            found = measure(link, seconds, lambda share: watch(100 * share))
    measured = {name: cycles for name, cycles in found.items() if cycles}
    if not measured:
        output.say(f"the board {port} does not measure its tasks: only the chip's own timer can")
    return measured


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
    while (passed := link.transport.now() - begun) < least or (None in link.task_times.values() and passed < most):
        progress(min(passed / least, 1.0))
        link.poll(_LOOK_S)
        link.events.fetch()
    missing = [name for name, cycles in link.task_times.items() if cycles is None]
    if missing:
        raise BoardError(
            f"the board at {link.transport.name} did not send the times of its tasks {', '.join(missing)} within "
            f"{most:.1f} s; expected one task after another"
        )
    return {name: cycles for name, cycles in link.task_times.items() if cycles is not None}


def check_image(identity: messages.Identity, code: bytes, name: str, port: str) -> None:
    """Whether the flash of a board holds an image: by its size and CRC-32, as the board read them back.

    Args:
        code: the image, from address 0.

    Raises:
        TimingError: it holds another one.
    """
    if identity.image_size == 0:  # a board without a flash
        return
    found, wanted = (identity.image_size, identity.image_hash), (len(code), zlib.crc32(code))
    if found != wanted:
        runs, judged = (f"{size} bytes with CRC-32 {crc:08x}" for size, crc in (found, wanted))
        raise TimingError(
            f"the board {port} runs another image ({runs}) than {name} ({judged}); "
            "expected the same: flash it, name the board's own with --elf, or leave out --port"
        )
