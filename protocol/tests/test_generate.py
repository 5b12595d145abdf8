"""The made files are fresh, and the golden frames agree with independent libraries."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from cobs import cobs

PROTOCOL = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PROTOCOL))

import reference_frame  # noqa: E402
import schema  # noqa: E402

GOLDEN = json.loads((PROTOCOL / "vectors" / "frames.json").read_text())


def test_made_files_are_fresh() -> None:
    run = subprocess.run([sys.executable, PROTOCOL / "generate.py", "--check"], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout


def test_every_message_has_golden_frames() -> None:
    assert {row["message"] for row in GOLDEN} == {message.name for message in schema.load().message}


@pytest.mark.parametrize("row", GOLDEN, ids=lambda row: f"{row['message']}-{row['sequence']}")
def test_golden_frame_unpacks_with_an_independent_cobs_and_polynomial_division(row: dict[str, Any]) -> None:
    frame = bytes.fromhex(row["frame"])
    assert frame[0] == frame[-1] == 0 and 0 not in frame[1:-1]
    stuffed, check = frame[1:-4], frame[-4:-1]
    assert cobs.decode(stuffed) == bytes([int(row["id"]), int(row["sequence"])]) + bytes.fromhex(row["payload"])
    # The CRC is the remainder of (seed·x^(8n) + data)·x^21 over GF(2): long division with Python's integers.
    bits = 8 * len(stuffed)
    dividend = (int.from_bytes(stuffed, "big") << 21) ^ (int(row["seed"]) << bits)
    divisor = 1 << 21 | reference_frame.POLYNOMIAL
    while dividend.bit_length() > 21:
        dividend ^= divisor << (dividend.bit_length() - 22)
    assert all(byte & 0x80 for byte in check)
    assert dividend == (check[0] & 0x7F) << 14 | (check[1] & 0x7F) << 7 | check[2] & 0x7F


def test_schema_refuses_a_number_used_twice(tmp_path: Path) -> None:
    text = (PROTOCOL / "messages.toml").read_text().replace("id = 0x12", "id = 0x11")
    (tmp_path / "messages.toml").write_text(text)
    with pytest.raises(ValueError, match="0x11 used twice"):
        schema.load(tmp_path / "messages.toml")


def test_hash_ignores_explanations_and_sees_layout(tmp_path: Path) -> None:
    original = (PROTOCOL / "messages.toml").read_text()
    file = tmp_path / "messages.toml"
    file.write_text(original.replace('doc = "Asks for the identity."', 'doc = "Asks who it is."'))
    assert schema.load(file).hash == schema.load().hash
    file.write_text(original.replace('name = "answers_tick", type = "u16"', 'name = "answers_tick", type = "i16"', 1))
    assert schema.load(file).hash != schema.load().hash


def test_hash_ignores_what_a_minor_version_adds(tmp_path: Path) -> None:
    """A message, a parameter, flags and values at the end; without `since` each would be another version."""
    original = (PROTOCOL / "messages.toml").read_text()
    count = len(schema.load().parameter)
    added = {
        "minor = 0": "minor = 1",
        '\n[[parameter]]\nname = "devices"': '\n[[message]]\nname = "more"\nid = 0x9E\ndirection = "to_host"\n'
        'delivery = "telemetry"\ndoc = ""\nsince = 1\nfields = [{ name = "x", type = "u8" }]\n'
        '\n[[parameter]]\nname = "devices"',
        '"latched_again", "busy"]': '"latched_again", "busy", "tired"]\nsince = { tired = 1 }',
        "max = 2047": "max = 4095",
    }
    text = original
    for before, after in added.items():
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    text += f'\n[[parameter]]\nname = "mood"\nid = {count}\ntype = "u16"\nunit = ""\ndoc = ""\nmin = 0\nmax = 1\n'
    file = tmp_path / "messages.toml"
    file.write_text(text + "since = 1\n")
    spec, ours = schema.load(file), schema.load()
    assert spec.hash == ours.hash and spec.version_byte == ours.version_byte + 1
    assert [spec.message_hash(m) for m in ours.message] == [ours.message_hash(m) for m in ours.message]
    for mark in ("since = { tired = 1 }", "since = 1\nfields", "since = 1\n"):
        file.write_text((text + "since = 1\n").replace(mark, mark.partition("fields")[1]))
        assert schema.load(file).hash != ours.hash, mark
