import numpy as np
import pytest
from small_worlds import box, meadow, mover

from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.scenario import Scenario, generate_scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VX, VY, X, Y
from uas_coverage_env.world import Acceleration, Velocity, Wrench

VELOCITY, ACCELERATION, WRENCH = map(KIND_NAMES.index, ("velocity", "acceleration", "wrench"))


def without_movers(scenario):
    return scenario.model_copy(update={"moving_obstacles": ()})


def draw(rng, world, commands, kinds):
    """Each UAS keeps its command for about four steps."""
    for i, vehicle in enumerate(world.scenario.vehicles):
        if rng.random() < 0.25:
            kind = rng.choice(kinds)
            if kind == VELOCITY:
                values = [*rng.uniform(-12, 12, 2), rng.uniform(-2, 48), 0.0]
            elif kind == ACCELERATION:
                values = [*rng.uniform(-3, 3, 3), 0.0]
            else:
                values = rng.uniform(-1, 1, 4) * [vehicle.limits.lift_max_N, *vehicle.torque_max_Nm]
            commands[i] = (kind, values, False)


def fly_randomly(world, seed, kinds=(VELOCITY,)):
    """A mission of random commands; returns (contacts, breaches, filtered) counted over it."""
    rng = np.random.default_rng(seed)
    world.reset()
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    commands["values"][:, 2] = 10.0
    contacts = breaches = filtered = 0
    for _ in range(world.scenario.max_steps):
        if world.done:
            break
        draw(rng, world, commands, kinds)
        outcome = world.step(commands)
        contacts += int((outcome["contact"] != 0).sum())
        breaches += int(outcome["breaches"].sum())
        filtered += int(outcome["filtered"].sum())
    return contacts, breaches, filtered


def short(scenario):
    return without_movers(scenario).model_copy(update={"max_steps": 150})


SCENARIOS = {
    "village": lambda: short(load_scenario("village")),
    "town_2": lambda: short(generate_scenario(1, n_uas=2, n_waypoints=16, n_obstacles=9)),
    "town_5": lambda: short(generate_scenario(2, n_uas=5, n_waypoints=16, n_obstacles=12)),
}
KINDS = [(VELOCITY,), (VELOCITY, ACCELERATION, WRENCH)]


@pytest.mark.parametrize("kinds", KINDS, ids=["velocity", "all"])
@pytest.mark.parametrize("name", SCENARIOS)
def test_random_commands_with_both_assistants_harm_no_uas_and_all_come_home(name, kinds):
    world = World(SCENARIOS[name](), safety_filter=True, return_mode=True)
    for seed in range(4):
        contacts, breaches, filtered = fly_randomly(world, seed, kinds)
        assert contacts == 0
        assert breaches == 0
        assert filtered > 0
        assert (world.state.uas["status"] == LANDED).all()


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_same_commands_without_the_filter_end_in_contacts(name):
    world = World(SCENARIOS[name](), return_mode=True)
    assert sum(fly_randomly(world, seed)[0] for seed in range(4)) > 0


def fly(world, command, n_steps):
    for _ in range(n_steps):
        if world.done:
            break
        yield world.step({name: command for name in world.active})


def test_a_command_that_is_safe_is_flown_as_it_is():
    plain = World(meadow([(60.0, 60.0, -10.0)]))
    filtered = World(meadow([(60.0, 60.0, -10.0)]), safety_filter=True)
    harmless = (
        Velocity(4.0, 3.0, 12.0),
        Acceleration(0.1, 0.2, 0.0),
        Wrench(0.1, 0.0, 1e-4, 0.0),
    )
    for command in harmless:
        a = plain.step({"uas_1": command})
        b = filtered.step({"uas_1": command})
        assert a.tobytes() == b.tobytes()
        assert not b["filtered"][0]


@pytest.mark.parametrize(
    "command",
    [
        Velocity(12.0, 0.0, 10.0),
        Acceleration(3.0, 0.0, 0.0),
        Wrench(0.0, 0.0, -0.004, 0.0),
    ],
    ids=["velocity", "acceleration", "wrench"],
)
def test_a_wall_ahead_stops_every_kind_of_command(command):
    wall = box("wall", (150.0, 1.0, -48.0), (155.0, 199.0, 0.0))
    hits = []
    for switch in (True, False):
        scenario = meadow([(100.0, 100.0, -10.0)], obstacles=[wall])
        world = World(scenario, safety_filter=switch)
        outcomes = list(fly(world, command, 40))
        hits.append(any(outcome["contact"].any() for outcome in outcomes))
        if switch:
            assert any(outcome["filtered"].any() for outcome in outcomes)
            assert min(o["obstacle_clearance_m"].min() for o in outcomes) >= 2.36 - 1e-6
            assert all(o["applied_command"]["kind"][0] == 4 for o in outcomes if o["filtered"][0])
    assert hits == [False, True]


def test_two_uas_head_on_pass_each_other():
    starts = [(60.0, 100.0, -10.0), (140.0, 100.0, -10.0)]
    commands = {"uas_1": Velocity(10.0, 0.0, 10.0), "uas_2": Velocity(-10.0, 0.0, 10.0)}
    least_m = []
    for switch in (True, False):
        world = World(meadow(starts), safety_filter=switch)
        apart_m = np.inf
        for _ in range(12):
            if not world.done:
                outcome = world.step({name: commands[name] for name in world.active})
                apart_m = min(apart_m, outcome["separation_m"].min())
        least_m.append(apart_m)
    assert least_m[0] >= 5.72 - 1e-6
    assert least_m[1] < 0.72


def test_a_uas_that_starts_in_a_breach_zone_can_leave_it():
    house = box("house", (100.0, 80.0, -30.0), (120.0, 120.0, 0.0))
    world = World(meadow([(90.0, 100.0, -10.0)], obstacles=[house]), safety_filter=True)
    world.state.x[0, 0] = 98.6
    towards = world.step({"uas_1": Velocity(5.0, 0.0, 10.0)})
    assert towards["filtered"][0]
    assert towards["contact"][0] == 0
    world.reset()
    world.state.x[0, 0] = 98.6
    away = world.step({"uas_1": Velocity(-5.0, 0.0, 10.0)})
    assert not away["filtered"][0]
    for _ in fly(world, Velocity(-5.0, 0.0, 10.0), 6):
        pass
    assert world.state.x[0, X] < 90.0


def test_a_moving_obstacle_on_the_way_is_not_flown_into():
    truck = mover((160.0, 100.0, -8.0), (0.0, (-5.0, 0.0, 0.0)), radius_m=6.0, height_m=16.0)
    hit = []
    for switch in (True, False):
        scenario = meadow([(40.0, 100.0, -8.0)], moving_obstacles=[truck])
        world = World(scenario, safety_filter=switch)
        outcomes = list(fly(world, Velocity(8.0, 0.0, 8.0), 12))
        hit.append(any(outcome["contact"].any() for outcome in outcomes))
    assert hit == [False, True]


def test_a_uas_gets_out_of_the_way_of_a_moving_obstacle():
    truck = mover((180.0, 100.0, -8.0), (0.0, (-6.0, 0.0, 0.0)), radius_m=6.0, height_m=16.0)
    hit = []
    for switch in (True, False):
        scenario = meadow([(90.0, 100.0, -8.0)], moving_obstacles=[truck])
        world = World(scenario, safety_filter=switch)
        outcomes = list(fly(world, Velocity(0.0, 0.0, 8.0), 25))
        hit.append(any(outcome["contact"].any() for outcome in outcomes))
    assert hit == [False, True]


@pytest.mark.parametrize("speed_mps", [4.0, 8.0])
@pytest.mark.parametrize("aside_m", [0.0, 6.0, -12.0])
def test_a_hovering_uas_keeps_the_safe_distance_from_something_large_that_comes(speed_mps, aside_m):
    airship = mover(
        (190.0, 100.0 + aside_m, -15.0),
        (0.0, (-speed_mps, 0.0, 0.0)),
        radius_m=8.0,
        height_m=12.0,
        safe_distance_m=12.0,
    )
    world = World(meadow([(80.0, 100.0, -15.0)], moving_obstacles=[airship]), safety_filter=True)
    outcomes = list(fly(world, Velocity(0.0, 0.0, 15.0), 40))
    assert sum(int(outcome["breaches"].sum()) for outcome in outcomes) == 0


def test_getting_out_of_the_way_is_not_paid_for_with_the_fence_a_wall_or_another_uas():
    wall = box("wall", (60.0, 1.0, -48.0), (140.0, 4.0, 0.0))
    starts = [(100.0, 10.0, -10.0), (100.0, 18.0, -10.0), (108.0, 14.0, -10.0)]
    truck = mover(
        (100.0, 60.0, -10.0), (0.0, (0.0, -9.0, 0.0)), radius_m=10.0, height_m=30.0,
        safe_distance_m=8.0,
    )  # fmt: skip
    scenario = meadow(starts, obstacles=[wall], moving_obstacles=[truck])
    world = World(scenario, safety_filter=True)
    for outcome in fly(world, Velocity(0.0, 0.0, 10.0), 20):
        assert set(outcome["contact"]) <= {
            CONTACT_NAMES.index(n) for n in ("none", "moving_obstacle")
        }
        assert outcome["separation_m"].min() >= 5.72 - 1e-6


def test_things_that_turn_without_warning_drive_no_uas_into_what_stands_still():
    world = World(restless(SCENARIOS["town_5"]()), safety_filter=True)
    for seed in range(4):
        assert lost_to(world, seed) <= {CONTACT_NAMES.index("moving_obstacle")}


def restless(scenario):
    """Two fast cylinders that turn every five seconds."""
    lots = np.random.default_rng(9)
    corners_m = scenario.fence.vertices_m
    movers = []
    for number in (1, 2):
        place_m = np.append(lots.uniform(0.4, 0.6, 2) * corners_m[:, :2].max(axis=0), -20.0)
        pieces = [(5.0 * k, (*lots.uniform(-12.0, 12.0, 2), 0.0)) for k in range(30)]
        movers.append(mover(tuple(place_m), *pieces, safe_distance_m=8.0, name=f"mover_{number}"))
    data = scenario.model_dump(by_alias=True) | {"moving_obstacles": movers}
    return Scenario.model_validate(data)


def lost_to(world, seed):
    """Contact codes of a mission of random velocities, without "none"."""
    rng = np.random.default_rng(seed)
    world.reset()
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    codes = set()
    for _ in range(100):
        if world.done:
            break
        draw(rng, world, commands, (VELOCITY,))
        codes |= set(world.step(commands)["contact"].tolist())
    return codes - {0}


def test_the_ceiling_and_the_ground_hold_back_climbs_and_descents():
    world = World(meadow([(100.0, 100.0, -25.0)]), safety_filter=True)
    for altitude_m in (80.0, -20.0):
        outcomes = fly(world, Velocity(0.0, 0.0, altitude_m), 45)
        assert sum(int(outcome["breaches"].sum()) for outcome in outcomes) == 0
    assert -world.state.x[0, 2] < 2.0


def test_the_filter_also_keeps_the_nonlinear_plant_clear():
    house = box("house", (100.0, 60.0, -40.0), (130.0, 140.0, 0.0))
    world = World(
        meadow([(40.0, 100.0, -10.0)], obstacles=[house]),
        dynamics="nonlinear",
        safety_filter=True,
    )
    rng = np.random.default_rng(5)
    for _ in range(20):
        north, east = rng.uniform(-12, 12, 2)
        for outcome in fly(world, Velocity(north, east, 12.0), 5):
            assert not outcome["contact"].any()
            assert outcome["breaches"].sum() == 0
    assert np.hypot(*world.state.x[0, [VX, VY]]) > 0.0
    assert 0.0 < world.state.x[0, Y] < 200.0


def test_the_next_state_says_whose_command_was_replaced_until_the_mission_begins_again():
    world = World(short(generate_scenario(4001)), safety_filter=True)
    rng, said = np.random.default_rng(1), []
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    for _ in range(60):
        draw(rng, world, commands, (VELOCITY, WRENCH))
        outcome = world.step(commands)
        assert np.array_equal(world.swarm_state().filtered, outcome["filtered"])
        said.append(outcome["filtered"])
    assert {True, False} <= set(np.ravel(said).tolist())
    world.reset()
    assert not world.swarm_state().filtered.any()
