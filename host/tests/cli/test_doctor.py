"""`boebot doctor`: a robot that is well, one with plugs pulled, a port that is missing, forbidden, held or silent."""

from __future__ import annotations

import json
import os
import socket
import sys
from pathlib import Path

import pytest

import boebot
import copied_process
from boebot import cli, load_robot
from boebot.boards import BoardRequest
from boebot.cli import doctor
from boebot.cli.board_link import board_link
from boebot.description.robots import robot_names


def examined(*arguments: str) -> tuple[int, dict[str, dict[str, str]]]:
    """The exit code, and each check by its part."""
    done = copied_process.command(["doctor", *arguments, "--json"], Path.cwd())
    assert done.stderr == ""
    answer = json.loads(done.stdout)
    assert answer["well"] == (done.returncode == 0) == all(check["well"] for check in answer["checks"])
    return done.returncode, {check["part"]: check for check in answer["checks"]}


@pytest.mark.parametrize(
    ("board", "robot"),
    [
        ("avr", "boebot"),
        *(("native", one.name) for one in map(load_robot, robot_names()) if one.has_board and one.takes_brain),
    ],
)
def test_robot_that_is_well_has_all_its_devices_examined(board: str, robot: str) -> None:
    code, found = examined(board, "--robot", robot)
    assert code == 0, [check for check in found.values() if not check["well"]]
    devices = {name for name, device in load_robot(robot).device.items() if device.on and device.READING is not None}
    assert devices <= set(found)
    assert found["kit"]["reads"].startswith(f"boebot {boebot.__version__}, ")
    assert ("image" in found) == (board == "avr")
    assert all(check["reads"] and not check["hint"] for check in found.values())


def test_device_without_its_plug_is_found(tmp_path: Path) -> None:
    bundled = (Path(__file__).parents[3] / "protocol" / "robots" / "boebot.toml").read_text(encoding="utf-8")
    robot = tmp_path / "mine.toml"
    assert "[device.compass]\n" in bundled
    robot.write_text(bundled.replace("[device.compass]\n", "[device.compass]\nplugged = false\n"), encoding="utf-8")
    code, found = examined("native", "--robot", str(robot))
    assert code == 1
    wrong = {part: check for part, check in found.items() if not check["well"]}
    assert set(wrong) == {"compass"}
    assert wrong["compass"]["reads"] == "no answer"
    assert wrong["compass"]["hint"] == "is it plugged in: power, ground, SDA and SCL to pins A4 and A5?"


def test_people_read_a_table_and_the_hints_below_it() -> None:
    done = copied_process.command(["doctor", "native", "--robot", "shieldbot-quad"], Path.cwd(), {"COLUMNS": "120"})
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1].startswith("all 1") and " well   whisker_left " in done.stdout
    done = copied_process.command(["doctor", "/dev/nothing"], Path.cwd(), {"COLUMNS": "120"})
    assert done.returncode == 1
    assert " look   port " in done.stdout and "\nport: is it plugged in? those there are: " in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals")
def test_port_is_missing_or_held() -> None:
    master, slave = os.openpty()
    port = os.ttyname(slave)
    try:
        code, found = examined("/dev/no-such-port")
        assert code == 1 and found["port"]["reads"] == "missing"
        code, found = examined(port)
        assert code == 1 and found["held by"]["reads"].startswith(f"process {os.getpid()} (")
    finally:
        os.close(slave)
        os.close(master)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs to become another user")
def test_port_of_another_user_is_forbidden(tmp_path: Path) -> None:
    master, slave = os.openpty()

    def work() -> None:
        os.setgroups([])
        os.setuid(65534)
        sys.argv = ["boebot", "doctor", os.ttyname(slave), "--json"]
        cli.main()

    try:
        Path(os.ttyname(slave)).chmod(0o600)
        done = copied_process.copied(work, Path("/"))
    finally:
        os.close(slave)
        os.close(master)
    assert done.returncode == 1, done.stderr
    (wrong,) = (check for check in json.loads(done.stdout)["checks"] if not check["well"])
    assert wrong["part"] == "permission" and wrong["hint"] == "its owner is another user"


def test_nobody_at_a_tcp_port_is_a_check_that_failed() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    code, found = examined(f"socket://127.0.0.1:{port}")
    assert code == 1 and found["link"]["reads"].endswith("cannot be opened: nobody listens there")


def test_what_is_no_board_is_one_sentence() -> None:
    no_boards = {("toaster",): "there is no board 'toaster'", ("native", "--robot", "arsim"): "has no board"}
    for arguments, sentence in no_boards.items():
        done = copied_process.command(["doctor", *arguments], Path.cwd())
        assert done.returncode == 1 and sentence in done.stderr and len(done.stderr.splitlines()) == 1


def test_image_that_is_not_the_kits_is_found() -> None:
    """The flash holds what another pin map's image is."""
    with board_link("avr", BoardRequest(robot=load_robot("shieldbot-quad"), record=False)) as (link, _):
        found = {check.part: check for check in doctor._firmware(link, load_robot("shieldbot"))}
    assert found["image"].reads not in found["image"].expected
    assert found["image"].hint == "if it is not meant, flash the kit's"
    assert not found["last reset"].hint


def test_device_that_is_switched_off_on_the_board_is_found() -> None:
    """The image's defaults have the battery off; the robot's description is not given to the board here."""
    with board_link("native", BoardRequest(robot=load_robot("shieldbot"), record=False)) as (link, _):
        found = {check.part: check for check in doctor._running(link, load_robot("shieldbot-charging"))}
    assert found["battery"].reads == "no reading" and found["battery"].hint.startswith("no fresh reading of it comes")
    assert not found["ping"].hint
