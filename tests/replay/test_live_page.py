"""The page of a flight that is still flown: a server for this machine alone, that ends with it."""

import dataclasses
import json
import time
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import pytest
from chromium import (
    SMALL,
    complaints,
    emulate,
    needs_chromium,
    opened,
    pixels,
    pressed,
    settled,
    time_s,
)
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env.cli import main
from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.replay import write_replay
from uas_coverage_env.replay.live import LivePage
from uas_coverage_env.scenario import load_scenario


def until(flight, samples):
    """A flight as it was after so many samples."""
    return dataclasses.replace(
        flight,
        x=flight.x[:samples],
        u=flight.u[:samples],
        voltage_V=flight.voltage_V[:samples],
        current_A=flight.current_A[:samples],
        mode=flight.mode[:samples],
        covered=flight.covered[:samples],
        moving_position_m=flight.moving_position_m[:samples],
        decisions=flight.decisions[: samples - 1],
        reward_terms=flight.reward_terms[: samples - 1],
        plan=flight.plan[flight.plan["step"] < samples],
    )


@pytest.fixture
def live(plain):
    page = LivePage(until(plain, 3))
    yield page
    if page is not None:
        page.close()


def got(address, **headers):
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
        return answer.status, answer.read().decode()


def refused(address, method="GET", **headers):
    request = urllib.request.Request(address, headers=headers, method=method)
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(request)
    caught.value.close()
    return caught.value.code


def test_only_this_machine_is_served_and_only_for_reading(live):
    address = urlsplit(live.address)
    assert address.hostname == "127.0.0.1"
    assert refused(live.address, Host="elsewhere.example") == 403
    assert refused(f"{live.address}etc/passwd") == 404
    for method in ("POST", "PUT", "DELETE"):
        assert refused(live.address, method) == 501


def test_a_client_is_told_what_is_new_and_nothing_else(live, plain):
    assert not live.due, "nobody looks"
    status, text = got(f"{live.address}flight.json")
    assert (status, json.loads(text)["samples"], json.loads(text)["over"]) == (200, 3, False)
    assert got(f"{live.address}flight.json?known=3") == (204, "")
    live.update(until(plain, 5))
    status, text = got(f"{live.address}flight.json?known=3")
    news = json.loads(text)
    assert (status, news["samples"]) == (200, 5)
    assert len(news["flight"]["covered"]) == 5


def test_the_page_may_ask_its_own_server_and_nobody_else(live):
    _, page = got(live.address)
    assert "connect-src &#x27;self&#x27;" in page
    assert 'data-live="/flight.json"' in page


def test_the_server_ends_with_the_flight(plain):
    page = LivePage(until(plain, 3))
    address = page.address
    assert got(address)[0] == 200
    page.close()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address, timeout=2)


class Client:
    """Flies like `hover`, and looks at the page as a browser does."""

    def __init__(self):
        self.planner, self.seen = load_planner("hover"), []
        self.page: LivePage | None = None

    def reset(self, brief, seed):
        self.planner.reset(brief, seed)

    def on_step(self, progress):
        if self.page is None:
            self.page = LivePage(progress.flown())
            return
        deadline_s = time.monotonic() + 20.0
        while not self.page.due and time.monotonic() < deadline_s:
            time.sleep(0.01)
        self.page.update(progress.flown())

    def act(self, swarm):
        known = self.seen[-1] if self.seen else -1
        status, text = got(f"{self.page.address}flight.json?known={known}")
        assert status == 200
        self.seen.append(json.loads(text)["samples"])
        return self.planner.act(swarm)


def test_a_flight_that_is_flown_is_served_step_by_step():
    client = Client()
    rollout(load_scenario("village"), client, max_steps=4, on_step=client.on_step)
    client.page.close()
    assert client.seen == [1, 2, 3, 4]


def test_the_command_says_where_it_can_be_seen(tmp_path, capsys):
    command = ["run", "village", "--planner", "hover", "--live"]
    assert main([*command, "--steps", "3", "--out", str(tmp_path / "out")]) == 0
    assert "live at http://127.0.0.1:" in capsys.readouterr().out
    assert main([*command, "--sorties", "2"]) == 2
    assert "either --live or --sorties" in capsys.readouterr().err


@needs_chromium
def test_a_browser_goes_on_with_the_flight_until_it_ends(browser, plain):
    page = LivePage(until(plain, 3))
    browser.get(f"{page.address}#view=map&t=2")
    wait = WebDriverWait(browser, 30)
    wait.until(lambda _: browser.find_elements(By.CLASS_NAME, "card"))
    wait.until(lambda _: time_s(browser) == 2.0)
    assert browser.find_elements(By.CSS_SELECTOR, "body.live")
    page.update(until(plain, 31))
    # who looks at the end goes on with it
    wait.until(lambda _: time_s(browser) == 30.0)
    page.close(plain)
    wait.until(lambda _: browser.find_elements(By.CSS_SELECTOR, "body.ended"))
    assert time_s(browser) == plain.steps
    assert complaints(browser) == []


@needs_chromium
def test_a_page_opened_late_begins_now_and_can_go_back(browser, plain):
    page = LivePage(until(plain, 31))
    browser.get("about:blank")
    browser.get(page.address)
    wait = WebDriverWait(browser, 30)
    wait.until(lambda _: page_time_is(browser, 30.0))
    page.update(until(plain, 41))
    wait.until(lambda _: time_s(browser) == 40.0)
    pressed(browser, Keys.HOME)
    assert time_s(browser) == 0.0
    page.update(until(plain, 51))
    slider = browser.find_element(By.CSS_SELECTOR, "input[type=range]")
    wait.until(lambda _: float(slider.get_attribute("max")) == 50.0)
    assert time_s(browser) == 0.0, "who looks at the past stays there"
    page.close(plain)
    assert complaints(browser) == []


@needs_chromium
@pytest.mark.parametrize("view", ["map", "3d"])
def test_a_live_flight_is_drawn_as_it_grows(browser, plain, tmp_path, view):
    """What is drawn of its first samples is the picture of a replay page of as many."""
    pictures = {}
    for samples in (3, 31):
        begun = write_replay([until(plain, samples)], tmp_path / f"{samples}.html")
        opened(browser, begun, SMALL, moment=f"#view={view}&t={samples - 1}")
        pictures[samples] = pixels(browser, ".stage")
    page = LivePage(until(plain, 3))
    browser.get("about:blank")
    emulate(browser, SMALL, "light")
    browser.get(f"{page.address}#view={view}&t=2")
    wait = WebDriverWait(browser, 30)
    for samples in (3, 31):
        if samples > 3:
            page.update(until(plain, samples))
        wait.until(lambda _, k=samples: page_time_is(browser, k - 1))
        settled(browser)
        drawn = pixels(browser, ".stage")
        assert (drawn != pictures[samples]).any(axis=2).mean() < 0.01
        if samples > 3:
            # not for being the same all the time
            assert (drawn != pictures[3]).any(axis=2).mean() > 0.01
    page.close(plain)
    assert complaints(browser) == []


def page_time_is(driver, k) -> bool:
    return bool(driver.find_elements(By.CLASS_NAME, "time")) and time_s(driver) == k
