"""Hills become obstacles that hold them, and waypoints keep their height above the ground."""

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("shapely")
pytest.importorskip("rasterio")
import rasterio
from drawings import HOME, SQUARE, collection, feature, imported, refused
from rasterio.errors import NotGeoreferencedWarning
from rasterio.transform import from_origin
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import gaussian_filter
from shapely.geometry import Point

from uas_coverage_env.flight import load_planner, rollout, seen_ground
from uas_coverage_env.operations import ExportOptions, LocalFrame, make_export
from uas_coverage_env.operations.area_import.ground import Ground
from uas_coverage_env.operations.area_import.terrain_obstacles import LOW_M, MOST_BOXES, hills
from uas_coverage_env.world.coverage import covering_samples

CELL_DEG, WEST, NORTH, SIZE = 0.0001, 9.998, 50.004, 70
BASE_M, HILL_M = 412.0, 35.0


pytestmark = pytest.mark.usefixtures("elsewhere")


def ground_m(latitude, longitude):
    """A hill in the north-east of the square, level ground of 412 m at home."""
    north_m = (latitude - 50.0014) * 111_200.0
    east_m = (longitude - 10.0021) * 71_600.0
    return BASE_M + HILL_M * np.exp(-(north_m**2 + east_m**2) / 40.0**2)


def heights(function=ground_m, size=SIZE, cell=CELL_DEG):
    middles = (np.arange(size) + 0.5) * cell
    longitude, latitude = np.meshgrid(WEST + middles, NORTH - middles)
    return function(latitude, longitude)


def geotiff(values, crs="EPSG:4326", transform=None, nodata=None, name="ground.tif"):
    profile = {"driver": "GTiff", "count": 1, "dtype": "float32", "compress": "deflate"}
    profile |= {"crs": crs, "nodata": nodata, "height": len(values), "width": values.shape[1]}
    profile["transform"] = transform or from_origin(WEST, NORTH, CELL_DEG, CELL_DEG)
    with warnings.catch_warnings():  # of the one without a place
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(name, "w", **profile) as file:
            file.write(values.astype("float32"), 1)
    return name


def ascii_grid(values, header=None):
    south = NORTH - len(values) * CELL_DEG
    lines = header or [
        *(f"ncols {values.shape[1]}", f"nrows {len(values)}", f"xllcorner {WEST}"),
        *(f"yllcorner {south:.6f}", f"cellsize {CELL_DEG}", "NODATA_value -9999"),
    ]
    lines += [" ".join(f"{value:.3f}" for value in row) for row in values]
    Path("ground.asc").write_text("\n".join(lines) + "\n")
    return "ground.asc"


def hilly(*options, terrain=None):
    terrain = terrain or geotiff(heights())
    return imported(collection(feature(SQUARE)), *HOME, "--terrain", terrain, *options)


def rises_m(scenario, north_m, east_m):
    """The ground above that of home, bilinear between the points of the grid."""
    places = LocalFrame(scenario.place).to_geodetic(
        np.stack([north_m, east_m, np.zeros_like(north_m)], axis=-1)
    )
    middles = (np.arange(SIZE) + 0.5) * CELL_DEG
    lattice = (NORTH - middles)[::-1], WEST + middles
    return RegularGridInterpolator(lattice, heights()[::-1])(places[..., :2]) - (
        scenario.place.height_m
    )


def random_places(scenario, n=4000):
    """North and east within the fence."""
    corners = scenario.fence.vertices_m
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = np.random.default_rng(0).uniform(low[:2], high[:2], (n, 2))
    inside = scenario.fence.signed_distance(np.c_[places, np.full(n, -1.0)]) < 0.0
    return places[inside].T


def boxes(scenario):
    hulls = zip(scenario.obstacles, scenario.hulls, strict=True)
    return [hull.vertices_m for obstacle, hull in hulls if obstacle.kind == "terrain"]


def tops_m(scenario, north_m, east_m):
    tops = np.zeros_like(north_m)
    for corners in boxes(scenario):
        low, high = corners.min(axis=0), corners.max(axis=0)
        under = (
            (low[0] <= north_m) & (north_m <= high[0]) & (low[1] <= east_m) & (east_m <= high[1])
        )
        tops[under] = np.maximum(tops[under], -low[2])
    return tops


def test_no_ground_rises_out_of_its_boxes_and_they_are_few():
    scenario = hilly()
    assert scenario.place.height_m == pytest.approx(BASE_M, abs=0.5)
    north_m, east_m = random_places(scenario)
    rise_m = rises_m(scenario, north_m, east_m)
    tops = tops_m(scenario, north_m, east_m)
    assert rise_m.max() > 0.9 * HILL_M
    assert (rise_m <= np.maximum(tops, LOW_M)).all()
    assert 3 <= len(boxes(scenario)) <= MOST_BOXES
    assert (tops - np.maximum(rise_m, 0.0)).mean() < 2.0  # on the whole they follow the ground


def test_waypoints_lie_the_height_above_the_highest_ground_that_they_see():
    flat, scenario = imported(collection(feature(SQUARE)), *HOME), hilly()
    assert len(scenario.waypoints) == len(flat.waypoints)
    places = np.array([w.position_m for w in scenario.waypoints])
    above_m = -places[:, 2] - rises_m(scenario, *places.T[:2])
    assert above_m.min() >= 60.0 - 1e-6  # HIGH of `imported`
    assert -places[:, 2].min() > -np.array([w.position_m for w in flat.waypoints])[:, 2].max() + 20
    assert -scenario.fence.vertices_m[:, 2].min() > 60.0 + 0.9 * HILL_M + 30.0


def test_a_flight_over_a_hill_keeps_clear_of_it_sees_the_ground_and_is_exported():
    scenario = hilly("--fleet", "s500_v2:1", "--height", "45")
    flight = rollout(scenario, load_planner("lawnmower"))
    assert flight.covered[-1] == len(scenario.waypoints)
    assert (flight.violations, flight.breaches) == ((), 0)
    for w in range(len(scenario.waypoints)):
        assert covering_samples(scenario, w, flight.x).any()
    flown = flight.x[:, 0, :3]
    high = -flown[:, 2] > 10.0
    assert (-flown[high, 2] - rises_m(scenario, *flown[high].T[:2])).min() > 3.0
    (ground,) = seen_ground(flight)
    assert 0.95 < ground.share <= 1.0
    made = make_export(flight, ExportOptions("qgc"))
    plan = json.loads(made.files["uas_1.plan"])
    assert plan["mission"]["plannedHomePosition"][2] == scenario.place.height_m
    for item in plan["mission"]["items"]:
        if item["command"] == 16:
            latitude, longitude, altitude_m = item["params"][4:]
            ground = ground_m(latitude, longitude) - scenario.place.height_m
            assert altitude_m > ground + 3.0


def test_pictures_count_by_their_height_above_the_hill():
    flat, scenario = imported(collection(feature(SQUARE)), *HOME), hilly()
    flight = rollout(scenario, load_planner("hover"), max_steps=2)
    x = flight.x.copy()
    (n0, e0), *_ = boxes(scenario)[-1][:, :2]
    top_m = tops_m(scenario, np.array([n0 + 0.1]), np.array([e0 + 0.1]))[0]
    x[:, 0, :3] = n0 + 0.1, e0 + 0.1, -(top_m + 20.0)
    seen = {}
    for name, changed in (
        ("hill", scenario),
        ("flat", scenario.model_copy(update={"obstacles": ()})),
    ):
        record = type(flight)(**{**vars(flight), "x": x, "scenario": changed})
        seen[name] = seen_ground(record)[0].seen
    assert flat.obstacles == ()
    assert 0 < seen["hill"].sum() < seen["flat"].sum()
    assert not (seen["hill"] & ~seen["flat"]).any()


def test_an_ascii_grid_and_projected_metres_give_the_same_mission():
    wanted = hilly()
    for terrain in (ascii_grid(heights()), in_metres()):
        scenario = hilly(terrain=terrain)
        assert scenario.place.height_m == pytest.approx(wanted.place.height_m, abs=0.2)
        for one, other in zip(scenario.waypoints, wanted.waypoints, strict=True):
            assert one.position_m == pytest.approx(other.position_m, abs=1.5)


def in_metres():
    """The ground in UTM 32N, whose zone is about 9 degrees east, 5 m wide cells."""
    import pyproj

    to_degrees = pyproj.Transformer.from_crs(32632, 4326, always_xy=True)
    west, north = to_degrees.transform(WEST, NORTH, direction="INVERSE")
    x, y = np.meshgrid(west + 2.5 + 5.0 * np.arange(110), north - 2.5 - 5.0 * np.arange(150))
    longitude, latitude = to_degrees.transform(x, y)
    transform = from_origin(west, north, 5.0, 5.0)
    return geotiff(ground_m(latitude, longitude), "EPSG:32632", transform, name="utm.tif")


def test_a_narrow_tower_in_a_fine_grid_is_not_lost_between_samples():
    fine = CELL_DEG / 10.0  # about 1 m: finer than what is sampled
    values = heights(lambda latitude, longitude: 0.0 * latitude + BASE_M, 10 * SIZE, fine)
    row, column = round((NORTH - 50.0012) / fine), round((10.0018 - WEST) / fine)
    values[row, column] += 25.0
    transform = from_origin(WEST, NORTH, fine, fine)
    scenario = hilly(terrain=geotiff(values, transform=transform))
    place = LocalFrame(scenario.place).to_ned(
        NORTH - (row + 0.5) * fine, WEST + (column + 0.5) * fine
    )
    assert tops_m(scenario, place[:1], place[1:2])[0] >= 24.0
    areas_m2 = [np.prod(np.ptp(corners[:, :2], axis=0)) for corners in boxes(scenario)]
    assert sum(areas_m2) < 400.0


def test_below_the_take_off_places_waypoints_stay_above_them(capsys):
    def valley(latitude, longitude):
        return BASE_M - 60.0 * (longitude > 10.0012)

    scenario = hilly("--height", "45", terrain=geotiff(heights(valley)))
    assert boxes(scenario) == []
    assert max(w.position_m[2] for w in scenario.waypoints) <= -(6.0 + 3.0)
    assert "lie higher above the ground than asked" in capsys.readouterr().out


def test_buildings_stand_on_the_ground():
    ring = [[10.002, 50.0013], [10.0022, 50.0013], [10.0022, 50.0015], [10.002, 50.0015]]
    house = feature([*ring, ring[0]], building="yes", height="8")
    Path("town.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [house]}))
    scenario = hilly("--town", "town.geojson")
    (roof,) = (o for o in scenario.obstacles if o.kind == "building")
    assert -min(z for _, _, z in roof.vertices_m) >= HILL_M * 0.95 + 8.0


def test_the_least_height_is_in_the_scenario_and_under_all_waypoints():
    scenario = hilly("--min-height", "12")
    assert scenario.min_height_m == 12.0
    for waypoint in scenario.waypoints:
        north_m, east_m, down_m = (np.array([value]) for value in waypoint.position_m)
        assert -down_m[0] > tops_m(scenario, north_m, east_m)[0] + 12.0


def with_hole(value=-9999.0):
    values = heights()
    values[40, 30] = value
    return values


def picture(bands, colours=None):
    name = geotiff(heights())
    with rasterio.open(name) as file:
        profile = {**file.profile, "count": bands, "dtype": "uint8"}
    profile |= {"photometric": "RGB"} if bands > 2 else {}
    with rasterio.open("photo.tif", "w", **profile) as file:
        for band in range(bands):
            file.write(np.full((SIZE, SIZE), 100 + band, "uint8"), band + 1)
        if colours:
            file.write_colormap(1, {n: (n, n, 0, 255) for n in range(256)})
    return "photo.tif"


def in_unit(unit):
    name = geotiff(heights())
    with rasterio.open(name, "r+") as file:
        file.units = [unit]
    return name


def steep(latitude, longitude):
    return BASE_M + 200_000.0 * (longitude - 10.0)


def beside(latitude, longitude):
    return BASE_M + 20.0 * (latitude > 50.00053)


def shifted(degrees):
    return from_origin(WEST + degrees, NORTH, CELL_DEG, CELL_DEG)


def fine_grid(function):
    fine = CELL_DEG / 10.0
    transform = from_origin(WEST, NORTH, fine, fine)
    return geotiff(heights(function, 10 * SIZE, fine), transform=transform)


NO_PLACE = ["ncols 2", "nrows 2", "xllcorner 500000", "yllcorner 5500000", "cellsize 10"]
MISTAKES = {
    "another kind": (lambda: "ground.csv", "unknown kind of grid"),
    "no file": (lambda: "none.tif", "none.tif: no such file"),
    "no grid": (lambda: Path("no.tif").write_text("I am a text") and "no.tif", "is no grid"),
    "elsewhere": (lambda: geotiff(heights(), transform=shifted(1.0)), "does not cover 49.999"),
    "half of it": (lambda: geotiff(heights(), transform=shifted(0.0035)), "of the fence"),
    "holes": (lambda: geotiff(with_hole(), nodata=-9999.0), "has no height at 49.9997"),
    "unnamed holes": (lambda: geotiff(with_hole()), "a height of -9999 m is on no ground"),
    "a picture": (lambda: picture(3), "has 3 bands, as a picture does"),
    "a picture with a mask": (lambda: picture(4), "has 4 bands, as a picture does"),
    "heights and something else": (lambda: picture(2), "has 2 bands, as a picture does"),
    "a grey picture": (lambda: picture(1), "holds gray of uint8, as a picture does"),
    "a map of colours": (lambda: picture(1, "palette"), "holds palette of uint8"),
    "feet": (lambda: in_unit("ft"), "heights in 'ft'; convert them to metres"),
    "a datum in feet": (lambda: geotiff(heights(), "EPSG:4326+8228"), "heights in 'foot'"),
    "coordinates in feet": (lambda: geotiff(heights(), "EPSG:2227"), "so its heights may be"),
    "a number of no height": (lambda: geotiff(with_hole(-999.0)), "-999 m is on no ground"),
    "metres of what": (lambda: ascii_grid(np.ones((2, 2)), NO_PLACE), "put the .prj"),
    "nowhere": (lambda: geotiff(heights(), None, from_origin(0, 0, 1, 1)), "does not say where"),
    "a slope": (lambda: geotiff(heights(steep)), "take off from places that differ by less than"),
    "a wall at home": (lambda: fine_grid(beside), "take off from where it is level"),
}


def test_the_range_and_the_unit_of_heights_are_said(capsys):
    hilly()
    low, high = "heights of the grid, taken as metres: 412 to ", "; ground of 0 to "
    out = capsys.readouterr().out
    assert low in out
    assert high in out


@pytest.mark.parametrize("unit", ["m", "metre", "Metres", "METER"])
def test_metres_are_read_however_they_are_written(unit):
    assert hilly(terrain=in_unit(unit)).place.height_m == pytest.approx(BASE_M, abs=0.5)


@pytest.mark.parametrize("case", MISTAKES)
def test_a_grid_that_cannot_be_used_is_refused_in_one_line(case, capsys):
    make, said = MISTAKES[case]
    err = refused(capsys, collection(feature(SQUARE)), *HOME, "--terrain", make())
    assert said in err


def test_a_ceiling_below_a_waypoint_over_a_hill_is_refused(capsys):
    grid, area = geotiff(heights()), collection(feature(SQUARE))
    options = ("--terrain", grid, "--height", "60", "--ceiling", "80")
    assert "--ceiling 80: should be between" in refused(capsys, area, *HOME, *options)


def test_flat_ground_changes_nothing_but_its_height():
    flat = imported(collection(feature(SQUARE)), *HOME)
    same = hilly(terrain=geotiff(heights(lambda latitude, longitude: 0.0 * latitude + 99.0)))
    assert same.place.height_m == 99.0
    assert math.isclose(flat.place.height_m, 0.0)
    assert same.model_copy(update={"place": flat.place}) == flat


@pytest.mark.parametrize("seed", range(12))
def test_boxes_hold_rough_ground_whatever_it_is_like_and_leave_the_starts_free(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(20, 60, 2))
    rough = gaussian_filter(rng.normal(0.0, 1.0, shape), rng.uniform(1.0, 6.0))
    rough *= rng.uniform(5.0, 60.0) / np.abs(rough).max()
    north_m, east_m = (2.0 * np.arange(n) for n in shape)
    starts_m = rng.uniform(10.0, 30.0, (2, 2))
    for east, north in starts_m:
        away_m = np.hypot(north_m[:, None] - north, east_m - east)
        rough[away_m < 15.0] = rng.uniform(-1.0, 1.0)
    ground = Ground(east_m, north_m, rough, rng.random((shape[0] - 1, shape[1] - 1)) > 0.2)
    found = hills(ground, starts_m, 4.0)
    high = ground.inside & (ground.tops_m > LOW_M)
    for row, column in np.argwhere(high):
        middle = Point(east_m[column] + 1.0, north_m[row] + 1.0)
        top_m = max(hill.top_m for hill in found if hill.footprint.contains(middle))
        assert top_m >= ground.tops_m[row, column]
    for east, north in starts_m:
        free = Point(east, north).buffer(4.0)
        assert not any(hill.footprint.buffer(-1e-6).intersects(free) for hill in found)
    assert len(found) <= MOST_BOXES + 8
