"""Exports flown by a small ArduCopter whose radio, pack or patience fails."""

import itertools

import numpy as np
import pytest

pytest.importorskip("pyproj")

from copter_model import RTL, SMART_RTL, Copter
from small_worlds import box, meadow, waypoint
from test_export import random_flight

from uas_coverage_env import rollout
from uas_coverage_env.operations import ExportOptions, LocalFrame, make_export
from uas_coverage_env.scenario import Place

HERE = Place(latitude_deg=47.0, longitude_deg=8.0, height_m=400.0)
START_M = (20.0, 100.0, -1.0)
BEYOND = [
    waypoint((north_m, east_m, -20.0), 4.0)
    for north_m in (125.0, 150.0, 175.0)
    for east_m in (30.0, 65.0, 100.0, 135.0, 170.0)
]
SCHOOL = box("school", (90.0, 70.0, -60.0), (110.0, 130.0, 0.0), 3.0) | {"kind": "no_fly"}
TOWER = box("tower", (90.0, 70.0, -30.0), (110.0, 130.0, 0.0), 3.0)


def flown(obstacles=(), starts_m=(START_M,), waypoints=BEYOND, **changes):
    scenario = meadow(starts_m, obstacles=obstacles, waypoints=waypoints, max_steps=600, **changes)
    return rollout(scenario.model_copy(update={"place": HERE}), "nearest-waypoint")


@pytest.fixture(scope="module", params=[(), (TOWER,), (SCHOOL,)], ids=["field", "tower", "school"])
def flight(request):
    return flown(request.param)


def copters(flight, folder, **options):
    """The vehicles with what an export writes for them, and the export."""
    made = make_export(flight, ExportOptions("ardupilot", **options))
    found = {}
    for uas in made.data["uas"]:
        path = folder / f"{uas['name']}.waypoints"
        path.write_text(made.files[path.name])
        index = flight.names.index(uas["uas"])
        param = made.files[f"{uas['name']}.param"]
        vehicle = flight.scenario.vehicles[index]
        found[uas["name"]] = Copter(path, param, LocalFrame(flight.scenario.place), vehicle)
    return found, made


def deepest_m(scenario, places_m):
    """How deep a path is in an obstacle or a zone, or outside of the fence; negative: it is not."""
    depths = [scenario.fence.signed_distance(places_m).max()]
    depths += [-hull.signed_distance(places_m).min() for hull in scenario.hulls]
    return max(depths)


def is_home(places_m):
    return np.linalg.norm(places_m[-1] - (*START_M[:2], 0.0)) < 0.5


@pytest.mark.parametrize("firmware", ["copter-4.6", "copter-4.7", None])
def test_a_radio_lost_at_any_time_leaves_the_mission_as_it_was_checked(flight, tmp_path, firmware):
    (copter,), _ = (list(copters(flight, tmp_path, firmware=firmware)[0].values()), None)
    planned = copter.planned().places_m
    for lost_s in np.arange(5.0, 0.1 * len(planned), 15.0):
        done = copter.fly(radio_lost_s=lost_s)
        assert done.modes == []
        assert np.array_equal(done.places_m, planned)
        assert deepest_m(flight.scenario, done.places_m[50:-50]) < 0.0


def test_the_model_itself_flies_into_the_zone_where_nothing_is_set(tmp_path):
    flight = flown((SCHOOL,))
    (copter,) = copters(flight, tmp_path)[0].values()
    copter.values |= {"FS_OPTIONS": 0.0, "FS_THR_ENABLE": 1.0}
    planned_m = copter.planned().places_m
    behind = np.linalg.norm(planned_m - (150.0, 100.0, -20.0), axis=1).argmin()
    done = copter.fly(radio_lost_s=0.1 * behind)
    assert [mode for _, mode in done.modes] == [RTL]
    assert deepest_m(flight.scenario, done.places_m[50:-50]) > 3.0


@pytest.mark.parametrize("share", [1.0, 0.6, 0.4, 0.3])
def test_a_pack_that_holds_less_than_it_should_brings_its_uas_home_past_all_there_is(
    flight, tmp_path, share
):
    (copter,), _ = (list(copters(flight, tmp_path)[0].values()), None)
    done = copter.fly(pack_share=share)
    assert not done.crashed
    assert is_home(done.places_m)
    assert done.soc > 0.0
    assert deepest_m(flight.scenario, done.places_m[50:-50]) < 0.0
    assert (share == 1.0) <= (done.modes == [])  # one that is sound flies its mission


def test_a_weak_pack_does_end_a_flight_early_and_the_way_is_the_one_that_the_report_names(
    flight, tmp_path
):
    found, made = copters(flight, tmp_path)
    (copter,), (uas,) = found.values(), made.data["uas"]
    told = {"return": RTL, "retrace": SMART_RTL}[uas["low_charge"]["action"]]
    done = copter.fly(pack_share=0.25)
    assert [mode for _, mode in done.modes] == [told]
    names = {obstacle.name for obstacle in flight.scenario.obstacles}
    assert uas["low_charge"]["action"] == ("retrace" if "school" in names else "return")
    assert (uas["return_height_m"] is None) == ("school" in names)


def test_the_model_itself_crashes_where_nothing_triggers_its_action(tmp_path):
    (copter,) = copters(flown(), tmp_path)[0].values()
    copter.values |= {"BATT_LOW_MAH": 0.0, "BATT_LOW_VOLT": 10.5}
    assert copter.fly(pack_share=0.1).crashed


def test_from_every_second_a_return_is_clear_and_takes_no_longer_than_the_report_counts(
    flight, tmp_path
):
    found, made = copters(flight, tmp_path)
    (copter,), (uas,) = found.values(), made.data["uas"]
    vehicle = flight.scenario.vehicles[0]
    action = {"return": RTL, "retrace": SMART_RTL}[uas["low_charge"]["action"]]
    places = list(copter.planned().places_m)
    up = next(n for n, p in enumerate(places) if -p[2] >= -flight.scenario.uas[0].start_m[2] + 3.0)
    down = len(places) - next(n for n, p in enumerate(places[::-1]) if -p[2] >= 4.0)
    for k in range(up + 10, down, 50):
        way = np.array(copter.way_home(action, places[: k + 1]))
        assert deepest_m(flight.scenario, way[:-30]) < 0.0
        takes_mAh = 0.1 * len(way) * copter._electrics(0.3)[0] / 3.6
        assert takes_mAh < copter.values["BATT_LOW_MAH"] - copter.values["BATT_CRT_MAH"] + 1.0
    for leg in uas["legs"]:
        k = round(leg["time_s"] / 0.1)
        way = copter.way_home(action, places[: k + 1])
        takes = 0.1 * len(way) * copter._electrics(leg["soc"])[0] / 3600.0
        assert leg["home"] > 0.97 * takes / vehicle.battery.capacity_Ah


CROSSING = (
    ((20.0, 60.0, -1.0), (20.0, 140.0, -1.0)),
    [waypoint((170.0, 140.0, -20.0), 6.0), waypoint((150.0, 40.0, -20.0), 6.0)],
)


class Crosses:
    """Each UAS flies to the waypoint that is ahead of the other."""

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        from uas_coverage_env.world import GoTo

        return {
            name: GoTo(w if swarm.uncovered[w] else None)
            for w, name in enumerate(("uas_1", "uas_2"))
            if name in swarm.active
        }


@pytest.fixture(scope="module")
def crossing():
    starts_m, waypoints = CROSSING
    scenario = meadow(starts_m, waypoints=waypoints, max_steps=600)
    return rollout(scenario.model_copy(update={"place": HERE}), Crosses())


@pytest.mark.parametrize("arm_wait_s", [0.0, 5.0, 60.0])
def test_the_documented_order_keeps_uas_apart_however_long_one_waits_before_arming(
    crossing, tmp_path, arm_wait_s
):
    found, made = copters(crossing, tmp_path, min_slack_s=20.0)
    assert any(uas["start_delay_s"] > 0 for uas in made.data["uas"])
    (pair,) = made.data["pairs"]
    one_m, other_m = (copter.planned(arm_wait_s).places_m for copter in found.values())
    for late_s in (-19.0, -10.0, 0.0, 10.0, 19.0):
        assert least_m(one_m, other_m, late_s) > pair["kept_m"] - 0.1
    assert least_m(one_m, other_m, 0.0) == pytest.approx(pair["least_distance_m"], abs=0.5)


def least_m(one, other, late_s):
    shift = round(abs(late_s) / 0.1)
    one, other = (one, other) if late_s >= 0.0 else (other, one)
    other = np.vstack([np.tile(other[0], (shift, 1)), other])
    steps = max(len(one), len(other))
    a, b = (np.pad(p, ((0, steps - len(p)), (0, 0)), mode="edge") for p in (one, other))
    return np.maximum(np.hypot(*(a - b)[:, :2].T), np.abs((a - b)[:, 2])).min()


def test_no_file_holds_a_wait_that_passes_on_the_ground(crossing, tmp_path):
    made = make_export(crossing, ExportOptions("ardupilot", min_slack_s=20.0))
    for name, text in made.files.items():
        if name.endswith(".waypoints"):
            commands = [int(line.split("\t")[3]) for line in text.splitlines()[1:]]
            assert 93 not in commands
            assert commands[1] == 22


def test_the_page_says_first_what_cannot_be_promised_and_what_vehicles_do_and_do_not_know(flight):
    made = make_export(flight, ExportOptions("ardupilot"))
    page = made.files["report.html"]
    (uas,) = made.data["uas"]
    for event, then in uas["failures"].items():
        assert event in page
        assert then in page
        assert "{" not in then
    zones = sum(obstacle.kind == "no_fly" for obstacle in flight.scenario.obstacles)
    others = len(flight.scenario.obstacles) - zones
    assert f"{zones} no-fly zone" in page
    assert f"they do not know {others} obstacle" in page


def test_a_way_home_that_the_plan_cannot_afford_is_said_first(tmp_path):
    # the zone has to be flown round, so that it retraces its way; there is charge for one way
    flight = flown((SCHOOL,), soc_0=0.36, dod_max=0.85)
    (copter,), made = copters(flight, tmp_path)[0].values(), copters(flight, tmp_path)[1]
    (uas,) = made.data["uas"]
    assert uas["low_charge"]["suffices"] == (uas["low_charge"]["soc"] <= uas["legs"][-1]["soc"])
    said = [note for note in made.notes if "has no safe way home for low charge" in note]
    assert bool(said) != uas["low_charge"]["suffices"]
    assert copter.values["BATT_CAPACITY"] == 1800


def test_an_early_way_home_is_close_to_another_uas_only_when_the_report_says_so(crossing, tmp_path):
    found, made = copters(crossing, tmp_path, min_slack_s=0.0)
    (pair,), seen = made.data["pairs"], 0
    for uas, other in itertools.permutations(made.data["uas"], 2):
        spans = uas["low_charge"]["close_to"]
        note = f"{uas['name']} comes too close to {other['name']} if it comes home early"
        assert any(note in said for said in made.notes) == bool(spans)
        one, two = found[uas["name"]], found[other["name"]].planned().places_m
        places = list(one.planned().places_m)
        for k in range(80, len(places) - 100, 20):
            way = np.array(one.way_home(RTL, places[: k + 1]))
            there = two[np.minimum(k + np.arange(len(way)), len(two) - 1)]
            least = np.maximum(np.hypot(*(way - there)[:, :2].T), np.abs((way - there)[:, 2])).min()
            if least < pair["kept_m"] - 1.5:
                seen += 1
                assert any(s["from_s"] - 2.0 <= 0.1 * k <= s["to_s"] + 2.0 for s in spans)
    assert seen > 0 or all(uas["return_height_m"] > 25.0 for uas in made.data["uas"][1:])


@pytest.mark.parametrize("seed", range(4))
def test_random_towns_bring_a_weak_pack_home(seed, tmp_path):
    flight = random_flight(seed)
    placed = flight.scenario.model_copy(update={"place": HERE})
    flight = type(flight)(**{**vars(flight), "scenario": placed})
    found, made = copters(flight, tmp_path, min_slack_s=0.0)
    for (name, copter), share in itertools.product(found.items(), (1.0, 0.12, 0.07)):
        uas = next(u for u in made.data["uas"] if u["name"] == name)
        done = copter.fly(pack_share=share)
        assert (share == 1.0) <= (not done.modes)
        if uas["low_charge"]["suffices"] and not any(name in note for note in made.notes):
            assert deepest_m(placed, done.places_m[60:-60]) < 0.0
