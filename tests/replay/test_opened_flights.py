"""Other flights onto a page: dropped or chosen, as pages or as the directories that hold them."""

import shutil
from pathlib import Path

import pytest
from chromium import complaints, needs_chromium, opened, pressed, requests, settled, time_s
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.replay import write_replay
from uas_coverage_env.scenario import load_scenario

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def directories(plain, tmp_path_factory) -> dict[str, Path]:
    """What a person has: two flights of the village, one of another place, one without a page."""
    base = tmp_path_factory.mktemp("flights")
    other = rollout(load_scenario("village"), load_planner("hover"), max_steps=20)
    field = rollout(load_scenario("open_field"), load_planner("hover"), max_steps=5)
    for name, flights in {
        "nearest": [plain],
        "hover": [other],
        "field": [field],
        "two": [plain, other],
    }.items():
        (base / name).mkdir()
        write_replay(flights, base / name / "replay.html")
    (base / "bare").mkdir()
    (base / "bare" / "summary.json").write_text("{}")
    old = (base / "hover" / "replay.html").read_text(encoding="utf-8")
    (base / "old.html").write_text(old.replace('"use strict"', '"use  strict"'), encoding="utf-8")
    (base / "letter.html").write_text("<p>Dear all</p>")
    return {path.name: path for path in base.iterdir()}


@pytest.fixture
def page(browser, directories):
    return opened(browser, directories["nearest"] / "replay.html", moment="#view=map")


def drop(driver, *paths):
    where = {"x": 200, "y": 200, "modifiers": 0}
    data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        event = {"type": kind, "data": data, **where}
        driver.execute_cdp_cmd("Input.dispatchDragEvent", event)


def titles(driver):
    # in one go: a panel may be taken away in between
    found = "return [...document.querySelectorAll('.flight h1')].map((head) => head.textContent)"
    return driver.execute_script(found)


def said(driver):
    return driver.find_element(By.CSS_SELECTOR, ".opened").text


def waits_for(driver, condition):
    WebDriverWait(driver, 10).until(lambda _: condition())
    settled(driver)


def test_a_directory_that_is_dropped_stands_beside_the_flight(page, directories):
    drop(page, directories["hover"])
    waits_for(page, lambda: titles(page) == ["village · nearest-waypoint", "village · hover"])
    beside = page.find_element(By.CSS_SELECTOR, ".beside").text
    assert beside.startswith("beside hover:")
    # one clock, whose keys are heard once
    pressed(page, Keys.ARROW_RIGHT)
    assert time_s(page) == 1.0
    # the next one takes the place of the second
    drop(page, directories["field"])
    waits_for(page, lambda: titles(page) == ["village · nearest-waypoint", "open_field · hover"])
    pressed(page, Keys.ARROW_RIGHT)
    assert time_s(page) == 1.0
    assert len(page.find_elements(By.TAG_NAME, "footer")) == 1
    assert complaints(page) == []


def test_two_that_are_dropped_take_the_place_of_what_is_there(page, directories):
    drop(page, directories["hover"] / "replay.html", directories["field"])
    waits_for(page, lambda: titles(page) == ["village · hover", "open_field · hover"])
    assert complaints(page) == []


def test_flights_can_be_chosen_by_hand(page, directories):
    chooser = page.find_element(By.CSS_SELECTOR, "input[type=file]")
    chooser.send_keys(str(directories["two"] / "replay.html"))
    waits_for(page, lambda: titles(page) == ["village · nearest-waypoint", "village · hover"])
    assert page.find_element(By.XPATH, "//button[text()='Open']").is_displayed()


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["bare"], 'bare holds no replay.html: write it with "uas-coverage replay bare"'),
        (["letter.html"], "letter.html is no replay page"),
        (["old.html"], "old.html was written by another version"),
        (["two", "hover"], "These are 3 flights"),
    ],
)
def test_what_cannot_be_opened_is_named_and_the_page_stays(page, directories, names, words):
    drop(page, *(directories[name] for name in names))
    waits_for(page, lambda: words in said(page))
    assert titles(page) == ["village · nearest-waypoint"]
    assert complaints(page) == []


def test_a_page_that_is_opened_brings_no_script_and_asks_no_network(page, directories, tmp_path):
    path = shutil.copy(directories["hover"] / "replay.html", tmp_path / "guest.html")
    text = Path(path).read_text(encoding="utf-8")
    guest = "<img src='https://nowhere.invalid/x.png' onerror='window.guest = 1'>"
    guest += "<script>window.guest = 1</script></body>"
    Path(path).write_text(text.replace("</body>", guest), encoding="utf-8")
    requests(page)
    drop(page, path)
    waits_for(page, lambda: len(titles(page)) == 2)
    assert page.execute_script("return window.guest") is None
    assert not [url for url in requests(page) if url.startswith("http")]


def test_three_dimensions_survive_many_openings(browser, directories):
    """Browsers take the oldest scene away where there are more than sixteen."""
    opened(browser, directories["nearest"] / "replay.html")
    for name in ["hover", "two"] * 5:
        drop(browser, directories[name])
        waits_for(browser, lambda: len(titles(browser)) == 2)
    assert all(
        canvas.is_displayed() for canvas in browser.find_elements(By.CSS_SELECTOR, "canvas.scene")
    )
    assert complaints(browser) == []
