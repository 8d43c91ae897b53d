"""Operation modes and transit targets: the paper's Algorithms 2 and 3."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uas_coverage_baselines.milp_mpc.model.problem import Weights
from uas_coverage_baselines.milp_mpc.modes import (
    Mode,
    ModeMemory,
    Situation,
    TargetChoice,
    best_fitting_waypoint,
    next_mode,
    target_of,
    update_modes,
)

COVERING, TRANSIT, RETURN, LANDED = Mode
WAYPOINTS = np.array(
    [(60.0, 0.0, -10.0), (0.0, 50.0, -10.0), (-40.0, 0.0, -10.0), (70.0, 70.0, -10.0)]
)


def situation(
    position_m=(0.0, 0.0, -10.0),
    velocity_mps=(0.0, 0.0, 0.0),
    dod=0.1,
    covered=(),
    plans_coverage=False,
    n_waypoints=4,
):
    """A UAS that returns at a depth of discharge of 0.4."""
    uncovered = np.ones(n_waypoints, bool)
    uncovered[list(covered)] = False
    return Situation(
        np.array(position_m), np.array(velocity_mps), dod, 0.4, uncovered, plans_coverage
    )


EVERYTHING = (0, 1, 2, 3)


@pytest.mark.parametrize(
    ("memory", "now", "following"),
    [
        (ModeMemory(LANDED), situation(), LANDED),
        (ModeMemory(LANDED), situation(covered=EVERYTHING, dod=0.9), LANDED),
        (ModeMemory(RETURN), situation(plans_coverage=True), RETURN),
        (ModeMemory(RETURN), situation(dod=0.9), RETURN),
        (ModeMemory(COVERING), situation(covered=EVERYTHING, plans_coverage=True), RETURN),
        (ModeMemory(COVERING), situation(dod=0.4, plans_coverage=True), RETURN),
        (ModeMemory(TRANSIT, 2), situation(covered=EVERYTHING), RETURN),
        (ModeMemory(TRANSIT, 2), situation(dod=0.41), RETURN),
        (ModeMemory(TRANSIT, 2), situation(plans_coverage=True), TRANSIT),
        (ModeMemory(TRANSIT, 2), situation(plans_coverage=False), TRANSIT),
        (ModeMemory(TRANSIT, 2), situation(covered=[2]), COVERING),
        (ModeMemory(COVERING), situation(plans_coverage=True, dod=0.39), COVERING),
        (ModeMemory(COVERING), situation(plans_coverage=False, dod=0.39), TRANSIT),
    ],
)
def test_the_next_mode_is_that_of_algorithm_2(memory, now, following):
    assert next_mode(memory, now) is following


def updated(memories, situations, planned=(), blocked=()):
    return update_modes(memories, situations, WAYPOINTS, planned, blocked, TargetChoice())


def test_a_uas_that_turns_to_transit_flies_to_the_best_fitting_waypoint():
    (memory,) = updated([ModeMemory()], [situation()])
    assert memory == ModeMemory(TRANSIT, 2)  # the nearest, at 40 m


def test_the_nearest_waypoint_fits_best_where_height_and_heading_are_equal():
    for position, nearest in (((50.0, 0.0, -10.0), 0), ((0.0, 30.0, -10.0), 1)):
        assert best_fitting_waypoint(situation(position), WAYPOINTS, (), TargetChoice()) == nearest


def test_height_counts_besides_distance():
    places = np.array([(30.0, 0.0, -50.0), (0.0, 45.0, -10.0)])
    now = situation(n_waypoints=2)
    assert best_fitting_waypoint(now, places, (), TargetChoice()) == 1
    assert best_fitting_waypoint(now, places, (), TargetChoice(vertical=0.0)) == 0


def test_heading_decides_between_waypoints_at_the_same_distance():
    places = np.array([(40.0, 0.0, -10.0), (-40.0, 0.0, -10.0)])
    for north_mps, ahead in ((5.0, 0), (-5.0, 1)):
        now = situation(velocity_mps=(north_mps, 0.0, 0.0), n_waypoints=2)
        assert best_fitting_waypoint(now, places, (), TargetChoice()) == ahead


def test_heading_means_nothing_in_a_hover():
    places = np.array([(39.0, 0.0, -10.0), (-40.0, 0.0, -10.0)])
    now = situation(velocity_mps=(-0.3, 0.0, 0.0), n_waypoints=2)
    assert best_fitting_waypoint(now, places, (), TargetChoice()) == 0


def test_a_waypoint_straight_above_is_a_target_like_any_other():
    places = np.array([(0.0, 0.0, -40.0), (0.0, 90.0, -10.0)])
    now = situation(velocity_mps=(5.0, 0.0, 0.0), n_waypoints=2)
    assert best_fitting_waypoint(now, places, (), TargetChoice()) == 0


@pytest.mark.parametrize("why", ["covered", "planned", "blocked"])
def test_waypoints_that_are_covered_planned_or_blocked_are_no_targets(why):
    covered = [2] if why == "covered" else []
    rest = {why: [2]} if why != "covered" else {}
    (memory,) = updated([ModeMemory()], [situation(covered=covered)], **rest)
    assert memory.mode is TRANSIT
    assert memory.waypoint != 2


def test_a_waypoint_is_the_target_of_one_uas_only():
    chosen = [m.waypoint for m in updated([ModeMemory()] * 3, [situation()] * 3)]
    assert len(set(chosen)) == 3
    # of one that already flies there as well, whatever its row
    first, second = updated([ModeMemory(), ModeMemory(TRANSIT, 2)], [situation()] * 2)
    assert second == ModeMemory(TRANSIT, 2)
    assert first.waypoint != 2


def test_a_target_is_kept_until_it_is_covered_even_if_another_fits_better_by_then():
    now = situation((0.0, 49.0, -10.0), plans_coverage=True)
    assert updated([ModeMemory(TRANSIT, 2)], [now]) == [ModeMemory(TRANSIT, 2)]
    covered = situation((0.0, 49.0, -10.0), covered=[2])
    assert updated([ModeMemory(TRANSIT, 2)], [covered]) == [ModeMemory(COVERING)]


def test_a_target_that_gets_blocked_is_exchanged():
    (memory,) = updated([ModeMemory(TRANSIT, 2)], [situation()], blocked=[2])
    assert memory.mode is TRANSIT
    assert memory.waypoint in (0, 1, 3)


def test_without_any_possible_target_the_uas_stays_in_covering_mode():
    assert updated([ModeMemory()], [situation()], planned=EVERYTHING) == [ModeMemory(COVERING)]
    (memory,) = updated([ModeMemory(TRANSIT, 2)], [situation()], blocked=EVERYTHING)
    assert memory == ModeMemory(COVERING)


def test_a_uas_that_returns_forgets_its_target():
    (memory,) = updated([ModeMemory(TRANSIT, 2)], [situation(dod=0.5)])
    assert memory == ModeMemory(RETURN)


subsets = st.sets(st.integers(0, 3))


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    modes=st.lists(st.sampled_from([COVERING, TRANSIT, RETURN]), min_size=1, max_size=4),
    order=st.permutations(range(4)),
    covered=subsets,
    planned=subsets,
    blocked=subsets,
    plans=st.booleans(),
)
def test_targets_are_open_unblocked_and_different_whatever_came_before(
    modes, order, covered, planned, blocked, plans
):
    memories = [
        ModeMemory(mode, order[row] if mode is TRANSIT else None) for row, mode in enumerate(modes)
    ]
    now = [situation(covered=covered, plans_coverage=plans)] * len(modes)
    result = updated(memories, now, planned, blocked)
    targets = [m.waypoint for m in result if m.waypoint is not None]
    assert len(set(targets)) == len(targets)
    assert not set(targets) & (covered | blocked)
    for before, after in zip(memories, result, strict=True):
        assert (after.waypoint is not None) == (after.mode is TRANSIT)
        if after.waypoint is not None and after != before:
            assert after.waypoint not in planned


def target(memory, now, seconds_left=600.0, seconds_home=60.0, home_m=(100.0, 0.0, -1.0)):
    return target_of(
        memory, now, np.array(home_m), WAYPOINTS, seconds_left, seconds_home, 180.0, Weights()
    )


def test_covering_and_landed_uas_have_no_target():
    assert target(ModeMemory(COVERING), situation()) is None
    assert target(ModeMemory(LANDED), situation()) is None


def test_the_transit_target_is_the_waypoint_and_its_weight_is_normalised_by_the_distance():
    for position in ((0.0, 0.0, -10.0), (-200.0, 0.0, -10.0)):
        made = target(ModeMemory(TRANSIT, 0), situation(position))
        distance_m = np.linalg.norm(WAYPOINTS[0] - position)
        assert made.position_m.tolist() == WAYPOINTS[0].tolist()
        assert made.waypoint == 0
        assert made.weight * distance_m == pytest.approx(Weights().transit)


def test_a_weight_stays_finite_at_the_target_itself():
    near = target(ModeMemory(TRANSIT, 0), situation(WAYPOINTS[0]))
    home = target(ModeMemory(RETURN), situation((100.0, 0.0, -1.0)))
    assert 0.0 < near.weight < 1.0
    assert 0.0 < home.weight < 1.0


def test_the_return_target_is_the_initial_position_and_no_waypoint_relaxes_it():
    made = target(ModeMemory(RETURN), situation())
    assert made.position_m.tolist() == [100.0, 0.0, -1.0]
    assert made.waypoint is None


def test_the_way_home_weighs_more_the_less_the_battery_gives():
    weights = [
        target(ModeMemory(RETURN), situation(), seconds_left=left).weight
        for left in (2000.0, 600.0, 200.0, 100.0, 70.0, 60.0, 10.0, 0.0, -5.0)
    ]
    assert (np.diff(weights) >= 0.0).all()
    assert weights[4] > 10.0 * weights[0]
    assert np.isfinite(weights).all()


def test_the_way_home_weighs_much_once_there_is_nothing_left_to_cover():
    full = 2000.0
    searching = target(ModeMemory(RETURN), situation(), seconds_left=full)
    done = target(ModeMemory(RETURN), situation(covered=EVERYTHING), seconds_left=full)
    assert done.weight > 2.0 * searching.weight


def test_what_its_charge_does_not_allow_is_nothing_left_to_cover():
    full, rest = 2000.0, {"covered": [0, 1]}
    searching = target(ModeMemory(RETURN), situation(**rest), seconds_left=full)
    some = dataclasses.replace(situation(**rest), beyond=frozenset({3}))
    assert target(ModeMemory(RETURN), some, seconds_left=full).weight == searching.weight
    all_of_it = dataclasses.replace(situation(**rest), beyond=frozenset({2, 3}))
    done = target(ModeMemory(RETURN), situation(covered=EVERYTHING), seconds_left=full)
    assert target(ModeMemory(RETURN), all_of_it, seconds_left=full).weight == done.weight
    # and it is urgent still where charge is short
    late = [target(ModeMemory(RETURN), now, seconds_left=61.0) for now in (all_of_it, situation())]
    assert late[0].weight == late[1].weight > done.weight


def test_a_metre_towards_a_far_target_costs_as_much_as_towards_one_that_is_not_so_far():
    for memory in (ModeMemory(TRANSIT, 0), ModeMemory(RETURN)):
        far, farther = (
            target_of(
                *(memory, situation((north, 0.0, -10.0), covered=[1, 2, 3])),
                *(np.array((100.0, 0.0, -1.0)), WAYPOINTS, 600.0, 60.0, 0.0, Weights(), 400.0),
            )
            for north in (-900.0, -4000.0)
        )
        assert far.weight == farther.weight > 0.0


def test_a_uas_in_transit_turns_from_a_target_that_its_charge_no_longer_allows():
    now = dataclasses.replace(situation(), beyond=frozenset({2}))
    (memory,) = updated([ModeMemory(TRANSIT, 2)], [now])
    assert memory == ModeMemory(TRANSIT, 1)


def test_the_return_weight_is_normalised_by_the_distance_too():
    near, far = (
        target(ModeMemory(RETURN), situation((north, 0.0, -1.0), plans_coverage=False))
        for north in (50.0, -150.0)
    )
    assert near.weight * 50.0 == pytest.approx(far.weight * 250.0)


def test_near_home_flying_on_to_cover_costs_no_more_than_farther_out():
    at_50, at_100 = (
        target(ModeMemory(RETURN), situation((north, 0.0, -1.0), plans_coverage=True))
        for north in (50.0, 0.0)
    )
    assert at_50.weight == at_100.weight


def test_near_home_the_distance_alone_normalises_where_the_paper_has_it_so():
    at_50, at_100 = (
        target_of(
            *(ModeMemory(RETURN), situation((north, 0.0, -1.0), plans_coverage=True)),
            *(np.array((100.0, 0.0, -1.0)), WAYPOINTS, 600.0, 60.0, 0.0, Weights()),
        )
        for north in (50.0, 0.0)
    )
    assert at_50.weight * 50.0 == pytest.approx(at_100.weight * 100.0)


def test_a_metre_from_home_weighs_at_most_what_is_said():
    for most in (0.1, 0.5):
        made = target_of(
            *(ModeMemory(RETURN), situation((97.0, 0.0, -1.0), covered=EVERYTHING)),
            *(np.array((100.0, 0.0, -1.0)), WAYPOINTS, 600.0, 60.0, 0.0),
            Weights(home_per_m_max=most),
        )
        assert made.weight == most


def test_the_costs_of_a_target_are_normalised_among_the_candidates_where_that_is_asked_for():
    # the second is nearer and higher; a third one is so high that beside it height says little
    places = np.array([(50.0, 0.0, -10.0), (40.0, 0.0, -36.0), (60.0, 0.0, -110.0)])
    now = situation((0.0, 0.0, -10.0), n_waypoints=3)
    chosen = [
        best_fitting_waypoint(now, places, (), TargetChoice(1.0, 0.3, 0.3, among_candidates=among))
        for among in (False, True)
    ]
    assert 0.5 < 0.4 + 0.3 * 26.0 / 40.0
    assert 50.0 / 60.0 > 40.0 / 60.0 + 0.3 * 26.0 / 100.0
    assert chosen == [0, 1]


def test_modes_have_the_names_of_the_flight_record():
    assert [mode.label for mode in Mode] == ["covering", "transit", "return", "return"]
    assert [int(mode) for mode in Mode] == [0, 1, 2, 3]
