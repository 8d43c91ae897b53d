"""The commands in the blocks of the pages are run one after the other, in a folder of their own.

As they stand, but where a mission, a sweep or a training would take minutes: these are cut short.
"""

from io import StringIO
from itertools import pairwise

import pytest
from markdown_blocks import PAGES, ROOT, blocks, command_lines, save_files
from numba import cuda
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon
from uas_coverage_baselines.reproduction import command as reproduction

from uas_coverage_env import generate_scenario
from uas_coverage_env.cli import main

QUICK = {"nearest-waypoint", "lawnmower", "learned-velocity"}
FILMED = ["--steps", "72"]  # of what is flown quickly, where the page makes films of it
SOON = "time_limit_s=0.5"  # of the paper's program, which else takes what it takes
ALONE = ["--jobs", "1"]  # else each of them starts processes of its own
SHORTER = {
    "run": ["--steps", "1"],
    "reproduce": ["--steps", "1", "--seeds", "0:1", *ALONE],
    "score": ["--missions", "1", "--planners", "nearest-waypoint"],
    "train": ["--steps", "64", "--missions", "1", "--set", "rounds=1", "--baselines", "none"],
}
COMPARED = {"--scenarios": "open_field", "--planners": "nearest-waypoint", "--seeds": "0:1"}
VARIED = {"--planners": "lawnmower", "--vary": "filter=true"}
DONE, FAILED, REFUSED = 0, 1, 2


def shortened(words, filmed=False):
    """The command, cut short where it would take minutes."""
    if words[0] == "run" and any(word in QUICK for word in words):
        return [*words, *FILMED] if filmed else words
    if words[0] == "run" and "milp-mpc-paper" in words:
        limited = [SOON if word.startswith("time_limit_s=") else word for word in words]
        words = limited if SOON in limited else [*words, "--option", SOON]
    if words[0] == "compare":
        instead = {**COMPARED, **(VARIED if "--vary" in words else {})}
        return [*(instead.get(option, word) for option, word in pairwise(["", *words])), *ALONE]
    return [*words, *SHORTER.get(words[0], [])]


def commands_of(page):
    """The words of our commands in the blocks of a page, without the program's name."""
    return [words[1:] for words in command_lines(page, inline=False) if words[0] == "uas-coverage"]


PAGES_WITH_COMMANDS = [page for page in PAGES if commands_of(page)]


@pytest.mark.slow
@pytest.mark.usefixtures("bounds_found_soon")
@pytest.mark.parametrize("page", PAGES_WITH_COMMANDS, ids=lambda p: str(p.relative_to(ROOT)))
def test_the_commands_of_a_page_run_one_after_the_other(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    # what is watched is watched in the terminal
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
        monkeypatch.delenv(name, raising=False)
    # nobody is timed here, so nothing has to be compiled before the first decision
    monkeypatch.setattr(MovingHorizon, "warm_up", lambda planner, scenario: None)
    monkeypatch.setattr(reproduction, "_QUICK_CAP_S", 0.2)  # of each of a dozen programs
    # what the reader brings along: a scenario of one's own, and what the page says to save
    save_files(page, tmp_path)
    generate_scenario(seed=1, n_uas=1, n_waypoints=4, n_obstacles=2).to_file("my_area.toml")
    for block in blocks(page):
        if block.language == "toml" and block.text.startswith("schema"):
            (tmp_path / "garden.toml").write_text(block.text, encoding="utf-8")
    commands = commands_of(page)
    filmed = any({"--gif", "--video"} & set(words) for words in commands)
    for words in commands:
        words = shortened(words, filmed)
        if words[0] == "stream":  # to vehicles that are not there: up to its question
            monkeypatch.setattr("sys.stdin", StringIO("no\n"))
            assert main(words) == REFUSED
            assert "vehicles would arm and take off" in capsys.readouterr().err
            continue
        if "cuda" in words and not cuda.is_available():
            assert main(words) == REFUSED
            assert "training on a GPU: " in capsys.readouterr().err
            continue
        # a planner may fail its mission, and the text may say so; the command has done its work
        assert main(words) in (DONE, FAILED), f"{words}: {capsys.readouterr().err}"
