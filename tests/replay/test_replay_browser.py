"""The replay page in a real Chromium without a screen, opened from disk."""

import dataclasses

import pytest
from chromium import (
    DESKTOP,
    PHONE,
    cards,
    colours,
    complaints,
    emulate,
    needs_chromium,
    opened,
    pixels,
    pressed,
    requests,
    settled,
    time_s,
)
from selenium.webdriver import Keys
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env.replay import write_replay

pytestmark = needs_chromium

HOSTILE = '</script><script>window.hacked = 1</script><img src=x onerror="window.hacked = 1">'


@pytest.fixture(scope="module")
def page(flight, tmp_path_factory):
    return write_replay([flight], tmp_path_factory.mktemp("page") / "replay.html")


def test_it_opens_from_disk_draws_and_asks_for_nothing(browser, page):
    opened(browser, page)
    assert browser.find_element(By.CSS_SELECTOR, "canvas.scene").is_displayed()
    assert colours(pixels(browser, ".stage")) > 500
    for chart in browser.find_elements(By.CLASS_NAME, "chart"):
        assert chart.size["width"] > 200
        assert chart.size["height"] >= 90
    assert cards(browser)[0].startswith("uas_1\ncovering\n100.0 %")
    assert requests(browser) == [page.as_uri()]
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    assert complaints(browser) == []


def test_the_slider_moves_the_vehicles(browser, page, flight):
    opened(browser, page)
    before, picture = cards(browser), pixels(browser, ".stage")
    slider = browser.find_element(By.CSS_SELECTOR, "input[type=range]")
    ActionChains(browser).move_to_element(slider).click().perform()
    settled(browser)
    k = round(time_s(browser))
    assert abs(k - flight.steps / 2) <= 1
    assert (pixels(browser, ".stage") != picture).any(axis=2).sum() > 500
    after = cards(browser)
    assert before[0] != after[0]
    pressed(browser, Keys.ARROW_RIGHT)
    k = int(time_s(browser))
    north, east = flight.x[k, 1, :2]
    assert f"N {north:.0f} m, E {east:.0f} m" in cards(browser)[1]
    assert f"{100 * flight.soc[k, 1]:.1f} %" in cards(browser)[1]


def test_a_click_on_a_curve_sets_the_time(browser, page):
    opened(browser, page)
    chart = browser.find_elements(By.CLASS_NAME, "chart")[1]
    ActionChains(browser).move_to_element(chart).click().perform()
    settled(browser)
    assert 25 < time_s(browser) < 35


def test_keys_step_and_play(browser, page, flight):
    # on the map, which is drawn faster without a graphics card
    opened(browser, page, moment="#view=map")
    pressed(browser, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert time_s(browser) == 2.0
    pressed(browser, Keys.SHIFT, Keys.ARROW_RIGHT)
    assert time_s(browser) == 12.0
    pressed(browser, Keys.ARROW_LEFT)
    assert time_s(browser) == 11.0
    pressed(browser, Keys.END)
    assert time_s(browser) == flight.steps
    pressed(browser, Keys.HOME)
    assert time_s(browser) == 0.0

    speed = browser.find_element(By.CSS_SELECTOR, "select[aria-label=Speed]")
    pressed(browser, "+")
    assert speed.get_property("value") == "20"
    pressed(browser, "----")
    assert speed.get_property("value") == "1"
    pressed(browser, Keys.SPACE)
    WebDriverWait(browser, 20).until(lambda _: time_s(browser) > 0.5)
    pressed(browser, Keys.SPACE)
    stopped = time_s(browser)
    assert stopped < flight.steps
    settled(browser)
    assert time_s(browser) == stopped

    assert complaints(browser) == []


def test_keys_change_the_view(browser, page):
    opened(browser, page)
    overview = pixels(browser, ".stage")
    pressed(browser, "2")
    assert browser.find_elements(By.CSS_SELECTOR, ".card[aria-pressed=true] b")[0].text == "uas_2"
    assert (pixels(browser, ".stage") != overview).any(axis=2).mean() > 0.5
    pressed(browser, "t")
    assert not browser.find_elements(By.CSS_SELECTOR, ".card[aria-pressed=true]")
    pressed(browser, "m")
    assert browser.find_element(By.CSS_SELECTOR, "canvas.map").is_displayed()
    assert not browser.find_element(By.CSS_SELECTOR, "canvas.scene").is_displayed()
    pressed(browser, "m", "?")
    assert browser.find_element(By.TAG_NAME, "dialog").is_displayed()
    assert complaints(browser) == []


def test_a_violation_is_listed_and_leads_to_its_moment(browser, page):
    opened(browser, page)
    (entry,) = browser.find_elements(By.CSS_SELECTOR, ".violations button")
    assert entry.text == "30 s: uas_1, obstacle contact with church"
    entry.click()
    settled(browser)
    assert time_s(browser) == 30.0
    assert len(browser.find_elements(By.CSS_SELECTOR, ".track .violation")) == 1


def test_without_webgl_the_map_is_drawn_with_the_same_slider(browser_without_webgl, page):
    driver = opened(browser_without_webgl, page)
    assert driver.find_element(By.CSS_SELECTOR, "canvas.map").is_displayed()
    assert not driver.find_element(By.CSS_SELECTOR, "canvas.scene").is_displayed()
    before = pixels(driver, ".stage")
    assert colours(before) > 100
    slider = driver.find_element(By.CSS_SELECTOR, "input[type=range]")
    ActionChains(driver).move_to_element(slider).click().perform()
    settled(driver)
    assert (pixels(driver, ".stage") != before).any(axis=2).sum() > 500
    assert "N 250 m, E 10 m" not in cards(driver)[0]
    assert complaints(driver) == []
    assert requests(driver) == [page.as_uri()]


def test_where_the_graphics_card_goes_the_map_comes(browser, page):
    opened(browser, page)
    browser.execute_script(
        "document.querySelector('canvas.scene').getContext('webgl2')"
        ".getExtension('WEBGL_lose_context').loseContext()"
    )
    shown = browser.find_element(By.CSS_SELECTOR, "canvas.map")
    WebDriverWait(browser, 20).until(lambda _: shown.is_displayed())
    settled(browser)
    assert colours(pixels(browser, ".stage")) > 100
    assert complaints(browser) == []


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_it_fits_the_screen_in_light_and_dark(browser, page, size):
    opened(browser, page, size, "light", "#t=20")
    light = pixels(browser, "body")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
    controls = browser.find_element(By.CLASS_NAME, "controls").rect
    buttons = browser.find_elements(By.CSS_SELECTOR, ".controls button, .controls select")
    for control in buttons:
        if control.is_displayed():
            assert control.rect["x"] + control.rect["width"] <= size[0]
            assert control.rect["height"] >= (40 if size == PHONE else 34)
    assert controls["width"] == size[0]
    assert time_s(browser) == 20.0
    # the page changes with the system, while it is open
    emulate(browser, size, "dark")
    settled(browser)
    dark = pixels(browser, "body")
    assert light.mean() > 180
    assert dark.mean() < 75
    assert colours(dark) > 500
    assert complaints(browser) == []


def test_two_flights_are_played_side_by_side(browser, flight, plain, tmp_path):
    other = dataclasses.replace(plain, planner="other")
    opened(browser, write_replay([flight, other], tmp_path / "replay.html"))
    left, right = browser.find_elements(By.CLASS_NAME, "flight")
    assert left.rect["width"] == right.rect["width"]
    assert [title.text for title in browser.find_elements(By.TAG_NAME, "h1")] == [
        "village · nearest-waypoint",
        "village · other",
    ]
    pressed(browser, Keys.END)
    assert len(cards(browser)) == 4
    assert cards(browser)[:2] == cards(browser)[2:]
    # one camera for both
    before = pixels(browser, ".flight:last-child .stage")
    stage = left.find_element(By.CLASS_NAME, "stage")
    ActionChains(browser).drag_and_drop_by_offset(stage, 120, 30).perform()
    settled(browser)
    assert (pixels(browser, ".flight:last-child .stage") != before).any(axis=2).mean() > 0.3
    assert complaints(browser) == []


def test_two_flights_of_a_mission_are_shown_in_one_scene(browser, flight, plain, tmp_path):
    x = plain.x.copy()
    x[30:, :, 1] += 60.0
    covered = plain.covered.copy()
    covered[30:] -= 1
    other = dataclasses.replace(plain, planner="other", x=x, covered=covered)
    page = write_replay([flight, other], tmp_path / "replay.html")
    opened(browser, page, moment="#t=40&view=map")
    first, second = browser.find_elements(By.CLASS_NAME, "flight")
    half = first.rect["width"]
    told = [text.text for text in browser.find_elements(By.CLASS_NAME, "beside")]
    assert told == [
        "beside other: ±0.00 Wh, +1 waypoint, as long",
        "beside nearest-waypoint: ±0.00 Wh, −1 waypoint, as long",
    ]
    pressed(browser, "g")
    assert not second.is_displayed()
    assert first.rect["width"] > 1.9 * half
    ghosts = {}
    for view in ("map", "3d"):
        opened(browser, page, DESKTOP, moment=f"#t=40&together=1&view={view}")
        ghosts[view] = pixels(browser, ".stage")
        alone = write_replay([flight], tmp_path / "alone.html")
        opened(browser, alone, DESKTOP, moment=f"#t=40&view={view}")
        without = pixels(browser, ".stage")
        changed = (ghosts[view] != without).any(axis=2)
        assert changed[60:].sum() > 300, "paths below the words at the top"
        assert changed.mean() < 0.3
    opened(browser, page, moment="#together=1&view=map")
    pressed(browser, "g")
    assert browser.find_elements(By.CLASS_NAME, "flight")[1].is_displayed()
    assert complaints(browser) == []


def test_flights_of_two_missions_stay_side_by_side(browser, flight, plain, tmp_path):
    scenario = plain.scenario.model_copy(update={"waypoints": plain.scenario.waypoints[:9]})
    other = dataclasses.replace(plain, scenario=scenario, covered=plain.covered.clip(max=9))
    page = write_replay([flight, other], tmp_path / "replay.html")
    opened(browser, page, moment="#together=1&view=map")
    pressed(browser, "g")
    assert all(one.is_displayed() for one in browser.find_elements(By.CLASS_NAME, "flight"))
    assert not any(one.is_displayed() for one in browser.find_elements(By.CLASS_NAME, "beside"))


def test_a_flight_of_one_sample_can_be_looked_at(browser, plain, tmp_path):
    """What is left where a person stops a flight before its first step."""
    series = ("x", "u", "voltage_V", "current_A", "mode", "covered", "moving_position_m")
    start = {name: getattr(plain, name)[:1] for name in series}
    nothing = dataclasses.replace(plain, **start, decisions=())
    opened(browser, write_replay([nothing], tmp_path / "replay.html"))
    pressed(browser, Keys.END, Keys.ARROW_RIGHT, Keys.SPACE)
    assert time_s(browser) == 0.0
    assert cards(browser)[0].startswith("uas_1\ncovering\n100.0 %")
    assert complaints(browser) == []


def test_a_hostile_name_is_shown_and_does_nothing(browser, flight, tmp_path):
    water = flight.scenario.decorations[0].model_copy(update={"kind": HOSTILE})
    scenario = flight.scenario.model_copy(update={"decorations": (water,)})
    evil = dataclasses.replace(flight, scenario=scenario, planner=HOSTILE)
    opened(browser, write_replay([evil], tmp_path / "replay.html"))
    assert browser.find_element(By.TAG_NAME, "h1").text == f"village · {HOSTILE}"
    assert browser.title == f"village, {HOSTILE}"
    assert browser.execute_script("return typeof window.hacked") == "undefined"
    assert complaints(browser) == []
