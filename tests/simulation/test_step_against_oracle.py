import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import expected_step
from small_worlds import box, meadow, mover, waypoint

from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.scenario import generate_scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.limits import LIMIT_NAMES, limit_names

VELOCITY, ACCELERATION, WRENCH = map(KIND_NAMES.index, ("velocity", "acceleration", "wrench"))


def crowded(**rules):
    """Everything that can be hit, close together: random flights end in every kind of contact."""
    return meadow(
        [(60.0, 60.0, -8.0), (66.0, 60.0, -8.0), (60.0, 66.0, -8.0)],
        obstacles=[
            box("wall", (80.0, 20.0, -20.0), (81.0, 120.0, 0.0)),
            box("floating", (20.0, 90.0, -40.0), (70.0, 100.0, -25.0)),
        ],
        moving_obstacles=[
            mover((30.0, 30.0, -10.0), (0.0, (3.0, 3.0, -0.2)), (9.0, (-4.0, 0.5, 0.0))),
            mover((100.0, 30.0, -5.0), (0.0, (-8.0, 2.0, 0.0)), name="second"),
        ],
        waypoints=[waypoint((60.0 + 3 * w, 57.0 + 6 * w, -8.0), 6.0, 1.0 + w) for w in range(9)],
        soc_0=0.27,
        **rules,
    )


SCENARIOS = {
    "village": lambda: load_scenario("village"),
    "crowded": crowded,
    "crowded_high": lambda: crowded(min_height_m=6.5),
    "generated": lambda: generate_scenario(3, n_uas=4, n_waypoints=25, n_obstacles=8),
    "generated_open": lambda: generate_scenario(4, n_uas=1, n_waypoints=12, n_obstacles=0),
}


LEARNERS = "crowded, learners"
"""There, wrenches beyond the vehicle's limits lose a UAS."""


@pytest.fixture(scope="module")
def worlds():
    made = {name: World(make()) for name, make in SCENARIOS.items()}
    return {**made, LEARNERS: World(crowded(), judges_wrenches=True)}


def random_commands(rng, world, commands):
    """Each UAS keeps its command for some steps, then draws another of any kind."""
    for i, uas in enumerate(world.scenario.vehicles):
        if rng.random() < 0.3:
            kind = rng.choice([VELOCITY, VELOCITY, ACCELERATION, WRENCH])
            if kind == VELOCITY:
                values = [*rng.uniform(-13, 13, 2), rng.uniform(0.5, 30), 0.0]
            elif kind == ACCELERATION:
                values = [*rng.uniform(-3, 3, 3), 0.0]
            else:
                values = rng.uniform(-1.5, 1.5, 4) * [uas.limits.lift_max_N, *uas.torque_max_Nm]
            commands[i] = (kind, values, rng.random() < 0.5)


def assert_same(world, before, outcome, commands):
    """The world's step is the oracle's."""
    learners = world.arena.rules["judges_wrenches"][0]
    judged = np.flatnonzero(learners & (commands["kind"] == WRENCH))
    expected, uncovered, departed = expected_step(
        world.scenario, before, outcome["u"][:, :4], commands["returning"], judged
    )
    state = world.state
    np.testing.assert_array_equal(state.uncovered, uncovered)
    np.testing.assert_array_equal(state.uas["departed"], departed)
    assert state.step[0] == before.step[0] + 1
    for i, want in enumerate(expected):
        got = outcome[i]
        np.testing.assert_allclose(state.x[i], want.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(got["u"], want.u, rtol=0, atol=1e-9)
        assert state.uas[i].status == want.status
        assert got["landed"] == (want.status == LANDED and before.uas[i].status == FLYING)
        assert got["voltage_V"] == pytest.approx(want.voltage_V, abs=1e-9)
        assert got["current_A"] == pytest.approx(want.current_A, abs=1e-9)
        energy_Wh = want.voltage_V * want.current_A * world.scenario.dt_s / 3600
        assert got["energy_Wh"] == pytest.approx(energy_Wh, abs=1e-9)
        weights = [world.scenario.waypoints[w].weight for w in want.covered]
        assert got["newly_covered"] == len(want.covered)
        assert got["newly_covered_weight"] == pytest.approx(sum(weights))
        contact = CONTACT_NAMES[got["contact"]]
        assert contact in want.contacts if want.contacts else contact == "none"
        assert (want.status == LOST) == (bool(want.contacts) or before.uas[i].status == LOST)
        assert got["breaches"] == want.breaches
        assert got["too_low"] == want.too_low
        assert set(limit_names(got["limits_exceeded"])) == want.limits
        for field in ("obstacle_clearance_m", "separation_m"):
            assert got[field] == pytest.approx(getattr(want, field), abs=1e-9), field


def fly_against_oracle(world, seed, n_steps):
    rng = np.random.default_rng(seed)
    world.reset()
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    commands["values"][:, 2] = 10.0
    met = set()
    for _ in range(n_steps):
        random_commands(rng, world, commands)
        before = world.state.copy()
        outcome = world.step(commands)
        assert_same(world, before, outcome, commands)
        met.update(CONTACT_NAMES[c] for c in outcome["contact"])
        for mask in outcome["limits_exceeded"]:
            met.update(limit_names(mask))
        if world.done:
            break
    return met


@pytest.mark.parametrize("name", [*SCENARIOS, LEARNERS])
@settings(max_examples=6, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_random_missions_are_those_of_the_oracle(worlds, name, seed):
    fly_against_oracle(worlds[name], seed, 40)


def test_the_random_missions_meet_every_kind_of_contact_and_most_limits(worlds):
    met, rare = set(), {"current", "voltage"}
    # a fault is an event of the scenario, and these have none
    expected = (set(CONTACT_NAMES) - {"fault"}) | set(LIMIT_NAMES) - rare
    for seed in range(60):
        met |= fly_against_oracle(worlds[LEARNERS], seed, 60)
        if met >= expected:
            break
    assert met - rare == expected


def test_no_planner_loses_a_uas_to_its_limits(worlds):
    met = set().union(*(fly_against_oracle(worlds["crowded"], seed, 60) for seed in range(10)))
    assert "limits" not in met
    assert {"speed", "tilt"} <= met


def test_coverage_at_the_start_is_that_of_the_oracle(worlds):
    world = worlds["crowded"]
    world.reset()
    starts = [uas.start_m for uas in world.scenario.uas]
    near = [
        any(math.dist(start, w.position_m) <= w.radius_m for start in starts)
        for w in world.scenario.waypoints
    ]
    assert any(near)
    np.testing.assert_array_equal(world.state.uncovered, ~np.array(near))
