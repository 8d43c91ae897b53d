"""Wind that is not constant: its profile, turbulence as in MIL-F-8785C, gusts; and its power."""

import math
from pathlib import Path

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import World, load_scenario
from uas_coverage_env.features import constant_wind, disturbances_of
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Gust, RandomGusts, Wind
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.derived import power_W
from uas_coverage_env.vehicle.layout import DOD, VX, VZ, X, Y, Z
from uas_coverage_env.vehicle.thrust_correction import level_flight_N
from uas_coverage_env.world import Wrench

BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
HEIGHT_M = 30.0
HIGH = ((100.0, 100.0, -HEIGHT_M),)
LEVEL = Wrench(0.0, 0.0, 0.0, 0.0)
FOOT_M = 0.3048


def windy(scenario=None, **wind):
    wind = {"mean_mps": 6.0, "from_deg": 180.0, **wind}
    return (scenario or meadow(HIGH)).model_copy(update={"wind": Wind(**wind)})


def winds_at_rest(world, steps, height_m=HEIGHT_M):
    """(steps, U, 3) what blows at UAS that are held where they are."""
    start = world.state.x.copy()
    start[:, Z] = -height_m
    found = []
    for _ in range(steps):
        world.state.x[:] = start
        outcome = world.step(dict.fromkeys(world.active, LEVEL))
        found.append(outcome["wind_mps"].copy())
    return np.array(found)


def blown_mps(height_m, **wind):
    """The steady wind at a height."""
    return winds_at_rest(World(windy(**wind)), 1, height_m)[0, 0]


def test_a_logarithmic_profile_is_that_of_the_roughness_length():
    told = {"roughness_m": 0.03, "reference_height_m": 10.0}
    for height_m in (2.0, 10.0, 45.0):
        share = math.log(height_m / 0.03) / math.log(10.0 / 0.03)
        np.testing.assert_allclose(blown_mps(height_m, **told), [6.0 * share, 0, 0], atol=1e-12)
    np.testing.assert_array_equal(blown_mps(0.5, **told), blown_mps(1.0, **told))


def test_a_power_law_leaves_the_vertical_wind_alone():
    told = {"exponent": 0.2, "reference_height_m": 20.0, "up_mps": 1.0}
    np.testing.assert_allclose(
        blown_mps(40.0, **told), [6.0 * 2.0**0.2, 0.0, -1.0], rtol=1e-12, atol=1e-12
    )


def theory(height_m, mean_mps, airspeed_mps, dt_s):
    """Intensities [m/s], and correlations of a component from one step to the next."""
    feet = height_m / FOOT_M
    shape = 0.177 + 0.000823 * feet
    sigma_w = 0.1 * mean_mps
    length_m = np.array([height_m / shape**1.2, height_m / shape**1.2, height_m])
    ratio = dt_s * airspeed_mps / length_m
    second_order = 1.0 - 0.5 * ratio * np.array([0.0, 1.0, 1.0])
    return np.array([1.0, 1.0, shape**0.4]) * sigma_w / shape**0.4, np.exp(-ratio) * second_order


@pytest.mark.parametrize(("height_m", "dt_s", "mean_mps"), [(30.0, 1.0, 6.0), (5.0, 0.5, 3.0)])
def test_turbulence_has_the_variance_and_the_correlation_of_the_dryden_spectra(
    height_m, dt_s, mean_mps
):
    scenario = meadow(HIGH, dt_s=dt_s)
    world = World(windy(scenario, mean_mps=mean_mps, turbulence=1.0), seed=3)
    gusts_mps = winds_at_rest(world, 12_000, height_m)[:, 0] - [mean_mps, 0.0, 0.0]
    sigma_mps, correlation = theory(height_m, mean_mps, mean_mps, dt_s)
    np.testing.assert_allclose(gusts_mps.std(axis=0), sigma_mps, rtol=0.06)
    assert abs(gusts_mps.mean(axis=0)).max() < 0.12 * sigma_mps.max()
    kept = [np.corrcoef(g[:-1], g[1:])[0, 1] for g in gusts_mps.T]
    np.testing.assert_allclose(kept, correlation, atol=0.02)
    later = [np.corrcoef(g[:-3], g[3:])[0, 1] for g in gusts_mps.T]
    np.testing.assert_allclose(later, theory(height_m, mean_mps, mean_mps, 3 * dt_s)[1], atol=0.04)
    assert abs(np.corrcoef(gusts_mps.T) - np.eye(3)).max() < 0.06
    assert (abs(gusts_mps) <= 3.0 * sigma_mps * (1.0 + 1e-12)).all()


def test_turbulence_is_stationary_from_the_first_step_on_and_its_own_for_each_uas():
    starts = tuple((20.0 + 30.0 * i, 20.0 + 30.0 * j, -30.0) for i in range(6) for j in range(6))
    gusts_mps = []
    for seed in range(30):
        world = World(windy(meadow(starts), turbulence=1.0), seed=seed)
        gusts_mps.append(winds_at_rest(world, 2)[:, :, :] - [6.0, 0.0, 0.0])
    first, second = np.swapaxes(np.array(gusts_mps), 0, 1)
    sigma_mps, correlation = theory(30.0, 6.0, 6.0, 1.0)
    np.testing.assert_allclose(first.std(axis=(0, 1)), sigma_mps, rtol=0.1)
    for axis in range(3):
        together = np.corrcoef(first[..., axis].ravel(), second[..., axis].ravel())[0, 1]
        assert together == pytest.approx(correlation[axis], abs=0.05)
    # but for what is cut off
    assert len(np.unique(first)) > 0.99 * first.size


def test_turbulence_follows_the_mean_wind_at_20_feet_and_its_direction():
    told = {"mean_mps": 8.0, "from_deg": 240.0, "exponent": 0.3, "turbulence": 2.0}
    *_, turbulence = disturbances_of(windy(**told))
    at_20_ft = 8.0 * (20.0 * FOOT_M / 10.0) ** 0.3
    towards = math.radians(60.0)
    expected = (0.2 * at_20_ft, math.cos(towards), math.sin(towards))
    np.testing.assert_allclose(turbulence.parameters, expected)


def test_a_gust_moves_the_air_by_half_its_peak_for_its_length():
    gust = Gust(at_s=2.3, lasts_s=5.5, peak_mps=4.0, from_deg=90.0, up_mps=1.0)
    world = World(windy(mean_mps=0.0, gusts=(gust,)))
    blown = winds_at_rest(world, 12)[:, 0]
    np.testing.assert_allclose(blown.sum(axis=0), [0.0, -2.0 * 5.5, -0.5 * 5.5], atol=1e-12)
    assert (blown[:2] == 0.0).all()
    assert (blown[8:] == 0.0).all()
    middle_s = np.arange(2, 8) + 0.5 - 2.3
    np.testing.assert_allclose(
        blown[3:7, 1], -2.0 * (1.0 - np.cos(2.0 * np.pi * middle_s / 5.5))[1:5], atol=0.15
    )
    assert blown[4:6, 1].min() > -4.0


def test_gusts_come_at_random_as_often_as_said_and_to_all_uas_at_once():
    told = RandomGusts(per_min=6.0, peak_mps=5.0, lasts_s=4.0)
    two = meadow(((50.0, 50.0, -30.0), (150.0, 150.0, -30.0)), max_steps=100_000)
    world = World(windy(two, mean_mps=0.0, random_gusts=told), seed=5)
    blown = winds_at_rest(world, 6000)
    np.testing.assert_array_equal(blown[:, 0], blown[:, 1])
    blows = blown[:, 0, 0] > 0.0
    begun = int((blows[1:] & ~blows[:-1]).sum())
    assert begun == pytest.approx(6000 / (10.0 + 4.0), rel=0.15)
    assert 4.0 < blown.max() <= 5.0
    assert abs(blown[..., 1:]).max() < 1e-12


@BOTH
def test_the_power_of_the_rotor_model_at_airspeeds_beyond_the_limit(dynamics):
    """The fit is linear; blade drag and the tilt against the wind grow faster."""
    limit_mps = meadow(HIGH).vehicles[0].limits.v_xy_max_mps
    for headwind_mps in (0.4 * limit_mps, 0.9 * limit_mps):
        currents = {}
        for power in ("fitted", "rotor"):
            scenario = windy(mean_mps=headwind_mps, from_deg=0.0, power=power)
            for flown in (dynamics, "nonlinear"):
                world = World(scenario, dynamics=flown)
                tilt = world.scenario.vehicles[0].trim_tilt_rad_per_mps * (limit_mps + headwind_mps)
                world.state.x[0, VX] = limit_mps
                world.state.x[0, 7] = -tilt if flown == "lpv" else -math.atan(tilt)
                currents[power, flown] = world.step({"uas_1": LEVEL})[0]["current_A"]
        assert currents["rotor", "nonlinear"] == currents["fitted", "nonlinear"]
        exact = currents["rotor", "nonlinear"]
        assert currents["rotor", dynamics] == pytest.approx(exact, rel=0.08)
        if dynamics == "lpv":
            assert currents["fitted", "lpv"] < 0.9 * exact


def test_the_page_tells_the_power_of_both_models():
    page = (Path(__file__).parents[2] / "docs" / "wind_and_models.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("|")]
    told = {
        head: [float(cell) for cell in cells]
        for head, *cells in rows
        if cells[:1] in (["0"], ["194"])
    }
    s500 = load_vehicle("s500_v2")
    for k, speed_mps in enumerate(told["airspeed, m/s"]):
        rotor_N = level_flight_N(s500, speed_mps)
        fitted_N = s500.thrust_correction.speed_N_per_mps * speed_mps
        linear_W = [
            s500.power.hover_W + s500.power.slope_W_per_N * extra_N
            for extra_N in (fitted_N, max(fitted_N, rotor_N))
        ]
        expected = [power_W(s500, s500.weight_N + rotor_N), *linear_W]
        names = ("rotor model", "LPV, fitted", 'LPV, `power = "rotor"`')
        assert [told[name][k] for name in names] == pytest.approx(expected, abs=0.6)


def test_the_power_of_the_fit_holds_where_it_needs_more():
    """Between a hover and its limit, the LPV model credits no flight with less than a hover."""
    taken = []
    for power in ("fitted", "rotor"):
        world = World(windy(power=power))
        winds_at_rest(world, 1)
        taken.append(world.state.x[0, DOD])
    assert taken[0] == pytest.approx(taken[1], rel=1e-9)


@BOTH
def test_a_uas_in_turbulence_is_thrown_about_and_no_number_breaks(dynamics):
    world = World(windy(turbulence=1.0), dynamics=dynamics, seed=1)
    x = []
    for _ in range(40):
        world.step(dict.fromkeys(world.active, LEVEL))
        x.append(world.state.x[0].copy())
    assert np.isfinite(x).all()
    assert np.diff(x, axis=0)[:, VX : VZ + 1].std() > 0.01
    assert (np.array(x)[-1, X : Y + 1] != HIGH[0][:2]).all()


def test_files_of_constant_wind_make_the_same_disturbance_as_ever():
    scenario = windy(mean_mps=4.0, from_deg=250.0, up_mps=0.5)
    assert disturbances_of(scenario) == (constant_wind(4.0, 250.0, 0.5),)
    assert scenario.content()["wind"] == {"mean_mps": 4.0, "from_deg": 250.0, "up_mps": 0.5}


def test_all_of_it_is_written_and_read_again(tmp_path):
    scenario = windy(
        roughness_m=0.1,
        turbulence=0.5,
        gusts=(Gust(at_s=3.0, lasts_s=4.0, peak_mps=2.0, from_deg=0.0),),
        random_gusts=RandomGusts(per_min=1.0, peak_mps=2.0, lasts_s=6.0),
        power="rotor",
    )
    scenario.to_file(tmp_path / "windy.toml")
    assert load_scenario(tmp_path / "windy.toml") == scenario
    names = [disturbance.name for disturbance in disturbances_of(scenario)]
    assert names == ["wind", "turbulence", "discrete_gusts", "random_gusts"]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("roughness_m = 0.05", "exponent = 0.2"), "wind: roughness_m is 0.05 and exponent is 0.2"),
        (("turbulence = -1",), "wind.turbulence: should be greater than or equal to 0"),
        (("roughness_m = 0",), "wind.roughness_m: should be greater"),
        (('power = "exact"',), "wind.power: should be 'fitted' or 'rotor'"),
        (("[[wind.gusts]]", "at_s = 1"), "wind.gusts[0].lasts_s: is missing"),
        (("[wind.random_gusts]", "per_min = 0"), "wind.random_gusts.per_min: should be greater"),
    ],
)
def test_a_mistake_in_the_wind_is_one_line(tmp_path, lines, message):
    path = tmp_path / "windy.toml"
    meadow(HIGH).to_file(path)
    told = ("[wind]", "mean_mps = 4", "from_deg = 270", *lines)
    path.write_text("\n".join([path.read_text(), *told]))
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
