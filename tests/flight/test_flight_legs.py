"""The legs of a flight: what each took, from the start by the covered waypoints to the landing."""

import csv
import json
import math

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.flight.legs import legs_of
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.scenario import Scenario


def nearest(scenario, **options):
    return rollout(scenario, load_planner("nearest-waypoint"), **options)


@pytest.fixture(scope="module")
def flight():
    starts = ((20.0, 20.0, -1.0), (180.0, 20.0, -1.0))
    points = [waypoint((x, y, -20.0), 6.0) for x in (40.0, 160.0) for y in (60.0, 140.0)]
    return nearest(meadow(starts, waypoints=points))


def test_legs_lead_from_start_to_landing_and_their_parts_add_up(flight):
    legs = legs_of(flight)
    for i, name in enumerate(flight.names):
        mine = [leg for leg in legs if leg.uas == name]
        assert mine[0].leaves == "start"
        assert mine[-1].reaches == "landing"
        assert [leg.leaves for leg in mine[1:]] == [leg.reaches for leg in mine[:-1]]
        assert [leg.begins_s for leg in mine[1:]] == [leg.ends_s for leg in mine[:-1]]
        assert mine[-1].ends_s == flight.last_sample[i] * flight.scenario.dt_s
        assert sum(leg.energy_Wh for leg in mine) == pytest.approx(energy_Wh(flight)[i])
        steps_m = np.linalg.norm(np.diff(flight.x[:, i, :3], axis=0), axis=1)
        assert sum(leg.way_m for leg in mine) == pytest.approx(steps_m.sum())
        assert (mine[0].soc_begins, mine[-1].soc_ends) == (flight.soc[0, i], flight.soc[-1, i])
        assert mine[-1].above_reserve == pytest.approx(flight.soc[-1, i] - 0.25)


def test_each_waypoint_ends_one_leg_of_the_uas_that_covered_it(flight):
    ends = [leg for leg in legs_of(flight) if leg.reaches.startswith("waypoint")]
    assert sorted(leg.reaches for leg in ends) == [f"waypoint {w}" for w in range(4)]
    for leg in ends:
        k, i = round(leg.ends_s), flight.names.index(leg.uas)
        place_m = flight.scenario.waypoints[int(leg.reaches.split()[1])].position_m
        assert math.dist(flight.x[k, i, :3], place_m) <= 6.0
        assert leg.begins_s == 0.0 or math.dist(flight.x[k - 1, i, :3], place_m) > 6.0


def test_what_is_left_on_landing_counts_from_the_reserve(flight):
    data = flight.scenario.model_dump(mode="json", by_alias=True) | {"reserve": {"share": 0.4}}
    kept = nearest(Scenario.model_validate(data))
    assert legs_of(kept)[-1].above_reserve == pytest.approx(kept.soc[-1, 1] - 0.4)


def test_a_flight_that_was_broken_off_ends_in_the_air(flight):
    legs = legs_of(nearest(flight.scenario, max_steps=3))
    assert {leg.reaches for leg in legs} == {"in the air"}
    assert sum(leg.energy_Wh for leg in legs) > 0.0


def test_a_uas_with_several_packs_has_a_start_for_each():
    points = [waypoint((190.0, 190.0, -40.0), 5.0)]
    scenario = meadow(((20.0, 20.0, -1.0),), waypoints=points, max_steps=900)
    data = scenario.model_dump(mode="json", by_alias=True)
    data["waypoints"][0]["again_after_s"] = (120.0,)
    data["sorties"] = {"packs": 2, "swap_s": 10.0, "together": False}
    flight = nearest(Scenario.model_validate(data))
    assert len(flight.swaps) == 1
    legs = legs_of(flight)
    assert [leg.leaves for leg in legs] == ["start", "waypoint 0", "start", "waypoint 1"]
    assert legs[1].ends_s == flight.swaps[0].landed_s
    assert legs[2].begins_s == flight.swaps[0].time_s
    assert sum(leg.energy_Wh for leg in legs) == pytest.approx(energy_Wh(flight)[0])


def test_file_and_command_tell_the_same(flight, tmp_path, capsys):
    flight.save(tmp_path / "flight")
    with (tmp_path / "flight" / "legs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert main(["show", str(tmp_path / "flight"), "--legs", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["legs"]
    assert [row["reaches"] for row in rows] == [leg["reaches"] for leg in told]
    assert [float(row["energy_Wh"]) for row in rows] == [leg["energy_Wh"] for leg in told]
    assert main(["show", str(tmp_path / "flight"), "--legs"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("landing") == 2
