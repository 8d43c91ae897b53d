"""A waypoint that is blocked for an unknown time: which UAS waits for it, and until when."""

import numpy as np
import pytest
from small_fleets import fleet_of
from small_worlds import meadow, mover, waypoint
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.fleet import Moment
from uas_coverage_baselines.trajectory.waiting import choose_waiting

from uas_coverage_env import Scenario, rollout
from uas_coverage_env.flight.metrics import accomplished, home
from uas_coverage_env.mission import Range
from uas_coverage_env.vehicle.layout import DOD

STARTS = ((20.0, 20.0, -1.0), (180.0, 180.0, -1.0))
PLACES = (
    (20.0, 90.0, -20.0),
    (60.0, 110.0, -14.0),
    (100.0, 60.0, -12.0),
    (60.0, 20.0, -18.0),
    (170.0, 140.0, -10.0),
)
PARKED_ON = 4


def parked(until_s):
    """A field of which one waypoint is blocked until then, near the start of the second UAS."""
    leaves = (until_s, (0.0, 0.0, -3.0)), (until_s + 5.0, (0.0, 12.0, 0.0))
    where = PLACES[PARKED_ON]
    return mover(where, (0.0, (0.0, 0.0, 0.0)), *leaves, radius_m=6.0, safe_distance_m=12.0)


def blocked_field(until_s, socs, max_steps=300):
    places = tuple(waypoint(place) for place in PLACES)
    made = meadow(
        STARTS[-len(socs) :], waypoints=places, moving_obstacles=(parked(until_s),)
    ).model_dump(by_alias=True)
    made["max_steps"] = max_steps
    for uas, soc in zip(made["uas"], socs, strict=True):
        uas["soc_0"] = soc
    return Scenario.model_validate(made)


def flown(scenario):
    effort = {"orders": 1, "moves": 20_000, "programs": 40, "weight_energy": 0.0, "idle_work": 0}
    return rollout(scenario, Trajectory(TrajectoryOptions(**effort)))


def waiting(socs, max_steps=300):
    scenario = blocked_field(60.0, socs, max_steps)
    fleet, swarm = fleet_of(scenario)
    blocked = np.arange(len(PLACES)) == PARKED_ON
    n_uas = len(socs)
    moment = Moment(
        swarm.x, np.ones(n_uas, bool), np.ones(5, bool), np.zeros(5, np.int64), swarm.time_s
    )
    return choose_waiting(fleet, Range(fleet.brief), moment, blocked)


def test_what_opens_when_most_are_home_is_covered_by_the_one_that_could_wait_longest():
    """The UAS that is nearest to it has charge for a minute, and the other one comes home early."""
    flight = flown(blocked_field(60.0, (1.0, 0.31)))
    assert accomplished(flight)
    assert flight.violations == ()
    assert flight.breaches == 0


@pytest.mark.parametrize(("until_s", "covers"), [(40.0, True), (250.0, False)])
def test_a_uas_alone_waits_as_long_as_its_charge_lasts_and_comes_home(until_s, covers):
    flight = flown(blocked_field(until_s, (0.36,)))
    assert accomplished(flight) == covers
    assert home(flight).all()
    assert flight.x[-1, 0, DOD] <= 0.75
    assert flight.breaches == 0
    if not covers:
        assert flight.steps > 90, "it waits before it gives up"
        assert flight.covered[-1] == len(PLACES) - 1


def test_the_uas_that_can_wait_longest_waits():
    one = waiting((1.0, 0.4))
    assert one.forbidden[:, PARKED_ON].tolist() == [False, True]
    assert not one.forbidden[:, :PARKED_ON].any()
    other = waiting((0.4, 1.0))
    assert other.forbidden[:, PARKED_ON].tolist() == [True, False]


def test_a_uas_that_can_wait_until_the_mission_ends_may_wait_wherever_its_home_is():
    both = waiting((1.0, 0.8), max_steps=120)
    assert not both.forbidden.any()
    assert 60 < both.latest[PARKED_ON] < 120


def test_no_uas_waits_where_the_charge_lasts_for_the_way_home_only():
    given_up = waiting((0.28, 0.27))
    assert given_up.latest[PARKED_ON] < 0
