"""What was typed once is answered with what is typed now, and works no more."""

import re
import shlex
from pathlib import Path

import pytest

from uas_coverage_env.cli import main, retired
from uas_coverage_env.cli.retired import FOLLOWERS

ROOT = Path(__file__).parents[2]
PLACES = ("uas_coverage_env", "baselines", "agents", "benchmarks", "docs", ".ci")
READ = {".md", ".py", ".toml", ".ipynb", ".yml", ".sh", ".ts", ""}


@pytest.mark.parametrize(("old", "new"), FOLLOWERS.items(), ids=FOLLOWERS)
def test_what_was_typed_once_is_answered_with_what_is_typed_now(old, new, capsys):
    assert main([*old.split(), "village"]) == 2
    out, said = capsys.readouterr()
    assert out == ""
    assert said.startswith(f"error: `uas-coverage {old}` is `uas-coverage {new}` now; see ")
    assert said.count("\n") == 1


@pytest.mark.parametrize("old", FOLLOWERS)
def test_the_help_that_an_answer_names_is_there(old, capsys):
    (named,) = re.findall(r"see `uas-coverage (.+)`$", retired.follower(*old.split()))
    assert main(shlex.split(named)) == 0
    assert "Usage" in capsys.readouterr().out


def test_an_option_that_was_typed_once_is_known_wherever_it_stands(capsys):
    assert main(["score", "--level", "easy", "--players", "hover"]) == 2
    assert "is `uas-coverage score --planners` now" in capsys.readouterr().err


def test_a_word_that_never_was_a_command_has_no_follower(capsys):
    assert main(["fronts"]) == 2
    assert "now; see" not in capsys.readouterr().err


def test_no_page_and_no_file_of_ours_names_a_command_that_is_typed_no_more():
    commands = sorted({old.split()[0] for old in FOLLOWERS if "--" not in old})
    former = re.compile(rf"uas-coverage ({'|'.join(commands)})\b")
    files = [path for name in PLACES for path in (ROOT / name).rglob("*")]
    files += [path for path in ROOT.glob("*.md") if path.name != "CHANGELOG.md"]
    files = [
        path
        for path in files
        if path.suffix in READ and path.is_file() and "_generated" not in path.parts
    ]
    assert len(files) > 500
    found = {
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in files
        for match in former.finditer(path.read_text("utf-8", errors="replace"))
    }
    assert found == set()
