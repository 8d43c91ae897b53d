"""Every equation of the paper's planner has its home in the code, under the paper's label."""

import ast
import re
from pathlib import Path

import pytest
import uas_coverage_baselines.milp_mpc as package

PACKAGE = Path(package.__file__).parent
GOLDEN = Path(__file__).parents[1] / "golden"
LABEL = re.compile(r"\b(OCP_\d|OF|const_(?:CS|Vec)_\w+?)\b(?!\w)")

# which block's module says in its first line which constraint it is
HOMES = {
    "OCP_1": {"dynamics"},
    "OCP_3": {"capabilities", "collision"},
    "OCP_4": {"slack"},
    "OCP_5": {"geofence"},
    "OCP_6": {"obstacles", "moving_obstacles"},
    "OCP_7": {"target_distance"},
    "OCP_8": {"coverage"},
    "const_CS_out": {"separation"},
    "const_Vec_lb": {"separation"},
}
NOT_IN_THE_PAPER = {"separation", "time_to_go", "min_height"}
# which classes are written by which formulation of Sec. III-B
FORMULATIONS = {
    "const_CS_in": {"InsideGeofence"},
    "const_CS_out": {"Obstacles"},
    "const_Vec_ub": {"BatteryReserve", "Capabilities", "Coverage", "TargetDistance", "TimeToGo"},
    "const_Vec_lb": {"Collision", "MovingObstacles"},
}
IN_THE_PAPER = {*HOMES, *FORMULATIONS, "OF"}


def blocks():
    """Syntax tree of each block by module name."""
    return {
        path.stem: ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted((PACKAGE / "model" / "blocks").glob("*.py"))
        if path.stem != "__init__"
    }


def docstring(node):
    return ast.get_docstring(node) or ""


@pytest.mark.parametrize("label", HOMES)
def test_a_constraint_is_named_by_the_first_line_of_its_own_module(label):
    first_lines = {name: docstring(tree).partition("\n")[0] for name, tree in blocks().items()}
    named = {name for name, line in first_lines.items() if label in LABEL.findall(line)}
    assert named == HOMES[label]


@pytest.mark.parametrize("label", FORMULATIONS)
def test_a_block_says_by_which_formulation_it_is_written(label):
    named = {
        node.name
        for tree in blocks().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and label in LABEL.findall(docstring(node))
    }
    assert named == FORMULATIONS[label]


def test_every_block_names_its_section_of_the_paper():
    for name, tree in blocks().items():
        text = docstring(tree) + "".join(
            docstring(node) for node in tree.body if isinstance(node, ast.ClassDef)
        )
        assert re.search(r"Sec\. III-C\.\d", text) or name in NOT_IN_THE_PAPER, name


def test_no_label_is_cited_that_the_paper_does_not_have():
    cited = {
        label
        for path in PACKAGE.rglob("*.py")
        for label in LABEL.findall(path.read_text(encoding="utf-8"))
    }
    assert cited == IN_THE_PAPER


def test_every_label_stands_at_the_head_of_a_golden_file():
    heads = "".join(
        line
        for path in GOLDEN.glob("*.lp")
        for line in path.read_text(encoding="utf-8").splitlines()
        if line.startswith("\\")
    )
    assert IN_THE_PAPER - {"OF"} <= set(LABEL.findall(heads))
