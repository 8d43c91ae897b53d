"""Exports are read back by parsers that are not ours, their metres by geodesics that are not."""

import dataclasses
import json
import math
import re
import warnings
import xml.etree.ElementTree as ElementTree
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyproj")
from geographiclib.geodesic import Geodesic
from pymavlink import mavwp
from qgc_loader import problems
from rich.console import Console
from small_worlds import box, meadow, waypoint

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.cli.operations import _report_export
from uas_coverage_env.features.wind import Wind
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.operations.mission_export.formats import ENDINGS, FORMATS
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.operations.path_geometry import cut_path, distances_m
from uas_coverage_env.scenario import Place, load_scenario

TOLERANCES = Tolerances(2.0, 2.0)
WITH_PLACE = (16, 21, 22)
MOST_OFF_M = 0.01
FLIGHTS = 6
PLACES = [(89.9999, 20.0), (-90.0, 0.0), (12.0, 180.0), (-45.0, -179.9999)]


def random_flight(seed):
    rng = np.random.default_rng(seed)
    scenario = generate_scenario(
        seed=seed,
        n_uas=int(rng.integers(1, 4)),
        n_waypoints=int(rng.integers(4, 9)),
        n_obstacles=int(rng.integers(0, 6)),
    )
    return rollout(scenario, load_planner("nearest-waypoint"), 0)


@pytest.fixture(scope="module", params=range(FLIGHTS))
def number(request):
    return request.param


@pytest.fixture(scope="module")
def flight(number):
    return random_flight(number)


@pytest.fixture(scope="module")
def place(number):
    rng = np.random.default_rng(number)
    anywhere = rng.uniform((-85.0, -180.0), (85.0, 180.0), (FLIGHTS, 2))
    latitude, longitude = [*PLACES, *anywhere][number]
    return Place(latitude_deg=latitude, longitude_deg=longitude, height_m=rng.uniform(0, 3000))


def exported(flight, place, kind, **changes):
    options = {"min_slack_s": 0.0, "place": place} | changes
    return make_export(flight, ExportOptions(kind, **options))


def metres(latitude, longitude, height, origin):
    """North, east, down by geodesics: the export is by a map projection."""
    line = Geodesic.WGS84.Inverse(origin.latitude_deg, origin.longitude_deg, latitude, longitude)
    azimuth = math.radians(line["azi1"])
    return np.array([line["s12"] * math.cos(azimuth), line["s12"] * math.sin(azimuth), -height])


def tracks_of(flight):
    tracks = [make_tracks(flight, i, TOLERANCES) for i in range(len(flight.names))]
    return {track.name: track for mine in tracks for track in mine}


def wanted_places(track):
    ground = np.array([*track.home_m[:2], 0.0])
    return [*track.corners_m, ground]


def test_every_corner_of_a_waypoint_file_is_where_it_was_planned(flight, place, tmp_path):
    made = exported(flight, place, "ardupilot")
    tracks = tracks_of(flight)
    assert {name for name in made.files if name.endswith(".waypoints")} == {
        f"{name}.waypoints" for name in tracks
    }
    for name, track in tracks.items():
        (tmp_path / name).write_text(made.files[f"{name}.waypoints"])
        loader = mavwp.MAVWPLoader()
        with warnings.catch_warnings():  # it leaves the file open
            warnings.simplefilter("ignore", ResourceWarning)
            assert loader.load(str(tmp_path / name)) == loader.count()
        items = [loader.wp(n) for n in range(1, loader.count())]
        places = [item for item in items if item.command in WITH_PLACE]
        for item, wanted in zip(places, wanted_places(track), strict=True):
            found = metres(item.x, item.y, item.z, place)
            assert np.linalg.norm(found - wanted) < MOST_OFF_M
        assert [item.command for item in (items[0], items[-1])] == [22, 21]
        assert loader.wp(0).z == pytest.approx(place.height_m, abs=1e-3)


@pytest.mark.parametrize("firmware", [None, "px4"])
def test_a_plan_passes_the_checks_of_its_loader_and_holds_the_same_corners(flight, place, firmware):
    made = exported(flight, place, "qgc", firmware=firmware)
    for name, track in tracks_of(flight).items():
        text = made.files[f"{name}.plan"]
        assert problems(text) == []
        plan = json.loads(text)
        items = [i for i in plan["mission"]["items"] if i["command"] in WITH_PLACE]
        for item, wanted in zip(items, wanted_places(track), strict=True):
            # what MAVLink keeps: whole 1e-7 degrees and 32-bit floats
            latitude, longitude = (round(value * 1e7) / 1e7 for value in item["params"][4:6])
            found = metres(latitude, longitude, float(np.float32(item["params"][6])), place)
            assert np.abs(found - wanted).max() < MOST_OFF_M
        (inside,) = [p for p in plan["geoFence"]["polygons"] if p["inclusion"]]
        for corner in inside["polygon"]:
            fence_m = flight.scenario.fence.vertices_m[:, :2]
            away = np.linalg.norm(fence_m - metres(corner[0], corner[1], 0.0, place)[:2], axis=1)
            assert away.min() < MOST_OFF_M
        assert plan["mission"]["firmwareType"] == {None: 3, "px4": 12}[firmware]
        assert len(plan["rallyPoints"]["points"]) == 1


def test_a_uas_that_looks_where_it_flies_leaves_its_yaw_to_the_autopilot():
    flight, place = random_flight(0), Place(latitude_deg=60.0, longitude_deg=20.0)
    first, *others = flight.scenario.uas
    fleet = (first.model_copy(update={"heading": "course"}), *others)
    scenario = flight.scenario.model_copy(update={"uas": fleet})
    made = {}
    for format in ("qgc", "ardupilot"):
        files = exported(dataclasses.replace(flight, scenario=scenario), place, format).files
        made |= {name: text for name, text in files.items() if first.name in name}
    items = json.loads(made[f"{first.name}.plan"])["mission"]["items"]
    assert {item["params"][3] for item in items if item["command"] == 16} == {None}
    assert "WP_YAW_BEHAVIOR,3\n" in made[f"{first.name}.param"]


def test_tracks_for_maps_and_tables_hold_the_flown_samples(flight, place):
    files = {k: exported(flight, place, k).files for k in ("kml", "geojson", "csv")}
    for name, track in tracks_of(flight).items():
        flown, legs = json.loads(files["geojson"][f"{name}.geojson"])["features"]
        of_geojson = [(b, a, c) for a, b, c in flown["geometry"]["coordinates"]]
        assert len(legs["geometry"]["coordinates"]) == len(track.corners_m)
        root = ElementTree.fromstring(files["kml"][f"{name}.kml"])
        text = root.findall(".//{*}coordinates")[0].text
        of_kml = [[float(v) for v in line.split(",")] for line in text.split()]
        of_kml = [(b, a, c) for a, b, c in of_kml]
        rows = files["csv"][f"{name}.csv"].splitlines()[1:]
        of_csv = [[float(v) for v in row.split(",")[2:5]] for row in rows]
        for found in (of_geojson, of_kml, of_csv):
            assert len(found) == len(track.flown_m)
            for sample in (0, len(found) // 2, -1):
                latitude, longitude, height = found[sample]
                off = metres(latitude, longitude, height, place) - track.flown_m[sample]
                assert np.linalg.norm(off) < MOST_OFF_M


def test_legs_are_few_close_to_the_flight_and_clear_also_where_corners_are_cut(flight):
    scenario = flight.scenario
    for track in tracks_of(flight).values():
        corners, radius_m = track.corners_m, scenario.uas[track.uas].radius_m
        assert len(corners) < 0.6 * len(track.flown_m)
        high = track.flown_m[-track.flown_m[:, 2] >= 3.0]
        off_m = np.min([distances_m(high, a, b) for a, b in pairwise(corners)], axis=0)
        assert off_m.max() <= TOLERANCES.path_m + 1e-9
        stops = [leg.stop for leg in track.legs]
        path = cut_path(corners, stops, TOLERANCES.corner_m)
        dense = np.concatenate(
            [
                a + np.linspace(0, 1, 40)[:, None] * (b - a)
                for a, b in [*pairwise(path), *pairwise(corners)]
            ]
        )
        assert scenario.fence.signed_distance(dense).max() < 0.0
        for hull in scenario.hulls:
            assert hull.signed_distance(dense).min() > radius_m


def test_what_a_uas_covered_is_covered_by_its_legs(flight):
    scenario = flight.scenario
    covered = set()
    for track in tracks_of(flight).values():
        stops = [leg.stop for leg in track.legs]
        path = cut_path(track.corners_m, stops, TOLERANCES.corner_m)
        for w, passed_m in zip(track.waypoints, track.passed_m, strict=True):
            centre = np.array([scenario.waypoints[w].position_m])
            away_m = min(distances_m(centre, a, b)[0] for a, b in pairwise(path))
            assert away_m == pytest.approx(passed_m)
            if away_m <= scenario.waypoints[w].radius_m:
                covered.add(w)
    assert len(covered) == flight.covered[-1]


def test_a_smaller_tolerance_keeps_closer_with_more_legs(flight):
    for i in range(len(flight.names)):
        tracks = (make_tracks(flight, i, Tolerances(t, 2.0)) for t in (0.5, 5.0))
        for near, far in zip(*tracks, strict=True):
            assert near.off_m <= 0.5 + 1e-9
            assert len(near.legs) >= len(far.legs)


def test_the_report_counts_charge_down_and_says_what_home_takes(flight, place):
    data = exported(flight, place, "csv").data
    assert data["waypoints_passed"] == flight.covered[-1]
    for uas in data["uas"]:
        socs = [leg["soc"] for leg in uas["legs"]]
        assert all(later <= earlier for earlier, later in pairwise(socs))
        assert uas["soc_landed"] < socs[-1]
        for leg in uas["legs"]:
            reserve = uas["soc_reserve"]
            assert leg["spare"] == pytest.approx(leg["soc"] - reserve - leg["home"], abs=3e-4)
        least = min(leg["spare"] for leg in uas["legs"])
        assert uas["least_spare"]["spare"] == least
        assert (uas["point_of_no_return"] is None) == (least >= 0.0)


def test_the_charge_of_a_file_is_estimated_with_care(flight, place):
    # per second it takes about what the flight took: level flight at full speed is most of that
    for uas in exported(flight, place, "csv").data["uas"]:
        soc_0 = next(u.soc_0 for u in flight.scenario.uas if u.name == uas["name"])
        per_s = (uas["legs"][0]["soc"] - uas["soc_landed"]) / (
            uas["duration_s"] - uas["legs"][0]["time_s"]
        )
        planned = (soc_0 - uas["planned_soc_landed"]) / uas["planned_s"]
        assert 0.95 * planned < per_s < 1.3 * planned


def north_and_back(**changes):
    scenario = meadow(waypoints=[waypoint((190.0, 100.0, -20.0))]).model_copy(update=changes)
    return rollout(scenario, load_planner("nearest-waypoint"), 0)


ANYWHERE = Place(latitude_deg=1.0, longitude_deg=2.0)


def test_against_a_wind_less_is_left_and_no_less_than_a_flight_against_it_takes():
    flight = north_and_back()
    still, windy = (
        exported(flight, ANYWHERE, "csv", wind_mps=w).data["uas"][0] for w in (None, 6.0)
    )
    assert still["in_wind"] is None
    assert windy["in_wind"]["headwind_mps"] == 6.0
    assert windy["in_wind"]["soc_landed"] < windy["soc_landed"] == still["soc_landed"]
    for leg, before in zip(windy["legs"], still["legs"], strict=True):
        assert leg["spare_in_wind"] < leg["spare"] == before["spare"]
    flown = north_and_back(wind=Wind(mean_mps=6.0, from_deg=0.0))
    assert windy["in_wind"]["soc_landed"] < flown.soc[-1, 0]
    # and what the scenario says counts, unless an option does
    there = dataclasses.replace(flight, scenario=flown.scenario)
    assert exported(there, ANYWHERE, "csv").data["uas"] == [windy]


def test_the_command_shows_what_is_left_in_wind_in_a_column_of_its_own(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "120")
    north_and_back().save(tmp_path / "flight")
    words = ("export", str(tmp_path / "flight"), "--format", "csv", "--place", "1,2")
    for name, more in (("still", ()), ("windy", ("--wind", "6"))):
        assert main([*words, *more, "--out", str(tmp_path / name)]) == 0
        head, row = capsys.readouterr().out.splitlines()[:2]
        assert ("spare in wind" in head) == bool(more)
        assert row.count("%") == 2 + len(more) // 2


def test_a_uas_that_meets_no_wind_where_another_does_has_an_empty_cell(capsys):
    of_one = {"begins_s": 0.0, "legs": [], "duration_s": 1.0, "planned_s": 1.0, "soc_landed": 0.5}
    left = {"least_spare": {"spare": 0.25}}
    fleet = [
        of_one | left | {"name": name, "in_wind": wind}
        for name, wind in (("calm", None), ("windy", {"least_spare": {"spare": 0.125}}))
    ]
    made = SimpleNamespace(data={"uas": fleet, "turnarounds": []}, grounded=(), files=())
    _report_export(Console(width=120), made, Path("there"))
    _, calm, windy = capsys.readouterr().out.splitlines()[:3]
    assert calm.split()[-1] == "25.0%"
    assert windy.split()[-2:] == ["25.0%", "12.5%"]


def test_who_makes_no_headway_against_the_wind_has_no_return():
    made = exported(north_and_back(), ANYWHERE, "csv", wind_mps=30.0)
    assert made.data["uas"][0]["point_of_no_return"] is None
    assert made.data["uas"][0]["in_wind"]["point_of_no_return"]["leg"] == 1
    assert any("in a headwind of 30.0 m/s" in note for note in made.notes)
    assert "point of no return at" in made.files["report.html"]


def test_the_page_shows_every_uas_and_needs_no_network(flight, place):
    page = exported(flight, place, "csv").files["report.html"]
    assert page.count("<polyline") == len(tracks_of(flight))
    assert "http" not in page
    svg = ElementTree.fromstring(page[page.index("<svg") : page.index("</svg>") + 6])
    words = [text.text for text in svg.iter() if text.tag.endswith("text")]
    names = list(tracks_of(flight))
    assert words[:-1] == [name.removeprefix("uas_") for name in names]
    assert words[-1].endswith(" m, N ↑")
    assert all(name in svg.attrib["aria-label"] for name in names)
    assert 'name="viewport"' in page


def test_every_colour_of_the_page_is_declared_for_light_and_for_dark(flight, place):
    page = exported(flight, place, "csv").files["report.html"]
    light, dark = page.split("prefers-color-scheme:dark")
    declared = [set(re.findall(r"(--[\w-]+):", half.split("body{")[0])) for half in (light, dark)]
    assert declared[0] == declared[1] >= set(re.findall(r"var\((--[\w-]+)\)", page))
    shapes = page[page.index("<svg") : page.index("</svg>")]
    assert "var(--uas-0)" in shapes
    assert "#" not in shapes


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    """A flight whose scenario has no place."""
    folder = tmp_path_factory.mktemp("flights") / "flight"
    random_flight(1).save(folder)
    return str(folder)


def refused(capsys, *arguments):
    assert main(["export", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


HERE = ("--place", "47.5,19.05", "--min-slack", "0")


def test_the_command_writes_one_file_per_uas_and_the_report(directory, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["export", directory, "--format", "qgc", "--out", str(out), *HERE]) == 0
    names = {path.name for path in out.iterdir()}
    assert {"uas_1.plan", "uas_1.param", "report.html", "report.json"} <= names
    report = json.loads((out / "report.json").read_text())
    assert report["place"] == {"latitude_deg": 47.5, "longitude_deg": 19.05, "height_m": 0.0}
    assert "see report.html" in capsys.readouterr().out


MISTAKES = {
    "an unknown format": (("--format", "pdf", *HERE), "take qgc, ardupilot, kml, geojson, csv"),
    "a misspelt format": (("--format", "qgcc", *HERE), "--format 'qgcc': did you mean qgc?"),
    "an unknown firmware": (("--format", "qgc", "--firmware", "cat", *HERE), "copter-4.7, px4"),
    "a format of another firmware": (
        ("--format", "ardupilot", "--firmware", "px4", *HERE),
        "--format ardupilot is of ArduPilot; take qgc",
    ),
    "no place": (("--format", "qgc"), "has no [place] on the Earth; give --place"),
    "no tolerance": (("--format", "qgc", "--tolerance", "0", *HERE), "--tolerance 0"),
    "no corner": (("--format", "qgc", "--corner", "nan", *HERE), "--corner nan"),
    "a storm": (("--format", "qgc", *HERE, "--wind", "61"), "--wind 61: should be between 0 and"),
    "no slack": (("--format", "qgc", *HERE, "--min-slack", "-1"), "--min-slack -1"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_refused_in_one_line(case, directory, tmp_path, capsys):
    arguments, said = MISTAKES[case]
    assert said in refused(capsys, directory, "--out", str(tmp_path / "no"), *arguments)
    assert not (tmp_path / "no").exists()


def test_what_is_no_flight_and_a_full_folder_are_refused(directory, tmp_path, capsys):
    assert "nowhere" in refused(capsys, "nowhere", "--format", "qgc", "--out", "no", *HERE)
    (tmp_path / "mine.txt").write_text("mine")
    err = refused(capsys, directory, "--format", "qgc", "--out", str(tmp_path), *HERE)
    assert "is not empty" in err


def test_files_of_another_export_are_not_left_beside_the_new_ones(directory, tmp_path, capsys):
    out = str(tmp_path)
    (tmp_path / "uas_9.plan").write_text("old")
    err = refused(capsys, directory, "--format", "qgc", "--out", out, *HERE, "--overwrite")
    assert "holds uas_9.plan of another export" in err
    (tmp_path / "uas_9.plan").unlink()
    for _ in range(2):
        assert (
            main(["export", directory, "--format", "csv", "--out", out, *HERE, "--overwrite"]) == 0
        )
    assert {name for kind in FORMATS for name in _endings(kind)} == set(ENDINGS)


def _endings(kind):
    flight = random_flight(1)
    made = exported(flight, Place(latitude_deg=1, longitude_deg=2), kind)
    return {Path(name).suffix for name in made.files if not name.startswith("report")}


def test_a_flight_that_is_not_home_is_refused():
    scenario = load_scenario("open_field")
    flight = rollout(scenario, load_planner("nearest-waypoint"), 0, max_steps=5)
    with pytest.raises(InputError, match="uas_1 is still in the air"):
        exported(flight, Place(latitude_deg=0, longitude_deg=0), "csv")


def test_a_place_is_given_once(flight, place):
    there = flight.scenario.model_copy(update={"place": place})
    placed = type(flight)(**{**vars(flight), "scenario": there})
    with pytest.raises(InputError, match=r"has a \[place\] already"):
        exported(placed, place, "csv")
    assert exported(placed, None, "csv").files == exported(flight, place, "csv").files


def test_a_file_keeps_clear_of_what_events_added_and_asks_for_what_they_left():
    pole = box("pole", (70.0, 102.0, -40.0), (72.0, 104.0, 0.0), safe_distance_m=1.0)
    events: Any = (
        {"kind": "obstacle_added", "at_s": 2.0, **pole},
        {"kind": "waypoint_dropped", "at_s": 3.0, "waypoint": 2},
    )
    points = [waypoint((north_m, 100.0, -20.0), 5.0) for north_m in (40.0, 120.0, 180.0)]
    scenario = meadow(((10.0, 100.0, -1.0),), waypoints=points)
    flight = rollout(scenario.model_copy(update={"events": events}), "nearest-waypoint")
    there = Place(latitude_deg=0, longitude_deg=0)
    (with_pole,) = exported(flight, there, "csv").data["uas"]
    (without,) = exported(dataclasses.replace(flight, events=()), there, "csv").data["uas"]
    assert 0.5 < with_pole["room_to_contact_m"] < 2.5 < without["room_to_contact_m"]
    assert exported(flight, there, "csv").data["waypoints"] == 2
