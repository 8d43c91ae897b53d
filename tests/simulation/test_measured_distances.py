"""What is left unmeasured is what nothing depends on."""

import numpy as np
import pytest
from small_worlds import box, meadow, mover, waypoint

from uas_coverage_env import generate_scenario, load_scenario
from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.simulation import World
from uas_coverage_env.world import build_arena

DISTANCES = ("obstacle_clearance_m", "separation_m")
VELOCITY = KIND_NAMES.index("velocity")


def dense():
    """Four UAS, two blocks and two moving obstacles in a small place."""
    starts_m = [
        (80.0, 80.0, -10.0),
        (86.0, 80.0, -10.0),
        (120.0, 80.0, -12.0),
        (120.0, 120.0, -8.0),
    ]
    return meadow(
        starts_m,
        obstacles=[
            box("block", (94.0, 94.0, -20.0), (106.0, 106.0, 0.0), safe_distance_m=3.0),
            box("wall", (60.0, 130.0, -30.0), (140.0, 134.0, 0.0), safe_distance_m=1.0),
        ],
        moving_obstacles=[
            mover((60.0, 100.0, -10.0), (0.0, (2.0, 0.0, 0.0)), safe_distance_m=4.0),
            mover((100.0, 60.0, -10.0), (0.0, (0.0, 3.0, 0.0)), safe_distance_m=1.0, name="cart"),
        ],
        waypoints=[waypoint((80.0, 60.0, -10.0), 8.0)],
    )


def flown(scenario, measured_m, n_missions=30, n_steps=40):
    """Random flights, in every second mission head-on: all outcomes, and the last states."""
    world = World(scenario, measured_m=measured_m)
    rng = np.random.default_rng(5)
    n_uas = len(world.names)
    commands = np.zeros(n_uas, COMMAND_DTYPE)
    commands["kind"] = VELOCITY
    outcomes, states = [], []
    for mission in range(n_missions):
        world.reset()
        for step in range(n_steps):
            if step % 5 == 0:
                low, high = [-12.0, -12.0, 6.0, 0.0], [12.0, 12.0, 18.0, 0.0]
                commands["values"] = rng.uniform(low, high, (n_uas, 4))
            if mission % 2:
                place_m = world.state.x[:, :3]
                commands["values"][:, :2] = (place_m[::-1] - place_m)[:, :2]
                commands["values"][:, 2] = 10.0
            outcomes.append(world.step(commands).copy())
        states.append([array.copy() for array in world.state])
    return np.stack(outcomes), states


@pytest.mark.parametrize(
    "scenario",
    [dense(), load_scenario("village"), generate_scenario(11, n_uas=4, n_obstacles=20)],
    ids=["dense", "village", "town"],
)
def test_nothing_but_the_unmeasured_distances_changes(scenario):
    exact, exact_states = flown(scenario, np.inf)
    short, short_states = flown(scenario, 0.0)
    for left, right in zip(exact_states, short_states, strict=True):
        for a, b in zip(left, right, strict=True):
            assert np.array_equal(a, b)
    for field in exact.dtype.names:
        if field not in DISTANCES:
            assert np.array_equal(exact[field], short[field]), field
    measured_m = build_arena(scenario, measured_m=0.0).rules["measured_m"][0]
    for field in DISTANCES:
        near = exact[field] < measured_m
        assert np.array_equal(short[field], np.where(near, exact[field], np.inf)), field
        assert near.any(), field
        assert (np.isfinite(exact[field]) & ~near).any(), field
    assert (exact["breaches"] > 0).any()
    assert (exact["contact"] > 0).any()


def test_the_dense_scene_meets_everything():
    exact, _ = flown(dense(), np.inf)
    met = {CONTACT_NAMES[contact] for contact in np.unique(exact["contact"])}
    assert met >= {"none", "obstacle", "moving_obstacle", "uas", "geofence"}


@pytest.mark.parametrize("measured_m", [10.0, 40.0])
def test_distances_are_exact_up_to_where_they_are_measured(measured_m):
    exact, _ = flown(dense(), np.inf, n_missions=10)
    short, _ = flown(dense(), measured_m, n_missions=10)
    for field in DISTANCES:
        near = exact[field] < measured_m
        assert near.any()
        assert not near.all()
        assert np.array_equal(short[field], np.where(near, exact[field], np.inf))
