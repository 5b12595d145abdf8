"""Robot descriptions: the bundled ones load, wrong ones are refused in one sentence that names the place."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.description.robots import load_robot, robot_names
from boebot.devices.device import pin_name, pin_number
from boebot.devices.encoder import QuadratureEncoder
from boebot.errors import CallError, RobotError


def variant(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "variant.toml"
    file.write_text('extends = "shieldbot"\n' + text)
    return file


def test_bundled_robots_load_under_their_own_names() -> None:
    assert (
        {load_robot(name).name for name in robot_names()}
        == set(robot_names())
        >= {"shieldbot", "shieldbot-basic", "shieldbot-quad", "boebot"}
    )


def test_shieldbot_pins_are_those_of_the_default_map() -> None:
    pins = {name: device.pins() for name, device in load_robot("shieldbot").device.items()}
    assert pins["servo_left"] == {"": 13} and pins["servo_right"] == {"": 12}
    assert pins["infrared_left"] == {"led": 9, "receiver": 10} and pins["infrared_right"] == {"led": 2, "receiver": 3}
    assert pins["whisker_left"] == {"": 5} and pins["whisker_right"] == {"": 7} and pins["ping"] == {"": 8}
    assert pins["encoder_left"] == {"": 16} and pins["encoder_right"] == {"": 17}


def test_the_basic_shieldbot_is_wired_as_in_the_book() -> None:
    """Parallax, "Robotics with the Board of Education Shield for Arduino": chapters 5 to 7."""
    robot = load_robot("shieldbot-basic")
    pins = {name: device.pins() for name, device in robot.device.items() if device.on and name != "uart"}
    assert pins == {
        "servo_left": {"": 13},
        "servo_right": {"": 12},
        "whisker_left": {"": 5},
        "whisker_right": {"": 7},
        "infrared_left": {"led": 9, "receiver": 10},
        "infrared_right": {"led": 2, "receiver": 3},
        "infrared": {},
        "light_left": {"": 8},
        "light_right": {"": 6},
        "buzzer": {"": 4},
    }


def test_the_page_has_the_pins_of_every_map() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "robots.md").read_text()
    section = page[page.index("| device | `shieldbot`") :].partition("\n\n")[0].splitlines()
    before = page.partition("The same in all: ")[2].partition(".\n")[0].replace(", `", "; `").replace("\n", " ")
    same = [text.strip() for text in before.split(";")]
    head, _, *rows = [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in section]
    rows += [[text.split("` ")[0].strip(" `"), *[text.split("` ")[1]] * (len(head) - 1)] for text in same]
    for column, name in enumerate(head[1:], start=1):
        devices = {key: device for key, device in load_robot(name).device.items() if device.PINS}
        assert {row[0]: row[column] for row in rows if row[column] != "–"} == {
            key: pins if device.on else f"({pins})"
            for key, device in devices.items()
            for pins in [", ".join(f"{role} {pin_name(pin)}".strip() for role, pin in device.pins().items())]
        }


def test_quad_replaces_encoders_and_gives_up_their_pins() -> None:
    robot = load_robot("shieldbot-quad")
    assert isinstance(robot.device["encoder_left"], QuadratureEncoder)
    assert "battery" not in robot.device and "light_left" not in robot.device


def test_boebot_has_every_device_but_encoders_on_pins_of_its_own() -> None:
    robot = load_robot("boebot")
    assert "encoder_left" not in robot.device and "encoder_right" not in robot.device
    assert all(device.on for device in robot.device.values())
    pins = {name: device.pins() for name, device in robot.device.items()}
    assert pins["analog_infrared"] == {"": 16} and pins["battery"] == {"": 14}
    assert pins["compass"] == {"sda": 18, "scl": 19} and pins["turret"] == {"": 11} and pins["buzzer"] == {"": 4}
    assert pins["light_left"] == {"": 15} and pins["light_right"] == {"": 6}


def test_classic_robots_servos_run_on_the_pack_and_the_shieldbots_on_the_regulator() -> None:
    """A Boe-Bot's servos hang on its pack: owners measured 5.3 V idle, 4.6 V running (forums.parallax.com, 62527).
    Parallax's shield for the Arduino feeds them from its 5 V regulator."""
    supplies = {name: load_robot(name).supply for name in ("shieldbot", "shieldbot-basic", "shieldbot-quad", "boebot")}
    assert all(supply is not None for supply in supplies.values())
    assert {name: supply.servos for name, supply in supplies.items() if supply} == {
        "shieldbot": "regulated",
        "shieldbot-basic": "regulated",
        "shieldbot-quad": "regulated",
        "boebot": "pack",
    }
    assert load_robot("arsim").supply is None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[supply]\nfull_v = 4.0", r"variant\.toml:3: supply\.full_v is 4; expected more than empty_v, 5 V"),
        ("[supply]\nservos = 'mains'", "servos"),
        (
            "[device.buzzer]\ntype = 'buzzer'\npin = 5",
            r"variant\.toml:4: device\.buzzer\.pin: whisker_left and buzzer cannot share pin 5",
        ),
        (
            "remove = ['compass']\n[device.feeler]\ntype = 'whisker'\npin = 'A5'\nroot_m = [0, 0]\ntip_m = [1, 0]",
            "device.feeler is whisker; expected the name whisker_left or whisker_right, which the firmware knows; ",
        ),
        (
            "remove = ['light_right']\n[device.horn]\ntype = 'buzzer'\npin = 6",
            "device.horn is buzzer; expected the name buzzer",
        ),
        ("[device.ping]\npin = 7", r"variant\.toml:3: device\.ping\.pin is pin 7, which cannot do that; expected 8"),
        (
            "[device.servo_left]\npin = 20",
            r"variant\.toml:3: device\.servo_left\.pin: there is no pin 20; expected 0..13 or 'A0'..'A5'",
        ),
        (
            "[device.servo_left]\npin = 13\nwidth_us = 3",
            "servo_left: there is no key 'width_us' here; expected on, plugged, pin",
        ),
        ("[body]\nmass_kg = -1.0", "body.mass_kg: expected float > 0"),
        ("[body]\nmass_kg = 'heavy'", "body.mass_kg: expected float, got str"),
        ("remove = ['wings']", "removes device 'wings'"),
        ("[body", "no valid TOML"),
        ("[body]\nmass_kg = inf", "body.mass_kg: expected a finite number"),
        ("[device.infrared_left]\nheading_rad = nan", "device.infrared_left.heading_rad: expected a finite number"),
        ("remove = 'ping'", "remove: expected a list of devices, got 'ping'"),
        (
            "remove = ['uart']",
            'device.uart is missing or off; the kit\'s firmware needs it; or firmware = "none" for a robot that runs',
        ),
        ("[device.servo_left]\non = false", r"variant\.toml:2: device\.servo_left is missing or off"),
        ("[device.light_right]\npin = 10", "light_right.pin is pin 10, which cannot do that; expected 0, 1, 2"),
        (
            "remove = ['light_right']\n[device.whisker_left]\npin = 6",
            "whisker_left is whisker on pin 6, but in the firmware for pin map 'shieldbot' it is whisker on pin 5",
        ),
        ("scheme = 'arsim'", r"variant\.toml:\d+: scheme is 'arsim', which only a robot without a board can have$"),
        ("pin_map = 'shieldbot-quad'", "device.encoder_left is encoder on pin A2, but in the firmware"),
    ],
)
def test_wrong_description_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(RobotError, match=sentence):
        load_robot(variant(tmp_path, text))


@pytest.mark.parametrize("text", ["extends = 5", "device = 5", "extends = 'shieldbot'\ndevice = 5"])
def test_wrong_type_at_the_top_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "odd.toml"
    file.write_text(text)
    with pytest.raises(RobotError, match=r"odd\.toml: (extends|device): expected"):
        load_robot(file)


PROGRAMS = 'firmware = "none"\nremove = ["uart", "encoder_left"]\n'


def test_a_robot_of_programs_has_any_device_on_any_pin_under_any_name(tmp_path: Path) -> None:
    """What only the kit's firmware needs binds no robot that does not run it: names, its pins, timers, devices that are
    off, those that are always there; and devices that only hear share a pin."""
    robot = load_robot(
        variant(
            tmp_path,
            PROGRAMS
            + "[device.servo_left]\npin = 6\n"  # light_right's, which is off
            + "[device.encoder_right]\npin = 13\n"
            + "[device.horn]\ntype = 'buzzer'\npin = 6\n"
            + "[device.ping_rear]\ntype = 'ping'\npin = 2\nposition_m = [0, 0]\nheading_rad = 3.0\nbeam_rad = 0.7\n"
            + "range_min_m = 0.02\nrange_max_m = 3.0\nperiod_ticks = 5\n"
            + "[device.infrared_right]\non = false",
        )
    )
    assert not robot.takes_brain and robot.device["servo_left"].pins() == {"": 6}
    with pytest.raises(CallError, match=r"expected a program of your own: boebot run FILE --robot shieldbot$"):
        robot.expect_kit()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[device.ping]\npin = 7", r"variant\.toml:5: device\.ping\.pin: whisker_right and ping cannot share pin 7$"),
        ("[device.ping]\npin = 20", "there is no pin 20"),
        (
            "[device.battery]\non = true\npin = 4",
            r"variant\.toml:6: device\.battery\.pin is pin 4, which cannot do that; expected A0, A1, A2, A3, A4, A5$",
        ),
    ],
)
def test_what_hurts_any_board_is_refused_in_a_robot_of_programs_too(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(RobotError, match=sentence):
        load_robot(variant(tmp_path, PROGRAMS + text))


def test_a_robot_without_a_board_runs_no_programs(tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text("extends = 'arsim'\nfirmware = 'none'")
    with pytest.raises(RobotError, match=r"lab\.toml:2: firmware is 'none', but a robot without a board runs none"):
        load_robot(file)


def test_device_may_be_switched_off(tmp_path: Path) -> None:
    robot = load_robot(variant(tmp_path, "[device.ping]\non = false"))
    assert not robot.has("ping") and robot.has("infrared_left")


def test_unknown_robot_names_the_known_ones() -> None:
    known = r"arsim, arsim-1\.2, boebot, roller, roller-charging, rover, "
    with pytest.raises(RobotError, match=rf"there is no robot 'dalek'; expected one of {known}"):
        load_robot("dalek")


def test_robot_that_extends_itself_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "loop.toml"
    file.write_text(f"extends = '{file}'")
    with pytest.raises(RobotError, match="extends itself"):
        load_robot(file)


def test_pin_names_and_numbers_are_inverse() -> None:
    assert [pin_number(pin_name(n) if n > 13 else n) for n in range(20)] == list(range(20))
