"""What the replay page shows of energy, safety and heights, in a real Chromium."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from chromium import (
    DESKTOP,
    PHONE,
    SMALL,
    cards,
    colours,
    complaints,
    emulate,
    map_pixels,
    needs_chromium,
    opened,
    pixels,
    pixels_of,
    pressed,
    settled,
    time_s,
)
from selenium.webdriver import Keys
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.record import DecisionRecord
from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.replay import write_replay
from uas_coverage_env.replay.reach_data import reach
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.vehicle.layout import DOD

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def troubled(discharged):
    """A point of no return, fallbacks, a gap, and a breach."""
    decisions = list(discharged.decisions)
    for k in (10, 11, 12):
        decisions[k] = DecisionRecord(0.1, fallback=True, reason="no time left")
    decisions[20] = DecisionRecord(0.1, mip_gap=0.4)
    x = discharged.x.copy()
    x[50, 0, :3] = x[50, 1, :3] + (0.0, 0.0, 1.0)
    return dataclasses.replace(discharged, decisions=tuple(decisions), x=x)


@pytest.fixture(scope="module")
def page(troubled, tmp_path_factory):
    return write_replay([troubled], tmp_path_factory.mktemp("page") / "replay.html")


def no_return(flight, uas: int) -> int:
    range_ = Range(MissionBrief.of(flight.scenario))
    return next(k for k, x in enumerate(flight.x[:, uas]) if range_.spare_dod(uas, x) <= 0.0)


def now(driver) -> list[str]:
    """What the page says is going on."""
    return [item.text for item in driver.find_elements(By.CSS_SELECTOR, ".now li")]


def clicked(driver, element):
    ActionChains(driver).move_to_element(element).click().perform()
    settled(driver)


def test_the_point_of_no_return_is_where_range_says(browser, page, troubled):
    opened(browser, page)
    (mark,) = browser.find_elements(By.CSS_SELECTOR, ".track .no-return")
    clicked(browser, mark)
    k = no_return(troubled, 1)
    assert time_s(browser) == k * troubled.scenario.dt_s
    assert any("uas_2: point of no return" in line for line in now(browser))
    spare = Range(MissionBrief.of(troubled.scenario)).spare_dod(1, troubled.x[k, 1])
    assert f"{-100 * spare:.1f} % short of home" in cards(browser)[1]
    assert "% to spare" in cards(browser)[0]
    pressed(browser, Keys.ARROW_LEFT)
    assert "% to spare" in cards(browser)[1]
    assert complaints(browser) == []


def test_the_colour_of_the_charge_says_whether_it_is_enough(browser, page, troubled):
    def level(uas):
        return browser.execute_script(
            "return getComputedStyle(document.querySelectorAll('.level i')[arguments[0]])"
            ".backgroundColor",
            uas,
        )

    k = no_return(troubled, 1)
    opened(browser, page, moment=f"#t={k + 2}")
    green, red = level(0), level(1)
    assert red == "rgb(200, 30, 45)"
    assert green == "rgb(0, 158, 115)"
    opened(browser, page, moment=f"#t={k - 1}")
    assert level(1) not in (red, green), "little is left"
    opened(browser, page)
    assert level(1) == green


def test_what_happened_is_on_the_time_axis_and_tells_its_reason(browser, page):
    opened(browser, page)
    found = {}
    for kind in ("fallback", "gap", "breach"):
        mark = browser.find_elements(By.CSS_SELECTOR, f".track .{kind}")[0]
        clicked(browser, mark)
        found[kind] = (time_s(browser), now(browser))
    assert found["fallback"] == (10.0, ["fallback (3 decisions): no time left"])
    assert found["gap"] == (20.0, ["decision solved to a gap of 40% at most"])
    at_s, told = found["breach"]
    assert at_s == 50.0
    assert any("within the safe distance of uas_2" in line for line in told)
    pressed(browser, Keys.HOME)
    assert now(browser) == []


def test_the_list_of_what_happened_leads_there_by_keys_alone(browser, page):
    opened(browser, page)
    summary = browser.find_element(By.CSS_SELECTOR, ".marks summary")
    assert "1 × fallback" in summary.text
    summary.send_keys(Keys.ENTER)
    (entry,) = browser.find_elements(By.CSS_SELECTOR, ".marks button.fallback")
    assert entry.text == "10 to 12 s: fallback (3 decisions): no time left"
    entry.send_keys(Keys.ENTER)
    settled(browser)
    assert time_s(browser) == 10.0


@pytest.mark.parametrize("view", ["3d", "map"])
def test_trails_are_coloured_by_a_value_with_its_scale(browser, page, troubled, view):
    opened(browser, page, moment=f"#t=45&view={view}")
    legend = browser.find_element(By.CLASS_NAME, "legend")
    assert not legend.is_displayed()
    plain = pixels(browser, ".stage")
    trails = Select(browser.find_element(By.CSS_SELECTOR, "select[aria-label=Trails]"))
    seen = []
    for kind in ("power", "speed", "height", "charge"):
        trails.select_by_value(kind)
        settled(browser)
        seen.append(pixels(browser, ".stage"))
        assert (seen[-1] != plain).any(axis=2).sum() > 200, kind
        assert legend.text.startswith(kind)
    assert (seen[0] != seen[1]).any(axis=2).sum() > 200
    heights_m = -troubled.x[..., 2]
    trails.select_by_value("height")
    settled(browser)
    low, high = heights_m.min(), heights_m.max()
    assert legend.text.split() == ["height:", f"{low:.0f}", f"{high:.0f}", "m"]
    assert complaints(browser) == []


def edge_of_reach_m(flight, k: int, uas: int, angle: float) -> tuple[float, float] | None:
    """Where the charge after a straight flight is what `Range` wants there; None: at the fence."""
    found = reach(flight.scenario)
    range_ = Range(MissionBrief.of(flight.scenario))
    at = flight.x[k, uas].copy()
    way = np.array([np.cos(angle), np.sin(angle)])
    for far_m in np.arange(1.0, 1000.0):
        x = np.zeros_like(at)
        x[:2] = at[:2] + far_m * way
        x[2] = -found.height_m
        for value, axis in zip(x[:2], (found.north_m, found.east_m), strict=True):
            if not axis[0] <= value <= axis[-1]:
                return None
        # the way home is estimated with the current of an empty battery
        x[DOD] = flight.scenario.uas[uas].dod_max
        home = range_.home(uas, x)
        needed = 1.0 - x[DOD] + home.dod + home.dod_margin
        if 1.0 - at[DOD] - found.fixed[uas] - far_m * found.per_m[uas] <= needed:
            return x[0], x[1]
    raise AssertionError("the way out of the fence is no longer than this")


def test_without_following_one_the_area_in_reach_of_each_ends_where_range_says(
    browser, discharged, tmp_path
):
    """The second UAS, orange, is short of charge: its area ends within the fence."""
    k = 25
    page = write_replay([discharged], tmp_path / "replay.html")
    opened(browser, page, DESKTOP, moment=f"#view=map&t={k}")
    picture = pixels(browser, ".stage").astype(int)
    corners_m = discharged.scenario.fence.vertices_m
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    at_m = discharged.x[k, 1, :2]

    def orange(north, east) -> bool:
        row, column = map_pixels(picture.shape, low, high, north, east)
        near = picture[row - 5 : row + 6, column - 5 : column + 6]
        return bool(((near[..., 0] - near[..., 2]) > 60).any())

    edges = [edge_of_reach_m(discharged, k, 1, angle) for angle in np.linspace(0.0, 6.0, 30)]
    inside = [np.array(edge) for edge in edges if edge is not None]
    assert len(inside) > 8
    drawn = [orange(*edge) for edge in inside]
    within = [orange(*(at_m + 0.85 * (edge - at_m))) for edge in inside]
    assert np.mean(drawn) > 0.8, "dashes, and the grid of the page is coarser than Range"
    assert np.mean(within) < 0.4, "paths and houses"


def test_the_height_profile_lies_under_the_map_and_sets_the_time(browser, page):
    opened(browser, page, DESKTOP)
    profile = browser.find_element(By.CLASS_NAME, "profile")
    stage = browser.find_element(By.CLASS_NAME, "stage")
    assert profile.rect["y"] >= stage.rect["y"] + stage.rect["height"]
    assert profile.rect["width"] > 0.9 * stage.rect["width"]
    assert colours(pixels(browser, ".profile")) > 20
    clicked(browser, profile)
    assert 25 < time_s(browser) < 35


def test_the_curves_look_at_the_uas_that_is_followed(browser, page):
    opened(browser, page, DESKTOP, moment="#view=map")
    charts = browser.find_elements(By.CLASS_NAME, "chart")

    def drawn():
        return [pixels_of(chart) for chart in charts[:3]]

    before = drawn()
    pressed(browser, "2")
    second = drawn()
    pressed(browser, "1")
    first = drawn()
    for all_, two, one in zip(before, second, first, strict=True):
        assert (all_ != two).any()
        assert (one != two).any()
    pressed(browser, "o")
    for all_, again in zip(before, drawn(), strict=True):
        assert (all_ == again).all(), "all are looked at again"


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_of_thirty_uas_the_charts_are_still_seen(browser, tmp_path, size):
    swarm = generate_scenario(seed=5, n_uas=30, n_waypoints=60, n_obstacles=5)
    flight = rollout(swarm, load_planner("hover"), max_steps=4)
    opened(browser, write_replay([flight], tmp_path / "replay.html"), size, moment="#view=map")
    assert len(cards(browser)) == 30
    assert cards(browser)[29].startswith("30\n")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
    charge = browser.find_elements(By.CSS_SELECTOR, ".charts .chart")[0]
    top = browser.find_element(By.CLASS_NAME, "cards").rect["y"]
    assert charge.rect["y"] - top < 220
    boxes = [chart.rect for chart in browser.find_elements(By.CSS_SELECTOR, ".charts .chart")]
    for above, below in pairwise(boxes):
        assert above["y"] + above["height"] <= below["y"] + 1, "no chart covers another"
    assert complaints(browser) == []


@pytest.mark.parametrize("size", [DESKTOP, PHONE, SMALL], ids=["desktop", "phone", "small"])
def test_what_is_going_on_fits_the_screen(browser, page, troubled, size):
    opened(browser, page, size, "dark", f"#t={no_return(troubled, 1)}&trail=power")
    assert now(browser)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
    stage = browser.find_element(By.CLASS_NAME, "stage").rect
    for part in browser.find_elements(By.CSS_SELECTOR, ".now li, .legend"):
        assert part.rect["x"] >= stage["x"]
        assert part.rect["x"] + part.rect["width"] <= stage["x"] + stage["width"] + 1


def test_a_name_that_lies_on_its_curve_has_an_edge(browser, flight, tmp_path):
    """A name longer than the margin begins on the curve."""
    fleet = flight.scenario.uas
    named = [
        uas.model_copy(update={"name": name})
        for name, uas in zip(("alpha", "bravo"), fleet, strict=True)
    ]
    scouts = flight.scenario.model_copy(update={"uas": tuple(named)})
    renamed = dataclasses.replace(flight, scenario=scouts, violations=())
    opened(browser, write_replay([renamed], tmp_path / "replay.html"), DESKTOP, "dark")
    edge = browser.execute_script(
        "return getComputedStyle(document.documentElement).getPropertyValue('--halo')"
    )
    charge = pixels(browser, ".charts .chart")[:, -60:]
    assert (charge == tuple(bytes.fromhex(edge.strip("# ")))).all(axis=2).sum() > 30


def test_a_page_that_is_shown_later_draws_its_curves_then(browser, page):
    opened(browser, page)
    browser.execute_script("document.querySelector('.charts').style.display = 'none'")
    emulate(browser, DESKTOP, "light")
    settled(browser)
    assert complaints(browser) == []
    browser.execute_script("document.querySelector('.charts').style.display = ''")
    emulate(browser, SMALL, "light")
    settled(browser)
    assert colours(pixels(browser, ".charts .chart")) > 20
