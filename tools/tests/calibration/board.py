"""The rows measured on a board behind a serial port: flashed by avrdude, then asked."""

from __future__ import annotations

import tempfile
from pathlib import Path

from boebot import flashing
from boebot.errors import BoardError
from boebot.image.program import read_program
from boebot.link.ports import open_serial
from tools.tests.calibration.program import image
from tools.tests.calibration.talk import START, Talk

BAUD = 500_000
ASK_AGAIN_S = 0.5  # while the bootloader waits, nobody hears
GREETING_S = 20.0
QUIET_S = 20.0  # no row takes as long


def flash(port: str) -> None:
    """Writes the calibration program into the board's flash; the EEPROM stays. Raises as `boebot.flashing.write`."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "calibration.elf")
        program.write_bytes(image())
        flashing.write(read_program(program).flash, port)


def listen(port: str) -> list[int | None]:
    """All rows, from a board that holds the program.

    Raises:
        BoardError: no such port, another program, or it stopped talking.
    """
    transport = open_serial(port, BAUD, baud_given=True)
    try:
        talk = Talk()
        begun = heard_at = transport.now()
        asked_at = begun - ASK_AGAIN_S
        while not talk.ended:
            now = transport.now()
            if now > (heard_at + QUIET_S if talk.heard_name else begun + GREETING_S):
                raise BoardError(f"the board at {port} does not talk; awaited: {talk.awaited}")
            if not talk.heard_name and now >= asked_at + ASK_AGAIN_S:
                transport.write(START)
                asked_at = now
            if data := transport.read(0.05):
                heard_at = transport.now()
                if answer := talk.hear(data):
                    transport.write(answer)
        return talk.values()
    finally:
        transport.close()
