"""What a person does with the page: looks at many, clicks on things, turns, takes pictures away."""

import csv
import dataclasses
import itertools
import subprocess
import time
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from chromium import (
    DESKTOP,
    PHONE,
    cards,
    complaints,
    needs_chromium,
    opened,
    pixels,
    pressed,
    settled,
)
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait
from small_worlds import box, meadow, waypoint

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.replay import write_replay
from uas_coverage_env.replay.home_data import way_home
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.vehicle.layout import DOD

pytestmark = needs_chromium

TITLE_PX = 26


@pytest.fixture(scope="module")
def swarm_page(tmp_path_factory):
    swarm = generate_scenario(seed=5, n_uas=40, n_waypoints=80, n_obstacles=5)
    flight = rollout(swarm, load_planner("hover"), max_steps=4)
    x = flight.x.copy()
    x[:, 16, DOD] = 0.9
    flight = dataclasses.replace(flight, x=x)
    return write_replay([flight], tmp_path_factory.mktemp("swarm") / "replay.html")


@pytest.fixture(scope="module")
def page(flight, tmp_path_factory):
    return write_replay([flight], tmp_path_factory.mktemp("page") / "replay.html")


def shown_cards(driver):
    return [card.split()[0] for card in cards(driver) if card]


def label(driver, title):
    css = f"canvas[aria-label^='{title}']"
    return driver.find_element(By.CSS_SELECTOR, css).get_attribute("aria-label")


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_many_uas_are_told_in_a_few_words_and_filtered(browser, swarm_page, size):
    opened(browser, swarm_page, size, moment="#view=map")
    fleet = browser.find_element(By.CLASS_NAME, "fleet")
    assert "least 10 %" in fleet.text
    chips = {chip.text: chip for chip in fleet.find_elements(By.CSS_SELECTOR, ".chips button")}
    assert "40 all" in chips
    everything = pixels(browser, ".stage")
    chips["1 little to spare"].click()
    settled(browser)
    assert shown_cards(browser) == ["17"]
    assert (pixels(browser, ".stage") != everything).any()
    chips["40 all"].click()
    names = fleet.find_element(By.CSS_SELECTOR, "input")
    names.send_keys("3, 40")
    settled(browser)
    assert shown_cards(browser) == ["3", "40"]
    # letters and digits typed there are no commands
    assert not browser.find_elements(By.CSS_SELECTOR, ".card[aria-pressed=true]")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
    assert complaints(browser) == []


def test_the_uas_with_least_to_spare_is_one_click_away(browser, swarm_page):
    opened(browser, swarm_page, moment="#view=map")
    browser.find_element(By.CSS_SELECTOR, ".fleet p button").click()
    settled(browser)
    (card,) = browser.find_elements(By.CSS_SELECTOR, ".card[aria-pressed=true]")
    assert card.text.split()[0] == "17"


def test_the_area_in_reach_of_the_uas_that_is_followed_shrinks(browser, flight, tmp_path):
    pictures = []
    spare = way_home(flight, SceneHistory.of(flight)).least_spare[0][1]
    for left in (-0.01, 0.007, 0.011):
        x = flight.x.copy()
        x[:, 0, DOD] += spare - left
        page = write_replay([dataclasses.replace(flight, x=x)], tmp_path / "replay.html")
        discharged = dataclasses.replace(flight, x=x)
        k = way_home(discharged, SceneHistory.of(discharged)).least_spare[0][0]
        opened(browser, page, DESKTOP, moment=f"#view=map&t={k}&follow=1")
        pictures.append(pixels(browser, ".stage"))
    nothing, small, large = pictures
    share = [(picture != nothing).any(axis=2).mean() for picture in (small, large)]
    assert 0.02 < share[0] < 0.7 * share[1]


def test_a_click_on_a_waypoint_says_what_became_of_it_and_leads_there(browser, page, flight):
    opened(browser, page, DESKTOP, moment="#view=map&t=60")
    stage = browser.find_element(By.CLASS_NAME, "stage").rect
    corners_m = flight.scenario.fence.vertices_m
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    scale = min(
        (stage["width"] - 28) / (high[1] - low[1]), (stage["height"] - 28) / (high[0] - low[0])
    )
    first = int(flight.covered[-1] == 0)
    at_m = np.array(flight.scenario.waypoints[first].position_m)
    middle = (low + high) / 2
    stage_element = browser.find_element(By.CLASS_NAME, "stage")
    ActionChains(browser).move_to_element_with_offset(
        stage_element,
        round(scale * (at_m[1] - middle[1])),
        round(-scale * (at_m[0] - middle[0])),
    ).click().perform()
    settled(browser)
    told = browser.find_element(By.CLASS_NAME, "told")
    assert told.text.startswith(f"Waypoint {first + 1}, N {at_m[0]:.0f} m, E {at_m[1]:.0f} m")
    assert complaints(browser) == []


def test_the_camera_is_turned_by_keys(browser, page):
    opened(browser, page)
    for key in ("a", "w", "e"):
        before = pixels(browser, ".stage")
        pressed(browser, key)
        assert (pixels(browser, ".stage") != before).any(axis=2).mean() > 0.2, key
    pressed(browser, "o")
    assert complaints(browser) == []


def test_curves_are_told_in_words(browser, page, flight):
    opened(browser, page, moment="#view=map&t=20")
    WebDriverWait(browser, 20).until(lambda d: "at 20.0 s" in label(d, "Charge"))
    assert f"1 {100 * flight.soc[20, 0]:.1f} %" in label(browser, "Charge")
    assert "fence" in label(browser, "Room")
    assert f"{flight.covered[20]} of 49" in label(browser, "Waypoints covered")
    assert "uas_1 covering" in label(browser, "Operation modes")
    assert f"uas_1 {-flight.x[20, 0, 2]:.1f} m" in label(browser, "Height")


def test_a_picture_and_a_table_come_out_of_the_page(browser, page, flight, tmp_path):
    opened(browser, page, moment="#view=map&t=20")
    browser.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )
    saved = Select(browser.find_element(By.CSS_SELECTOR, "select[aria-label=Save]"))

    def file(what, name):
        saved.select_by_value(what)
        path = tmp_path / name
        WebDriverWait(browser, 20).until(lambda _: path.exists() and path.stat().st_size > 0)
        return path

    with Image.open(file("picture", "village-nearest-waypoint-20s.png")) as picture:
        assert picture.width == browser.find_element(By.CLASS_NAME, "stage").rect["width"]
        assert len(set(picture.convert("RGB").resize((200, 120)).get_flattened_data())) > 100
    with file("table", "village-nearest-waypoint.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    assert len(rows) == (flight.last_sample + 1).sum()
    row = next(row for row in rows if row["t_s"] == "20" and row["uas"] == "uas_2")
    assert float(row["x_m"]) == pytest.approx(flight.x[20, 1, 0], abs=0.01)
    assert float(row["soc"]) == pytest.approx(flight.soc[20, 1], abs=1e-4)
    assert complaints(browser) == []


@pytest.mark.parametrize("view", ["map", "3d"])
def test_a_film_comes_out_of_the_page_on_a_phone(browser, page, tmp_path, view):
    opened(browser, page, PHONE, moment=f"#view={view}&t=58")
    browser.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )
    saved = Select(browser.find_element(By.CSS_SELECTOR, "select[aria-label=Save]"))
    assert "film" in [option.get_attribute("value") for option in saved.options]
    saved.select_by_value("film")
    deadline_s = time.monotonic() + 60.0
    while not list(tmp_path.glob("*.webm")) and time.monotonic() < deadline_s:
        time.sleep(0.1)
    (film,) = tmp_path.glob("village-nearest-waypoint.webm")
    stage = browser.find_element(By.CLASS_NAME, "stage").rect
    seen = pixels(browser, ".stage")
    pictures = frames(film, width=round(stage["width"]), height=round(stage["height"]) + TITLE_PX)
    assert len(pictures) >= 2
    # its last picture is the last one of the page, its compression apart
    last = pictures[-1, TITLE_PX:].astype(float)
    assert np.abs(last - seen).mean() < 8.0
    assert complaints(browser) == []


def frames(film, width, height):
    """The pictures of a film, which has to be of this size."""
    decoder = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(film)]
    decoder += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = subprocess.run(decoder, capture_output=True, check=True)
    assert f"{width}x{height}" in decoded.stderr.decode()
    return np.frombuffer(decoded.stdout, np.uint8).reshape(-1, height, width, 3)


@pytest.mark.parametrize("view", ["map", "3d"])
def test_what_events_add_and_drop_is_shown_from_its_time_on(browser, view, tmp_path):
    shed = box("shed", (60.0, 60.0, -30.0), (140.0, 140.0, 0.0))
    events: Any = (
        {"kind": "obstacle_added", "at_s": 2.0, **shed},
        {"kind": "waypoint_dropped", "at_s": 4.0, "waypoint": 0},
        {"kind": "home_closed", "at_s": 6.0, "uas": "uas_1", "alternative_m": (20.0, 20.0, -1.0)},
    )
    starts_m = ((20.0, 180.0, -1.0),)
    scenario = meadow(starts_m, waypoints=[waypoint((180.0, y, -20.0)) for y in (40.0, 160.0)])
    flight = rollout(scenario.model_copy(update={"events": events}), "hover", max_steps=8)
    # nothing moves, so that only what events change makes another picture
    flight = dataclasses.replace(flight, x=np.repeat(flight.x[:1], len(flight.x), axis=0))
    page = write_replay([flight], tmp_path / "replay.html")
    pictures = []
    for t in (0.0, 1.0, 3.0, 5.0, 7.0):
        opened(browser, page, moment=f"#view={view}&t={t}")
        pictures.append(pixels(browser, ".stage"))
    changed = [(a != b).any(axis=2).mean() for a, b in itertools.pairwise(pictures)]
    still, shed_stands, dropped, home_moved = changed
    assert still == 0.0
    assert shed_stands > 0.02 > dropped > 1e-4
    assert home_moved > 1e-4
    assert "0 of 1 waypoints" in browser.find_element(By.TAG_NAME, "header").text
