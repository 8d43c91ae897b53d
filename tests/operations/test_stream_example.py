"""The documented example, streamed to vehicles that fly as ArduPilot's simulator was seen to."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import KDTree
from simulated_vehicle import DrivenClock, SimulatedVehicle

pytest.importorskip("pyproj")

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import LocalFrame
from uas_coverage_env.operations.clearance import Surroundings
from uas_coverage_env.operations.stream import StreamOptions, stream_flight
from uas_coverage_env.operations.stream.timeline import timeline_of
from uas_coverage_env.scenario import load_scenario


def planned(folder, *options):
    out = folder / "town.toml"
    asked = ["import", "karhula", "--height", "60", "--fleet", "s500_v2:2", *options]
    assert main([*asked, "--out", str(out)]) == 0
    return rollout(load_scenario(out), load_planner("lawnmower"))


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    folder = tmp_path_factory.mktemp("town")
    return planned(folder, "--flown-by", "autopilot", "--speed", "9")


def streamed(flight, *hows):
    frame = LocalFrame(flight.scenario.place)
    starts_m = [uas.start_m for uas in flight.scenario.uas]
    vehicles = [SimulatedVehicle(frame, m, **how) for m, how in zip(starts_m, hows, strict=True)]
    addresses = {n: v.address for n, v in zip(flight.names, vehicles, strict=True)}
    clock = DrivenClock(vehicles)
    try:
        ended, _ = stream_flight(
            flight, flight.scenario.place, addresses, StreamOptions(), clock, lambda line: None
        )
    finally:
        for vehicle in vehicles:
            vehicle.close()
    return ended, vehicles


def off_and_room_m(flight, uas, vehicle):
    """(N,) how far the vehicle was from its path in the air, and its least room to what stands."""
    plan = timeline_of(flight, uas)
    path_m = plan.places_at_m(np.arange(plan.first_s, plan.last_s, 0.05))
    flown = np.array(vehicle.path)[:, 1:]
    flown = flown[flown[:, 2] < -4.0]
    around = Surroundings(flight.scenario, uas)
    rooms = [around.room(a, b).contact_m for a, b in pairwise(flown)]
    return KDTree(path_m).query(flown)[0], min(rooms)


@pytest.mark.parametrize("drag", ["+", "s500"])
def test_it_is_flown_in_time_on_its_path_and_clear_of_its_zone(flight, drag):
    ended, vehicles = streamed(flight, {"drag": drag}, {"drag": drag})
    assert ended.reason == ""
    planned_s = flight.scenario.dt_s * flight.last_sample.max()
    assert ended.late_s < 0.05 * planned_s
    assert max(vehicle.path[-1][0] for vehicle in vehicles) < 1.05 * planned_s + 15.0  # on ground
    for u, vehicle in enumerate(vehicles):
        off_m, room_m = off_and_room_m(flight, u, vehicle)
        assert np.percentile(off_m, 95) < 3.0
        assert off_m.max() < 6.0
        assert room_m > 3.0  # of the 3.5 m that the plan keeps
    flown = np.concatenate([np.array(vehicle.path)[:, 1:] for vehicle in vehicles])
    for waypoint in flight.scenario.waypoints:
        nearest_m = np.linalg.norm(flown - waypoint.position_m, axis=1).min()
        assert nearest_m < waypoint.radius_m


def test_a_link_that_is_cut_beside_the_zone_leads_nobody_into_it(flight):
    # uas_2 flies towards it then, at 8 m/s
    ended, vehicles = streamed(flight, {}, {"cut": (40.5, 46.5)})
    assert ended.reason == ""
    for u, vehicle in enumerate(vehicles):
        assert off_and_room_m(flight, u, vehicle)[1] > 2.0


def test_a_mission_is_planned_at_the_speed_that_the_autopilot_is_set_to(flight):
    vehicles = flight.scenario.vehicles
    assert [vehicle.limits.v_xy_max_mps for vehicle in vehicles] == [9.0, 9.0]
    assert max(timeline_of(flight, u).fastest_mps for u in range(2)) < 9.1


def test_a_speed_without_an_autopilot_is_refused(tmp_path, capsys):
    asked = ["import", "karhula", "--speed", "9", "--out", str(tmp_path / "town.toml")]
    assert main(asked) == 2
    assert "add --flown-by autopilot" in capsys.readouterr().err


def test_a_plan_that_no_autopilot_can_follow_is_refused(tmp_path):
    flight = planned(tmp_path)
    with pytest.raises(InputError, match=r"import \.\.\. --flown-by autopilot --speed 9"):
        streamed(flight, {}, {})
