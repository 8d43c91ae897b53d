"""Pictures per second of the replay page in headless Chromium, which draws on the processor.

    python benchmarks/replay_page.py
    python benchmarks/replay_page.py --uas 100 --views 3d,map --seconds 20 --keep pages

Flights of `nearest-waypoint` over generated towns with ten waypoints per UAS, 120 steps, played at
ten times real time in a window of 1400 x 900 pixels. A picture is one that the browser has shown.
The processor time is that of Chromium and all its processes; it says more than the pictures per
second where the machine does other work, too. The script's part of it is what remains where a
graphics card draws: the page's own code, with its layout, by Chromium's clock of the main thread.
Needs Chromium and its driver (Debian: `chromium`, `chromium-driver`) and the extra `test`.
"""

import argparse
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import psutil
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env import Flight, Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.replay import write_replay

WINDOW_PX = (1400, 900)
STEPS = 120
SEED = 5
WAYPOINTS_PER_UAS = 10
MOST_GENERATED = 50
_COUNT = """
const [seconds, done] = arguments;
let pictures = 0;
const begun = performance.now();
const count = (now) => {
  pictures += 1;
  if (now - begun < 1000 * seconds) requestAnimationFrame(count);
  else done([pictures, (now - begun) / 1000]);
};
requestAnimationFrame(count);
"""


def swarm(uas: int) -> Scenario:
    """A generated town; of more UAS than those have, each second one starts beside another."""
    generated = uas if uas <= MOST_GENERATED else -(-uas // 2)
    town = generate_scenario(
        seed=SEED,
        n_uas=generated,
        n_waypoints=WAYPOINTS_PER_UAS * uas,
        n_obstacles=8 if uas < MOST_GENERATED else 20,
    )
    beside = [
        each.model_copy(
            update={
                "name": f"uas_{generated + 1 + i}",
                "start_m": (each.start_m[0], each.start_m[1] + 10.0, each.start_m[2]),
            }
        )
        for i, each in enumerate(town.uas[: uas - generated])
    ]
    return town.model_copy(update={"uas": [*town.uas, *beside]})


def flown(uas: int) -> Flight:
    """The first two minutes of a swarm."""
    return rollout(swarm(uas), load_planner("nearest-waypoint"), max_steps=STEPS)


def browser() -> webdriver.Chrome:
    """A headless Chromium that renders WebGL on the processor."""
    options = Options()
    for argument in ("--headless=new", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        # Chromium refuses to sandbox its processes for the superuser
        options.add_argument("--no-sandbox")
    options.binary_location = shutil.which("chromium") or ""
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver") or ""))
    width, height = WINDOW_PX
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
    )
    return driver


def processor_s(process: psutil.Process) -> float:
    """Processor time of a process and all that it has started [s]."""
    times = [each.cpu_times() for each in (process, *process.children(recursive=True))]
    return sum(each.user + each.system for each in times)


def script_s(driver: webdriver.Chrome) -> float:
    """Time that the page has spent in scripts and layout [s]."""
    metrics = driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    by_name = {metric["name"]: metric["value"] for metric in metrics}
    parts = ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
    return sum(by_name[part] for part in parts)


class Played(NamedTuple):
    """What playing a page took.

    Attributes:
        rate: Pictures per second.
        picture_s: Processor time per picture [s].
        script_s: Of it, time in scripts and layout [s].
        loaded_s: Time until the first picture [s].
    """

    rate: float
    picture_s: float
    script_s: float
    loaded_s: float


def played(page: Path, view: str, seconds: float) -> Played:
    """Open a page and play it."""
    driver = browser()
    try:
        driver.set_script_timeout(10.0 * seconds + 60.0)
        begun_s = time.monotonic()
        driver.get(f"{page.resolve().as_uri()}#view={view}&t=20")
        WebDriverWait(driver, 60).until(lambda _: driver.find_elements(By.CLASS_NAME, "controls"))
        driver.execute_async_script(_COUNT, 0.0)
        loaded_s = time.monotonic() - begun_s
        driver.find_element(By.TAG_NAME, "body").send_keys(" ")
        process = psutil.Process(driver.service.process.pid)
        driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
        before_s, scripts_before_s = processor_s(process), script_s(driver)
        pictures, lasted_s = driver.execute_async_script(_COUNT, seconds)
        used_s = processor_s(process) - before_s
        scripts_s = script_s(driver) - scripts_before_s
    finally:
        driver.quit()
    return Played(pictures / lasted_s, used_s / pictures, scripts_s / pictures, loaded_s)


def main() -> None:
    """Fly, write the pages, play them, print a row for each."""
    parser = argparse.ArgumentParser(description="Play replay pages and count.")
    parser.add_argument("--uas", default="2,8,32,100", help="numbers of UAS")
    parser.add_argument("--views", default="3d,map", help="of 3d, map")
    parser.add_argument("--seconds", type=float, default=8.0, help="of playing")
    parser.add_argument("--keep", type=Path, help="folder in which pages and flights are kept")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        columns = ("pictures/s", "processor, ms", "script, ms", "loaded, s")
        print(f"{'UAS':>4} {'view':4} {' '.join(f'{column:>13}' for column in columns)}")
        for uas in map(int, arguments.uas.split(",")):
            flight = flown(uas)
            if arguments.keep:
                flight.save(folder / f"flight{uas}", overwrite=True)
            page = write_replay([flight], folder / f"uas{uas}.html")
            for view in arguments.views.split(","):
                it = played(page, view, arguments.seconds)
                values = (it.rate, 1e3 * it.picture_s, 1e3 * it.script_s, it.loaded_s)
                print(
                    f"{uas:4d} {view:4} {' '.join(f'{value:13.1f}' for value in values)}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
