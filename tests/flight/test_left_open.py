"""Why waypoints are left open: one reason for each, whatever the planner."""

import dataclasses
import json

import numpy as np
import pytest
from closed_yards import HOME, INSIDE, OPEN, yard
from small_worlds import box, meadow, mover, waypoint

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight, Why, rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.left_open import left_open
from uas_coverage_env.flight.record import LOST
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import GoTo


class HomeAtOnce:
    """Lands where it stands; what it says of the waypoint 0 can be chosen."""

    def __init__(self, **said):
        if said:
            self.given_up = {0: said["said"]}

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return {name: GoTo(None) for name in swarm.active}


def landed(scenario, **said):
    return rollout(scenario, HomeAtOnce(**said))


def field(place_m=OPEN[0], radius_m=8.0, **fields):
    return meadow((HOME,), waypoints=[waypoint(place_m, radius_m)], **fields)


def only(flight):
    (one,) = flight.left_open
    return one


def test_a_planner_that_gives_up_with_charge_left_is_named_and_what_it_says_is_kept():
    one = only(landed(field(), said="too windy"))
    assert one.why is Why.PLANNER
    assert one.detail.endswith("; too windy")
    # 41 m there and back at 12 m/s, 11 s to slow down and settle, and the margin
    assert "landed with charge for 9" in one.detail
    assert only(landed(field())).detail + "; too windy" == one.detail


def test_what_is_closed_off_is_so_and_the_zone_that_closes_it_is_named():
    closed, planner = landed(yard()).left_open[1], landed(yard()).left_open[0]
    assert (closed.waypoint, closed.why) == (1, Why.NO_WAY)
    assert "no-fly zone zone_" in closed.detail
    assert planner.why is Why.PLANNER


def test_what_no_battery_reaches_is_out_of_reach_from_the_beginning():
    one = only(landed(field((190.0, 190.0, -40.0), soc_0=0.28)))
    assert one.why is Why.TOO_FAR
    takes_s, lasts_s = (int(part.split()[0]) for part in _figures(one.detail))
    assert takes_s > lasts_s > 0


def _figures(detail):
    return detail.partition("takes uas_1 ")[2], detail.partition("lasts ")[2]


def test_what_the_charge_that_is_left_does_not_reach_is_for_want_of_charge():
    flight = landed(field((190.0, 190.0, -40.0)))
    assert only(flight).why is Why.PLANNER
    x = flight.x.copy()
    x[-1, :, DOD] = 0.73
    (one,) = left_open(dataclasses.replace(flight, x=x))
    assert one.why is Why.CHARGE
    assert "its charge that was left lasts" in one.detail


def test_where_no_uas_is_left_the_loss_is_the_reason():
    flight = landed(field())
    mode = flight.mode.copy()
    mode[-1] = LOST
    (one,) = left_open(dataclasses.replace(flight, mode=mode))
    assert (one.why, one.detail) == (Why.LOST, "uas_1 could have covered it")


def test_where_the_mission_ends_first_time_is_the_reason():
    one = only(landed(field((190.0, 190.0, -40.0), max_steps=30)))
    assert one.why is Why.TIME
    assert one.detail.endswith("29 s were left")


def test_a_flight_that_was_ended_in_the_air_blames_no_planner():
    flight = rollout(field((150.0, 150.0, -20.0)), "nearest-waypoint", max_steps=4)
    assert only(flight).why is Why.ENDED
    assert only(flight).detail == "at its limit of steps, with uas_1 in the air"


def test_a_waypoint_that_is_too_near_to_a_tower_has_no_room():
    tower = box("tower", (50.0, 31.0, -40.0), (70.0, 50.0, 0.0))
    assert only(landed(field(radius_m=1.0, obstacles=[tower]))).why is Why.NO_ROOM


def test_a_waypoint_that_asks_for_a_sensor_that_no_uas_carries_says_so():
    asks = waypoint(OPEN[0]) | {"sensor": "thermal"}
    one = only(landed(meadow((HOME,), waypoints=[asks])))
    assert (one.why, one.detail) == (Why.NO_SENSOR, "no UAS carries 'thermal'")


def test_what_something_that_moves_stands_over_in_the_end_is_blocked():
    balloon = mover(OPEN[0], (0.0, (0.0, 0.0, 0.0)), name="balloon")
    one = only(landed(field(radius_m=3.0, moving_obstacles=[balloon])))
    assert (one.why, one.detail) == (Why.BLOCKED, "balloon kept it closed in the end")


def test_a_zone_that_an_event_closes_in_flight_counts_as_it_is_in_the_end():
    wall = {
        "kind": "no_fly_zone",
        "at_s": 1.0,
        "name": "late",
        "safe_distance_m": 2.0,
        "vertices_m": box("late", (0.0, 80.0, -50.0), (200.0, 84.0, 0.0))["vertices_m"],
    }
    scenario = meadow((HOME,), waypoints=[waypoint(INSIDE, 5.0), waypoint(OPEN[0])])
    data = scenario.model_dump(by_alias=True) | {"events": (wall,)}
    flight = rollout(type(scenario).model_validate(data), "nearest-waypoint")
    assert only(flight).why is Why.NO_WAY
    assert only(flight).detail == "closed off by no-fly zone late"


def test_a_flight_that_has_covered_everything_has_nothing_to_say():
    flight = rollout(field(), "nearest-waypoint")
    assert flight.left_open == ()
    assert "left_open" not in summary(flight)


@pytest.fixture
def kept(tmp_path):
    flight = landed(yard())
    flight.save(tmp_path / "flight")
    return flight, tmp_path / "flight"


def test_reasons_are_in_the_summary_and_are_read_back(kept):
    flight, folder = kept
    told = json.loads((folder / "summary.json").read_text())["left_open"]
    assert [one["waypoint"] for one in told] == [0, 1, 2]
    assert told[1] == {"waypoint": 1, "why": "no way to it", "detail": flight.left_open[1].detail}
    assert Flight.load(folder) == flight


def test_a_reason_that_there_is_not_is_damage(kept):
    _, folder = kept
    data = json.loads((folder / "summary.json").read_text())
    data["left_open"][0]["why"] = "laziness"
    (folder / "summary.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"summary.json.*left_open"):
        Flight.load(folder)


def test_every_reason_has_words_and_a_meaning():
    assert len({why.value for why in Why}) == len(Why) == 10
    assert all(len(why.meaning) > len(why.value) for why in Why)
    assert np.all([why.value == str(why) for why in Why])
