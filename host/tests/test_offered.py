"""What a package offers is what it imports from its own files."""

from __future__ import annotations

from types import ModuleType

import pytest

from boebot import arenas, behaviors, brain, cognition, navigation


@pytest.mark.parametrize(
    ("package", "names"),
    [
        (arenas, {"Arena", "load_arena"}),
        (behaviors, {"Avoid", "Klinotaxis"}),
        (brain, {"Brain", "maximum"}),
        (cognition, {"Odometry", "near"}),
        (navigation, {"Potential", "search"}),
    ],
)
def test_a_package_offers_its_own_classes_and_functions(package: ModuleType, names: set[str]) -> None:
    assert names <= set(package.__all__)


@pytest.mark.parametrize("package", [arenas, behaviors, brain, cognition, navigation])
def test_it_offers_neither_its_files_nor_what_others_have(package: ModuleType) -> None:
    homes = {getattr(getattr(package, name), "__module__", "a file") for name in package.__all__}
    assert {home.rpartition(".")[0] for home in homes} == {package.__name__}
