"""The notebooks of docs/notebooks: kept without outputs, and run by a real kernel of Jupyter. `make test` runs them in
one kernel, the sweep with few runs, what is watched for a second; `make soak` runs each as it stands."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_notebook

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "notebooks"
PATHS = sorted(FOLDER.glob("*.ipynb"))
NAMES = [path.stem for path in PATHS]
LONGEST_S = 150
SHORTER = {"RUNS = 1000 ": "RUNS = 60 ", "seconds=30, seed=1, view=True": "seconds=1, seed=1, view=True"}

HASH = """
import hashlib
from boebot.view import replay
print(hashlib.sha256(replay.page_text([result]).encode()).hexdigest())
"""
SEVERAL = """
import boebot
robots = [boebot.Member(brain="wander", robot="arsim", pose=(x, 0.0, 0.0)) for x in (0.0, 1.0)]
boebot.run_together(robots, arena="empty", seconds=0.5).replay()
"""


def read(name: str) -> NotebookNode:
    return nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)


def code_of(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


# ---- as files --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_is_kept_without_outputs(name: str) -> None:
    notebook = read(name)
    nbformat.validate(notebook)
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code_of(notebook))
    assert {*notebook.metadata} == {"kernelspec", "language_info"} and notebook.metadata.kernelspec.name == "python3"
    assert all(cell.metadata == {} for cell in notebook.cells)
    text = (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
    assert text == nbformat.writes(notebook) + "\n", "saved otherwise than Jupyter saves it"


@pytest.mark.parametrize("name", NAMES)
def test_links_lead_somewhere(name: str) -> None:
    for cell in read(name).cells:
        if cell.cell_type == "markdown":
            for target in re.findall(r"\]\(([^)#\s]+)", cell.source):
                assert (FOLDER / target).exists(), f"{name}: {target} is not there"


@pytest.mark.parametrize("name", NAMES)
def test_each_axis_has_its_unit(name: str) -> None:
    labels = [label for cell in code_of(read(name)) for label in re.findall(r'[xy]label="([^"]*)"', cell.source)]
    assert labels and [label for label in labels if not re.search(r" \((m|s|1|%)\)$", label)] == []


# ---- run -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kernel_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where kernels work, with none of the settings that the user has made for Jupyter."""
    folder = tmp_path_factory.mktemp("jupyter")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR"):
            patch.setenv(name, str(folder / name))
        patch.delenv("MPLBACKEND", raising=False)
        yield folder


def shorter(source: str) -> str:
    for long, short in SHORTER.items():
        source = source.replace(long, short)
    return source


def run(notebook: NotebookNode, folder: Path) -> None:
    """Runs it in a kernel of its own; what a cell raises is raised here."""
    client = NotebookClient(
        notebook, kernel_name="python3", timeout=LONGEST_S, resources={"metadata": {"path": str(folder)}}
    )
    client.execute()


@pytest.fixture(scope="module")
def outputs(kernel_folder: Path) -> dict[str, list[Any]]:
    """Of each cell, by "NOTEBOOK/CELL". A notebook begins without the names of the one before."""
    cells = {}
    for name in NAMES:
        if cells:
            cells[f"before {name}"] = new_code_cell("%reset -f")
        for cell in code_of(read(name)):
            cells[f"{name}/{cell.id}"] = new_code_cell(shorter(cell.source))
        if name == "first-drive":
            cells[f"{name}/hash"] = new_code_cell(HASH)
    cells["several"] = new_code_cell(SEVERAL)
    run(new_notebook(cells=[*cells.values()]), kernel_folder)
    return {name: cell.outputs for name, cell in cells.items()}


class Frame(HTMLParser):
    """The attributes of the iframe that a piece of HTML consists of."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.feed(html)
        self.close()
        assert self.tags == ["iframe", "/iframe"]

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes = {name: value or "" for name, value in attributes}

    def handle_endtag(self, tag: str) -> None:
        self.tags.append(f"/{tag}")

    def handle_data(self, data: str) -> None:
        self.tags.append(data)


def test_replay_is_shown_below_its_cell(outputs: dict[str, list[Any]]) -> None:
    (shown,) = outputs["first-drive/replay"]  # one output: no path below it
    assert shown.output_type == "display_data" and {*shown.data} == {"text/html", "text/plain"}
    attributes = Frame(shown.data["text/html"]).attributes
    assert hashlib.sha256(attributes["srcdoc"].encode()).hexdigest() == outputs["first-drive/hash"][0].text.strip()
    assert attributes["sandbox"] == "allow-scripts", "the page must not reach the notebook around it"
    assert "src" not in attributes, "no file, no server"
    (shown,) = outputs["several"]
    assert "wander on arsim" in Frame(shown.data["text/html"]).attributes["srcdoc"]


def test_figures_are_shown(outputs: dict[str, list[Any]]) -> None:
    for cell in ("first-drive/picture", "first-drive/plot", "thousand-runs/one", "thousand-runs/figure",
                 "why-it-turned/overview", "why-it-turned/picture", "why-it-turned/place"):  # fmt: skip
        (shown,) = outputs[cell]
        assert "image/png" in shown.data, cell


def test_figure_is_as_large_as_the_picture_of_a_result(outputs: dict[str, list[Any]]) -> None:
    (shown,) = outputs["first-drive/picture"]
    assert shown.metadata["image/png"]["width"] == 806  # 8.4 inches of 96 pixels


def test_tables_are_shown(outputs: dict[str, list[Any]]) -> None:
    for cell in ("first-drive/readings", "why-it-turned/switches", "why-it-turned/sensors", "why-it-turned/utility"):
        assert outputs[cell][0].data["text/html"].count("<tr") > 5, cell


def test_sweep_says_how_long_it_took(outputs: dict[str, list[Any]]) -> None:
    assert re.fullmatch(r"60 runs, \d\.\d km, in \d+\.\d s\n", outputs["thousand-runs/runs"][0].text)
    assert "RUNS = 1000 " in next(cell.source for cell in read("thousand-runs").cells if cell.id == "parameters")


def test_live_view_is_a_link(outputs: dict[str, list[Any]]) -> None:
    link, said = outputs["first-drive/watch"]
    address = r"http://127\.0\.0\.1:\d+/\?token=[\w-]+"
    assert re.fullmatch(rf'<a href="{address}" target="_blank" rel="noopener">[\w ]+</a>', link.data["text/html"])
    assert re.fullmatch(f"watch it: {address}", link.data["text/plain"])
    assert said.text == "touched 0 times by hand\n"


def test_nothing_warns(outputs: dict[str, list[Any]]) -> None:
    said = {name: [one.text for one in shown if one.get("name") == "stderr"] for name, shown in outputs.items()}
    assert {name: texts for name, texts in said.items() if texts} == {}


@pytest.mark.soak
@pytest.mark.parametrize("name", NAMES)
def test_whole_notebook_runs(name: str, kernel_folder: Path) -> None:
    run(read(name), kernel_folder)
