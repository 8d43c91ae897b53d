"""The documentation: it builds, its code runs, its commands and the names that it cites exist."""

import re
import tomllib

import pytest
import typer
from markdown_blocks import PAGES, ROOT, blocks, command_lines, save_files
from typer.core import TyperGroup

from uas_coverage_env.cli.app import command_group
from uas_coverage_env.env.observation import OBSERVATION
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.flight import load_planner
from uas_coverage_env.flight.directory import FLIGHT_COLUMNS
from uas_coverage_env.leaderboard import planner_specs_of
from uas_coverage_env.scenario import Scenario, load_scenario

DOCS = ROOT / "docs"
PLACEHOLDERS = {"NAME"}
PAPER_MAP = (DOCS / "nomenclature.md").read_text(encoding="utf-8").partition("\n## Symbols\n")[0]
WITH_CODE = [page for page in PAGES if any(b.language == "python" for b in blocks(page))]
WITH_COMMANDS = [page for page in PAGES if any(command_lines(page))]


def shown(page):
    return str(page.relative_to(ROOT))


def test_the_site_builds_without_a_warning_and_holds_every_page(site):
    pages = [*DOCS.glob("*.md"), *DOCS.glob("api/*.md")]
    assert len(pages) > 30
    for page in pages:
        assert (site / page.relative_to(DOCS)).with_suffix(".html").is_file()


def test_the_site_fetches_nothing(site):
    fetched = re.compile(r"<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=\"(?:https?:)?//[^\"]*")
    found = {path.name: fetched.findall(path.read_text()) for path in site.rglob("*.html")}
    assert len(found) > 15
    assert not any(found.values()), found
    styles = [path for path in site.rglob("*.css") if "url(http" in path.read_text()]
    assert styles == []


def test_the_page_of_observations_has_every_feature_of_the_default_one(site):
    text = (site / "observations.html").read_text()
    for group in OBSERVATION:
        for feature in group.features:
            assert f"{group.name}.{feature.name}" in text


def test_formulas_are_drawn_by_the_browser(site):
    text = (site / "formulation.html").read_text()
    assert "<math" in text
    assert "$$" not in text


@pytest.mark.usefixtures("bounds_found_soon")
@pytest.mark.parametrize("page", WITH_CODE, ids=shown)
def test_the_python_blocks_of_a_page_run_one_after_the_other(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_files(page, tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    names = {"__name__": "page"}
    for block in blocks(page):
        if block.language == "python":
            code = compile(block.text, f"{shown(page)}, block of line {block.line}", "exec")
            if not block.long:
                exec(code, names)


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=shown)
def test_the_command_line_understands_every_command_of_a_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_files(page, tmp_path)
    for words in command_lines(page):
        if words[0] == "uas-coverage":
            understood(words)
        elif words[0] == "python" and words[1].endswith(".py"):
            assert (ROOT / words[1]).is_file(), words


def understood(words):
    """Parse a command as the program does, and ask that planners and their options exist."""
    command, context, rest = command_group(), None, words[1:]
    while True:
        if rest == [] and context is not None:
            return  # a text that names a command without what it needs
        context = command.make_context(words[0], list(rest), parent=context)
        rest = [*context._protected_args, *context.args]
        if not isinstance(command, TyperGroup) or not rest:
            break
        _, command, rest = command.resolve_command(context, rest)
    given = context.params
    if command.name == "run":
        options = dict(option.split("=", 1) for option in given["option"] or ())
        if given["planner"] not in PLACEHOLDERS and not given["planner"].startswith("policy:"):
            load_planner(given["planner"], options)
        if not given["scenario"].endswith((".toml", ".json")):
            load_scenario(given["scenario"])
    if command.name == "compare":
        named = ",".join(given["planners"]).split(",")
        shipped = [planner for planner in named if "policy:" not in planner]
        planner_specs_of(shipped, given["option"] or ())


def test_a_command_that_does_not_exist_would_be_noticed():
    with pytest.raises(typer.TyperException):
        understood(["uas-coverage", "run", "village", "--no-such-option"])
    with pytest.raises(typer.TyperException):
        understood(["uas-coverage", "fly", "village"])
    with pytest.raises(ValueError, match="no option"):
        understood(["uas-coverage", "run", "village", "--planner", "hover", "--option", "wings=2"])


def test_toml_blocks_of_scenarios_are_valid_scenarios():
    found = [
        (shown(page), block)
        for page in PAGES
        for block in blocks(page)
        if block.language == "toml" and block.text.startswith("schema")
    ]
    assert found
    for page, block in found:
        parse(tomllib.loads(block.text), Scenario, page)


@pytest.mark.parametrize("page", PAGES, ids=shown)
def test_links_to_files_lead_somewhere(page):
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    for target in re.findall(r"(?<!!)\[[^\]]*\]\(([^)#\s]+)[^)]*\)", prose):
        if ":" not in target:  # else on the web, or made by the build, which checks it
            assert (page.parent / target).exists(), target


def test_every_name_of_the_paper_map_stands_where_it_says():
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAPER_MAP.splitlines()
        if line.startswith("|") and "`" in line
    ]
    assert len(rows) > 30
    for what, _, _, names, places, _ in rows:
        words = set()
        for place in re.findall(r"`([^`]*)`", places):
            path = place.replace("milp_mpc/", "baselines/uas_coverage_baselines/milp_mpc/")
            path = path if path.startswith("baselines") else f"uas_coverage_env/{path}"
            words |= set(re.findall(r"\w+", (ROOT / path).read_text(encoding="utf-8")))
        missing = set(re.findall(r"`(\w+)`", names)) - words
        assert not missing, f"{what}: {missing} not in {places}"


def test_every_row_of_the_paper_map_has_a_verdict_and_a_test_that_exists():
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in PAPER_MAP.splitlines()
        if line.startswith("|") and not line.startswith(("| paper |", "|---"))
    ]
    assert {row[2] for row in rows} == {"faithful", "ours", "missing"}
    for what, _, verdict, names, _, proof in rows:
        if verdict == "missing":
            assert not names, what
            continue
        file, _, test = proof.strip("`").partition("::")
        assert f"def {test}(" in (ROOT / "tests" / file).read_text(encoding="utf-8"), what


def test_the_columns_of_a_flight_are_described_in_their_order():
    text = (DOCS / "flight_directory.md").read_text(encoding="utf-8")
    table = text.partition("## `flight.csv`")[2].partition("## ")[0]
    cells = re.findall(r"^\|([^|]*)\|", table, re.MULTILINE)
    assert tuple(re.findall(r"`(\w+)`", " ".join(cells))) == FLIGHT_COLUMNS
