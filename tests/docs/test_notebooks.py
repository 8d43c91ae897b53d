"""The lessons in docs/lessons run from top to bottom, and are kept without what they print."""

import ast
import re

import nbformat
import pytest
from markdown_blocks import ROOT
from matplotlib import pyplot
from matplotlib.figure import Figure
from nbclient import NotebookClient

from uas_coverage_env.compiled.progress import NOTICE

NOTEBOOKS = sorted((ROOT / "docs" / "lessons").glob("*.ipynb"))
SECONDS_FOR_A_CELL = 600  # the longest takes half a minute; a busy machine several times that
MACHINE_PATH = re.compile(r"/(?:home|Users|private|var)/|\b[A-Z]:\\")
INLINE = "%matplotlib inline\n"
IN_A_KERNEL = {"1_vehicle_and_battery", "4_learn_and_compare"}
"""As a reader runs them: the first one, and the one that trains, which alters its process."""
SHORTER = {
    "2_milp_blocks": {
        "relative_gap=0.01)": "relative_gap=0.5)",
        '"horizon": 12}))': '"horizon": 12}), max_steps=12)',
    },
    "3_village_mission": {
        "rollout(village, planner,": "rollout(village, planner, max_steps=12,",
        "map_figure(flight, step=60)": "map_figure(flight, step=10)",
    },
    "4_learn_and_compare": {
        "total_timesteps=120_000": "total_timesteps=8_000",
        '"agent=each",': '"agent=each", "rounds=2",',
        "missions=4": "missions=2",
        "range(2000, 2006)": "range(2000, 2002)",
    },
    "5_own_area": {"height_m=60.0": "height_m=100.0"},
    "6_own_vehicle": {'rollout(field, "nearest-waypoint")': 'rollout(field, "hover", max_steps=9)'},
    "7_own_planner": {"range(30, 35)": "range(30, 31)"},
    "8_wind_and_faults": {"[0.0, 2.0, 4.0, 6.0]": "[0.0, 6.0]", "range(12)": "range(2)"},
    "9_reading_flights": {"range(5, 11)": "range(5, 7)"},
}
"""What is cut short in a lesson, where it takes long: all cells run, on less of the same."""
PRIVATE_NAME = re.compile(r"(?:[.,(]|\bimport)\s*_(?!_)\w+")


def name_of(path):
    return path.stem


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def cut_short(notebook, name):
    for long, short in SHORTER.get(name, {}).items():
        (cell,) = [cell for cell in code_cells(notebook) if long in cell.source]
        cell.source = cell.source.replace(long, short)


def test_there_are_nine_lessons_and_pages_lead_to_them():
    assert "".join(path.name[0] for path in NOTEBOOKS) == "123456789"
    text = (ROOT / "docs" / "quickstart.md").read_text(encoding="utf-8")
    assert all(f"(lessons/{path.name})" in text for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name_of)
def test_a_notebook_is_committed_without_what_it_printed(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    for cell in code_cells(notebook):
        assert cell.outputs == []
        assert cell.execution_count is None
    for cell in notebook.cells:
        assert cell.metadata == {}
        assert not MACHINE_PATH.search(cell.source)
    # who opens it elsewhere has another kernel, and other versions
    assert notebook.metadata.kernelspec.name == "python3"
    assert notebook.metadata.language_info == {"name": "python"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name_of)
def test_a_notebook_uses_public_names_only(path):
    for cell in code_cells(nbformat.read(path, as_version=4)):
        assert not PRIVATE_NAME.search(cell.source)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name_of)
def test_the_links_of_a_notebook_lead_somewhere(path):
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type == "markdown":
            for target in re.findall(r"\]\(([^)#\s]+)", cell.source):
                assert (path.parent / target).exists(), target


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in NOTEBOOKS if p.stem in IN_A_KERNEL], ids=name_of)
def test_a_notebook_runs_from_top_to_bottom_without_a_warning(path, tmp_path, monkeypatch):
    # nothing of the person's own settings, and nothing left behind
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path / "runtime"))
    folder = tmp_path / "lesson"
    folder.mkdir()
    notebook = nbformat.read(path, as_version=4)
    cut_short(notebook, path.stem)
    NotebookClient(
        notebook,
        timeout=SECONDS_FOR_A_CELL,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
    ).execute()
    outputs = [output for cell in code_cells(notebook) for output in cell.outputs]
    warned = "".join(output.text for output in outputs if output.get("name") == "stderr")
    told = NOTICE.partition("{")[0]  # a fresh machine compiles
    lines = [line for line in warned.splitlines() if told not in line]
    assert lines == []
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in NOTEBOOKS if p.stem not in IN_A_KERNEL], ids=name_of)
def test_the_cells_of_a_notebook_run_one_after_the_other(path, tmp_path, monkeypatch):
    """In this process: a kernel would import everything again for each lesson."""
    drawn = []
    pyplot.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pyplot, "show", lambda: drawn.append(pyplot.gcf()) or pyplot.close())
    notebook = nbformat.read(path, as_version=4)
    cut_short(notebook, path.stem)
    names = {"__name__": "lesson"}
    for cell in code_cells(notebook):
        statements = ast.parse(cell.source.replace(INLINE, ""))
        shown = statements.body.pop() if isinstance(statements.body[-1], ast.Expr) else None
        exec(compile(statements, cell.id, "exec"), names)
        if isinstance(shown, ast.Expr):
            value = eval(compile(ast.Expression(shown.value), cell.id, "eval"), names)
            if isinstance(value, Figure):
                value.canvas.draw()
                drawn.append(value)
    assert len(drawn) >= 3
