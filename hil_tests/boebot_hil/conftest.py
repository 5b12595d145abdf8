"""One suite for every board: `boebot test --on native --on avr` (the default: both), or `--on /dev/ttyACM0`; in a
checkout also `pytest hil_tests --uno-on native`.

Tests that reach for the board's pins, its reset or its EEPROM carry the mark `emulated`; on a board behind a port they
are skipped, and so is whatever would move its motors, unless `--motors` (`--uno-motors`) allows it.
"""

from __future__ import annotations

import pytest

from boebot.boards import is_live
from boebot.errors import BoebotError
from boebot_hil.rig import Rig
from sim_bridge.bench.uno import Uno, Wanted, open_uno
from sim_bridge.bench.waiting import Cannot

EMULATED = "only an emulated board gives its pins, its reset, its EEPROM"
START_S = 4.0  # from a real board's reset to its first hello: a boot loader waits for one to three of them


def pytest_configure(config: pytest.Config) -> None:
    for mark in (
        "promise(heading, words...): what it proves, in the words of PROTOCOL.md",
        "emulated: reaches for what only an emulated board gives: its pins, its reset, its EEPROM",
    ):
        config.addinivalue_line("markers", mark)
    Rig.may_move = config.getoption("--uno-motors")


def boards(config: pytest.Config) -> list[str]:
    return config.getoption("--uno-on") or ["native", "avr"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """On several given boards the plugin runs them."""
    if "uno" in metafunc.fixturenames and not metafunc.config.getoption("--uno-on"):
        metafunc.parametrize("uno", boards(metafunc.config), indirect=True)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """A board behind a port has to answer.

    Raises:
        UsageError: it does not.
    """
    for url in filter(is_live, boards(config)) if items and not config.option.collectonly else ():
        try:
            with open_uno(url, Wanted(robot="shieldbot", motors=False)) as uno:
                Rig(uno).next_hello(within_s=START_S)
        except AssertionError:
            firmware = f"expected its firmware: boebot flash --on {url}"
            raise pytest.UsageError(f"the board at {url} does not speak the kit's protocol; {firmware}") from None
        except BoebotError as error:
            raise pytest.UsageError(str(error)) from None


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Raises Cannot where only an emulated board can be asked, and the board under test is another."""
    params: dict[str, str] = item.callspec.params if hasattr(item, "callspec") else {}
    if item.get_closest_marker("emulated") and is_live(params.get("uno", boards(item.config)[0])):
        raise Cannot(EMULATED)


@pytest.fixture
def rig(uno: Uno) -> Rig:
    """The board, greeted."""
    rig = Rig(uno)
    rig.start()
    return rig
