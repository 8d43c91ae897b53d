"""Planar missions: no input, wind, fault or plant moves a UAS from the height of the mission."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import Acceleration, GoTo, Velocity, World, Wrench, uas_coverage_v0
from uas_coverage_env import uas_coverage_v1 as v1
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.scenario import Gust, RandomGusts, Uncertainty, Wind
from uas_coverage_env.scenario.planar import Planar
from uas_coverage_env.scenario.source import MissionSource
from uas_coverage_env.vehicle.layout import VZ, Z

HEIGHT_M = 10.0
STARTS = ((100.0, 100.0, -HEIGHT_M), (100.0, 60.0, -HEIGHT_M))
GUSTY = Wind(
    mean_mps=4.0,
    from_deg=30.0,
    turbulence=0.2,
    gusts=(Gust(at_s=3.0, lasts_s=6.0, from_deg=90.0, peak_mps=4.0, up_mps=6.0),),
    random_gusts=RandomGusts(per_min=6.0, lasts_s=4.0, peak_mps=3.0),
)


def plane(height_m=HEIGHT_M, obstacles=(), **changes):
    starts = [(north, east, -height_m) for north, east, _ in STARTS]
    wanted = [waypoint((150.0, 100.0, -height_m), 4.0), waypoint((150.0, 60.0, -height_m), 4.0)]
    ground = meadow(starts, waypoints=wanted, obstacles=obstacles)
    return ground.model_copy(update={"planar": Planar(height_m=height_m), **changes})


COMMANDS = {
    "velocity": lambda k: Velocity(3.0, -2.0, 40.0 if k % 2 else 0.5),
    "acceleration": lambda k: Acceleration(1.0, 0.5, -3.0 if k % 2 else 3.0),
    "wrench": lambda k: Wrench(4.0 if k % 3 else -4.0, 0.002, -0.002, 0.0),
    "waypoint": lambda k: GoTo(0, climb_m=20.0),
}


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize("disturbed", [False, True])
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_gust_or_wrong_vehicle_moves_a_uas_from_the_height(command, disturbed, dynamics):
    changes = {}
    if disturbed:
        changes = {"wind": GUSTY, "uncertainty": Uncertainty(mass=0.1, thrust=0.1)}
    world = World(plane(**changes), dynamics=dynamics, safety_filter=True)
    for k in range(12):
        flying = {uas: COMMANDS[command](k) for uas in world.swarm_state().active}
        if not flying:
            break
        world.step(flying)
        assert np.abs(world.state.x[:, Z] + HEIGHT_M).max() < 1e-9
        assert np.abs(world.state.x[:, VZ]).max() < 1e-9


def test_a_heavier_vehicle_draws_more_to_keep_its_height():
    used = {}
    for mass in (0.0, 0.2):
        world = World(plane(uncertainty=Uncertainty(mass=mass)), seed=3)
        for _ in range(10):
            world.step(dict.fromkeys(world.swarm_state().active, Velocity(0.0, 0.0, HEIGHT_M)))
        used[mass] = world.state.x[0, 12]
    assert used[0.0] != used[0.2]


@pytest.mark.parametrize("version", [uas_coverage_v0, v1])
@pytest.mark.parametrize(
    ("action", "size", "share"),
    [("velocity", 2, 0.9), ("acceleration", 2, 0.1), ("wrench", 3, 0.01), ("waypoint", 1, 0.0)],
)
def test_actions_lose_their_vertical_number_in_single_missions_and_batches(
    version, action, size, share
):
    ground = plane()
    env = version.parallel_env(ground, action=action)
    env.reset(seed=0)
    space = env.action_space("uas_1")
    batch = CoverageBatch(2, ground, action=action, version=version.VERSION)
    batch.reset(seed=0)
    assert batch.actions.size == size
    if action == "waypoint":
        return
    assert space.shape == (size,)
    rng = np.random.default_rng(1)
    for _ in range(4):
        asked = rng.uniform(0.7, 1.0, (2, size)).astype(np.float32) * share
        observations, *_ = env.step({"uas_1": asked[0], "uas_2": asked[1]})
        batch.step(np.stack([asked, asked]))
        row = np.asarray(batch.observation).reshape(2, 2, -1)[0, 0]
        assert np.array_equal(row, observations["uas_1"])
        assert env.swarm_state().x[:, Z] == pytest.approx([-HEIGHT_M] * 2, abs=1e-9)


@pytest.mark.parametrize(
    ("action", "command"),
    [
        ("velocity", Velocity(1.5, -0.7, HEIGHT_M)),
        ("acceleration", Acceleration(0.3, -0.2, 0.0)),
        ("wrench", Wrench(0.0, 0.001, -0.002, 0.0005)),
        ("velocity", GoTo(0)),
    ],
)
def test_a_command_and_the_action_that_flies_it_move_a_uas_alike(action, command):
    for version in (uas_coverage_v0, v1):
        env, world = version.parallel_env(plane(), action=action), World(plane())
        env.reset(seed=0)
        both = {"uas_1": command, "uas_2": command}
        env.step(env.actions_of(both))
        world.step(both)
        assert env.swarm_state().x[:, :12] == pytest.approx(world.state.x[:, :12], abs=1e-4)


def test_a_uas_that_wishes_to_hold_still_at_its_start_lands_in_v1():
    env = v1.parallel_env(plane())
    env.reset(seed=0)
    env.step({"uas_1": np.zeros(2, np.float32), "uas_2": np.ones(2, np.float32)})
    assert env.agents == ["uas_2"]


def test_walls_above_and_below_the_height_are_no_walls_and_one_across_it_is_flown_round():
    def way_of(low_m, high_m):
        wall = box("wall", (124.0, 70.0, -high_m), (126.0, 130.0, -low_m))
        world = World(plane(obstacles=(wall,)), safety_filter=True)
        track = []
        for _ in range(60):
            active = world.swarm_state().active
            if "uas_1" not in active or not world.state.uncovered[0]:
                break
            world.step({uas: GoTo(0 if uas == "uas_1" else 1) for uas in active})
            track.append(world.state.x[0, :3].copy())
        assert not world.state.uncovered[0]
        return np.array(track)

    assert np.ptp(way_of(14.0, 20.0)[:, 1]) < 1.0
    assert np.ptp(way_of(0.0, 6.0)[:, 1]) < 1.0
    aside = way_of(0.0, 14.0)
    assert np.abs(aside[:, 1] - 100.0).max() > 30.0
    assert np.abs(aside[:, 2] + HEIGHT_M).max() < 1e-9


def test_planar_missions_and_others_are_not_flown_side_by_side():
    flat, space = plane(), meadow()
    with pytest.raises(ValueError, match="some scenarios are planar and some are not"):
        CoverageBatch(2, [flat, space])
    env = v1.parallel_env(lambda rng: flat)
    with pytest.raises(ValueError, match="'meadow' is not planar and 'meadow' of the same"):
        env.reset(options={"scenario": space})
    assert MissionSource.of(flat).fitted(flat) is flat
