"""Reachable sets hold whatever can be flown, and pruning by them changes no optimum."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from toy_problems import S500, TO_OPTIMALITY, box, flight, moving, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks import Capabilities, Dynamics
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import coverable
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import Target
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolveStatus

from uas_coverage_env.geometry import sphere_faces
from uas_coverage_env.geometry.round_shapes import closed_cylinder_faces
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import VX, VY

HEXACOPTER = load_vehicle("hexacopter")
OPEN_SKY = box((-1000.0, -1000.0, -1000.0), (1000.0, 1000.0, 1000.0))
DIRECTIONS = np.vstack(
    [closed_cylinder_faces(8), sphere_faces(8), [[0.3, -0.9, 0.1], [2.0, 1.0, -3.0]]]
)
LOST_TO_THE_BOUND_M = 30.0  # after 18 steps, of some 200 m; nothing is lost vertically
FOUND_IS_ENOUGH = (Phase.explicit, Phase.generate)  # a shorter flight would say no more

speeds = st.floats(-14.0, 14.0).map(lambda value: round(value, 1))
commands = st.lists(
    st.tuples(speeds, speeds, speeds.map(lambda v: 0.3 * v)), min_size=18, max_size=18
)


def already_flying(vehicle, seed, dt_s=1.0):
    """A state out of the middle of a short flight under random commands."""
    draw = np.random.default_rng(seed)
    way = draw.uniform(-14.0, 14.0, (seed, 3)) * (1.0, 1.0, 0.3)
    return flight(vehicle, state((0.0, 0.0, 0.0)), way, dt_s)[-1]


@pytest.mark.parametrize("vehicle", [S500, HEXACOPTER])
@pytest.mark.parametrize("dt_s", [0.5, 1.0])
@settings(max_examples=40, deadline=None, derandomize=True, phases=FOUND_IS_ENOUGH)
@given(seed=st.integers(0, 6), commands=commands)
def test_no_flight_leaves_the_reachable_sets(vehicle, dt_s, seed, commands):
    start = already_flying(vehicle, seed, dt_s)
    problem = toy(start, horizon=18, vehicles=[vehicle], fence=OPEN_SKY, dt_s=dt_s)
    path = flight(vehicle, start, commands, dt_s)[:, :3]
    assert (path @ DIRECTIONS.T <= problem.reach.support(DIRECTIONS)[0] + 1e-9).all()


def farthest(problem, steps):
    """(steps, F) largest direction · p(n) over everything that dynamics and limits allow."""
    milp, v = written(problem, Dynamics(), Capabilities())
    built = milp.build()
    result = np.empty((len(steps), len(DIRECTIONS)))
    for row, step in enumerate(steps):
        for column, direction in enumerate(DIRECTIONS):
            built.cost[:] = 0.0
            built.cost[v.position[0, step]] = -direction
            solution = solve(built, TO_OPTIMALITY)
            assert solution.status is SolveStatus.OPTIMAL
            result[row, column] = -solution.objective
    return result


@pytest.mark.parametrize(
    ("vehicle", "seed", "dt_s"), [(S500, 0, 1.0), (S500, 4, 1.0), (HEXACOPTER, 3, 0.5)]
)
def test_reachable_sets_hold_the_farthest_flights_and_are_not_silly(vehicle, seed, dt_s):
    start = already_flying(vehicle, seed, dt_s)
    problem = toy(start, horizon=18, vehicles=[vehicle], fence=OPEN_SKY, dt_s=dt_s)
    steps = [1, 18]
    reach, true = problem.reach.support(DIRECTIONS)[0][steps], farthest(problem, steps)
    assert (true <= reach + 1e-6).all()
    length = np.linalg.norm(DIRECTIONS, axis=1)
    assert (reach - true <= LOST_TO_THE_BOUND_M * length).all()
    vertical = [8, 9]
    assert reach[:, vertical] == pytest.approx(true[:, vertical], abs=2e-3)


def test_reachable_sets_hold_for_a_uas_a_little_faster_than_allowed_that_can_slow_down():
    start = already_flying(S500, 0)
    start[[VX, VY]] = 11.7, -5.2  # the fast plant overshoots a limit; the polygon allows 12
    problem = toy(start, horizon=6, fence=OPEN_SKY)
    reach, true = problem.reach.support(DIRECTIONS)[0][[1, 6]], farthest(problem, [1, 6])
    assert (true <= reach + 1e-6).all()


def test_the_fence_cuts_the_reachable_sets():
    start = state((190.0, 100.0, -2.0), (9.0, 0.0, 0.0))
    reach = toy(start, horizon=6).reach.support(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))[0]
    assert reach[0] == pytest.approx([190.0, -2.0])
    assert reach[-1] == pytest.approx([200.0, 0.0], abs=0.01)


def test_without_pruning_everywhere_inside_the_fence_counts_as_reachable():
    problem = toy(state((50.0, 50.0, -10.0)), prune=False)
    reach = problem.reach.support(np.array([[1.0, 0.0, 0.0]]))[0, :, 0]
    assert reach == pytest.approx([50.0, 200.0, 200.0], abs=0.01)


@settings(max_examples=60, deadline=None, derandomize=True, phases=FOUND_IS_ENOUGH)
@given(
    seed=st.integers(0, 6),
    commands=commands,
    step=st.integers(0, 17),
    shift=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    radius_m=st.floats(1.0, 20.0),
)
def test_a_waypoint_that_some_flight_covers_is_coverable(seed, commands, step, shift, radius_m):
    start = already_flying(S500, seed)
    path = flight(S500, start, commands)[:, :3]
    for sides, share in ((4, 0.49), (8, 0.49)):
        waypoint = path[step] + share * radius_m * np.array(shift)
        problem = toy(
            start,
            horizon=18,
            fence=OPEN_SKY,
            waypoints=[(waypoint, radius_m)],
            waypoint_sides=sides,
        )
        faces = sphere_faces(sides)
        inside = (faces @ (path[step] - waypoint) <= problem.waypoint_reach_m).all()
        if inside:
            assert coverable(problem)[0, step, 0]
        assert inside or sides == 8


def small_but_complete(seed, prune):
    """One or two UAS in flight, two obstacles in their way, a mover, targets, waypoints."""
    draw = np.random.default_rng(seed)
    n_uas = 1 + seed % 2
    states = []
    for uas in range(n_uas):
        start = state((90.0 + 16.0 * uas + draw.uniform(-3.0, 3.0), 100.0, -15.0))
        command = draw.uniform(-8.0, 8.0, 3) * (1.0, 1.0, 0.2)
        states.append(flight(S500, start, np.tile(command, (seed % 4, 1)))[-1])
    centre = states[0][:3] + 2.0 * states[0][3:6]
    obstacles = []
    while len(obstacles) < 2:
        middle = centre + draw.uniform(-14.0, 14.0, 3) * (1.0, 1.0, 0.4)
        half = draw.uniform(2.0, 4.0, 3)
        hull = box(middle - half, middle + half)
        if all(hull.signed_distance(x[:3]) > 1.2 for x in states):
            obstacles.append(hull)
    N = 6 - n_uas + (seed < 4)
    path = centre + np.array([9.0, -6.0, 2.0]) + np.outer(np.arange(N + 1), (0.0, 1.5, 0.0))
    return toy(
        *states,
        horizon=N,
        obstacles=obstacles,
        moving_obstacles=[moving(path, 2.0, 2.0)] if seed >= 4 else [],
        waypoints=[
            (centre + draw.uniform(-16.0, 16.0, 3) * (1.0, 1.0, 0.3), draw.uniform(4.0, 9.0), w)
            for w in (1.0, 2.0, 1.0)
        ],
        targets=[
            Target(centre + draw.uniform(-30.0, 30.0, 3), 0.02, None if uas else 0)
            for uas in range(n_uas)
        ],
        prune=prune,
    )


@pytest.mark.parametrize("seed", range(8))
def test_pruning_changes_no_optimum(seed):
    limits = SolverLimits(relative_gap=1e-7, absolute_gap=1e-6)
    whole, pruned = (
        formulate(small_but_complete(seed, prune))[0].build() for prune in (False, True)
    )
    assert pruned.integer.sum() < whole.integer.sum()
    assert len(pruned.row_lower) < len(whole.row_lower)
    best, best_pruned = solve(whole, limits), solve(pruned, limits)
    assert best.status is SolveStatus.OPTIMAL
    assert best_pruned.status is SolveStatus.OPTIMAL
    assert best_pruned.objective == pytest.approx(best.objective, abs=1e-5)
