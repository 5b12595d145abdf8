"""`boebot timing --port`: the board's own maxima over a pseudo-terminal, and only of the image that is judged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from boebot import resources
from boebot.errors import TimingError
from boebot.image.elf import read_image
from boebot.link.messages import Identity
from boebot_timing.board import check_image
from sim_bridge.tests.test_served import boebot, served

IMAGE = resources.folder("images") / "shieldbot.elf"
CHECK = bytes(range(256))
CRC = 0x29058C73  # of these 256 bytes, as zlib's documentation and every CRC-32 calculator gives it


@pytest.mark.wall_clock
@pytest.mark.soak
def test_board_on_a_port_is_judged_by_its_own_image_only(tmp_path: Path) -> None:
    changed = tmp_path / "changed.elf"
    code = read_image(IMAGE).code
    whole = IMAGE.read_bytes()
    place = whole.index(code[:64]) + 0x400
    changed.write_bytes(whole[:place] + bytes((whole[place] ^ 1,)) + whole[place + 1 :])
    with served("avr", "--pty") as (url, _):
        done = boebot("timing", "--no-measure", "--json", "--port", url, "--seconds", "0.2")
        assert done.returncode in (0, 1), done.stderr
        image = json.loads(done.stdout)["image"]
        found = {row["name"]: row["board_max_cycles"] for row in image["tasks"]}
        responses = {row["name"]: row["response_bound_cycles"] for row in image["tasks"]}
        assert all(0 < found[name] <= responses[name] for name in ("whisker", "safety", "telemetry"))
        refused = boebot("timing", "--no-measure", "--port", url, "--elf", str(changed))
        assert refused.returncode == 2 and refused.stdout == ""
        assert f"runs another image ({len(code)} bytes with CRC-32 " in refused.stderr
        assert "than changed.elf (" in refused.stderr and refused.stderr.count("\n") == 1


@pytest.mark.parametrize(("size", "crc"), [(256, CRC), (0, 0)], ids=["the same", "no flash"])
def test_same_image_is_accepted(size: int, crc: int) -> None:
    check_image(Identity(b"", b"", b"", size, crc), CHECK, "image.elf", "avr")


@pytest.mark.parametrize(("size", "crc"), [(256, CRC ^ 1), (255, CRC)], ids=["other bytes", "shorter"])
def test_another_image_is_refused(size: int, crc: int) -> None:
    with pytest.raises(TimingError, match=r"expected the same: flash it, name the board's own with --elf"):
        check_image(Identity(b"", b"", b"", size, crc), CHECK, "image.elf", "avr")
