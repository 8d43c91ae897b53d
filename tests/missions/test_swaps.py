"""A mission larger than one charge in one flight: each UAS swaps packs while the others fly on."""

import json
from functools import partial

import numpy as np
import pytest
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory import Trajectory

from uas_coverage_env import Flight, generate_scenario, independent_check, load_scenario, rollout
from uas_coverage_env.bound import MissionBound
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import rest_of
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import accomplished, energy_Wh, packs_used
from uas_coverage_env.flight.record import MODES
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.replay.flight_data import flight_data

SWAP_S = 20.0
FLY = partial(rollout, planner="nearest-waypoint")


def with_charge(scenario, soc, **changes):
    fleet = tuple(uas.model_copy(update={"soc_0": soc}) for uas in scenario.uas)
    return scenario.model_copy(update={"uas": fleet, **changes})


class Counted(Trajectory):
    """Counts how often it is told of a mission."""

    resets = 0

    def reset(self, brief, seed):
        self.resets += 1
        super().reset(brief, seed)


class CountedNearest(NearestWaypoint):
    resets = 0

    def reset(self, brief, seed):
        self.resets += 1
        super().reset(brief, seed)


@pytest.fixture(scope="module")
def mission():
    """Some waypoints of the village, too many for what is in the batteries."""
    village = load_scenario("village")
    sorties = {"packs": 4, "swap_s": SWAP_S, "together": False}
    return with_charge(village, 0.36, waypoints=village.waypoints[:16], sorties=sorties)


@pytest.fixture(scope="module")
def flight(mission):
    return FLY(mission)


def test_one_flight_covers_it_with_several_packs(flight):
    assert accomplished(flight)
    assert flight.ended == "complete"
    assert {swap.uas for swap in flight.swaps} == set(flight.names)
    assert packs_used(flight) == {name: 2 for name in flight.names}
    assert not flight.breaches


def test_every_swap_begins_with_a_landing_and_ends_with_a_fresh_pack(flight, mission):
    for swap in flight.swaps:
        i = flight.names.index(swap.uas)
        landed, took_off = int(swap.landed_s), int(swap.time_s)
        assert took_off - landed == SWAP_S
        assert flight.soc[took_off, i] == mission.uas[i].soc_0
        assert (flight.soc[landed:took_off, i] < mission.uas[i].soc_0).all()
        assert (flight.x[landed:took_off, i, :3] == flight.x[landed, i, :3]).all()
        assert not flight.current_A[landed:took_off, i].any()
        assert flight.current_A[took_off, i] > 0.0
        assert {MODES[mode] for mode in flight.mode[landed:took_off, i]} == {"return"}
        assert flight.resting[:, i].sum() == SWAP_S


def test_planners_see_packs_that_are_left_and_when_a_uas_is_ready(mission, flight):
    seen = []
    FLY(mission, max_steps=int(flight.swaps[-1].time_s) + 2, on_step=lambda p: seen.append(p.swarm))
    for swap in flight.swaps:
        i, landed, took_off = flight.names.index(swap.uas), int(swap.landed_s), int(swap.time_s)
        rests = [seen[k] for k in range(landed, took_off)]
        assert [swarm.ground_s[i] for swarm in rests] == list(range(int(SWAP_S), 0, -1))
        assert {int(swarm.packs_left[i]) for swarm in (seen[0], *rests)} == {3}
        assert (seen[took_off].packs_left[i], seen[took_off].ground_s[i]) == (2, 0.0)


def test_planners_of_other_missions_see_no_packs():
    swarm = first_sight(MissionBrief.of(load_scenario("village")))
    assert not len(swarm.packs_left)
    assert not len(swarm.ground_s)


class OneCharge(Trajectory):
    """As if it knew of no packs."""

    def reset(self, brief, seed):
        super().reset(brief.model_copy(update={"sorties": None}), seed)


@pytest.fixture(scope="module")
def large_mission(mission):
    """A town of too many waypoints for what is in the batteries, in which nothing moves."""
    town = generate_scenario(7, n_uas=2, n_waypoints=60)
    return with_charge(town, 0.36, sorties=mission.sorties)


def test_a_planner_that_knows_packs_is_done_earlier_than_one_that_does_not(large_mission):
    options = Trajectory.Options(orders=1, moves=20_000, programs=20, idle_work=0)
    knows, plans_charge_by_charge = (
        rollout(large_mission, planner(options)) for planner in (Trajectory, OneCharge)
    )
    assert accomplished(knows)
    assert not knows.breaches
    assert knows.steps < plans_charge_by_charge.steps


@pytest.mark.parametrize(("planner", "charge"), [(Trajectory, 0.36), (Tour, 0.42)])
def test_before_take_off_each_waypoint_is_for_now_or_for_a_fresh_pack(
    large_mission, planner, charge
):
    made = planner(planner.Options(moves=20_000))
    made.reset(MissionBrief.of(with_charge(large_mission, charge)), 0)
    order = made.mission_plan.order if planner is Trajectory else made.flight.schedule.order
    visits = np.concatenate([*order.routes, order.later])
    assert sorted(visits.tolist()) == list(range(len(large_mission.waypoints)))
    assert len(order.later)
    assert not len(order.left_out)


def test_the_energy_is_that_of_all_packs(flight):
    power_W = flight.voltage_V * flight.current_A
    assert energy_Wh(flight).sum() == pytest.approx(power_W.sum() / 3600.0)
    capacity = [flight.scenario.vehicles[i].battery.capacity_Ah for i in range(2)]
    rests = flight.resting[:-1]
    drawn = np.where(rests, 0.0, np.diff(1.0 - flight.soc, axis=0)).sum(axis=0)
    np.testing.assert_allclose(flight.current_A.sum(axis=0) / 3600.0 / capacity, drawn, rtol=0.02)


def test_it_is_kept_whole_in_files_and_judged_anew(flight, tmp_path):
    loaded = Flight.load(flight.save(tmp_path / "flight"))
    assert loaded == flight
    assert loaded.swaps == flight.swaps
    told = summary(flight)
    assert told["packs"] == {name: 2 for name in flight.names}
    assert [swap["t_s"] for swap in told["swaps"]] == [swap.time_s for swap in flight.swaps]
    report = independent_check.check(tmp_path / "flight")
    assert report.problems == []


@pytest.mark.parametrize(
    ("swap", "said"),
    [
        ({"uas": "uas_9", "landed_s": 1.0, "time_s": 2.0}, "uas is 'uas_9'"),
        ({"uas": "uas_1", "landed_s": 9.0, "time_s": 2.0}, "before it has landed"),
    ],
)
def test_a_swap_that_cannot_be_is_refused(flight, tmp_path, swap, said):
    folder = flight.save(tmp_path / "flight")
    run = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**run, "swaps": [swap]}))
    with pytest.raises(InputError, match=said):
        Flight.load(folder)


def test_the_replay_marks_swaps_and_shows_no_way_home_on_the_ground(flight):
    data = flight_data(flight, "here")
    texts = [mark["text"] for mark in data["marks"]]
    assert sum("swaps its battery pack" in text for text in texts) == len(flight.swaps)


def test_what_cannot_be_said_of_it_is_refused_in_a_line(mission):
    with pytest.raises(ValueError, match="swap packs"):
        MissionBound(mission)


def test_a_flight_broken_off_while_one_swaps_has_it_landed(mission, flight):
    swap = flight.swaps[0]
    i = flight.names.index(swap.uas)
    broken_off = FLY(mission, max_steps=int(swap.landed_s) + 3)
    assert MODES[broken_off.mode[-1, i]] == "landed"
    assert not broken_off.swaps
    rest = rest_of(broken_off)
    assert len(rest.waypoints) == len(mission.waypoints) - broken_off.covered[-1]
    assert rest.sorties == mission.sorties


def test_a_planner_of_whole_missions_plans_on_without_a_reset(large_mission):
    planner = Counted(Trajectory.Options(orders=1, moves=20_000, programs=20))
    flown = rollout(large_mission, planner)
    assert accomplished(flown)
    assert flown.swaps
    assert not flown.breaches
    assert not flown.return_mode
    assert planner.resets == 1


def test_other_planners_see_who_flies_again_and_are_flown_home_in_time(mission, flight):
    planner = CountedNearest()
    assert rollout(mission, planner).swaps == flight.swaps
    assert planner.resets == 2  # to warm up, and at the start
    assert flight.return_mode
    assert flight.safety_filter


def test_the_command_says_what_was_swapped(mission, tmp_path, capsys):
    mission.to_file(tmp_path / "mission.toml")
    command = ["run", str(tmp_path / "mission.toml"), "--planner", "nearest-waypoint"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 0
    assert "2 swaps; packs used: uas_1 2, uas_2 2" in capsys.readouterr().out
    assert main([*command, "--sorties", "2", "--out", str(tmp_path / "none")]) == 2
    assert "swaps packs on its own (sorties.together = false)" in capsys.readouterr().err
    assert main(["show", str(tmp_path / "out")]) == 0
    assert "uas_1 2, uas_2 2" in capsys.readouterr().out
