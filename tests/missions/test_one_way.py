"""Missions that end elsewhere: each UAS takes off at its start and lands at `land_m`."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import Flight, load_planner, rollout
from uas_coverage_env.bound import MissionBound
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.flight.rest import rest_of
from uas_coverage_env.independent_check.judge import check
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario, warnings
from uas_coverage_env.scenario.feasibility import back_and_forth
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import GoTo, Velocity

WEST, EAST = (100.0, 20.0, -1.0), (100.0, 180.0, -1.0)
ON_THE_WAY = [waypoint((100.0 + aside, 130.0, -8.0), 6.0) for aside in (-30.0, 30.0)]


def one_way(starts_m, homes_m, *, soc_0=1.0, reserve=None, **changes):
    """A meadow in which each UAS lands elsewhere; of None, at its start."""
    changes = {"waypoints": ON_THE_WAY} | changes
    data = meadow(starts_m, soc_0=soc_0, **changes).model_dump(mode="json", by_alias=True)
    for uas, home_m in zip(data["uas"], homes_m, strict=True):
        uas |= {"land_m": home_m} if home_m else {}
    return Scenario.model_validate(data | ({"reserve": reserve} if reserve else {}))


def flown(scenario, planner="nearest-waypoint", **options):
    return rollout(scenario, load_planner(planner), **options)


def away_m(flight, uas, place_m):
    return float(np.linalg.norm(flight.x[-1, uas, :3] - place_m))


@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower", "tour"])
def test_a_uas_covers_what_lies_on_its_way_and_lands_elsewhere(planner):
    flight = flown(one_way([WEST], [EAST]), planner)
    assert accomplished(flight)
    assert flight.breaches == 0
    assert away_m(flight, 0, EAST) <= flight.scenario.landing_distance_m
    # there and back would be twice as far
    assert flight.steps < flown(one_way([WEST], [None]), planner).steps


def test_two_uas_trade_places():
    flight = flown(one_way([WEST, EAST], [EAST, WEST]))
    assert accomplished(flight)
    assert flight.breaches == 0
    assert away_m(flight, 0, EAST) <= 2.0
    assert away_m(flight, 1, WEST) <= 2.0


def test_two_uas_land_on_one_pad_one_after_the_other():
    flight = flown(one_way([WEST, (140.0, 20.0, -1.0)], [EAST, EAST]))
    assert accomplished(flight)
    assert flight.breaches == 0
    landed = [int(flight.last_sample[i]) for i in range(2)]
    assert abs(landed[0] - landed[1]) >= 1
    assert max(away_m(flight, i, EAST) for i in range(2)) <= 2.0


def test_with_nothing_to_cover_on_the_way_it_still_flies_to_its_landing_place():
    at_start = [waypoint(WEST, 5.0)]
    flight = flown(one_way([WEST], [EAST], waypoints=at_start), return_mode=True)
    assert accomplished(flight)
    assert away_m(flight, 0, EAST) <= 2.0


def test_return_mode_brings_a_uas_to_its_landing_place_though_its_start_is_near():
    # it stays near its start until the charge is needed for the way to the other place
    scenario = one_way([WEST], [EAST], soc_0=0.4, waypoints=[waypoint((190.0, 20.0, -40.0), 1.0)])
    world = World(scenario, return_mode=True)
    turned_at = None
    while not world.done:
        world.step({"uas_1": Velocity(0.0, 0.0, 20.0)})
        if turned_at is None and world.state.uas[0].returning:
            turned_at = float(world.state.x[0, DOD])
    assert np.linalg.norm(world.state.x[0, :3] - EAST) <= 2.0
    near = one_way([WEST], [None], soc_0=0.4, waypoints=[waypoint((190.0, 20.0, -40.0), 1.0)])
    back = World(near, return_mode=True)
    while not back.state.uas[0].returning:
        back.step({"uas_1": Velocity(0.0, 0.0, 20.0)})
    assert turned_at < float(back.state.x[0, DOD])


def test_players_are_told_where_each_uas_lands():
    swarm = World(one_way([WEST, EAST], [EAST, None])).swarm_state()
    assert swarm.home_m.tolist() == [list(EAST), list(EAST)]
    assert swarm.x[:, :3].tolist() == [list(WEST), list(EAST)]


def test_low_flight_is_allowed_near_the_start_and_near_the_landing_place():
    world = World(one_way([WEST], [EAST], min_height_m=3.0))
    for place_m, low in ((WEST, False), (EAST, False), ((100.0, 100.0, -1.0), True)):
        world.reset()
        world.state.x[0, :3] = place_m
        outcome = world.step({"uas_1": Velocity(0.0, 0.0, -place_m[2])})
        assert bool(outcome["too_low"][0]) == low


def test_the_way_counts_once_in_the_estimate_and_in_the_bound():
    there, back = one_way([WEST], [EAST]), one_way([WEST], [None])
    assert back_and_forth(there).makespan_s < back_and_forth(back).makespan_s
    assert MissionBound(there).steps < MissionBound(back).steps
    assert MissionBound(there).steps <= flown(there).steps
    assert MissionBound(there).energy_Wh() <= flown(there).figures["energy_Wh"]


def test_a_uas_without_waypoints_counts_its_way_in_the_estimate():
    near = [waypoint((100.0, 30.0, -20.0), 6.0)]
    both = one_way([WEST, (140.0, 20.0, -1.0)], [None, (140.0, 180.0, -1.0)], waypoints=near)
    alone = one_way([WEST, (140.0, 20.0, -1.0)], [None, None], waypoints=near)
    assert back_and_forth(both).flight_s[1] > 13.0  # 160 m at 12 m/s
    assert back_and_forth(alone).flight_s[1] == 0.0


def test_a_mission_that_is_feasible_one_way_only_has_no_warning():
    there, back = (
        one_way([WEST], [home], soc_0=0.2715, waypoints=ON_THE_WAY[:1]) for home in (EAST, None)
    )
    assert warnings(there) == []
    assert any("batteries" in line for line in warnings(back))


def test_what_is_left_is_flown_from_where_all_are_to_where_they_were_to_land():
    flight = flown(one_way([WEST], [EAST]), max_steps=4)
    rest = rest_of(flight, from_here=True)
    assert rest.uas[0].start_m == tuple(flight.x[-1, 0, :3])
    assert rest.uas[0].home_m == EAST
    assert rest.events == ()
    # with fresh packs all are at home
    assert rest_of(flight).uas[0].start_m == EAST


def test_a_flight_is_judged_alike_from_its_files(tmp_path):
    flight = flown(one_way([WEST], [EAST], reserve={"share": 0.3}))
    flight.save(tmp_path / "flight")
    assert check(tmp_path / "flight").problems == []
    again = Flight.load(tmp_path / "flight")
    assert again.scenario.uas[0].land_m == EAST
    assert again.figures["reserve_breaches"] == 0


@pytest.mark.parametrize("reserve", [{"share": 0.62}, {"minutes": 8.6}], ids=["share", "minutes"])
def test_landing_below_the_reserve_is_a_breach_and_no_loss(tmp_path, reserve):
    class GoesHome:
        def reset(self, brief, seed):
            pass

        def act(self, swarm):
            open_ = np.flatnonzero(swarm.uncovered)
            return {name: GoTo(int(open_[0]) if len(open_) else None) for name in swarm.active}

    scenario = one_way([WEST], [EAST], soc_0=0.65, reserve=reserve)
    landed = MissionBrief.of(scenario).dod_landed[0]
    assert landed < 0.75
    flight = rollout(scenario, GoesHome())
    assert flight.x[-1, 0, DOD] > landed
    assert accomplished(flight)
    assert flight.breaches == flight.figures["reserve_breaches"] == 1
    flight.save(tmp_path / "flight")
    assert check(tmp_path / "flight").problems == []
    enough = rollout(scenario.model_copy(update={"reserve": None}), GoesHome())
    assert enough.breaches == 0
    assert enough.figures["reserve_breaches"] is None


def test_return_mode_begins_by_the_reserve():
    def soc_at_return(**more):
        far = [waypoint((190.0, 190.0, -40.0), 1.0)]
        world = World(one_way([WEST], [None], soc_0=0.9, waypoints=far, **more), return_mode=True)
        while not world.state.uas[0].returning:
            world.step({"uas_1": Velocity(0.0, 0.0, 20.0)})
        return 1.0 - float(world.state.x[0, DOD])

    usual = soc_at_return(max_steps=2000)
    kept = soc_at_return(max_steps=2000, reserve={"share": 0.5})
    assert kept - usual == pytest.approx(0.25, abs=0.01)


def test_a_reserve_beyond_what_a_uas_has_is_refused():
    with pytest.raises(ValueError, match=r"uas\[0\].soc_0: 0.4 is no more than the \[reserve\]"):
        one_way([WEST], [None], soc_0=0.4, reserve={"share": 0.5})
    with pytest.raises(ValueError, match=r"uas\[0\].soc_0: 1 is no more than the \[reserve\]"):
        one_way([WEST], [None], reserve={"minutes": 60.0})
    for both in ({"share": 0.2, "minutes": 1.0}, {}):
        with pytest.raises(ValueError, match=r"share or minutes: .* give one of them"):
            one_way([WEST], [None], reserve=both or {"share": None})


def test_a_landing_place_is_checked_as_a_start_is():
    house = box("house", (95.0, 170.0, -9.0), (105.0, 190.0, 0.0))
    with pytest.raises(ValueError, match=r"uas\[0\].land_m: .* from obstacle 'house'"):
        one_way([WEST], [EAST], obstacles=[house])
    with pytest.raises(ValueError, match=r"uas\[0\].land_m: .* outside the geofence"):
        one_way([WEST], [(100.0, 250.0, -1.0)])
    # two that take off at one place at once would collide, two that land there need not
    with pytest.raises(ValueError, match=r"uas\[1\].start_m: .* from the start of 'uas_1'"):
        one_way([WEST, WEST], [EAST, None])
