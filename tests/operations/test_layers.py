"""Where waits would be long, a UAS flies at another height, and its file is checked as before."""

import numpy as np
import pytest
from small_worlds import meadow, waypoint

pytest.importorskip("pyproj")

from uas_coverage_env import rollout
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.operations.clearance import Surroundings
from uas_coverage_env.operations.mission_export.height_layers import LONG_WAITS_S, above, shifted
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.planning.execution.leg_follower import LegFollower
from uas_coverage_env.scenario import Execution, Place

HERE = Place(latitude_deg=47.0, longitude_deg=8.0)
# one flies to and fro across the way of the other, which begins at the far end
THERE = [(60.0, 150.0), (95.0, 50.0), (130.0, 150.0), (165.0, 50.0)]
BACK = [(165.0, 150.0), (130.0, 50.0), (95.0, 150.0), (60.0, 50.0)]


class Routes:
    """Flies given routes."""

    def reset(self, brief, seed):
        self._follower = LegFollower(brief)
        self._routes = [[0, 1, 2, 3], [4, 5, 6, 7]]
        self._follower.begin(self._routes)

    def act(self, swarm):
        left = [[w for w in route if swarm.uncovered[w]] for route in self._routes]
        return self._follower.commands(swarm, left)


@pytest.fixture(scope="module")
def flight():
    waypoints = [waypoint((*place, -20.0), 11.0) for place in (*THERE, *BACK)]
    starts_m = (20.0, 70.0, -1.0), (20.0, 130.0, -1.0)
    scenario = meadow(starts_m, waypoints=waypoints, max_steps=400)
    execution = Execution(flown_by="autopilot", min_slack_s=0.0)
    return rollout(scenario.model_copy(update={"execution": execution}), Routes())


def waited_s(data):
    return sum(uas["start_delay_s"] for uas in data["uas"])


def test_a_layer_takes_the_place_of_long_waits_and_every_waypoint_is_still_passed(flight):
    made = make_export(flight, ExportOptions("qgc", min_slack_s=20.0, place=HERE))
    said = [note for note in made.notes if "than planned, to be out of the way" in note]
    assert len(said) == 1
    assert waited_s(made.data) < LONG_WAITS_S
    (pair,) = made.data["pairs"]
    assert pair["slack_s"] is None or pair["slack_s"] >= 20.0
    assert all(uas["waypoint_margin_m"] >= 0.0 for uas in made.data["uas"])
    heights_m = [max(leg["height_m"] for leg in uas["legs"]) for uas in made.data["uas"]]
    assert max(heights_m) - min(heights_m) > pair["kept_m"]
    assert all(uas["room_to_contact_m"] > 0.0 for uas in made.data["uas"])


def test_short_waits_stay_waits(flight):
    made = make_export(flight, ExportOptions("qgc", min_slack_s=0.0, place=HERE))
    assert not [note for note in made.notes if "high" in note]


def test_a_layer_that_would_miss_a_waypoint_is_not_taken(flight):
    track = make_tracks(flight, 0, Tolerances())[0]
    assert shifted(flight, track, 7.0, Tolerances()) is not None
    assert shifted(flight, track, 12.0, Tolerances()) is None


def test_the_way_above_the_others_is_level_and_within_the_fence(flight):
    tolerances = Tolerances()
    track = make_tracks(flight, 0, tolerances)[0]
    new = above(flight, track, 30.0, tolerances)
    corners = new.corners_m
    assert np.isclose(corners[:, 2], -30.0).sum() >= 4
    assert new.room.spare_m >= -1.0
    around = Surroundings(flight.scenario, 0)
    assert around.path_room(corners).contact_m > 0.0
    assert above(flight, track, 60.0, tolerances) is None  # the fence ends at 50 m
