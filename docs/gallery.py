"""Make the pictures of scenarios, planners and replay pages: python docs/gallery.py.

Flies the planners that take less than a minute, and opens replay pages in headless Chromium. Needs
Chromium, its driver (Debian: `chromium`, `chromium-driver`) and the extra `test`.
"""

import io
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from replay_gif import browser, emulated
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env import Flight, Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.draw import picture
from uas_coverage_env.flight import flight_picture
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.replay import write_replay
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World

PICTURES = Path(__file__).parent / "pictures"
TILE_PX, COLUMNS, TITLE_PX = 400, 3, 28
PAGE_PX = (1280, 800)
SCENARIOS = ("village", "gasche2025", "corridor", "open_field", "indoor", "streets:2")
PLANNERS = (
    *("nearest-waypoint", "lawnmower", "tour"),
    *("trajectory", "learned-route", "learned-velocity"),
)


def titled(pixels: NDArray[np.uint8], title: str) -> Image.Image:
    """A tile with its title above."""
    tile = Image.new("RGB", (TILE_PX, TILE_PX + TITLE_PX), "white")
    tile.paste(Image.fromarray(pixels), (0, TITLE_PX))
    ImageDraw.Draw(tile).text((8, 7), title, fill="black", font_size=14)
    return tile


def save(image: Image.Image, name: str) -> None:
    """Write a picture with few colours."""
    path = PICTURES / name
    # a palette that keeps the colours of thin lines and of large areas
    coverage = Image.Quantize.MAXCOVERAGE
    few = image.convert("RGB").quantize(256, coverage, kmeans=4, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB", flush=True)


def save_tiles(tiles: list[Image.Image], name: str) -> None:
    """Write the tiles row by row."""
    rows = -(-len(tiles) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * TILE_PX, rows * (TILE_PX + TITLE_PX)), "white")
    for n, tile in enumerate(tiles):
        row, column = divmod(n, COLUMNS)
        sheet.paste(tile, (column * TILE_PX, row * (TILE_PX + TITLE_PX)))
    save(sheet, name)


def flown_picture(flight: Flight) -> Image.Image:
    """A flight at its end, with what it took."""
    result = summary(flight)
    words = f"{flight.planner}: {flight.steps} steps, {result['energy_Wh']:.1f} Wh"
    return titled(flight_picture(flight, size_px=TILE_PX), words)


def scenario_picture(scenario: Scenario, name: str) -> Image.Image:
    """A mission at its start."""
    return titled(picture(scenario, World(scenario).swarm_state(), size_px=TILE_PX), name)


def save_page(flight: Flight, moment: str, name: str, theme: str) -> None:
    """Write what a replay page shows at a moment."""
    driver = browser()
    try:
        with tempfile.TemporaryDirectory() as scratch:
            page = write_replay([flight], Path(scratch) / "replay.html")
            emulated(driver, PAGE_PX, theme)
            driver.get(f"{page.as_uri()}#{moment}")
            WebDriverWait(driver, 30).until(lambda _: driver.find_elements(By.CLASS_NAME, "card"))
            driver.execute_async_script("setTimeout(arguments[0], 1500)")
            shot = Image.open(io.BytesIO(driver.get_screenshot_as_png()))
    finally:
        driver.quit()
    save(shot.resize(PAGE_PX, Image.Resampling.LANCZOS), name)


def main() -> None:
    """Make them all."""
    save_tiles([scenario_picture(load_scenario(name), name) for name in SCENARIOS], "scenarios.png")
    flights = {name: rollout("village", load_planner(name)) for name in PLANNERS}
    save_tiles([flown_picture(flight) for flight in flights.values()], "planners.png")
    save_page(flights["tour"], "t=80", "replay.png", "light")
    town = generate_scenario(seed=5, n_uas=32, n_waypoints=320, n_obstacles=8)
    swarm = rollout(town, load_planner("nearest-waypoint"), max_steps=120)
    save_page(swarm, "t=90&trail=power", "replay-swarm.png", "dark")


if __name__ == "__main__":
    main()
