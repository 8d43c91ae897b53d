"""The ground that cameras have seen, painted on the replay page, in a real Chromium."""

import dataclasses

import numpy as np
import pytest
from chromium import SMALL, complaints, map_pixels, needs_chromium, opened, pixels
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env.flight import Flight, load_planner, rollout, seen_ground
from uas_coverage_env.replay import write_replay
from uas_coverage_env.scenario import load_scenario

pytestmark = needs_chromium

STEPS = 30


@pytest.fixture(scope="module")
def mapped() -> Flight:
    """UAS with a camera and a thermal camera, on their way."""
    return rollout(load_scenario("mixed_fleet"), load_planner("lawnmower"), max_steps=STEPS)


@pytest.fixture(scope="module")
def blind(mapped) -> Flight:
    """The same flight of UAS whose sensors take no pictures."""
    uas = [
        each.model_copy(
            update={
                "sensors": tuple(
                    sensor.model_copy(update={"field_of_view_deg": None}) for sensor in each.sensors
                )
            }
        )
        for each in mapped.scenario.uas
    ]
    scenario = mapped.scenario.model_copy(update={"uas": tuple(uas)})
    return dataclasses.replace(mapped, scenario=scenario)


@pytest.fixture(scope="module")
def pages(mapped, blind, tmp_path_factory):
    folder = tmp_path_factory.mktemp("seen")
    return [
        write_replay([flight], folder / f"{name}.html")
        for name, flight in (("mapped", mapped), ("blind", blind))
    ]


def painted(driver, pages, view, sample):
    """(H, W) where the picture of the flight with cameras is another one than without."""
    both = []
    for page in pages:
        opened(driver, page, SMALL, moment=f"#view={view}&t={sample}")
        both.append(pixels(driver, ".stage"))
    return (both[0] != both[1]).any(axis=2)


def test_the_map_is_tinted_where_the_ground_was_seen(browser, pages, mapped):
    corners_m = mapped.scenario.fence.vertices_m
    low, high = corners_m[:, :2].min(axis=0), corners_m[:, :2].max(axis=0)
    shares = []
    for sample in (10, STEPS):
        tinted = painted(browser, pages, "map", sample)
        grounds = seen_ground(mapped, sample)
        places_m = grounds[0].north_m, grounds[0].east_m
        rows, columns = map_pixels(tinted.shape, low, high, *places_m)
        seen = np.any([ground.seen for ground in grounds], axis=0)
        agree = tinted[np.ix_(rows, columns)] == seen
        # buildings, marks and names lie above the tint
        assert agree.mean() > 0.93
        shares.append(tinted.mean())
    assert shares[1] > 1.5 * shares[0] > 0.0
    assert complaints(browser) == []


def test_the_ground_of_the_scene_is_tinted_and_clears_when_time_goes_back(browser, pages):
    late = painted(browser, pages, "3d", STEPS).mean()
    assert late > 0.03
    # the same page goes back: what was seen later is not seen any more
    opened(browser, pages[0], SMALL, moment=f"#t={STEPS}")
    browser.execute_script("location.hash = '#t=2'")
    WebDriverWait(browser, 20).until(
        lambda _: browser.find_element(By.CLASS_NAME, "time").text.startswith("2.0")
    )
    back = pixels(browser, ".stage")
    opened(browser, pages[0], SMALL, moment="#t=2")
    assert (back != pixels(browser, ".stage")).any(axis=2).mean() < 0.002


def test_the_share_that_was_seen_is_a_curve(browser, pages, mapped):
    opened(browser, pages[0], SMALL, moment=f"#view=map&t={STEPS}")
    shares = {ground.sensor: ground.share for ground in seen_ground(mapped)}
    curve = browser.find_element(By.CSS_SELECTOR, "canvas[aria-label^='Ground seen']")
    WebDriverWait(browser, 20).until(lambda _: " s: " in curve.get_attribute("aria-label"))
    words = curve.get_attribute("aria-label")
    assert f"camera {100 * shares['camera']:.0f} %" in words
    assert f"thermal {100 * shares['thermal']:.0f} %" in words
    opened(browser, pages[1], SMALL, moment="#view=map")
    assert not browser.find_elements(By.CSS_SELECTOR, "canvas[aria-label^='Ground seen']")
