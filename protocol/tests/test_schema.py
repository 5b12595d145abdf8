"""What the schema demands of messages.toml: each rule, broken once, is refused by a sentence that names the place."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest

PROTOCOL = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PROTOCOL))

import schema  # noqa: E402

TEXT = (PROTOCOL / "messages.toml").read_text()
TODAY = schema.load()
# An id of one bit that no message to the board has yet, and two of several bits to either side.
SINGLE, FREE, FREE_TO_HOST = (
    next(number for number in numbers if number not in {message.id for message in TODAY.message})
    for numbers in ((0x40, 0x20, 0x04), range(0x7E, 0x60, -1), range(0xFE, 0xE0, -1))
)
LONGEST = max(message.length for message in TODAY.of_direction("to_board"))


def message(
    name: str, fields: str, delivery: str = "telemetry", direction: str = "to_board", number: int = FREE
) -> str:
    return (
        f'\n[[message]]\nname = "{name}"\nid = {number}\ndirection = "{direction}"\n'
        f'delivery = "{delivery}"\ndoc = ""\nfields = [{fields}]\n'
    )


def parameter(type_: str = "u16", least: int = 0, greatest: int = 10, number: int = -1, name: str = "extra") -> str:
    number = number if number >= 0 else len(TODAY.parameter)
    return (
        f'\n[[parameter]]\nname = "{name}"\nid = {number}\ntype = "{type_}"\nunit = ""\ndoc = ""\n'
        f"min = {least}\nmax = {greatest}\ndefault = 1\n"
    )


def load(folder: Path, extra: str, text: str = TEXT) -> schema.Schema:
    (folder / "messages.toml").write_text(text + extra)
    return schema.load(folder / "messages.toml")


NUMBER = '{ name = "number", type = "u8" }'
VALUE = '{ name = "value", type = "u8" }'
LONG = f'{{ name = "text", type = "text[{LONGEST + 9}]" }}'  # as long as no message to the board
LIVES = '{ name = "time_to_live", type = "u16" }'
ANSWERS = '{ name = "answers_tick", type = "u16" }'


@pytest.mark.parametrize(
    "extra",
    [
        message("ask", f"{NUMBER}, {VALUE}", "exactly_once"),
        message("move", f"{LONG}, {LIVES}, {ANSWERS}", "set_point"),
        message("greet", LONG, "handshake"),
        message("tell", VALUE, direction="to_host", number=FREE_TO_HOST),
        parameter(),
        parameter("i16", -5, 5),
    ],
)
def test_what_keeps_the_rules_is_accepted(tmp_path: Path, extra: str) -> None:
    assert load(tmp_path, extra).hash != schema.load().hash


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        (message("ask", f"{VALUE}, {NUMBER}", "exactly_once"), "ask: .*its first field must be number"),
        (message("ask", "", "exactly_once"), "ask: .*its first field must be number"),
        (message("move", f"{VALUE}, {ANSWERS}, {LIVES}", "set_point"), "move: .*must end with time_to_live and"),
        (message("move", f"{LIVES}, {ANSWERS}, {VALUE}", "set_point"), "move: .*must end with time_to_live and"),
        (message("move", ANSWERS, "set_point"), "move: .*must end with time_to_live and"),
        (message("greet", VALUE, "handshake"), "greet: of the handshake, so no other message to_board may be as long"),
        (
            message("say", '{ name = "x", type = "u16" }, { name = "y", type = "u8" }', number=SINGLE),
            f"say: a wrong bit .* id {SINGLE:#04x}, .* as long as stop",
        ),
        (message("say", VALUE, "perhaps"), "say: unknown delivery 'perhaps'"),
        (message("say", VALUE, number=FREE_TO_HOST), "say: ids from 0x80 on are for messages to the host"),
        (message("say", VALUE, direction="to_host"), "say: ids from 0x80 on are for messages to the host"),
        (message("say", VALUE, number=0x08), "message: 0x8 used twice"),
        (message("stop", VALUE), "message: stop used twice"),
        (message("say", '{ name = "x", type = "u64" }'), "say: field x has unknown type 'u64'"),
        (message("say", '{ name = "x", type = "u8", flags = "moods" }'), "say: field x names unknown flags 'moods'"),
        (message("say", '{ name = "x", type = "u8", enum = "moods" }'), "say: field x names unknown enum 'moods'"),
        (
            message("say", VALUE) + f"since = {TODAY.minor + 1}\n",
            f"message say: since minor version {TODAY.minor + 1}; expected 0 to minor, {TODAY.minor}",
        ),
        (parameter("u32"), "parameter extra: type 'u32'"),
        (parameter("u8"), "parameter extra: type 'u8'"),
        (parameter("u16", -1, 5), "parameter extra: -1 to 5 is no range"),
        (parameter("u16", 5, 5), "parameter extra: 5 to 5 is no range"),
        (parameter("i16", 0, 32768), "parameter extra: 0 to 32768 is no range"),
        (parameter("i16", 0, 5), "parameter extra: the firmware tells the types apart by the minimum's sign"),
        (parameter("u16", 32768, 40000), "parameter extra: the firmware tells the types apart"),
        (parameter("u16", 5, 6), "parameter extra: its default is not within its range"),
        (parameter(number=100), "parameter ids must count from 0 without gaps"),
        (parameter(name="bandgap"), "parameter: bandgap used twice"),
    ],
)
def test_what_breaks_a_rule_is_refused(tmp_path: Path, extra: str, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        load(tmp_path, extra)


def test_a_file_that_is_no_toml_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"^messages.toml: no valid TOML: "):
        load(tmp_path, "\n[flags")


def test_devices_without_a_robot_part_are_refused() -> None:
    table = tomllib.loads(TEXT)
    table["flags"]["devices"]["device"].append("radio")
    with pytest.raises(ValueError, match="flags devices: expected one device for each bit"):
        schema.checked(table, "messages.toml")


def with_devices(count: int, *parameters: str) -> schema.Schema:
    """Today's schema with that number of devices, and with parameters of these names besides `devices`."""
    table = tomllib.loads(TEXT)
    names = [f"device_{i}" for i in range(count)]
    table["flags"]["devices"] = {"doc": "", "type": "u32", "bits": names, "device": names}
    for name in parameters:
        number = len(table["parameter"])
        table["parameter"].append({"name": name, "id": number, "type": "u16", "unit": "flags", "doc": ""})
    return schema.checked(table, "messages.toml")


BOTH = "devices and more_devices"


def test_devices_fill_one_parameter_and_then_a_second() -> None:
    for count, more, ranges in (
        (1, (), [1]),
        (16, (), [0xFFFF]),
        (17, ("more_devices",), [0xFFFF, 1]),
        (32, ("more_devices",), [0xFFFF, 0xFFFF]),
    ):
        found = [p.max for p in with_devices(count, *more).parameter if p.name in ("devices", "more_devices")]
        assert found == ranges
    for count, more, wanted in ((16, ("more_devices",), "devices"), (17, (), BOTH), (33, ("more_devices",), BOTH)):
        sentence = f"flags devices has {count} bits; expected 32 at most, 16 each in the parameters {wanted}$"
        with pytest.raises(ValueError, match=sentence):
            with_devices(count, *more)


EIGHT = '{ name = "x", type = "text[8]" }'


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        (message("say", ""), ["padding"]),
        (message("move", f'{{ name = "x", type = "text[5]" }}, {LIVES}, {ANSWERS}', "set_point"),
         ["x", "padding", "time_to_live", "answers_tick"]),
        (message("tell", EIGHT, direction="to_host", number=FREE_TO_HOST), ["x", "padding"]),
        (message("tell", EIGHT.replace("8", "9"), direction="to_host", number=FREE_TO_HOST), ["x"]),
    ],
)  # fmt: skip
def test_a_message_as_long_as_one_of_the_handshake_gets_a_byte_more(
    tmp_path: Path, text: str, fields: list[str]
) -> None:
    """`identify` has no byte, `open` 9 and `description` 8."""
    found = load(tmp_path, text).message[-1]
    assert [field.name for field in found.fields] == fields
    alike = {m.delivery for m in TODAY.of_direction(found.direction) if m.length == found.length}
    assert "handshake" not in alike


@pytest.mark.parametrize(
    ("field", "sentence"),
    [
        ('{ name = "x", type = "u8", colour = "red" }', "there is no key 'colour' here; expected name, type, unit"),
        ('{ name = "x" }', "type is missing"),
        ('{ name = "x", type = 8 }', "type: expected str, got 8"),
        ('{ name = "x", type = "u8", min = 0.5 }', "min: expected int, got 0.5"),
        ("8", "expected dict, got 8"),
    ],
)
def test_a_key_that_nobody_reads_or_a_value_of_another_type_is_refused(
    tmp_path: Path, field: str, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        load(tmp_path, message("say", field))
