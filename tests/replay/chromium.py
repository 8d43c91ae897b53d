"""A real Chromium without a screen, and what tests ask of the pages in it.

Needs the Debian packages `chromium` and `chromium-driver`.
"""

import io
import json
import os
import shutil

import numpy as np
import pytest
from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
needs_chromium = pytest.mark.skipif(
    not (BROWSER and DRIVER),
    reason="no Chromium here: apt-get install chromium chromium-driver",
)

DESKTOP, PHONE = (1400, 900), (390, 844)
# fewer pixels to compute where the size does not matter
SMALL = (1020, 560)


def started(*arguments: str) -> webdriver.Chrome:
    options = Options()
    options.binary_location = BROWSER or ""
    # WebGL is computed by the processor; a container has little shared memory
    for argument in (
        *("--headless=new", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"),
        *arguments,
    ):
        options.add_argument(argument)
    if os.geteuid() == 0:
        # Chromium does not isolate its processes for the superuser
        options.add_argument("--no-sandbox")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


def opened(driver, page, size=SMALL, theme="light", moment=""):
    """Open a page anew; what the browser has logged until now is forgotten."""
    driver.get("about:blank")
    emulate(driver, size, theme)
    for kind in ("browser", "performance"):
        driver.get_log(kind)
    driver.get(page.as_uri() + moment)
    WebDriverWait(driver, 20).until(lambda _: driver.find_elements(By.CLASS_NAME, "card"))
    settled(driver)
    return driver


def emulate(driver, size, theme):
    width, height = size
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 700},
    )
    driver.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": theme}]},
    )


def settled(driver):
    """Wait until what was asked for has been drawn."""
    driver.execute_async_script(
        "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))"
    )


def pressed(driver, *keys):
    driver.find_element(By.TAG_NAME, "body").send_keys(*keys)
    settled(driver)


def time_s(driver) -> float:
    return float(driver.find_element(By.CLASS_NAME, "time").text.split()[0])


def cards(driver) -> list[str]:
    return [card.text for card in driver.find_elements(By.CLASS_NAME, "card")]


def pixels(driver, css) -> np.ndarray:
    return pixels_of(driver.find_element(By.CSS_SELECTOR, css))


def pixels_of(element) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(element.screenshot_as_png)).convert("RGB"))


def map_pixels(shape, low, high, north_m, east_m):
    """Rows and columns of places on the map: what `map.ts` does where no UAS is followed.

    Args:
        shape: Of the picture of the stage: (height, width).
        low: Least north and east of the fence [m].
        high: Greatest.
        north_m: Places [m].
        east_m: Places [m].
    """
    height, width = shape[0] - 18, shape[1]  # the scale lies at the foot
    scale = min((width - 28) / (high[1] - low[1]), (height - 28) / (high[0] - low[0]))
    rows = height / 2 - scale * (north_m - (low[0] + high[0]) / 2)
    columns = width / 2 + scale * (east_m - (low[1] + high[1]) / 2)
    return np.rint(rows).astype(int), np.rint(columns).astype(int)


def colours(image) -> int:
    return len(np.unique(image.reshape(-1, 3), axis=0))


def complaints(driver) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]


def requests(driver) -> list[str]:
    events = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    return [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    ]
