"""Planning problems small enough to be followed by hand, and ways to solve parts of them."""

from itertools import product

import numpy as np
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, formulate, shared_variables
from uas_coverage_baselines.milp_mpc.model.problem import MovingHull, Plan, PlanningProblem, Target
from uas_coverage_baselines.milp_mpc.search.decision import Effort
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.vehicle import compile_vehicle, linear_model, load_vehicle, lpv_step
from uas_coverage_env.vehicle.inner_loop import reseed_reference, velocity_climb_wrench
from uas_coverage_env.vehicle.layout import DOD, N_INPUTS, N_STATES, VX, VZ

BY_NODES = Effort(teams=4)
S500 = load_vehicle("s500_v2")
TO_OPTIMALITY = SolverLimits(relative_gap=1e-9, absolute_gap=1e-7)


def box(low, high):
    """The box between two corners."""
    return ConvexPolytope.from_points(list(product(*zip(low, high, strict=True))))


FIELD = box((0.0, 0.0, -50.0), (200.0, 200.0, 0.0))


def state(position_m, velocity_mps=(0.0, 0.0, 0.0), dod=0.1):
    """A level UAS at rest or in motion."""
    x = np.zeros(N_STATES)
    x[:3], x[VX : VZ + 1], x[DOD] = position_m, velocity_mps, dod
    return x


def moving(path_m, radius_m=4.0, half_height_m=3.0, name="mover"):
    """A moving obstacle along a path (N+1, 3)."""
    return MovingHull(name, np.array(path_m, float), radius_m, half_height_m)


def toy(
    *states,
    horizon=2,
    vehicles=None,
    obstacles=(),
    clearance_m=1.0,
    moving_obstacles=(),
    moving_clearance_m=1.0,
    separation_m=6.0,
    waypoints=(),
    targets=None,
    fence=FIELD,
    fence_margin_m=0.5,
    dt_s=1.0,
    home_m=None,
    dod_max=0.75,
    **fields,
):
    """A decision; `waypoints` are (position, radius) or (position, radius, weight)."""
    U = len(states)
    vehicles = (S500,) * U if vehicles is None else tuple(vehicles)
    sides = fields.get("waypoint_sides", 4)
    rows = [(*waypoint, 1.0)[:3] for waypoint in waypoints]
    return PlanningProblem(
        names=tuple("abcdef"[:U]),
        vehicles=vehicles,
        models=tuple(
            linear_model(vehicle, float(x[DOD]), dt_s, fields.get("order", 4))
            for vehicle, x in zip(vehicles, states, strict=True)
        ),
        x0=np.array(states),
        horizon=horizon,
        fence=fence,
        fence_margin_m=fence_margin_m,
        obstacles=tuple((f"tower_{o}", hull) for o, hull in enumerate(obstacles)),
        obstacle_clearance_m=np.full((U, len(obstacles)), clearance_m),
        moving=tuple(moving_obstacles),
        moving_clearance_m=np.full((U, len(moving_obstacles)), moving_clearance_m),
        separation_m=np.full((U, U), separation_m),
        waypoints_m=np.array([row[0] for row in rows], float).reshape(-1, 3),
        waypoint_reach_m=np.array([row[1] for row in rows], float) * inner_factor(sides, 3),
        waypoint_weight=np.array([row[2] for row in rows], float),
        waypoint_index=np.arange(len(rows)),
        n_scenario_waypoints=len(rows),
        home_m=np.array(states)[:, :3] if home_m is None else np.array(home_m, float),
        dod_max=np.full(U, dod_max),
        targets=(None,) * U if targets is None else tuple(targets),
        dt_s=dt_s,
        **fields,
    )


def written(problem, *blocks):
    """The program of some blocks alone, and its shared variables."""
    milp = Milp()
    v = shared_variables(milp, problem)
    for block in blocks:
        block.add_to(milp, v, problem)
    return milp, v


def feasible(milp, fixed):
    """Whether the program has a point with the given columns fixed: pairs (columns, values)."""
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    for columns, values in fixed:
        lower[columns] = upper[columns] = values
    built.cost[:] = 0.0
    return solve(built, TO_OPTIMALITY, lower=lower, upper=upper).values is not None


def flown(vehicle, x0, commands, dt_s=1.0):
    """(T+1, 14) states and (T, 5) inputs under commands (T, 3) of the inner loop [m/s]."""
    record = compile_vehicle(vehicle, dt_s)[()]
    reference = np.zeros(2)
    reseed_reference(record, x0, reference)
    states, inputs = [x0.copy()], np.zeros((len(commands), N_INPUTS))
    for (north, east, down), u in zip(commands, inputs, strict=True):
        x = states[-1].copy()
        velocity_climb_wrench(record, x, reference, north, east, down, u)
        lpv_step(record, x, u, x)
        states.append(x)
    return np.array(states), inputs


def flight(vehicle, x0, commands, dt_s=1.0):
    """(T+1, 14) states of such a flight."""
    return flown(vehicle, x0, commands, dt_s)[0]


def objective_of(problem, plan, blocks=OCP):
    """The objective of a plan's states, inputs and coverage, by the whole OCP; inf if refused."""
    milp, v = formulate(problem, blocks)
    built = milp.build()
    lower, upper = built.lower.copy(), built.upper.copy()
    covers = plan.covers[:, :, problem.waypoint_index].astype(float)
    for columns, values, room in (
        (v.x[:, 1:], plan.x[:, 1:], 1e-7),
        (v.u, plan.u, 1e-7),
        (v.covers[v.covers >= 0], covers[v.covers >= 0], 0.0),
    ):
        lower[columns], upper[columns] = values - room, values + room
    assert not covers[v.covers < 0].any()
    return solve(built, TO_OPTIMALITY, lower=lower, upper=upper).objective


def planned(outcome) -> Plan:
    """What `decide` answers, where it is a plan and no reason for having none."""
    assert isinstance(outcome, Plan), outcome
    return outcome


def two_around_a_tower(n_uas=2, horizon=7):
    """Two UAS in flight, a tower between them and waypoints on both sides."""
    starts = [
        flight(S500, state((80.0, 70.0, -12.0)), [(4.0, 2.0, 0.0)] * 3)[-1],
        flight(S500, state((80.0, 100.0, -12.0)), [(5.0, -1.0, 0.0)] * 3)[-1],
    ]
    return toy(
        *starts[:n_uas],
        horizon=horizon,
        obstacles=[box((105.0, 80.0, -25.0), (115.0, 92.0, 0.0))],
        waypoints=[
            ((108.0, 74.0, -12.0), 12.0),
            ((110.0, 99.0, -12.0), 10.0, 2.0),
            ((98.0, 86.0, -14.0), 10.0),
        ],
        targets=[Target(np.array([180.0, 90.0, -12.0]), 0.02), None][:n_uas],
    )
