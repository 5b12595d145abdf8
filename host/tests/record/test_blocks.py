"""The record of a run as a third party's program reads it: npm's @mcap/core, in node, by the schemas in the file."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.record.reading import attachments_of
from boebot.record.record_file import RecordReader
from boebot.record.run_folder import RECORD

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ROOT / "build" / "mcap-core"  # from package-lock.json in mcap_core
READER = Path(__file__).parents[1] / "mcap_core" / "read_record.cjs"
NODE = shutil.which("node", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}")
pytestmark = pytest.mark.skipif(
    NODE is None or not (PACKAGES / "node_modules").is_dir(), reason="@mcap/core comes with make bench"
)


def streams_of(record: Path) -> dict[str, dict[str, Any]]:
    """What boebot reads, in the form of read_record.cjs."""
    blocks: dict[str, list[Any]] = {}
    with record.open("rb") as file:
        for kept in RecordReader(file, str(record)).groups():
            for stream, block in kept.group.items():
                blocks.setdefault(stream, []).append(block)
    return {
        stream: {
            "messages": len(each),
            "rows": sum(len(block) for block in each),
            "times": sum_of(b"".join(block.times.astype("<f8").tobytes() for block in each)),
            "sizes": sum_of(
                b"".join(np.broadcast_to(block.sizes, len(block)).astype("<u4").tobytes() for block in each)
            ),
            "data": sum_of(b"".join(block.data for block in each)),
        }
        for stream, each in blocks.items()
    }


def sum_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def read_elsewhere(record: Path) -> dict[str, Any]:
    done = subprocess.run([str(NODE), READER, PACKAGES, record], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    read: dict[str, Any] = json.loads(done.stdout)
    return read


@pytest.mark.parametrize("robot", ["shieldbot-charging", "arsim"])
def test_another_reader_finds_the_same_rows_and_attachments(robot: str, tmp_path: Path) -> None:
    boebot.run("demo" if robot == "shieldbot-charging" else "wander", robot, seconds=5, out=tmp_path)
    read, expected = read_elsewhere(tmp_path / RECORD), streams_of(tmp_path / RECORD)
    assert read["streams"] == expected and expected["command"]["rows"] > 50
    assert read["messages_by_index"] == {stream: found["messages"] for stream, found in expected.items()}
    assert read["attachments"] == {name: sum_of(data) for name, data in attachments_of(tmp_path).items()}


def test_another_reader_refuses_a_changed_byte(tmp_path: Path) -> None:
    boebot.run("wander", seconds=1, out=tmp_path)
    record = tmp_path / RECORD
    data = bytearray(record.read_bytes())
    data[len(data) // 2] ^= 1
    record.write_bytes(data)
    done = subprocess.run([str(NODE), READER, PACKAGES, record], capture_output=True, text=True, check=False)
    assert done.returncode != 0
