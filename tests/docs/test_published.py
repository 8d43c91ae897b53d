"""What is published: each table of the pages has a command, and one command makes all of them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from uas_coverage_env.files.errors import InputError

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import publish
from marks import filled, pages, places

BENCHMARK = re.compile(r"python benchmarks/([a-z_]+\.py)")
TABLE = "| planner | energy |\n|---|---:|\n"


def test_each_measured_table_of_the_pages_has_one_command_and_each_command_its_table():
    stated = [mark for one in publish.figures_in().values() for mark in one.marks]
    assert sorted(stated) == sorted({mark for _, mark, _ in places()})


def test_commands_say_where_their_results_go_and_run_here():
    for name, figures in publish.figures_in().items():
        for command in (figures.command, figures.quick, *figures.fill):
            program = command.partition(" ")[0]
            assert program in ("", "python", "uas-coverage", "{command}"), name
            if program == "python":
                assert (publish.ROOT / command.split()[1]).exists(), name
        if figures.fill:
            assert "{out}" in figures.command, name


def test_each_benchmark_that_a_page_names_is_run():
    """But for those that fill pages or prepare a figure, and those that only a user runs."""
    named = {name for page in pages() for name in BENCHMARK.findall(page.read_text("utf-8"))}
    run_by = BENCHMARK.findall(publish.FIGURES.read_text("utf-8"))
    assert named - set(run_by) <= {"publish.py", "put_table.py"}


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of two figures; `again` counts how often they were made."""
    root = tmp_path / "project"
    (root / "benchmarks").mkdir(parents=True)
    (root / "docs").mkdir()
    (root / "README.md").write_text(page("first", "by hand"))
    other = page("second", "old") + "`python benchmarks/two.py`: 7\n"
    (root / "docs" / "page.md").write_text(other)
    (root / "benchmarks" / "one.py").write_text(
        f"open('again', 'a').write('1')\nprint({TABLE + '| `one` | 1 |'!r})\n"
    )
    (root / "benchmarks" / "two.py").write_text(
        "import pathlib, sys\n"
        "open('again', 'a').write('2')\n"
        "sys.exit(3 if pathlib.Path('broken').exists() else 0)\n"
    )
    (root / "benchmarks" / "put.py").write_text(
        "import pathlib, sys\n"
        "page = pathlib.Path(sys.argv[1]) / 'docs' / 'page.md'\n"
        "page.write_text(page.read_text().replace('(not filled yet)', 'NEW'))\n"
    )
    committed(root)
    figures = {
        "one": publish.Figures(
            command="python benchmarks/one.py", quick="python benchmarks/one.py --few",
            minutes=1, marks=("first",),
        ),
        "two": publish.Figures(
            command="python benchmarks/two.py", minutes=1, marks=("second",),
            fill=("python benchmarks/put.py {checkout}",),
        ),
    }  # fmt: skip
    monkeypatch.setattr(publish, "ROOT", root)
    monkeypatch.setattr(publish, "figures_in", lambda: figures)
    return root


def committed(root: Path) -> None:
    for words in ("init -q", "add .", "-c user.name=a -c user.email=a@b commit -qm all"):
        subprocess.run(["git", "-C", str(root), *words.split()], check=True)


def page(mark: str, content: str) -> str:
    return filled(f"# Page\n\n<!-- {mark} -->\n<!-- end of {mark} -->\n", content, mark)


def run(out: Path, **given) -> None:
    publish.main(**({"out": out, "only": "", "quick": False, "jobs": 1, "listed": False} | given))


def results(root: Path) -> dict:
    return json.loads((root / publish.RESULTS).read_text("utf-8"))


def test_pages_and_results_hold_what_the_commands_of_one_commit_made(project, tmp_path, capsys):
    run(tmp_path / "out")
    commit = publish._git(project, "rev-parse", "HEAD")
    found = results(project)
    assert found["commit"] == commit
    assert not found["quick"]
    assert set(found["tables"]) == {"README.md: first", "docs/page.md: second"}
    for where, table in found["tables"].items():
        name, _, mark = where.partition(": ")
        on_page = {m: text for p, m, text in places(project) if p == project / name}[mark]
        assert on_page == table["text"]
    first = found["tables"]["README.md: first"]
    assert first["text"] == f"`python benchmarks/one.py`\n\n{TABLE}| `one` | 1 |"
    assert first["command"] == "python benchmarks/one.py"
    assert found["tables"]["docs/page.md: second"]["text"] == "NEW"
    assert "to be read: docs/page.md:" in capsys.readouterr().out


def test_what_was_made_is_not_made_again_and_what_failed_is(project, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / "broken").touch()
    with pytest.raises(publish.typer.Exit):
        run(out)
    assert "two: ended with 3" in capsys.readouterr().err
    assert (out / "again").read_text() == "12"
    assert not (project / publish.RESULTS).exists()
    (out / "broken").unlink()
    run(out)
    run(out)
    assert (out / "again").read_text() == "122"


def test_the_commit_of_the_first_call_is_flown_whatever_is_changed_later(project, tmp_path):
    out = tmp_path / "out"
    run(out, only="one")
    commit = publish._git(project, "rev-parse", "HEAD")
    (project / "benchmarks" / "one.py").write_text("raise SystemExit(9)\n")
    run(out)
    assert results(project)["commit"] == commit


def test_what_is_not_committed_is_not_flown(project, tmp_path):
    (project / "benchmarks" / "one.py").write_text("print()\n")
    with pytest.raises(InputError, match=r"benchmarks/one\.py: is changed; commit it"):
        run(tmp_path / "out")


@pytest.mark.parametrize("given", [{"quick": True}, {"only": "one"}])
def test_a_part_or_a_quick_run_leaves_the_pages_alone(project, tmp_path, given):
    run(tmp_path / "out", **given)
    assert "by hand" in (project / "README.md").read_text()
    assert not (project / publish.RESULTS).exists()
    kept = results(tmp_path / "out" / "checkout")
    assert kept["quick"] == given.get("quick", False)
    assert kept["tables"]["README.md: first"]["command"].endswith(
        "--few" if kept["quick"] else "one.py"
    )


def test_a_page_that_is_not_filled_is_an_error(project, tmp_path):
    (project / "benchmarks" / "put.py").write_text("")
    committed(project)
    with pytest.raises(InputError, match=r"two: has not filled <!-- second --> of page\.md"):
        run(tmp_path / "out")
    assert "by hand" in (project / "README.md").read_text()


def test_names_of_figures_are_checked(project, tmp_path):
    with pytest.raises(InputError, match="--only"):
        run(tmp_path / "out", only="onne")
    with pytest.raises(InputError, match="--out: is missing"):
        run(None)
