"""Small missions for the waypoint policies, and an untrained network to fly them."""

import numpy as np
from uas_coverage_agents.policy.pointer import HOME_AT_FIRST
from uas_coverage_agents.waypoint.policy_runner import network

from uas_coverage_env import generate_scenario
from uas_coverage_env.scenario import MovingObstacle, ScheduledVelocity

PRIOR = 6.0


def town(seed, n_uas=2, n_waypoints=9, n_obstacles=4):
    return generate_scenario(seed, n_uas=n_uas, n_waypoints=n_waypoints, n_obstacles=n_obstacles)


def with_something_parked(scenario, waypoint, leaves_s):
    """Something stands on a waypoint and leaves later."""
    north_m, east_m, _ = scenario.waypoints[waypoint].position_m
    parked = MovingObstacle(
        name="parked",
        radius_m=8.0,
        height_m=20.0,
        safe_distance_m=10.0,
        start_m=(north_m, east_m, -10.0),
        schedule=(
            ScheduledVelocity(from_s=0.0, velocity_mps=(0.0, 0.0, 0.0)),
            ScheduledVelocity(from_s=leaves_s, velocity_mps=(0.0, 0.0, -10.0)),
            ScheduledVelocity(from_s=leaves_s + 30.0, velocity_mps=(0.0, 0.0, 0.0)),
        ),
    )
    return scenario.model_copy(update={"moving_obstacles": (parked,)})


def tensors(hidden=16, seed=None):
    """Weights of a network: as before training, or random with a seed."""
    shapes = network(hidden, PRIOR).shapes()
    rng = np.random.default_rng(0 if seed is None else seed)
    weights = {name: rng.normal(0.0, 0.3, shape) for name, shape in shapes.items()}
    if seed is None:
        weights["score.out.weight"][:] = 0.0
        weights["home.1.weight"][:] = 0.0
        weights["home.1.bias"][:] = HOME_AT_FIRST
    return weights
