"""The board's column of `boebot timing`: what a connected board measures of its own tasks, if it runs the judged
image."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.cli import output
from boebot.errors import TimingError

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription
    from boebot.link import messages


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
    from boebot.link import task_times

    code = read_image(image).code
    request = BoardRequest(
        robot=robot, record=False, realtime=True, image=None if loaded is None else str(loaded.resolve())
    )
    with board_link(port, request) as (link, _):
        check_image(link.identity(), code, image.name, port)
        label = f"listening to {port}"
        with output.share_bars([label]) as watch:
            found = task_times.measure(link, seconds, lambda share: watch({label: share}))
    measured = {name: cycles for name, cycles in found.items() if cycles}
    if not measured:
        output.say(f"the board {port} does not measure its tasks: only the chip's own timer can")
    return measured


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
