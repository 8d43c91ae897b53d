"""Families: feasible for every seed, different from each other, as large as they are asked for."""

import itertools
import math

import numpy as np
import pytest

from uas_coverage_env import evaluate
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.scenario import Family, MissionSource, load_scenario, warnings
from uas_coverage_env.scenario import families as package
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.families.open_field import open_field
from uas_coverage_env.scenario.families.site import CLEARANCE_M, GAP_M, Size
from uas_coverage_env.world.arena import build_arena

SIZED = [name for name, family in package.BUILT_IN.items() if isinstance(family, Family)]
SUFFICIENT = [name for name in SIZED if name != "low-charge"]
OUTDOORS = [name for name in SIZED if name != "indoor"]
SMALL = {"n_uas": (1, 3), "n_waypoints": (6, 12)}


def drawn(name, seed, **size):
    return package.BUILT_IN[name].sized(**(size or SMALL)).of_seed(seed)


def clearances(scenario, points):
    """(P,) how far points are from all that stands."""
    distances = [hull.signed_distance(points) for hull in scenario.hulls]
    return np.min(distances, axis=0) if distances else np.full(len(points), math.inf)


@pytest.mark.parametrize("name", SUFFICIENT)
def test_nothing_is_doubtful_about_a_draw(name):
    for seed in range(8):
        scenario = drawn(name, seed)
        assert warnings(scenario) == []
        assert 1 <= len(scenario.uas) <= 3
        assert 6 <= len(scenario.waypoints) <= 12


@pytest.mark.parametrize("name", OUTDOORS)
def test_centres_and_starts_keep_all_distances(name):
    for seed in range(6):
        scenario = drawn(name, seed)
        centres = np.array([waypoint.position_m for waypoint in scenario.waypoints])
        starts = np.array([uas.start_m for uas in scenario.uas])
        assert clearances(scenario, centres).min() >= CLEARANCE_M + 0.9
        assert clearances(scenario, starts).min() >= CLEARANCE_M
        assert scenario.fence.signed_distance(centres).max() < -1.4


@pytest.mark.parametrize("name", [name for name in OUTDOORS if name not in ("walls", "air-taxi")])
def test_every_centre_has_a_free_way_up(name):
    scenario = drawn(name, 3)
    top_m = max((-hull.vertices_m[:, 2].min() for hull in scenario.hulls), default=0.0)
    assert top_m + CLEARANCE_M < 49.5
    for waypoint in scenario.waypoints:
        north_m, east_m, down_m = waypoint.position_m
        line = np.array([(north_m, east_m, z) for z in np.arange(down_m, -49.0, -1.0)])
        assert clearances(scenario, line).min() >= CLEARANCE_M


def test_every_room_has_a_door_and_starts_and_centres_keep_clear_of_walls():
    for seed in range(6):
        scenario = drawn("indoor", seed, n_uas=(2, 9), n_waypoints=(8, 12))
        assert scenario.planar is not None
        places = [place.position_m for place in scenario.waypoints]
        places += [uas.start_m for uas in scenario.uas]
        assert clearances(scenario, np.array(places)).min() > 0.7
        assert np.isfinite(build_arena(scenario).node_distance_m.min(axis=1)).all()
        person = scenario.moving_positions(np.arange(0.0, 400.0, 0.5))[:, 0]
        assert scenario.fence.signed_distance(person).max() < -0.5
        assert clearances(scenario, person).min() > 0.5


def test_walls_reach_the_ceiling_and_have_gaps_to_pass():
    for seed in range(6):
        scenario = drawn("walls", seed)
        north_m = float(np.ptp(scenario.fence.vertices_m[:, 0]))
        pieces = {}
        for obstacle in scenario.obstacles:
            corners = np.array(obstacle.vertices_m)
            assert corners[:, 2].min() == scenario.fence.vertices_m[:, 2].min()
            pieces.setdefault(obstacle.name.rpartition("_")[0], []).append(
                (corners[:, 0].min(), corners[:, 0].max())
            )
        assert pieces
        for spans in pieces.values():
            spans.sort()
            assert spans[0][0] == 0.0
            assert spans[-1][1] == pytest.approx(north_m, abs=0.1)
            gaps = [b[0] - a[1] for a, b in itertools.pairwise(spans)]
            assert gaps
            assert min(gaps) >= GAP_M - 0.2


def test_a_yard_is_entered_from_above_alone():
    scenario = drawn("courtyards", 2)
    yards = [waypoint for waypoint in scenario.waypoints if waypoint.kind == "yard"]
    assert yards
    for yard in yards:
        north_m, east_m, _ = yard.position_m
        for turn in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False):
            ways = np.arange(0.0, 30.0, 0.5)[:, None] * [[math.cos(turn), math.sin(turn), 0.0]]
            assert clearances(scenario, ways + np.array([[north_m, east_m, -6.0]])).min() < 0.0


def test_moving_obstacles_pass_waypoints_and_stay_inside():
    for seed in range(4):
        scenario = drawn("traffic", seed)
        centres = np.array([waypoint.position_m for waypoint in scenario.waypoints])
        nearest = math.inf
        for time_s in range(0, scenario.max_steps, 2):
            at = scenario.moving_positions(float(time_s))
            assert scenario.fence.signed_distance(at).max() < 0.0
            away = np.linalg.norm(at[:, None, :2] - centres[None, :, :2], axis=2)
            nearest = min(nearest, away.min())
        assert nearest < 25.0


def test_the_charge_of_low_charge_does_not_suffice():
    large = {"n_uas": (2, 2), "n_waypoints": (36, 36)}
    for seed in range(4):
        scenario = drawn("low-charge", seed, **large)
        assert any("batteries will hardly finish" in line for line in warnings(scenario))


@pytest.mark.parametrize("name", SIZED)
def test_a_seed_gives_the_same_scenario_and_another_seed_another(name):
    assert drawn(name, 5) == drawn(name, 5)
    assert drawn(name, 5).waypoints != drawn(name, 6).waypoints


@pytest.mark.parametrize("name", ["streets", "courtyards", "walls"])
def test_nearest_waypoint_covers_a_draw_and_comes_home(name):
    family = package.BUILT_IN[name].sized(n_uas=(2, 2), n_waypoints=(8, 8))
    (episode,) = evaluate("nearest-waypoint", family, seeds=[1]).episodes
    assert episode.accomplished


def test_an_environment_and_the_command_line_draw_the_same():
    env = CoverageParallelEnv("river", max_cycles=2)
    env.reset(seed=4)
    assert env.scenario.name == load_scenario("river:4").name


def test_a_family_of_ones_own_is_announced_by_an_entry_point(monkeypatch):
    mine = Family(open_field, Size(n_uas=(1, 1), n_waypoints=(3, 3)))

    class Entry:
        name = "mine"

        def load(self):
            return mine

    monkeypatch.setattr(package, "entry_points", lambda group: [Entry()])
    assert installed_families()["mine"] is mine
    env = CoverageParallelEnv("mine", max_cycles=2)
    env.reset(seed=0)
    assert len(env.scenario.waypoints) == 3
    assert load_scenario("mine:0").waypoints == env.scenario.waypoints


def test_a_family_is_a_file_in_the_folder_and_nothing_else(monkeypatch, tmp_path):
    (tmp_path / "pond.py").write_text(
        "from uas_coverage_env.scenario.families.family import Family\n"
        "from uas_coverage_env.scenario.families.open_field import open_field\n"
        "FAMILIES = {'pond': Family(open_field)}\n"
    )
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
    found = package._found()
    assert [*found] == [*package.BUILT_IN, "pond"]
    monkeypatch.setattr(package, "BUILT_IN", found)
    assert load_scenario("pond:3") == load_scenario("open-field:3")


@pytest.mark.parametrize("name", installed_families())
def test_an_environment_flies_every_family_and_has_room_for_what_it_draws(name):
    source = MissionSource.of(name)
    drawn = [source.draw(np.random.default_rng(seed)) for seed in range(4)]
    assert len({scenario.name for scenario in drawn}) == 4


def test_a_family_that_cannot_be_loaded_says_so_when_it_is_asked_for_and_harms_no_other(
    monkeypatch,
):
    class Entry:
        name = "broken"

        def load(self):
            raise RuntimeError("no licence")

    monkeypatch.setattr(package, "entry_points", lambda group: [Entry()])
    assert CoverageParallelEnv("village").reset(seed=0)
    with pytest.raises(InputError, match="family 'broken' cannot be loaded: RuntimeError: no lic"):
        CoverageParallelEnv("broken")


def test_a_family_in_wind_has_the_wind_of_the_level():
    family = Family(open_field, Size(), disturbances="moderate")
    scenario = family.of_seed(1)
    assert 4.0 <= scenario.wind.mean_mps <= 7.0
    with pytest.raises(ValueError, match="storm"):
        Family(open_field, disturbances="storm")
