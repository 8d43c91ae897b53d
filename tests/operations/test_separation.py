"""Waits that exports put in, held against files flown again, late by what is asked."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from qgc_loader import problems
from test_export import random_flight
from test_lateness import FIELD, HOMES, KEPT_M, PLACES, least_m, pair_of

pytest.importorskip("pyproj")

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, follow
from uas_coverage_env.planning.execution.separation import Waits, separate
from uas_coverage_env.scenario import Place

SLACK_S = 20.0
HERE = Place(latitude_deg=47.0, longitude_deg=8.0)


def file_of(home, corners, in_hover=False):
    """How a file is flown, with waits in it: on the ground or where its take-off ends."""
    points = [(*home, -10.0), *corners, (*home, -10.0)]
    n = len(points) - 1

    def fly(waits):
        holds_s = [0.0] * n
        if waits.leg is not None:
            holds_s[waits.leg] = 1.0 + waits.hold_s
        if in_hover:
            return follow(points, [8.0] * n, holds_s, Autopilot(), hover_s=waits.start_s)
        return follow(points, [8.0] * n, holds_s, Autopilot(), waits.start_s)

    return fly


def apart(one, other, slack_s):
    delays = np.linspace(-slack_s + DT_S, slack_s - DT_S, 21)
    return min(least_m(one, other, late_s) for late_s in delays) >= KEPT_M


@pytest.mark.parametrize("in_hover", [False, True])
@settings(max_examples=15, deadline=None, derandomize=True)
@given(one=PLACES, other=PLACES)
def test_with_the_waits_every_uas_may_be_late_by_what_is_asked(one, other, in_hover):
    files = file_of(HOMES[0], one, in_hover), file_of(HOMES[1], other, in_hover)
    waits = separate(FIELD, [(0, files[0]), (1, files[1])], SLACK_S, in_hover=in_hover)
    if waits is None:
        return
    a, b = (fly(w) for fly, w in zip(files, waits, strict=True))
    assert pair_of(a, b).slack_s is None or pair_of(a, b).slack_s >= SLACK_S
    assert apart(a, b, SLACK_S)


CROSSING = file_of(HOMES[0], [(100.0, 40.0, -10.0)]), file_of(HOMES[1], [(100.0, 0.0, -10.0)])


def test_one_of_two_that_cross_takes_off_later_and_no_later_than_needed():
    waits = separate(FIELD, [(0, CROSSING[0]), (1, CROSSING[1])], SLACK_S)
    assert sorted(w.start_s > 0 for w in waits) == [False, True]
    assert all(w.leg is None for w in waits)
    late = 0 if waits[0].start_s else 1
    sooner = [CROSSING[k](Waits(w.start_s - (k == late))) for k, w in enumerate(waits)]
    assert pair_of(*sooner).slack_s < SLACK_S


def test_one_that_waits_in_hover_is_as_late_where_it_flies_on_and_stands_above_its_start():
    one, other = (
        file_of(home, [(100.0, y, -10.0)], True) for home, y in zip(HOMES, (40.0, 0.0), strict=True)
    )
    waits = separate(FIELD, [(0, one), (1, other)], SLACK_S, in_hover=True)
    assert sorted(w.start_s > 0 for w in waits) == [False, True]
    late = 0 if waits[0].start_s else 1
    flown, base = (one, other)[late](waits[late]), (one, other)[late](Waits())
    assert flown.duration_s == pytest.approx(base.duration_s + waits[late].start_s)
    assert flown.corner_s[0] == pytest.approx(base.corner_s[0] + waits[late].start_s)
    stands = flown.places_m[round(base.corner_s[0] / DT_S) : round(flown.corner_s[0] / DT_S)]
    assert np.ptp(stands, axis=0).max() == 0.0
    assert stands[0, 2] == -10.0


def test_uas_that_are_apart_do_not_wait():
    far = file_of(HOMES[0], [(100.0, 0.0, -10.0)]), file_of(HOMES[1], [(100.0, 40.0, -10.0)])
    assert separate(FIELD, [(0, far[0]), (1, far[1])], SLACK_S) == [Waits(), Waits()]


# each passes low over the home of the other, so that neither can wait long on the ground
LOW = [
    (
        [(56.0, 77.0, -11.0), (30.0, -27.0, -11.0), (0.0, 38.0, -4.0)],
        [(29.0, 62.0, -8.0), (28.0, 36.0, -7.0), (0.0, 4.0, -4.0)],
    ),
    (
        [(36.0, -22.0, -14.0), (46.0, -12.0, -6.0), (0.0, 37.0, -4.0)],
        [(33.0, 78.0, -10.0), (0.0, 4.0, -4.0)],
    ),
]


@pytest.mark.parametrize("corners", LOW)
def test_where_no_start_may_be_later_one_waits_in_the_air(corners):
    files = [file_of(home, way) for home, way in zip(HOMES, corners, strict=True)]
    for late, start_s in itertools.product((0, 1), range(0, 200, 5)):
        starts = [Waits(start_s * (late == k)) for k in (0, 1)]
        assert pair_of(*(fly(w) for fly, w in zip(files, starts, strict=True))).slack_s < 10.0
    waits = separate(FIELD, [(0, files[0]), (1, files[1])], 10.0)
    assert [w.start_s for w in waits] == [0, 0]
    assert sorted(w.leg is not None for w in waits) == [False, True]
    flown = [fly(w) for fly, w in zip(files, waits, strict=True)]
    assert pair_of(*flown).slack_s >= 10.0
    one, other = flown
    assert apart(one, other, 10.0)


def test_where_no_wait_helps_there_is_none():
    # each circles low over the home of the other, with no time between
    files = [
        file_of(home, [(*other, -4.0), (2.0, other[1], -4.0)])
        for home, other in zip(HOMES, HOMES[::-1], strict=True)
    ]
    assert separate(FIELD, [(0, files[0]), (1, files[1])], 60.0) is None


@pytest.fixture(scope="module")
def flight():
    return random_flight(1)


def export_of(flight, kind="qgc", **changes):
    return make_export(flight, ExportOptions(kind, place=HERE, **changes))


def test_an_export_puts_in_what_its_report_says(flight):
    close = export_of(flight, min_slack_s=0.0)
    assert close.data["pairs"][0]["slack_s"] < SLACK_S
    made = export_of(flight, min_slack_s=SLACK_S)
    assert made.data["pairs"][0]["slack_s"] >= SLACK_S
    waited = 0
    for before, uas in zip(close.data["uas"], made.data["uas"], strict=True):
        wait_s = uas["start_delay_s"]
        waited += wait_s > 0
        text = made.files[f"{uas['name']}.plan"]
        assert problems(text) == []
        first, *others = json.loads(text)["mission"]["items"]
        assert first["command"] == 22
        stays = next(item for item in others if item["command"] == 16)
        delayed = stays["params"][0] == wait_s > 0
        assert delayed == (wait_s > 0)
        assert (stays["params"][4:] == first["params"][4:]) == delayed
        assert uas["duration_s"] == pytest.approx(before["duration_s"] + wait_s, abs=0.11)
        # hovering is counted as flying, and what is spare on the way is less by it
        per_s = (uas["legs"][0]["soc"] - uas["soc_landed"]) / (
            uas["duration_s"] - uas["legs"][0]["time_s"]
        )
        less = before["soc_landed"] - uas["soc_landed"]
        assert less == pytest.approx(per_s * wait_s, rel=0.1, abs=2e-4)
        said = [note for note in made.notes if "where its take-off ends" in note]
        assert any(note.startswith(uas["name"]) for note in said) == delayed
    assert waited == 1
    assert "To keep apart," in made.files["report.html"]
    assert "To keep apart," not in close.files["report.html"]


def test_files_that_need_no_waits_hold_none(flight):
    made = export_of(flight, min_slack_s=0.0)
    assert all(uas["waits"] == [] for uas in made.data["uas"])
    for name, text in made.files.items():
        if name.endswith(".plan"):
            stops = [i for i in json.loads(text)["mission"]["items"] if i["command"] == 16]
            assert {item["params"][0] for item in stops} <= {0, 1}


def test_an_export_that_no_wait_helps_is_refused_with_pair_and_place(flight, monkeypatch):
    monkeypatch.setattr(
        "uas_coverage_env.operations.mission_export.scheduling.separate", lambda *_, **__: None
    )
    with pytest.raises(InputError, match=r"uas_1 and uas_2 come closer .* no wait after take-off"):
        export_of(flight, min_slack_s=SLACK_S)
