"""A UAS that takes off again has a file for each sortie, read by parsers that are not ours."""

import csv
import io
import json
import warnings
import xml.etree.ElementTree as ElementTree
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("pyproj")

from pymavlink import mavwp
from qgc_loader import problems
from small_worlds import meadow, waypoint
from test_export import metres
from test_lateness import FIELD, HOMES, flown

from uas_coverage_env import rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import fly_sorties
from uas_coverage_env.flight.take_offs import sorties_of
from uas_coverage_env.operations import (
    ExportOptions,
    LocalFrame,
    flown_flight,
    make_export,
    read_log,
)
from uas_coverage_env.operations.stream import RealClock, StreamOptions, stream_flight
from uas_coverage_env.planning.execution.lateness import Timed, pairs_of
from uas_coverage_env.planning.execution.separation import ready_s
from uas_coverage_env.scenario import Place
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.world import GoTo

HERE = Place(latitude_deg=47.0, longitude_deg=8.0, height_m=400.0)
SWAP_S = 20.0
SLACK_S = 20.0
STARTS_M = (60.0, 60.0, -1.0), (60.0, 120.0, -1.0)
# out and back, too far apart for one charge
PLACES = [(150.0, 40.0), (40.0, 170.0), (160.0, 160.0), (30.0, 30.0), (165.0, 100.0), (95.0, 30.0)]
FLY = partial(rollout, planner="nearest-waypoint")


def mission(together, soc=0.29):
    waypoints = [waypoint((*place, -20.0)) for place in PLACES]
    scenario = meadow(STARTS_M, waypoints=waypoints, max_steps=2000)
    fleet = tuple(uas.model_copy(update={"soc_0": soc}) for uas in scenario.uas)
    sorties = Sorties(packs=6, swap_s=SWAP_S, together=together)
    return scenario.model_copy(update={"uas": fleet, "sorties": sorties, "place": HERE})


@pytest.fixture(scope="module")
def flight():
    """Each UAS swaps on its own."""
    found = FLY(mission(together=False))
    assert len(found.swaps) > 1
    assert found.covered[-1] == len(PLACES)
    return found


@pytest.fixture(scope="module")
def chain():
    """All swap together."""
    return list(fly_sorties(mission(together=True), FLY, 6))


def made_of(flight, kind, **changes):
    return make_export(flight, ExportOptions(kind, **({"min_slack_s": SLACK_S} | changes)))


def names_of(flight):
    return [
        f"{name}-sortie-{n}"
        for i, name in enumerate(flight.names)
        for n in range(1, len(sorties_of(flight, i)) + 1)
    ]


def test_the_sorties_of_a_uas_begin_and_end_where_the_flight_says(flight):
    for i, name in enumerate(flight.names):
        swaps = [swap for swap in flight.swaps if swap.uas == name]
        sorties = sorties_of(flight, i)
        assert [s.first for s in sorties] == [0, *(int(swap.time_s) for swap in swaps)]
        assert [s.landed for s in sorties[:-1]] == [int(swap.landed_s) for swap in swaps]
        assert [s.rest_s for s in sorties[1:]] == [s.time_s - s.landed_s for s in swaps]
        assert sorties[-1].landed == flight.last_sample[i]
        assert all(sortie.fresh for sortie in sorties)


def test_every_sortie_is_a_plan_of_one_take_off_and_one_landing(flight):
    made = made_of(flight, "qgc")
    names = names_of(flight)
    assert len(names) > 2
    assert {n for n in made.files if n.endswith(".plan")} == {f"{name}.plan" for name in names}
    for name in names:
        assert problems(made.files[f"{name}.plan"]) == []
        items = json.loads(made.files[f"{name}.plan"])["mission"]["items"]
        commands = [item["command"] for item in items]
        assert (commands.count(22), commands.count(21)) == (1, 1)
        assert f"{name}.param" in made.files


def test_the_corners_of_every_sortie_are_read_back_where_they_were_planned(flight, tmp_path):
    made = made_of(flight, "ardupilot")
    for uas in made.data["uas"]:
        i = flight.names.index(uas["uas"])
        sortie = sorties_of(flight, i)[uas["sortie"] - 1]
        (tmp_path / "file").write_text(made.files[f"{uas['name']}.waypoints"])
        loader = mavwp.MAVWPLoader()
        with warnings.catch_warnings():  # it leaves the file open
            warnings.simplefilter("ignore", ResourceWarning)
            loader.load(str(tmp_path / "file"))
        items = [loader.wp(n) for n in range(1, loader.count())]
        ends = [metres(w.x, w.y, w.z, HERE) for w in items if w.command == 16]
        assert len(ends) == len(uas["legs"])
        path = flight.x[sortie.first : sortie.landed, i, :3]
        assert max(np.linalg.norm(path - end, axis=1).min() for end in ends) < 2.5


def test_together_the_files_pass_every_waypoint_once(flight, chain):
    for mission_flown in (flight, chain):
        made = made_of(mission_flown, "csv")
        assert made.data["waypoints_passed"] == made.data["waypoints"] == len(PLACES)
        assert sum(uas["waypoints_passed"] for uas in made.data["uas"]) == len(PLACES)


def by_uas(data):
    found = {}
    for uas in data["uas"]:
        found.setdefault(uas["uas"], []).append(uas)
    return found


def test_every_sortie_starts_with_its_pack_once_it_is_in(flight):
    made = made_of(flight, "qgc")
    for uas in made.data["uas"]:
        assert uas["soc_start"] == 0.29
        assert uas["soc_landed"] < uas["legs"][-1]["soc"] < uas["legs"][0]["soc"] < 0.29
    for sorties in by_uas(made.data).values():
        for one, after in pairwise(sorties):
            assert after["begins_s"] >= ready_s(one["lands_s"], SWAP_S)
    order = made.data["turnarounds"]
    assert [entry["lands_s"] for entry in order] == sorted(entry["lands_s"] for entry in order)
    assert len(order) == len(flight.swaps)
    for entry in order:
        assert entry["fresh_pack"]
        assert entry["starts_s"] - entry["lands_s"] == pytest.approx(entry["on_ground_s"], abs=0.1)
    page = made.files["report.html"]
    assert page.count("swap its pack; load uas_") == len(order)
    assert "<h2>Order</h2>" in page


def test_sorties_that_overlap_in_time_keep_the_slack_that_is_asked(flight):
    assert min(p["slack_s"] or 99.0 for p in made_of(flight, "qgc", min_slack_s=0.0).data["pairs"])
    made = made_of(flight, "qgc")
    clock = {uas["name"]: uas for uas in made.data["uas"]}
    assert made.data["pairs"]
    for pair in made.data["pairs"]:
        one, other = (clock[name] for name in pair["uas"])
        assert one["uas"] != other["uas"]
        assert pair["slack_s"] is None or pair["slack_s"] >= SLACK_S
        assert one["begins_s"] - other["lands_s"] <= SLACK_S
        assert other["begins_s"] - one["lands_s"] <= SLACK_S


def test_files_on_a_clock_are_as_far_apart_in_time_as_when_they_begin():
    one, other = flown(HOMES[0], [(100.0, 40.0, -10.0)]), flown(HOMES[1], [(100.0, 0.0, -10.0)])

    def slack_s(begins_s, since_s):
        second = Timed(1, "b", other, begins_s, since_s)
        return pairs_of(FIELD, [Timed(0, "a", one), second])[0].slack_s

    together = slack_s(0.0, 0.0)
    assert slack_s(100.0, 100.0) > 50.0 + together
    # one that stands at its home, where the other lands beside it, is no nearer than it ever was
    assert slack_s(100.0, 0.0) == slack_s(100.0, 100.0)
    # two files of one UAS are flown one after the other
    assert pairs_of(FIELD, [Timed(0, "a", one), Timed(0, "b", other)]) == []


def test_a_uas_that_rests_below_a_path_allows_no_delay():
    over = flown(HOMES[0], [(0.0, 40.0, -4.0), (100.0, 40.0, -10.0)])
    there = flown(HOMES[1], [(-80.0, 40.0, -10.0)])
    waiting = Timed(1, "b", there, begins_s=400.0, since_s=0.0)
    assert pairs_of(FIELD, [Timed(0, "a", over), waiting])[0].slack_s == 0.0
    away = Timed(1, "b", there, begins_s=400.0, since_s=350.0)
    assert pairs_of(FIELD, [Timed(0, "a", over), away])[0].slack_s > 100.0


def test_sorties_flown_together_begin_when_all_have_landed_and_swapped(chain):
    made = made_of(chain, "qgc")
    begins = sorted({uas["begins_s"] for uas in made.data["uas"]})
    assert len(begins) == len(chain) > 1
    for before, at_s in pairwise(begins):
        lands_s = [uas["lands_s"] for uas in made.data["uas"] if uas["begins_s"] == before]
        assert at_s == pytest.approx(ready_s(max(lands_s), SWAP_S), abs=1.0)
    assert all(problems(t) == [] for name, t in made.files.items() if name.endswith(".plan"))


class LeavesOne:
    """The first UAS covers a near waypoint, the second a far one, then the first one the last."""

    def __init__(self):
        self.resets = 0

    def reset(self, brief, seed):
        self.resets += 1

    def act(self, swarm):
        wanted = {"uas_1": 0, "uas_2": 1} if self.resets == 1 else {"uas_1": 2}
        open_ones = {name: w for name, w in wanted.items() if swarm.uncovered[w]}
        return {name: GoTo(open_ones.get(name)) for name in swarm.active}


def test_a_uas_that_takes_off_again_on_the_same_pack_begins_with_what_is_left():
    places = (100.0, 60.0), (170.0, 130.0), (150.0, 90.0)
    waypoints = [waypoint((*place, -20.0)) for place in places]
    field = meadow(STARTS_M, waypoints=waypoints, max_steps=800)
    scenario = field.model_copy(update={"relaunch": True, "place": HERE})
    made = made_of(rollout(scenario, LeavesOne()), "qgc")
    (entry,) = made.data["turnarounds"]
    assert not entry["fresh_pack"]
    assert entry["soc_next"] == pytest.approx(entry["soc_landed"], abs=1e-3)
    assert "it flies on with the same pack" in made.files["report.html"]
    names = [uas["name"] for uas in made.data["uas"]]
    assert names == ["uas_1-sortie-1", "uas_1-sortie-2", "uas_2-sortie-1"]
    assert made.data["uas"][1]["soc_start"] == entry["soc_next"]


def test_tracks_are_one_file_for_each_uas_with_a_line_for_each_sortie(flight, chain):
    for mission_flown in (flight, chain):
        made = {k: made_of(mission_flown, k) for k in ("kml", "geojson", "csv")}
        for name, sorties in by_uas(made["csv"].data).items():
            numbers = [uas["sortie"] for uas in sorties]
            features = json.loads(made["geojson"].files[f"{name}.geojson"])["features"]
            lines = [
                f["properties"]["sortie"] for f in features if f["properties"]["line"] != "legs"
            ]
            assert lines == numbers
            root = ElementTree.fromstring(made["kml"].files[f"{name}.kml"])
            titles = [e.text for e in root.findall(".//{*}Placemark/{*}name")]
            assert titles == [f"sortie {n}, {kind}" for n in numbers for kind in ("flown", "legs")]
            rows = list(csv.DictReader(io.StringIO(made["csv"].files[f"{name}.csv"])))
            times_s = [float(row["t_s"]) for row in rows]
            assert times_s == sorted(set(times_s))
            assert sorted({int(row["sortie"]) for row in rows}) == numbers
            for uas in sorties:
                at_s = [float(row["t_s"]) for row in rows if int(row["sortie"]) == uas["sortie"]]
                assert at_s[0] == uas["planned_begins_s"]
                assert len(at_s) >= uas["planned_s"]


def test_a_table_of_one_flight_leaves_no_second_out(flight):
    rows = list(csv.DictReader(io.StringIO(made_of(flight, "csv").files["uas_1.csv"])))
    assert [float(row["t_s"]) for row in rows] == list(range(flight.last_sample[0]))


def test_a_table_of_several_sorties_holds_as_many_flights_of_which_one_is_judged(flight, tmp_path):
    (tmp_path / "uas_1.csv").write_text(made_of(flight, "csv").files["uas_1.csv"])
    (log,) = read_log(tmp_path / "uas_1.csv")
    swaps = [swap for swap in flight.swaps if swap.uas == "uas_1"]
    with pytest.raises(InputError, match=f"holds {len(swaps) + 1} flights: 1 .*choose with --flig"):
        flown_flight(flight, {"uas_1": log}, LocalFrame(HERE))
    again = flown_flight(flight, {"uas_1": log}, LocalFrame(HERE), {"uas_1": 2}).flight
    flown_s = swaps[1].landed_s - swaps[0].time_s
    assert again.last_sample[0] * again.scenario.dt_s == pytest.approx(flown_s, abs=2.0)
    assert again.soc[0, 0] == pytest.approx(0.29)  # with a fresh pack


def test_the_command_exports_both_forms_and_says_what_to_swap_when(flight, chain, tmp_path, capsys):
    flight.save(tmp_path / "alone")
    for n, sortie in enumerate(chain, 1):
        sortie.save(tmp_path / "together" / f"sortie_{n}")
    summary = {"sorties": [{}] * len(chain)}
    (tmp_path / "together" / "sorties.json").write_text(json.dumps(summary))
    for form in ("alone", "together"):
        out = tmp_path / f"files_{form}"
        command = ["export", str(tmp_path / form), "--format", "ardupilot", "--out", str(out)]
        assert main(command) == 0
        said = capsys.readouterr().out
        assert "swap its pack, start uas_1-sortie-2 at" in said
        assert (out / "uas_2-sortie-2.waypoints").is_file()
    (tmp_path / "together" / "sorties.json").write_text("{}")
    assert main([*command, "--overwrite"]) == 2
    assert "holds no list of sorties" in capsys.readouterr().err


def test_stream_refuses_it_in_a_line(flight):
    with pytest.raises(InputError, match="lands and takes off again, which stream cannot wait for"):
        stream_flight(flight, HERE, {}, StreamOptions(), RealClock(), print)
