"""The paper's program counted by class, and what is left where a class is left out."""

import dataclasses

import numpy as np
import pytest
from told_flights import HELIPAD, as_told
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.planner import MilpMpcOptions
from uas_coverage_baselines.reproduction import sizes
from uas_coverage_baselines.reproduction.decisions import decision, seen_at, whole_decision
from uas_coverage_baselines.reproduction.sizes import LEFT_OUT, class_sizes, sizes_by_class, timed
from uas_coverage_baselines.reproduction.sweeps import ORDERS, discretisation_error_m, trades

from uas_coverage_env.entities.state import FLYING, LANDED


@pytest.fixture(scope="module")
def flown():
    some = as_told()
    return dataclasses.replace(some, planner_options=MilpMpcOptions(limit_sides=8).model_dump())


@pytest.fixture(scope="module")
def of_classes(flown):
    return {one.name: one for one in class_sizes(whole_decision(flown))}


def test_rows_and_columns_are_counted_under_the_class_of_their_name():
    milp = Milp()
    covers = milp.variables("covers", (3,), upper=1.0, lower=0.0, integer=True)
    speed = milp.variables("thrust.speed", (2,))
    milp.subject_to("coverage.inside", (1.0, covers[:, None]), upper=1.0)
    milp.subject_to("barn.outside", (1.0, speed[:, None]), lower=0.0)
    found = sizes_by_class(milp, {"covers": "c", "coverage": "c", "thrust": "t", "barn": "b"})
    assert [(one.name, one.rows, one.columns, one.binaries) for one in found] == [
        ("c", 3, 3, 3),
        ("b", 2, 0, 0),
        ("t", 0, 2, 0),
    ]


def test_no_row_of_the_papers_program_is_without_a_class(of_classes):
    assert "others" not in of_classes


def test_waypoints_have_most_of_the_rows_but_obstacles_most_of_the_binaries(of_classes):
    # the paper says that the number of waypoints has the highest impact on both
    rows = {name: one.rows for name, one in of_classes.items()}
    binaries = {name: one.binaries for name, one in of_classes.items()}
    assert max(rows, key=lambda name: rows[name]) == sizes.COVERAGE
    assert max(binaries, key=lambda name: binaries[name]) == sizes.OBSTACLES
    assert binaries[sizes.OBSTACLES] > 0.5 * sum(binaries.values())


def test_the_counts_are_those_of_the_papers_formulas(of_classes):
    N, U, W, faces = 18, 2, 49, 6  # a sphere of H_WP = 4: a box
    # inside: a row per face, UAS, step and waypoint; two of Phi per step and waypoint
    inside = of_classes[sizes.COVERAGE].rows - 2 * N * W
    assert 0.9 * N * U * W * faces < inside <= N * U * W * faces  # a box that none can leave
    assert of_classes[sizes.COVERAGE].binaries == N * U * W + (N + 1) * W
    assert of_classes["dynamics"].rows == 14 * N * U


def test_a_flight_shows_again_what_the_planner_saw(flown):
    swarm = seen_at(flown, 160)
    assert list(swarm.status) == [FLYING, LANDED]
    assert swarm.active == ("uas_1",)
    assert swarm.uncovered[HELIPAD]
    assert swarm.uncovered.sum() == 1
    assert np.array_equal(swarm.x, flown.x[160])
    assert np.array_equal(swarm.moving_position_m, flown.moving_position_m[160])


def test_what_is_left_out_is_not_in_the_program(flown):
    problem = decision(flown, 60)
    left = {
        name: {one.name: one for one in class_sizes(change(problem))}
        for name, change in LEFT_OUT.items()
    }
    whole = left["nothing"]
    assert whole[sizes.COVERAGE].rows > left["half of the waypoints"][sizes.COVERAGE].rows > 0
    assert sizes.COVERAGE not in left["all waypoints"]
    assert whole[sizes.OBSTACLES].rows > left["half of the obstacles"][sizes.OBSTACLES].rows > 0
    assert sizes.OBSTACLES not in left["all obstacles"]
    assert sizes.MOVING not in left["all obstacles"]
    assert left["the distance between UAS"].get(sizes.COLLISION, whole[sizes.COVERAGE]) is not None
    for name in left:
        assert left[name]["dynamics"] == whole["dynamics"]


def test_a_timing_says_whether_the_gap_was_closed(flown):
    problem = LEFT_OUT["all waypoints"](LEFT_OUT["all obstacles"](decision(flown, 160)))
    timing = timed("little", problem, cap_s=30.0, scale=sizes.open_cost(decision(flown, 60)))
    assert timing.solved
    assert timing.gap <= sizes.GAP
    assert timing.rows > 0


def test_a_longer_horizon_and_rounder_shapes_make_the_program_larger(flown):
    tried = {
        (one.parameter, one.value): one
        for one in trades(flown, 160, 0.1, {"N": (8, 12), "H_O": (4, 8), "H_P": (8, 16)})
    }
    assert tried["N", 8].timing.rows < tried["N", 12].timing.rows
    assert tried["H_P", 8].timing.rows < tried["H_P", 16].timing.rows
    assert {value for name, value in tried if name == "N_dis"} == set(ORDERS)


def test_a_higher_order_is_nearer_to_the_exact_model(flown):
    u = flown.u.copy()
    u[60:64, 0, 1] = [0.002, -0.002, 0.001, -0.001]  # roll there and back
    some = dataclasses.replace(flown, u=u)
    errors_m = [discretisation_error_m(some, 60, order) for order in ORDERS]
    assert errors_m == sorted(errors_m, reverse=True)
    assert errors_m[0] > 10.0 * errors_m[2]
