"""What a UAS that chooses waypoints sees and may do, and the teams that fly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uas_coverage_agents.waypoint.layout import (
    CANDIDATE_AT,
    CANDIDATE_TABLE,
    HIGH,
    HOME_CHOICE,
    LOW,
    N_CANDIDATE,
    N_TEAM,
    TEAM_TABLE,
    K,
)
from uas_coverage_agents.waypoint.legs import legs_of
from uas_coverage_agents.waypoint.sub_environments import (
    begin_lanes,
    make_lanes,
    pool_legs,
    step_lanes,
)
from uas_coverage_agents.waypoint.team import (
    ENERGY,
    LEFT,
    LOST_UAS,
    NO_UAS,
    NOT_HOME,
    TIME,
)
from waypoint_missions import town, with_something_parked

from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.mission.blocked import find_blocked
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import build_arena

SCENARIOS = [
    town(1, n_uas=1, n_waypoints=5),
    town(2, n_uas=2, n_waypoints=14),
    town(3, n_uas=8, n_waypoints=12),
    with_something_parked(town(4, n_uas=3), waypoint=4, leaves_s=60.0),
    town(5, n_uas=1, n_waypoints=1, n_obstacles=0),
]


class Teams:
    """Lanes that fly SCENARIOS, one each."""

    def __init__(self, order=(0, 1, 2, 3, 4), covered=0.0, seed=0):
        scenarios = [SCENARIOS[s] for s in order]
        self.arenas, self.legs = pool_worlds(scenarios), pool_legs(scenarios)
        n = len(scenarios)
        self.lanes, self.states = make_lanes(n, self.arenas)
        shape = self.states.uncovered.shape
        rng = np.random.default_rng(seed)
        begin_lanes(
            self.arenas, self.legs, self.lanes, self.states, np.arange(n), np.arange(n),
            rng.random(shape) < covered, np.zeros(self.states.uas.shape),
            True, assistants(True, True),
        )  # fmt: skip

    def step(self, choices):
        step_lanes(
            self.arenas, self.legs, self.lanes, self.states, choices, True, assistants(True, True)
        )

    def fly(self, choose):
        while (self.lanes.decider != NO_UAS).any():
            self.step(choose(self.lanes))
        return self.lanes.account


def nearest(lanes):
    return lanes.legal.argmax(axis=1)


def at_random(seed):
    rng = np.random.default_rng(seed)
    return lambda lanes: (lanes.legal * rng.random(lanes.legal.shape)).argmax(axis=1)


@settings(max_examples=4, deadline=None, derandomize=True)
@given(st.integers(0, 1000), st.sampled_from([0.0, 0.6]))
def test_masks_and_observations_are_sound_whatever_is_chosen(seed, covered):
    teams = Teams(covered=covered, seed=seed)
    choose = at_random(seed)

    def checked(lanes):
        for lane in np.flatnonzero(lanes.decider != NO_UAS):
            legal, candidates = lanes.legal[lane], lanes.candidates[lane]
            uncovered = teams.states.uncovered[lane]
            assert legal.sum() > 1  # otherwise there is nothing to decide
            there = candidates >= 0
            assert not legal[:K][~there].any()
            assert uncovered[candidates[there]].all()
            assert len(set(candidates[there])) == there.sum()
            team = lanes.observation[lane, :N_TEAM]
            each = lanes.observation[lane, N_TEAM:].reshape(K, N_CANDIDATE)
            assert np.isfinite(team).all()
            assert (team >= TEAM_TABLE[:, LOW]).all()
            assert (team <= TEAM_TABLE[:, HIGH]).all()
            assert (each >= CANDIDATE_TABLE[:, LOW]).all()
            assert (each <= CANDIDATE_TABLE[:, HIGH]).all()
            assert (each[:, CANDIDATE_AT.there] == there).all()
            assert (each[~there] == 0.0).all()
            assert (np.diff(each[there, CANDIDATE_AT.way]) >= 0.0).all()  # nearest first
        return choose(lanes)

    account = teams.fly(checked)
    assert (account[:, LOST_UAS] == 0).all()
    assert (account[:, NOT_HOME] == 0).all()
    assert (account[:, LEFT] == 0).all()
    assert (account[:, [ENERGY, TIME]] > 0.0).all()


def test_a_lane_flies_the_same_whatever_flies_beside_it():
    together = Teams().fly(nearest)
    for s in range(len(SCENARIOS)):
        assert np.array_equal(Teams([s]).fly(nearest)[0], together[s])


def test_no_uas_goes_home_while_it_is_the_last_that_covers():
    teams = Teams([0])
    assert teams.lanes.decider[0] == 0
    assert not teams.lanes.legal[0, HOME_CHOICE]


def test_a_uas_goes_home_when_it_chooses_to_and_the_others_finish():
    teams = Teams([1])
    assert teams.lanes.legal[0, HOME_CHOICE]
    teams.step(np.array([HOME_CHOICE]))
    account = teams.fly(nearest)
    assert account[0, LEFT] == 0
    used = teams.states.x[0, :, DOD] - [1 - uas.soc_0 for uas in SCENARIOS[1].uas]
    assert used[0] < 0.02 < used[1]


def test_a_uas_without_charge_for_the_way_is_not_sent():
    scenario = SCENARIOS[1]
    arenas, legs = pool_worlds([scenario]), pool_legs([scenario])
    lanes, states = make_lanes(1, arenas)
    discharged = np.zeros(states.uas.shape)
    discharged[0, 0] = scenario.uas[0].dod_max - (1 - scenario.uas[0].soc_0) - 0.03
    begin_lanes(
        arenas, legs, lanes, states, np.array([0]), np.array([0]),
        np.zeros(states.uncovered.shape, dtype=bool), discharged, True,
        assistants(True, True),
    )  # fmt: skip
    while lanes.decider[0] != NO_UAS:
        assert lanes.decider[0] == 1
        step_lanes(arenas, legs, lanes, states, nearest(lanes), True, assistants(True, True))
    assert lanes.account[0, LOST_UAS] == 0


def test_what_something_parks_on_comes_last_and_is_covered_once_it_left():
    scenario = SCENARIOS[3]
    arena = build_arena(scenario)
    blocked = np.zeros(len(scenario.waypoints), dtype=bool)
    find_blocked(arena, 0, 0.0, 0.0, 0.0, blocked)
    assert list(np.flatnonzero(blocked)) == [4]
    teams = Teams([3])
    while teams.lanes.decider[0] != NO_UAS:
        free = teams.states.uncovered[0] & ~teams.lanes.blocked[0]
        if teams.lanes.blocked[0, 4] and free.sum() > 3:
            assert 4 not in teams.lanes.candidates[0]
        teams.step(nearest(teams.lanes))
    assert teams.lanes.account[0, LEFT] == 0
    assert teams.lanes.account[0, TIME] > 60.0


def test_legs_are_no_shorter_than_the_straight_line_at_top_speed():
    scenario = SCENARIOS[1]
    arena = build_arena(scenario)
    legs = legs_of(arena)
    places_m = np.array([w.position_m for w in scenario.waypoints])[:, :2]
    straight_m = np.linalg.norm(places_m[:, None] - places_m, axis=2)
    speed_mps = arena.uas["speed_mps"][0]
    assert (legs.between_s >= straight_m / speed_mps - 1e-9).all()
    assert (np.diag(legs.between_s) == 0.0).all()
    assert (legs.return_s > legs.home_s).all()  # return mode reckons with reserve
    assert legs.unit[0] == pytest.approx(60.0, rel=0.3)


def test_places_and_directions_do_not_matter():
    """The observation of the town mirrored in the east-west axis is the same."""
    scenario = SCENARIOS[1].model_copy(update={"obstacles": ()})
    data = scenario.model_dump(mode="json", by_alias=True)
    north_m = max(vertex[0] for vertex in data["geofence"]["vertices_m"])
    for entry, key in [(u, "start_m") for u in data["uas"]] + [
        (w, "position_m") for w in data["waypoints"]
    ]:
        entry[key][0] = north_m - entry[key][0]
    mirrored = type(scenario).model_validate(data)
    rows = []
    for each in (scenario, mirrored):
        arenas, legs = pool_worlds([each]), pool_legs([each])
        lanes, states = make_lanes(1, arenas)
        begin_lanes(
            arenas, legs, lanes, states, np.array([0]), np.array([0]),
            np.zeros(states.uncovered.shape, dtype=bool), np.zeros(states.uas.shape),
            True, assistants(True, True),
        )  # fmt: skip
        rows.append(lanes.observation[0].copy())
    assert initial_state(mirrored).x[0, 0] != initial_state(scenario).x[0, 0]
    assert rows[0] == pytest.approx(rows[1], abs=1e-5)
