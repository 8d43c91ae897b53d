"""What is published: each table of the pages has a command, and one command makes all of them."""

import hashlib
import json
import re
import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console
from rich.table import Table

from uas_coverage_env.files.errors import InputError

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import publish
from marks import filled, markdown, pages, places

SHALLOW = "the history is not here (a shallow clone)"
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
            labels = set(re.findall(r"--(?:option|vary) ([a-z-]+):", command))
            flown = re.search(r"--planners (\S+)", command)
            assert labels <= set(flown[1].split(",") if flown else ()), name
            if program == "python":
                assert (publish.ROOT / command.split()[1]).exists(), name
        if figures.fill:
            assert "{out}" in figures.command, name


def test_each_benchmark_that_a_page_names_is_run():
    """But for those that fill pages or prepare a figure, and one that needs a GPU."""
    named = {name for page in pages() for name in BENCHMARK.findall(page.read_text("utf-8"))}
    run_by = BENCHMARK.findall(publish.FIGURES.read_text("utf-8"))
    assert named - set(run_by) <= {"publish.py", "put_table.py", "gpu.py"}


def faults_of(kept: dict, root: Path, stated: dict[str, publish.Figures]) -> list[str]:
    """Where pages and commands are not those of `docs/published.json`."""
    on_pages = {
        f"{path.relative_to(root).as_posix()}: {mark}": text for path, mark, text in places(root)
    }
    faults = []
    for name, made in kept["figures"].items():
        if name not in stated or made["source"] != stated[name].source(kept["quick"]):
            faults.append(f"{name}: has another command than published.toml")
        for where, text in made["tables"].items():
            if on_pages.get(where) != text:
                faults.append(f"{where}: is not what {name} made")
    for name, expected in kept["files"].items():
        if hashlib.sha256((root / name).read_bytes()).hexdigest() != expected:
            faults.append(f"{name}: is not what was made")
    if kept["quick"]:
        faults.append("is of fewer missions")
    wanted = {name for name, one in stated.items() if not one.elsewhere}
    if wanted <= set(kept["figures"]):  # else it is being flown
        made = {where for one in kept["figures"].values() for where in one["tables"]}
        from_elsewhere = {mark for one in stated.values() if one.elsewhere for mark in one.marks}
        faults += [
            f"{where}: is of another state"
            for where in sorted(set(on_pages) - made)
            if where.partition(": ")[2] not in from_elsewhere
        ]
    return faults


@pytest.mark.skipif(not (publish.ROOT / publish.RESULTS).exists(), reason="not flown yet")
def test_pages_have_what_the_commands_made_of_one_commit_of_their_history():
    kept = json.loads((publish.ROOT / publish.RESULTS).read_text("utf-8"))
    assert not faults_of(kept, publish.ROOT, publish.figures_in())
    if not (publish.ROOT / ".git").exists():
        pytest.skip("no history")
    if publish._git(publish.ROOT, "rev-parse", "--is-shallow-repository") == "true":
        pytest.skip(SHALLOW)
    assert publish._is_known(publish.ROOT, kept["commit"])


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project of two figures; `again` counts how often they were made."""
    root = tmp_path / "project"
    (root / "benchmarks").mkdir(parents=True)
    (root / "docs").mkdir()
    (root / "README.md").write_text(page("first", "by hand"))
    other = page("second", "old") + "`python benchmarks/two.py`: 7\n"
    (root / "docs" / "rules.md").write_text(other)
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
        "page = pathlib.Path(sys.argv[1]) / 'docs' / 'rules.md'\n"
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
    usual = {"only": "", "quick": False, "jobs": 1, "anew": False, "listed": False}
    publish.main(**({"out": out} | usual | given))


def tables_of(kept: dict) -> dict[str, str]:
    return {where: t for one in kept["figures"].values() for where, t in one["tables"].items()}


def results(root: Path) -> dict:
    return json.loads((root / publish.RESULTS).read_text("utf-8"))


def test_pages_and_results_hold_what_the_commands_of_one_commit_made(project, tmp_path, capsys):
    run(tmp_path / "out")
    kept = results(project)
    assert kept["commit"] == publish._git(project, "rev-parse", "HEAD")
    assert not kept["quick"]
    assert tables_of(kept) == {
        "README.md: first": f"`python benchmarks/one.py`\n\n{TABLE}| `one` | 1 |",
        "docs/rules.md: second": "NEW",
    }
    assert kept["figures"]["one"]["command"] == "python benchmarks/one.py"
    assert kept["figures"]["one"]["machine"]
    assert faults_of(kept, project, publish.figures_in()) == []
    assert "to be read: docs/rules.md:" in capsys.readouterr().out


def test_files_that_a_command_writes_are_copied_and_later_ones_find_them(project, tmp_path):
    kept = flown_with_files(project, tmp_path)
    assert (project / "docs" / "picture.txt").read_text() == "drawn"
    assert set(kept["files"]) == {"docs/picture.txt"}


def test_a_star_stands_for_what_a_command_has_made(project, tmp_path, monkeypatch):
    figures = publish.figures_in()
    fill = ("python benchmarks/one.py", "python benchmarks/count.py {out}/*")
    several = figures["one"].model_copy(update={"fill": fill, "marks": ()})
    monkeypatch.setattr(publish, "figures_in", lambda: {"one": several})
    (project / "benchmarks" / "count.py").write_text("import sys\nprint(sys.argv[1:])\n")
    committed(project)
    out = tmp_path / "out"
    for name in ("b", "a"):
        (out / "one" / name).mkdir(parents=True)
    run(out)
    assert (out / "one.fill.txt").read_text() == "['one/a', 'one/b']\n"


def flown_with_files(project, tmp_path) -> dict:
    with (project / "benchmarks" / "one.py").open("a") as script:
        script.write(
            "import pathlib\n"
            "docs = pathlib.Path(__file__).parents[1] / 'docs'\n"
            "(docs / 'picture.txt').write_text('drawn')\n"
        )
    committed(project)
    run(tmp_path / "out", only="one")
    return results(project)


def test_a_clone_of_what_was_committed_goes_on_with_the_rest_from_the_same_commit(
    project, tmp_path, monkeypatch
):
    first = publish._git(project, "rev-parse", "HEAD")
    run(tmp_path / "out", only="one")
    (project / "benchmarks" / "two.py").write_text("raise SystemExit(9)\n")
    committed(project)
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "-q", str(project), str(clone)], check=True)
    monkeypatch.setattr(publish, "ROOT", clone)
    run(tmp_path / "other")
    kept = results(clone)
    assert kept["commit"] == first
    assert (tmp_path / "other" / "again").read_text() == "2"
    assert set(kept["figures"]) == {"one", "two"}
    assert faults_of(kept, clone, publish.figures_in()) == []


def test_a_clone_has_the_files_that_figures_made_elsewhere(project, tmp_path, monkeypatch):
    flown_with_files(project, tmp_path)
    committed(project)
    run(tmp_path / "other")
    assert (tmp_path / "other" / "checkout" / "docs" / "picture.txt").read_text() == "drawn"


def test_a_command_that_is_another_now_is_flown_again(project, tmp_path, monkeypatch):
    out = tmp_path / "out"
    run(out, only="one")
    figures = publish.figures_in()
    other = figures["one"].model_copy(update={"command": "python benchmarks/one.py --more"})
    monkeypatch.setattr(publish, "figures_in", lambda: figures | {"one": other})
    assert faults_of(results(project), project, publish.figures_in()) == [
        "one: has another command than published.toml"
    ]
    (out / "one").mkdir()
    run(out, only="one")
    assert (out / "again").read_text() == "11"
    assert not (out / "one").exists()  # what another command has begun
    assert faults_of(results(project), project, publish.figures_in()) == []


def test_results_of_a_commit_that_is_not_in_the_history_are_refused(project, tmp_path):
    run(tmp_path / "out", only="one")
    kept = results(project)
    (project / publish.RESULTS).write_text(json.dumps(kept | {"commit": "0" * 40}))
    with pytest.raises(InputError, match=r"is of 00000000, which is not in the history"):
        run(tmp_path / "other")
    with pytest.raises(InputError, match=r"has flights of [0-9a-f]{8}, and docs/published.json of"):
        run(tmp_path / "out")


def test_anew_begins_again_from_the_commit_that_is_checked_out(project, tmp_path):
    run(tmp_path / "out")
    (project / "benchmarks" / "one.py").write_text("print('other')\n")
    committed(project)
    with pytest.raises(InputError, match=r"--anew: .* has flights of a commit"):
        run(tmp_path / "out", anew=True)
    run(tmp_path / "other", anew=True, only="one")
    kept = results(project)
    assert kept["commit"] == publish._git(project, "rev-parse", "HEAD")
    assert tables_of(kept) == {"README.md: first": "`python benchmarks/one.py`\n\nother"}


def test_tables_that_are_drawn_on_a_terminal_are_tables_of_the_page():
    table = Table("rule", "home", "share", title="Which")
    table.add_row("fly", "95 %", "")
    table.add_section()
    table.add_row("wait", "none", "≤ 3 %")
    console = Console(file=StringIO(), width=200)
    console.print("on 5 missions", table, "the end")
    assert markdown(console.file.getvalue()) == (
        "on 5 missions\nWhich\n\n"
        "| rule | home | share |\n| --- | --- | ---: |\n"
        "| fly | 95 % |  |\n| wait | none | ≤ 3 % |\n\nthe end"
    )
    assert markdown(TABLE) == TABLE.strip()


@pytest.mark.parametrize(
    ("edit", "fault"),
    [
        (("README.md", "| 1 |", "| 2 |"), "README.md: first: is not what one made"),
        (("docs/rules.md", "NEW", "OLD"), "docs/rules.md: second: is not what two made"),
        (("docs/picture.txt", "drawn", "redrawn"), "docs/picture.txt: is not what was made"),
    ],
)
def test_a_table_that_is_edited_is_found(project, tmp_path, edit, fault):
    flown_with_files(project, tmp_path)
    run(tmp_path / "out")
    path, old, new = edit
    (project / path).write_text((project / path).read_text().replace(old, new))
    assert faults_of(results(project), project, publish.figures_in()) == [fault]


def test_a_table_beside_those_that_were_flown_is_found(project, tmp_path):
    run(tmp_path / "out")
    with (project / "README.md").open("a") as readme:
        readme.write(page("third", "by hand"))
    faults = faults_of(results(project), project, publish.figures_in())
    assert faults == ["README.md: third: is of another state"]


def test_what_was_made_is_not_made_again_and_what_failed_is(project, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / "broken").touch()
    with pytest.raises(publish.typer.Exit):
        run(out)
    assert "two: ended with 3" in capsys.readouterr().err
    assert (out / "again").read_text() == "12"
    assert set(results(project)["figures"]) == {"one"}
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


def test_a_quick_run_leaves_the_pages_alone_and_goes_on_where_it_was(project, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        run(out, quick=True)
    assert "by hand" in (project / "README.md").read_text()
    assert not (project / publish.RESULTS).exists()
    kept = results(out / "checkout")
    assert kept["quick"]
    assert kept["figures"]["one"]["command"].endswith("--few")
    assert (out / "again").read_text() == "12"
    assert faults_of(kept, out / "checkout", publish.figures_in()) == ["is of fewer missions"]


def test_figures_of_another_machine_are_made_where_they_are_named(project, tmp_path, monkeypatch):
    figures = publish.figures_in()
    elsewhere = figures["two"].model_copy(update={"elsewhere": True})
    monkeypatch.setattr(publish, "figures_in", lambda: figures | {"two": elsewhere})
    run(tmp_path / "out")
    assert set(results(project)["figures"]) == {"one"}
    assert faults_of(results(project), project, publish.figures_in()) == []
    run(tmp_path / "out", only="two")
    assert set(results(project)["figures"]) == {"one", "two"}


def test_a_page_that_is_not_filled_is_an_error(project, tmp_path, capsys):
    (project / "benchmarks" / "put.py").write_text("")
    committed(project)
    with pytest.raises(publish.typer.Exit):
        run(tmp_path / "out")
    assert "two: has not filled <!-- second --> of rules.md" in capsys.readouterr().err
    assert "old" in (project / "docs" / "rules.md").read_text()


def test_names_of_figures_are_checked(project, tmp_path):
    with pytest.raises(InputError, match="--only"):
        run(tmp_path / "out", only="onne")
    with pytest.raises(InputError, match="--out: is missing"):
        run(None)
