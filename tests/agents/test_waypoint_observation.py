"""Every number that a waypoint policy is told means what its name says."""

import numpy as np
import pytest
from uas_coverage_agents.waypoint.layout import (
    CANDIDATE,
    CANDIDATE_AT,
    HOME_CHOICE,
    N_CANDIDATE,
    N_TEAM,
    OBSERVATION_SIZE,
    TEAM,
    TEAM_AT,
    WAY,
    K,
    Number,
)
from uas_coverage_agents.waypoint.legs import legs_of
from uas_coverage_agents.waypoint.observation import NO_TARGET, observe
from waypoint_missions import town
from waypoint_oracle import Mission, observation

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.vehicle.layout import DOD, VX, VZ
from uas_coverage_env.world import build_arena

SCENARIOS = [
    town(1, n_uas=1, n_waypoints=5),
    town(2, n_uas=2, n_waypoints=14),
    town(3, n_uas=6, n_waypoints=20),
    town(4, n_uas=3),
]


def moments(scenario, number):
    """(arena, legs, state, blocked, targets) in the middle of missions, drawn at random."""
    arena = build_arena(scenario)
    legs = legs_of(arena)
    rng = np.random.default_rng(number)
    for _ in range(number):
        state = initial_state(scenario)
        n_uas, n_waypoints = len(state.uas["status"]), len(state.uncovered)
        corners_m = np.array(scenario.geofence.vertices_m)
        low_m, high_m = corners_m.min(axis=0) + 5, corners_m.max(axis=0) - 5
        state.x[:, :3] = rng.uniform(low_m, high_m, (n_uas, 3))
        state.x[:, VX:VZ] = rng.uniform(-6, 6, (n_uas, 2))
        state.x[:, DOD] = rng.uniform(0.1, 0.7, n_uas)
        state.step[0] = rng.integers(0, scenario.max_steps // 2)
        state.uncovered[:] = rng.random(n_waypoints) < rng.choice([0.1, 0.4, 0.9])
        state.uncovered[rng.integers(n_waypoints)] = True
        state.uas["returning"][:] = rng.random(n_uas) < 0.2
        state.uas["status"][rng.random(n_uas) < 0.1] = LANDED
        targets = rng.choice([HOME, NO_TARGET, *range(n_waypoints)], n_uas)
        if rng.random() < 0.4:
            targets[:] = rng.choice(np.flatnonzero(state.uncovered), n_uas)
        # it is the turn of the first
        state.uas[0].returning, state.uas[0].status, targets[0] = False, 0, NO_TARGET
        blocked = rng.random(n_waypoints) < rng.choice([0.0, 0.3, 1.0])
        yield arena, legs, state, blocked, targets


def seen(moment):
    """(row, candidates, legal) of the first UAS."""
    row = np.full(OBSERVATION_SIZE, np.nan, dtype=np.float32)
    candidates, legal = np.full(K, -1), np.zeros(K + 1, dtype=np.bool_)
    n_legal = observe(*moment, 0, candidates, legal, row)
    assert n_legal == legal.sum() > 0
    return row, candidates, legal


def clipped(values, group):
    bounds = {feature.name: (feature.low, feature.high) for feature in group.features}
    return {name: np.clip(value, *bounds[name]) for name, value in values.items()}


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: f"{len(s.uas)} UAS")
def test_each_number_is_the_one_of_its_name(scenario):
    for moment in moments(scenario, 12):
        row, candidates, legal = seen(moment)
        team, each = observation(*moment, 0)
        assert dict(zip(TEAM_AT._fields, row[:N_TEAM], strict=True)) == pytest.approx(
            clipped(team, TEAM), abs=1e-5
        )
        rows = row[N_TEAM:].reshape(K, N_CANDIDATE)
        for told, expected in zip(rows, each, strict=False):
            assert dict(zip(CANDIDATE_AT._fields, told, strict=True)) == pytest.approx(
                clipped(expected, CANDIDATE), abs=1e-5
            )
        n = len(each)
        assert (rows[n:] == 0.0).all()
        assert list(candidates[:n]) == Mission(*moment).candidates(0)
        assert (candidates[n:] == -1).all()
        assert legal[:n].tolist() == [expected["margin"] > 0 for expected in each]
        assert legal[HOME_CHOICE] == (
            not legal[:n].any() or (not team["alone"] and team["home_left"] <= 0)
        )


def test_the_moments_differ_enough_to_tell_one_number_from_another():
    """Otherwise two of them could be exchanged, and the test above would not notice."""
    found = [observation(*m, 0) for s in SCENARIOS for m in moments(s, 12)]
    team = np.array([[values[name] for name in TEAM_AT._fields] for values, _ in found])
    each = np.array([[row[n] for n in CANDIDATE_AT._fields] for _, rows in found for row in rows])
    for columns in (np.clip(team, -9, 9), np.clip(each, -9, 9)):
        for k in range(columns.shape[1]):
            for other in range(k):
                assert not np.allclose(columns[:, k], columns[:, other]), (k, other)


def test_columns_and_scales_come_from_the_table():
    assert [feature.name for feature in TEAM.features] == list(TEAM_AT._fields)
    assert tuple(range(N_TEAM)) == TEAM_AT
    assert [feature.name for feature in CANDIDATE.features] == list(CANDIDATE_AT._fields)
    assert tuple(range(N_CANDIDATE)) == CANDIDATE_AT
    assert CANDIDATE.features[WAY].name == "way"
    assert CANDIDATE.features[0].name == "there"  # the network looks there for which are there
    for feature in (*TEAM.features, *CANDIDATE.features):
        assert isinstance(feature, Number)
        assert feature.meaning.endswith(f" / {feature.over}" if feature.over else feature.meaning)
    scales = {f.over: f.scale for f in CANDIDATE.features if isinstance(f, Number)}
    assert scales["2 unit_m"] == (2.0, 1)
    assert scales["unit_s"] == (1.0, 2)
    assert scales["300 s"] == (300.0, 0)
    assert scales["15"] == (15.0, 0)
    assert scales[""] == (1.0, 0)
