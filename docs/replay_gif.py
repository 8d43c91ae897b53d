"""Record the README's animation: the replay page of a flight in headless Chromium, as a GIF.

    uas-coverage run village --planner tour --out flights/tour
    uas-coverage replay flights/tour
    python docs/replay_gif.py flights/tour docs/pictures/replay.gif

Needs Chromium, its driver (Debian: `chromium`, `chromium-driver`) and the extra `test`.
"""

import argparse
import io
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env import Flight

PAGE_PX = (1280, 721)
SCALE = 2  # without a graphics card edges are smooth only if they are drawn larger
GIF_PX = (880, 496)
COLOURS = 128
FRAME_MS = 120
LAST_FRAME_MS = 2000
_DRAWN = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))"


def browser() -> webdriver.Chrome:
    """A headless Chromium that renders WebGL on the processor."""
    options = Options()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless=new", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        # Chromium refuses to sandbox its processes for the superuser
        options.add_argument("--no-sandbox")
    return webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver") or ""))


def emulated(driver: webdriver.Chrome, size: tuple[int, int], theme: str) -> None:
    """Give a browser a window of so many pixels, light or dark."""
    width, height = size
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": SCALE, "mobile": False},
    )
    driver.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": theme}]},
    )


def frames(driver: webdriver.Chrome, page: Path, steps: int, stride: int) -> Iterator[Image.Image]:
    """The page at every `stride`-th step, and at the last one."""
    emulated(driver, PAGE_PX, "light")
    driver.get(page.as_uri())
    WebDriverWait(driver, 30).until(lambda _: driver.find_elements(By.CLASS_NAME, "card"))
    for step in [*range(0, steps, stride), steps]:
        driver.execute_script(f"location.hash = 't={step}'")
        driver.execute_async_script(_DRAWN)
        shot = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
        yield shot.resize(GIF_PX, Image.Resampling.LANCZOS)


def save_gif(pictures: list[Image.Image], path: Path) -> None:
    """Write the pictures with one palette, so that unchanged pixels cost nothing."""
    palette = pictures[len(pictures) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    first, *others = (p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures)
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=[FRAME_MS] * len(others) + [LAST_FRAME_MS],
        loop=0,
        optimize=True,
    )


def main() -> None:
    """Record what the command line names."""
    parser = argparse.ArgumentParser(description="Record a replay page as a GIF.")
    parser.add_argument("flight", type=Path, help="flight directory that holds a replay.html")
    parser.add_argument("gif", type=Path, help="file to write")
    parser.add_argument("--stride", type=int, default=3, help="steps of flight per picture")
    arguments = parser.parse_args()
    steps = Flight.load(arguments.flight).steps
    driver = browser()
    try:
        page = (arguments.flight / "replay.html").resolve()
        pictures = list(frames(driver, page, steps, arguments.stride))
    finally:
        driver.quit()
    save_gif(pictures, arguments.gif)


if __name__ == "__main__":
    main()
