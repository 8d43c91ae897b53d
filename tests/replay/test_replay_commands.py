"""`uas-coverage replay` and `figure`, in this process: what they write, and what they refuse."""

import re
import shutil
import sys
from pathlib import Path

import pytest

from uas_coverage_env.cli import main


@pytest.fixture
def directory(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return flight.save(tmp_path / "flown")


def without_line(n):
    def change(text):
        lines = text.splitlines(keepends=True)
        return "".join(lines[:n] + lines[n + 1 :])

    return change


def refused(capsys, *command: str) -> str:
    assert main(list(command)) == 2
    out, err = capsys.readouterr()
    assert out == "", "nothing is said to have been made"
    assert err.startswith("error: ")
    assert err.count("\n") == 1, err
    return err


def test_replay_writes_a_page_into_the_flight_and_again(directory, capsys):
    for _ in range(2):
        assert main(["replay", "flown"]) == 0
        assert capsys.readouterr().out.startswith("page in flown/replay.html (")
    first = (directory / "replay.html").read_text(encoding="utf-8")
    assert "village, nearest-waypoint" in first


def test_a_page_of_two_flights_leaves_the_pages_of_each_alone(directory, flight, tmp_path, capsys):
    flight.save(tmp_path / "other")
    for name in ("flown", "other"):
        assert main(["replay", name]) == 0
    alone = {page: page.read_bytes() for page in tmp_path.glob("*/replay.html")}
    assert len(alone) == 2
    capsys.readouterr()
    assert main(["replay", "flown", "other"]) == 0
    assert capsys.readouterr().out.startswith("page in flown/replay_with_other.html (")
    assert len((directory / "replay_with_other.html").read_bytes()) > max(map(len, alone.values()))
    assert {page: page.read_bytes() for page in alone} == alone


def test_replay_writes_a_film_but_not_over_another(directory, capsys):
    command = ["replay", "flown", "--gif", "film.gif", "--fps", "50"]
    assert main(command) == 0
    assert "film in film.gif (" in capsys.readouterr().out
    assert "film.gif: exists" in refused(capsys, *command)


@pytest.mark.parametrize("kind", ["map", "battery", "modes", "decision-time"])
def test_figure_writes_a_pdf_into_the_flight(kind, directory, capsys):
    assert main(["figure", "flown", "--kind", kind]) == 0
    assert capsys.readouterr().out == f"figure in flown/{kind}.pdf\n"
    assert (directory / f"{kind}.pdf").read_bytes().startswith(b"%PDF")


@pytest.fixture
def trained(directory):
    folder = directory.parent / "trained"
    folder.mkdir()
    head = "steps,process_s,wall_s,coverage,all_home,violations,energy_Wh,flight_steps"
    (folder / "learning_curve.csv").write_text(f"{head}\n0,1,1,0.5,1,0,30,200\n")
    return folder


def test_figure_draws_trainings_and_comparisons_too(trained, capsys):
    shutil.copytree(trained, "again")
    assert main(["figure", "trained", "again", "--kind", "training"]) == 0
    assert capsys.readouterr().out == "figure in trained/training.pdf\n"
    flights = ["--scenarios", "open_field", "--planners", "hover", "--seeds", "0:1"]
    assert main(["compare", *flights, "--jobs", "1", "--out", "compared"]) in (0, 1)
    capsys.readouterr()
    assert main(["figure", "compared", "--kind", "leaderboard", "--out", "board.svg"]) == 0
    assert capsys.readouterr().out == "figure in board.svg\n"
    assert Path("board.svg").read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (["flown", "--kind", "training"], "flown: is the directory of a flight"),
        (["flown", "--kind", "leaderboard"], "draw map, battery, modes, decision-time"),
        (["trained", "--kind", "battery"], "trained: is the directory of a training"),
        ([".", "--kind", "leaderboard"], "no directory of a comparison: it has no table.json"),
        (["flown", "trained", "--kind", "map"], "--kind map shows one directory; 2 were given"),
        (["trained", "trained", "--kind", "training"], "a directory is given twice"),
        (["trained", "gone", "--kind", "training"], "gone: there is no such directory"),
    ],
)
def test_figure_says_what_a_directory_is(command, message, trained, capsys):
    assert message in refused(capsys, "figure", *command)


def test_figure_writes_where_it_is_told_but_not_over_another(directory, capsys):
    command = ["figure", "flown", "--kind", "map", "--step", "30", "--out", "fig1.svg"]
    assert main(command) == 0
    capsys.readouterr()
    assert "fig1.svg: exists" in refused(capsys, *command)
    assert main([*command, "--overwrite"]) == 0


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["replay", "nowhere"], "nowhere"),
        (["replay", "."], "is it a flight?"),
        (["replay", "flown", "nowhere"], "nowhere"),
        (["replay", "flown/flight.csv"], "flight.csv"),
        (["replay", "flown", "--video", "film.avi"], "should end in .mp4"),
        (["replay", "flown", "--gif", "no/such/folder/film.gif"], "no/such/folder"),
        (["replay", "flown", "--fps", "0"], "--fps"),
        (["replay"], "DIR"),
        (["figure", "nowhere", "--kind", "map"], "nowhere"),
        (["figure", "flown"], "--kind"),
        (["figure", "flown", "--kind", "pie"], "pie"),
        (["figure", "flown", "--kind", "map", "--out", "map.docx"], "should end in .pdf"),
        (["figure", "flown", "--kind", "map", "--step", "61"], "samples 0 to 60"),
        (["figure", "flown", "--kind", "map", "--step", "-1"], "--step"),
        (["figure", "flown", "--kind", "modes", "--step", "3"], "--step is for --kind map"),
    ],
)
def test_a_mistake_is_answered_by_one_line(arguments, word, directory, capsys):
    before = sorted(path.name for path in directory.rglob("*"))
    assert word in refused(capsys, *arguments)
    assert sorted(path.name for path in directory.rglob("*")) == before


@pytest.mark.parametrize(
    ("file", "change", "word"),
    [
        ("flight.csv", lambda text: text.replace("covering", "dancing", 1), "flight.csv"),
        ("flight.csv", lambda text: text[: len(text) // 2], "flight.csv"),
        ("flight.csv", lambda text: text.replace(",-1.0,", ",nan,", 1), "not finite"),
        ("flight.csv", lambda text: text.replace("covering", "x" * 200_000, 1), "flight.csv"),
        ("run.json", lambda text: "[" * 100_000, "run.json"),
        ("plan.csv", lambda text: text.replace("uas_1", "uas_9", 1), "plan.csv"),
        ("plan.csv", lambda text: text + "9999.0,uas_1,0,0.0,0.0,0.0\n", "plan.csv"),
        ("plan.csv", lambda text: text.replace("0.0,uas_1", "-3.0,uas_1", 1), "plan.csv"),
        ("flight.csv", lambda text: text.replace("\n60.0,", "\n1e9,"), "flight.csv"),
        ("flight.csv", without_line(12), "sample 5 of uas_2 is missing"),
        ("run.json", lambda text: text[:-20], "run.json"),
        ("run.json", lambda text: text.replace('_s": ', '_s": "soon", "x": ', 1), "run.json"),
        ("run.json", lambda text: re.sub('_s": [^,]+', '_s": NaN', text, count=1), "run.json"),
        ("run.json", lambda text: re.sub(r"\{[^{}]*\},", "", text, count=1), "59 decisions"),
        ("summary.json", lambda text: text.replace('"t_s": 30.0', '"t_s": -3'), "summary.json"),
        ("summary.json", lambda text: text.replace('"t_s": 30.0', '"t_s": []'), "summary.json"),
        ("summary.json", lambda text: text.replace('"uas": "uas_1"', '"uas": "x"'), "uas is 'x'"),
        ("summary.json", lambda text: text.replace('"seed": 0', '"seed": "x"'), "summary.json"),
        ("summary.json", lambda text: "[]", "summary.json"),
        ("scenario.json", lambda text: text.replace('"village"', '"</script>"', 1), "name"),
    ],
)
def test_a_damaged_flight_is_named(file, change, word, directory, capsys):
    path = directory / file
    text = path.read_text(encoding="utf-8")
    path.write_text(change(text), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != text
    assert word in refused(capsys, "replay", "flown")


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("matplotlib", ["figure", "flown", "--kind", "map"]),
        ("imageio_ffmpeg", ["replay", "flown", "--video", "film.mp4"]),
    ],
)
def test_what_is_not_installed_is_named_with_the_extra(
    module, arguments, directory, capsys, monkeypatch
):
    for name in [name for name in sys.modules if "replay.figures" in name]:
        monkeypatch.delitem(sys.modules, name)
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    line = refused(capsys, *arguments)
    assert module.replace("_", "-") in line
    assert "uas-coverage-env[view]" in line
