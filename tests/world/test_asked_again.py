"""A waypoint that is to be covered more than once: when it is asked for again, and who flies."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import meadow, waypoint

from uas_coverage_env import World, load_planner, rollout
from uas_coverage_env.entities.state import FLYING, SWAPPING
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.flight import Flight, rest_of
from uas_coverage_env.flight.metrics import accomplished, coverage, open_waypoints
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.scenario import Scenario, warnings
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.room import Room
from uas_coverage_env.uas_coverage_v0 import parallel_env
from uas_coverage_env.world import GoTo, Velocity

STARTS_M = ((20.0, 20.0, -10.0), (20.0, 100.0, -10.0))
NEAR, FAR = (
    waypoint(position_m, 4.0) for position_m in ((40.0, 20.0, -10.0), (120.0, 90.0, -10.0))
)
HOVERS = Velocity(0.0, 0.0, 10.0)


def again(entry, *gaps_s):
    return {**entry, "again_after_s": gaps_s}


def mission(*waypoints, packs=0, starts_m=STARTS_M, max_steps=400, **more):
    """A meadow whose UAS fly again: on their charge, or with fresh packs."""
    sorties = Sorties(packs=packs, swap_s=5.0, together=False) if packs else None
    changes = {"sorties": sorties, "relaunch": not packs, **more}
    return meadow(starts_m, waypoints=waypoints, max_steps=max_steps).model_copy(update=changes)


def nearest(scenario, **options):
    return rollout(scenario, load_planner("nearest-waypoint"), 0, **options)


def test_it_is_asked_for_again_so_long_after_it_was_covered_and_comes_last():
    scenario = mission(again(NEAR, 7.5, 30.0), FAR)
    world = World(scenario)
    commands = {"uas_1": GoTo(0), "uas_2": HOVERS}
    while world.state.uncovered[0]:
        world.step(commands)
    covered_at = int(world.state.step[0])
    assert world.waits
    assert world.visits_to_come == 3
    for _ in range(7):
        world.step({"uas_1": HOVERS, "uas_2": HOVERS})
        assert len(world.known.waypoints) == 2
    world.step({"uas_1": HOVERS, "uas_2": HOVERS})
    assert int(world.state.step[0]) == covered_at + 8  # the first sample from then on
    assert world.state.uncovered.tolist() == [False, True, True]
    last = world.known.waypoints[-1]
    assert last.position_m == scenario.waypoints[0].position_m
    assert last.again_after_s == (30.0,)
    assert world.visits_to_come == 3
    world.reset()
    assert world.known is scenario
    assert not world.waits


def test_what_is_covered_at_the_start_is_asked_for_again_counted_from_there():
    world = World(mission(again(waypoint(STARTS_M[0], 5.0), 3.0), FAR))
    assert world.state.uncovered.tolist() == [False, True]
    for _ in range(3):
        assert len(world.known.waypoints) == 2
        world.step({"uas_1": Velocity(9.0, 0.0, 10.0), "uas_2": HOVERS})
    assert len(world.known.waypoints) == 3


@pytest.mark.parametrize("packs", [0, 4])
@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower", "tour", "trajectory"])
def test_uas_wait_at_home_until_it_is_asked_for_again_and_fly_again(planner, packs):
    scenario = mission(again(NEAR, 100.0), again(FAR, 60.0, 70.0), packs=packs)
    flight = rollout(scenario, load_planner(planner), 0)
    assert accomplished(flight)
    assert flight.covered[-1] == 5
    assert coverage(flight) == 1.0
    history = SceneHistory.of(flight)
    gaps = {0: 100, 1: 60}
    copies = history.covered_at[[0, 1]] + [gaps[0], gaps[1]]
    assert sorted(history.waypoint_from[2:4].tolist()) == sorted(copies.tolist())
    assert (history.covered_at >= history.waypoint_from).all()


def test_where_no_uas_flies_again_what_is_asked_for_later_is_left():
    scenario = mission(again(NEAR, 100.0), relaunch=False)
    flight = nearest(scenario)
    assert flight.covered[-1] == 1
    assert open_waypoints(flight) == 1
    assert coverage(flight) == 0.5
    assert not accomplished(flight)
    assert any("do not fly again" in line for line in warnings(scenario))
    assert not any("fly again" in line for line in warnings(mission(again(NEAR, 100.0))))


def test_a_flight_ends_with_its_last_landing_where_no_uas_can_take_off_any_more():
    scenario = mission(again(NEAR, 150.0), starts_m=STARTS_M[:1])
    low = scenario.model_copy(update={"uas": (scenario.uas[0].model_copy(update={"soc_0": 0.28}),)})
    flight = nearest(low)
    assert flight.ended == "complete"
    assert flight.steps < 100
    assert open_waypoints(flight) == 1


def test_the_record_is_read_back_and_tells_when_it_was_asked_for(tmp_path):
    flight = nearest(mission(again(NEAR, 20.0, 20.0), FAR))
    flight.save(tmp_path / "flight")
    read = Flight.load(tmp_path / "flight")
    assert read.covered.tolist() == flight.covered.tolist()
    assert open_waypoints(read) == 0
    there, now = SceneHistory.of(flight), SceneHistory.of(read)
    assert now.waypoint_from.tolist() == there.waypoint_from.tolist()
    assert not now.asked_later.any()


def test_the_rest_of_a_flight_asks_at_once_for_what_was_going_to_be_asked_for():
    scenario = mission(again(NEAR, 150.0, 20.0), FAR)
    flight = nearest(scenario, max_steps=8)
    assert SceneHistory.of(flight).asked_later.tolist() == [True, False]
    rest = rest_of(flight)
    assert [w.again_after_s for w in rest.waypoints] == [(), (20.0,)]
    assert accomplished(nearest(rest))


def test_what_is_dropped_is_not_asked_for_again():
    scenario = mission(again(NEAR, 40.0), FAR)
    data = scenario.model_dump(mode="json", by_alias=True)
    data["events"] = [{"kind": "waypoint_dropped", "waypoint": 0, "at_s": 30.0}]
    flight = nearest(parse(data, Scenario, "dropped"))
    assert flight.covered[-1] == 2
    assert accomplished(flight)
    assert len(SceneHistory.of(flight).scenario.waypoints) == 2


def test_only_a_uas_that_can_cover_it_waits_for_it():
    thermal = {**again(NEAR, 40.0), "sensor": "thermal"}
    scenario = mission(thermal, FAR, packs=3)
    carrier = scenario.uas[0].model_dump() | {"sensors": ({"name": "thermal"},)}
    fleet = (type(scenario.uas[0]).model_validate(carrier), scenario.uas[1])
    world = World(scenario.model_copy(update={"uas": fleet}))
    home = GoTo(None, mode="return")
    while world.state.uncovered.any():
        commands = {"uas_1": GoTo(0), "uas_2": GoTo(1)}
        world.step({name: commands[name] for name in world.active})
    while world.state.uas[1].status == FLYING or world.state.uas[0].status == FLYING:
        world.step({name: home for name in world.active})
    assert world.state.uas[0].status == SWAPPING or len(world.known.waypoints) == 3


@pytest.mark.parametrize(("other_flies", "packs_used"), [(True, 2), (False, 3)])
def test_one_whose_last_sortie_covered_nothing_waits_while_another_flies(other_flies, packs_used):
    beside = waypoint((46.0, 30.0, -10.0), 4.0)
    world = World(mission(again(NEAR, 60.0), again(beside, 170.0), packs=5))
    home = GoTo(None, mode="return")
    for w in range(2):
        while world.state.uncovered[w]:
            world.step({"uas_1": GoTo(w), "uas_2": HOVERS})
    used = 1
    for _ in range(250):
        flies = world.state.uas[0].status == FLYING
        away = flies and used == 2 and not world.state.uas[0].departed
        commands = {
            "uas_1": Velocity(0.0, -3.0, 30.0) if away else home,
            "uas_2": HOVERS if other_flies else home,
        }
        world.step({name: commands[name] for name in world.active})
        used += not flies and world.state.uas[0].status == FLYING
    assert world.state.uncovered.tolist() == [False, False, True, True]
    assert used == packs_used


def test_agents_see_it_open_again_and_their_episode_goes_on_while_they_swap():
    scenario = mission(again(NEAR, 30.0), starts_m=STARTS_M[:1], packs=3)
    env: Any = parallel_env(scenario, action="waypoint")
    env.reset(seed=0)
    steps = 0
    while env.agents:
        home = env.action_space("uas_1").n - 1
        waits = not env.unwrapped.swarm_state().uncovered.any()
        _, _, _, _, infos = env.step({"uas_1": home if waits else 0})
        steps += 1
    assert infos["uas_1"]["covered"] == 2
    assert 30 < steps < 200
    assert Room.of(scenario).n_waypoints == 2


def test_it_does_not_go_with_sorties_one_after_the_other():
    scenario = mission(again(NEAR, 30.0), packs=2)
    data = scenario.model_dump(mode="json", by_alias=True)
    data["sorties"]["together"] = True
    with pytest.raises(InputError, match=r"sorties\.together.*again_after_s.*false"):
        parse(data, Scenario, "mission")


def test_files_of_scenarios_without_it_are_as_they_were():
    text = mission(NEAR).file_text()
    assert "again_after_s" not in text
    assert "again_after_s = [30.0, 5.0]" in mission(again(NEAR, 30.0, 5.0)).file_text()


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.lists(st.floats(0.5, 60.0), max_size=3), min_size=1, max_size=4),
    st.sampled_from([0, 3]),
    st.integers(0, 10**6),
)
def test_history_and_world_agree_on_every_visit(gaps_s, packs, seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform((5.0, 5.0, -30.0), (120.0, 120.0, -5.0), (len(gaps_s), 3))
    entries = [
        again(waypoint(tuple(place), 6.0), *gaps)
        for place, gaps in zip(places.tolist(), gaps_s, strict=True)
    ]
    flight = nearest(mission(*entries, packs=packs, max_steps=150))
    history = SceneHistory.of(flight)
    visited = (history.covered_at < len(flight.x)).sum()
    assert visited == flight.covered[-1]
    later = [
        len(w.again_after_s) * (open_ or asked)
        for w, open_, asked in zip(
            history.scenario.waypoints, history.open_at_end, history.asked_later, strict=True
        )
    ]
    assert history.open_at_end.sum() + sum(later) == open_waypoints(flight)
