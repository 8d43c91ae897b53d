"""A UAS swaps its battery pack at home while the others fly on, where the scenario says so."""

import numpy as np
import pytest
from small_worlds import meadow, mover, waypoint

from uas_coverage_env import World
from uas_coverage_env.entities.state import FLYING, LANDED, LOST, SWAPPING
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.vehicle.layout import DOD, X, Y, Z
from uas_coverage_env.world import GoTo, Velocity

STARTS_M = ((20.0, 20.0, -10.0), (20.0, 100.0, -10.0))
NEAR, NEXT, FAR = (
    waypoint((north_m, east_m, -10.0), 4.0)
    for north_m, east_m in ((30.0, 20.0), (32.0, 30.0), (160.0, 160.0))
)
HOME = GoTo(None, mode="return")
SWAP_S = 7.0


def mission(*events, packs=3, swap_s=SWAP_S, starts_m=STARTS_M, **more):
    """A meadow in which each UAS swaps on its own."""
    given = {"waypoints": (NEAR, NEXT, FAR), "soc_0": 0.8, **more}
    sorties = Sorties(packs=packs, swap_s=swap_s, together=False)
    return meadow(starts_m, **given).model_copy(update={"sorties": sorties, "events": events})


def event(kind, at_s, **fields):
    return {"kind": kind, "at_s": at_s, **fields}


def fly(world, until, commands):
    """Fly commands, those of UAS that do not fly left out, until a condition holds."""
    for _ in range(world.scenario.max_steps):
        if until(world):
            return int(world.state.step[0])
        world.step({name: commands[name] for name in world.active})
    raise AssertionError("it never came to that")


def has(i, status):
    return lambda world: world.state.uas[i].status == status


HOVERS = Velocity(0.0, 0.0, 10.0)
FIRST = {"uas_1": GoTo(0), "uas_2": HOVERS}
BACK = {"uas_1": HOME, "uas_2": HOVERS}


def first_sortie(world):
    """The first UAS covers a waypoint and lands; the second hovers."""
    fly(world, lambda world: not world.state.uncovered[0], FIRST)
    return fly(world, lambda world: world.state.uas[0].status != FLYING, BACK)


def test_it_flies_again_with_a_fresh_pack_when_its_swap_is_over():
    world = World(mission())
    landed = first_sortie(world)
    seen = world.swarm_state()
    assert world.state.uas["status"].tolist() == [SWAPPING, FLYING]
    assert seen.status.tolist() == [LANDED, FLYING]
    assert seen.active == ("uas_2",)
    assert seen.x[0, DOD] > 0.2
    place_m = seen.x[0, :3].copy()
    assert fly(world, has(0, FLYING), BACK) == landed + SWAP_S
    seen = world.swarm_state()
    assert seen.active == ("uas_1", "uas_2")
    assert seen.x[0, DOD] == pytest.approx(0.2)
    assert (seen.x[0, :3] == place_m).all()
    assert not seen.departed[0]
    assert not seen.returning[0]


def test_without_a_pack_left_landing_is_final():
    world = World(mission(packs=1))
    first_sortie(world)
    assert world.state.uas["status"].tolist() == [LANDED, FLYING]


def test_a_sortie_that_covers_nothing_is_the_last_until_another_uas_is_lost():
    lost = event("uas_lost", 90.0, uas="uas_2")
    world = World(mission(lost))
    first_sortie(world)
    fly(world, has(0, FLYING), BACK)
    away = {"uas_1": Velocity(3.0, 0.0, 30.0), "uas_2": HOVERS}
    fly(world, lambda world: world.state.uas[0].departed, away)
    fly(world, has(0, SWAPPING), BACK)
    again = fly(world, has(0, FLYING), BACK)
    assert again == 90
    assert world.state.uas[1].status == LOST


def test_the_mission_goes_on_while_one_swaps_and_ends_when_no_uas_is_going_to_fly():
    world = World(mission(starts_m=STARTS_M[:1]))
    first_sortie(world)
    assert not world.active
    assert not world.done
    fly(world, has(0, FLYING), BACK)
    away = {"uas_1": Velocity(3.0, 0.0, 30.0)}
    fly(world, lambda world: world.state.uas[0].departed, away)
    fly(world, lambda world: world.done, BACK)
    assert world.state.uas["status"].tolist() == [LANDED]
    assert world.state.uncovered.any()


def test_a_uas_that_swaps_when_nothing_is_left_has_landed_for_good():
    dropped = [event("waypoint_dropped", 60.0, waypoint=w) for w in (1, 2)]
    world = World(mission(*dropped, swap_s=1000.0, max_steps=3000))
    first_sortie(world)
    assert fly(world, has(0, LANDED), BACK) == 60
    assert not world.done


def test_the_limit_of_steps_ends_a_swap():
    world = World(mission(swap_s=100.0, max_steps=100))
    first_sortie(world)
    assert fly(world, has(0, LANDED), BACK) <= 100


def test_no_uas_takes_off_that_could_not_be_back_in_time():
    far = waypoint((160.0, 20.0, -10.0), 4.0)
    world = World(mission(waypoints=(NEAR, far), swap_s=20.0, max_steps=50))
    first_sortie(world)
    assert world.state.uas[0].status == LANDED


def test_it_waits_until_one_that_flies_past_is_gone():
    world = World(mission())
    landed = first_sortie(world)
    beside_m = world.state.x[0, [X, Y, Z]] + (0.0, 4.0, 0.0)
    for step in range(12):
        world.state.x[1, [X, Y, Z]] = beside_m  # closer than 5 m and two radii
        world.step({"uas_2": HOVERS})
        assert world.state.uas[0].status == SWAPPING, step
    world.state.x[1, [X, Y, Z]] = (150.0, 150.0, -10.0)
    assert fly(world, has(0, FLYING), BACK) == landed + 13


def test_it_waits_for_a_moving_obstacle_to_leave():
    landed = first_sortie(World(mission()))
    passing = mover(
        (20.0, 60.0, -10.0),
        (0.0, (0.0, 0.0, 0.0)),
        (landed - 2.0, (0.0, -8.0, 0.0)),
        (landed + 3.0, (0.0, 0.0, 0.0)),
        (landed + 20.0, (0.0, 8.0, 0.0)),
    )
    world = World(mission(moving_obstacles=(passing,)))
    assert first_sortie(world) == landed
    assert fly(world, has(0, FLYING), BACK) > landed + 20


def test_without_its_radio_it_waits_and_takes_off_when_it_hears_again():
    deaf = event("radio_lost", 40.0, uas="uas_1", for_s=60.0, then="hover")
    world = World(mission(deaf))
    assert first_sortie(world) < 40
    world = World(mission(deaf, swap_s=30.0))
    first_sortie(world)
    assert fly(world, has(0, FLYING), BACK) == 100


def test_what_a_planner_is_told_late_shows_the_fresh_pack_at_once():
    scenario = mission().model_copy(update={"sensing": {"delay_steps": 4}})
    world = World(Scenario.model_validate(scenario.model_dump(by_alias=True)))
    first_sortie(world)
    fly(world, has(0, FLYING), BACK)
    assert world.swarm_state().x[0, DOD] == pytest.approx(0.2)


def test_from_the_ground_the_swap_takes_landing_and_climb_and_the_climb_its_charge():
    from_ground = mission().model_copy(update={"from_ground": True})
    world = World(from_ground)
    first_dod = world.state.x[0, DOD]
    assert first_dod > 0.2
    landed = first_sortie(world)
    took_off = fly(world, has(0, FLYING), BACK)
    assert took_off > landed + SWAP_S + 4.0
    assert world.state.x[0, DOD] == first_dod


def test_a_reset_gives_all_packs_back():
    world = World(mission(packs=2))
    for _ in range(2):
        world.reset()
        first_sortie(world)
        fly(world, has(0, FLYING), BACK)
        assert world.state.packs[0].number == 1


def test_no_file_says_together_that_did_not_before():
    data = mission().model_copy(update={"sorties": Sorties(packs=3)}).model_dump(mode="json")
    assert data["sorties"] == {"packs": 3, "swap_s": 0.0}
    data = mission().model_dump(mode="json", by_alias=True)
    assert data["sorties"]["together"] is False
    with pytest.raises(InputError, match="relaunch: true does not go with sorties"):
        parse({**data, "relaunch": True}, Scenario, "mission.toml")


def test_where_no_uas_lands_with_work_left_flights_are_what_they_were():
    plain = mission().model_copy(update={"sorties": None})
    worlds = World(mission()), World(plain)
    for _ in range(20):
        for world in worlds:
            world.step(FIRST)
    np.testing.assert_array_equal(worlds[0].state.x, worlds[1].state.x)


def test_where_its_home_was_closed_it_swaps_at_the_other_place():
    other_m = (40.0, 40.0, -10.0)
    closed = event("home_closed", 5.0, uas="uas_1", alternative_m=other_m)
    world = World(mission(closed))
    first_sortie(world)
    assert world.state.uas[0].status == SWAPPING
    fly(world, has(0, FLYING), BACK)
    np.testing.assert_allclose(world.state.x[0, :3], other_m, atol=2.0)
