"""A figure of a flight is declared once, and stands wherever flights are told of."""

import hashlib
import json
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from numba.core import event
from small_worlds import meadow

from uas_coverage_env.autopilot.guidance import steer
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Figure, Flight, figures, rollout
from uas_coverage_env.flight.figure import FigureError
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.scores import columns
from uas_coverage_env.world import GoTo

OWN = """
import numpy as np

from uas_coverage_env.flight import Figure


def distance_m(flight):
    return np.linalg.norm(np.diff(flight.x[..., :3], axis=0), axis=-1).sum()


DISTANCE = Figure("distance_m", float, distance_m, "flown by all UAS", "distance flown", digits=0)
BROKEN = Figure("broken_Wh", float, lambda flight: 1.0 / (flight.seed - flight.seed), "never")
"""

USE = """
import json, sys
from uas_coverage_env import Flight, evaluate
from uas_coverage_env.cli import main
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import rows_in
from pathlib import Path

fly = ["run", "open_field", "--planner", "hover", "--steps", "3", "--quiet", "--out", "f"]
assert main(fly) == 0
assert main(["show", "f"]) == 0
assert main(["show", "f", "--json"]) == 0
words = ["compare", "--scenarios", "open_field", "--planners", "hover,nearest-waypoint"]
words += ["--seeds", "0:1", "--jobs", "1", "--no-bounds", "--out", "sweep"]
print("compared", main(words))
(_, row) = rows_in(Path("sweep"), Row)
episode = evaluate("hover", "open_field", seeds=[0], max_cycles=3).episodes[0]
found = {"row": row.distance_m, "failed": row.failed_figures, "episode": episode.distance_m,
         "of the flight": Flight.load("f").figures["distance_m"]}
Path("found.json").write_text(json.dumps(found))
"""


@pytest.fixture(scope="module")
def outside(tmp_path_factory):
    """A folder in which a package with two figures is installed, one of which always fails."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "own_figures.py").write_text(OWN)
    told = folder / "own_figures-1.0.dist-info"
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: own-figures\nVersion: 1.0\n")
    points = "distance = own_figures:DISTANCE\nbroken = own_figures:BROKEN\n"
    (told / "entry_points.txt").write_text(f"[{figures.GROUP}]\n{points}")
    path = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))
    result = subprocess.run(
        [sys.executable, "-c", USE],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    return folder, result.stdout, result.stderr


def test_a_figure_from_outside_stands_wherever_flights_are_told_of(outside):
    folder, out, _ = outside
    summary = json.loads((folder / "f/summary.json").read_text())
    found = json.loads((folder / "found.json").read_text())
    distance_m = summary["distance_m"]
    assert found["of the flight"] == distance_m
    assert found["episode"] == distance_m, "three steps of the same planner"
    assert found["row"] > distance_m, "a whole mission"
    assert f"distance flown, m {distance_m:.0f}" in " ".join(out.split())
    assert f'"distance_m": {distance_m}' in out, "show --json"
    scores = json.loads((folder / "sweep/table.json").read_text())["scores"]
    (one,) = [one for one in scores if one["label"] == "nearest-waypoint"]
    assert one["distance_m"]["value"] == pytest.approx(found["row"])
    assert "distance_m_low" in (folder / "sweep/table.csv").read_text()
    assert "| distance flown, m |" in (folder / "sweep/table.md").read_text()


def test_a_figure_that_fails_is_null_and_named_and_loses_no_flight(outside):
    folder, out, err = outside
    why = "broken_Wh: ZeroDivisionError: float division by zero (own_figures.py:"
    summary = json.loads((folder / "f/summary.json").read_text())
    assert summary["broken_Wh"] is None
    assert why in summary["failed_figures"]["broken_Wh"].replace(f"{folder}{os.sep}", "")
    assert "figure broken_Wh: ZeroDivisionError" in out
    assert "compared 1" in out
    assert "hover lacks figures of 1 flight" in err
    assert "broken_Wh" in json.loads((folder / "found.json").read_text())["failed"]


@pytest.mark.parametrize(
    ("kind", "value", "said"),
    [
        (float, float("nan"), "it is nan, which is no finite number"),
        (float, np.float64("inf"), "it is .*inf.*, which is no finite number"),
        (float, "12", "it is '12', which is no finite number"),
        (int, 2.5, "it is 2.5, which is no whole number"),
        (int, -1, "it is -1, which is no whole number"),
        (bool, 3, "it is 3, which is no truth"),
        (dict, {"a": np.float32(1.0)}, "TypeError: Object of type float32"),
        (list, [float("nan")], "Out of range float values are not JSON compliant"),
    ],
)
def test_one_that_no_file_could_hold_says_so(kind, value, said, monkeypatch):
    flight = rollout(meadow(), "hover", max_steps=1)
    broken = Figure("mine", kind, lambda flight: value, "wrong")
    monkeypatch.setattr(figures, "figures", lambda: {"mine": broken})
    with pytest.raises(FigureError, match=f"mine: .*{said}"):
        flight.figures["mine"]
    assert figures.summary(flight)["mine"] is None
    assert "mine" in figures.summary(flight)["failed_figures"]


@pytest.mark.parametrize(
    ("kind", "value", "kept"),
    [
        (float, 3, 3.0), (float, np.float32(0.5), 0.5), (int, np.int8(3), 3), (int, 4.0, 4),
        (bool, np.True_, True), (dict, {"a": 1}, {"a": 1}), (list, (), []), (float, None, None),
    ],
)  # fmt: skip
def test_what_numpy_gives_is_kept_as_plain_data(kind, value, kept):
    found = Figure("mine", kind, lambda flight: value, "right").computed(None)
    assert found == kept
    assert type(found) is type(kept)


def test_one_whose_text_fails_is_printed_with_the_reason(monkeypatch):
    mine = Figure("mine", float, lambda flight: 1.0, "fine", text=lambda value: 1 / 0)
    monkeypatch.setattr(figures, "figures", lambda: {"mine": mine})
    text = figures.printed(rollout(meadow(), "hover", max_steps=1))["mine"]
    assert text.startswith("cannot be printed: ZeroDivisionError")


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "my figure"}, {"name": "return"}, {"name": "_mine"}, {"kind": complex},
        {"over": "sum"}, {"counts": "some"}, {"table": "mine"},
    ],
)  # fmt: skip
def test_a_figure_that_could_stand_nowhere_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))) as error:
        Figure(**{"name": "mine", "kind": float, "of": len, "meaning": "", **wrong})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("named", "said"),
    [
        (Figure("steps", int, lambda flight: 0, "again"), "there is a figure 'steps' already"),
        (Figure("x", int, lambda flight: 0, "again", key="return"), "there is a figure 'x'"),
        (Figure("mine", int, lambda flight: 0, "", key="seed"), "there is a figure 'mine'"),
        (3, "is a int; name a Figure"),
        (ImportError("no such package"), "cannot be loaded: ImportError: no such package"),
    ],
)
def test_what_is_no_figure_is_refused_in_one_line(named, said, monkeypatch):
    class Point:
        name, value = "mine", "my_package:FIGURE"

        def load(self):
            if isinstance(named, Exception):
                raise named
            return named

    monkeypatch.setattr(figures, "entry_points", lambda group: (Point(),))
    with pytest.raises(InputError) as error:
        figures.figures()
    assert said in str(error.value)
    assert "my_package:FIGURE" in str(error.value)
    assert "\n" not in str(error.value)


def test_every_number_has_a_column_in_rows_and_in_tables():
    flight = rollout(meadow(), "hover", max_steps=2)
    numbers = {name for name, each in figures.figures().items() if each.kind in (int, float, bool)}
    assert numbers <= set(figures.rows_part(figures.computed(flight)[0]))
    assert numbers <= set(Row.__dataclass_fields__)
    assert len(columns()) > len(numbers)
    headings = [each.heading for each in columns().values()]
    assert len(set(headings)) == len(headings)


def test_a_flight_looks_its_figures_up_by_name(tmp_path):
    flight = rollout(meadow(), "hover", max_steps=2)
    assert flight.figures["steps"] == 2
    assert set(flight.figures) == set(figures.figures())
    again = Flight.load(flight.save(tmp_path))
    assert dict(again.figures) == dict(flight.figures)
    assert figures.rows_part(None).items() >= {"coverage": 0.0, "steps": None}.items()


class Works:
    """Works in a second thread, sleeps, and compiles, in each decision."""

    goes_to = True

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        with event.trigger_event("numba:compile", {"dispatcher": steer}):
            busy(0.2)
        thread = threading.Thread(target=busy, args=(0.1,))
        thread.start()
        thread.join()
        time.sleep(0.3)
        return {name: GoTo(0) for name in swarm.active}


def busy(seconds):
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        hashlib.sha256(bytes(10_000)).digest()


def test_processor_time_is_that_of_all_threads_without_waiting_and_compiling():
    flight = rollout(meadow(), Works(), max_steps=2)
    assert all(0.1 <= decision.processor_s < 0.2 for decision in flight.decisions)
    assert all(decision.duration_s > 0.3 for decision in flight.decisions)
    assert flight.figures["processor_p50_s"] == pytest.approx(
        flight.figures["decision_processor_s"]["p50"]
    )
    assert 0.1 <= flight.figures["processor_p95_s"] < 0.2


def test_a_flight_of_a_version_without_processor_times_is_read(tmp_path):
    folder = rollout(meadow(), "hover", max_steps=2).save(tmp_path)
    run = json.loads((folder / "run.json").read_text())
    for decision in run["decisions"]:
        del decision["processor_s"]
    (folder / "run.json").write_text(json.dumps(run))
    flight = Flight.load(folder)
    assert flight.figures["processor_p50_s"] is None
    assert "decision_processor_s" not in figures.summary(flight)
    assert figures.summary(flight)["decision_time_s"]["p50"] is not None
