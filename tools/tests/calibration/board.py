"""The rows measured on a board behind a serial port: flashed by avrdude, then asked."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from boebot.errors import BoardError
from boebot.link.ports import open_serial
from tools.tests.calibration.program import flash_hex
from tools.tests.calibration.talk import START, Talk

BAUD = 500_000
UPLOAD_BAUD = 115_200  # of the Uno's bootloader
UPLOAD_TIMEOUT_S = 60.0  # a lost byte lets avrdude try for minutes
ASK_AGAIN_S = 0.5  # while the bootloader waits, nobody hears
GREETING_S = 20.0
QUIET_S = 20.0  # no row takes as long


def flash(port: str) -> None:
    """Writes the calibration program into the board's flash, through its bootloader; the EEPROM stays.

    Raises:
        BoardError: avrdude is missing, fails, or takes too long.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "calibration.hex")
        program.write_text(flash_hex(), encoding="ascii")
        command = ["avrdude", "-p", "atmega328p", "-c", "arduino", "-b", str(UPLOAD_BAUD), "-P", port, "-D"]
        try:
            done = subprocess.run(
                [*command, "-U", f"flash:w:{program}:i"],
                capture_output=True,
                text=True,
                check=False,
                timeout=UPLOAD_TIMEOUT_S,
            )
        except OSError as error:
            raise BoardError(f"avrdude, which flashes the board, cannot be run: {error.strerror}") from error
        except subprocess.TimeoutExpired:
            raise BoardError(f"avrdude did not end within {UPLOAD_TIMEOUT_S:.0f} s; is the board at {port}?") from None
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        said = next((line for line in lines if "avrdude" in line), "it said nothing")
        raise BoardError(f"avrdude could not flash the board at {port}: {said.strip()}")


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
