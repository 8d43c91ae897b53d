"""Make the pictures of scenarios, planners and replay pages.

    python docs/gallery.py                    all of them
    python docs/gallery.py maps               those that are drawn
    python docs/gallery.py pages              replay pages
    python docs/gallery.py replay-indoor.png  some, by name

Flies planners that take less than a minute, and opens replay pages in headless Chromium. Needs the
extra `test`, and for pages Chromium and its driver (Debian: `chromium`, `chromium-driver`).
"""

import contextlib
import io
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import families_picture
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from replay_gif import browser, emulated
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from uas_coverage_env import Flight, Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.cli import main
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


def scenarios() -> None:
    """Draw shipped missions at their start."""
    save_tiles([scenario_picture(load_scenario(name), name) for name in SCENARIOS], "scenarios.png")


def planners() -> None:
    """Draw the village as planners fly it."""
    flights = [rollout("village", load_planner(name)) for name in PLANNERS]
    save_tiles([flown_picture(flight) for flight in flights], "planners.png")


def drawn_by(name: str, *commands: str) -> None:
    """Keep the last file that some command lines write: those that the page has."""
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        for command in commands:
            if main(command.split()):
                raise SystemExit(f"uas-coverage {command}: failed")
        save(Image.open(commands[-1].split()[-1]), name)


def swarm() -> None:
    """Keep a replay page of a large fleet."""
    town = generate_scenario(seed=5, n_uas=32, n_waypoints=320, n_obstacles=8)
    flight = rollout(town, load_planner("nearest-waypoint"), max_steps=120)
    save_page(flight, "t=90&trail=power", "replay-swarm.png", "dark")


DRAWN: dict[str, Callable[[], None]] = {
    "scenarios.png": scenarios,
    "planners.png": planners,
    "families.png": families_picture.main,
    "zones.png": lambda: drawn_by(
        "zones.png",
        "import zones --height 60 --flown-by autopilot --out zones.toml",
        "run zones.toml --planner trajectory --out zones_flight",
        "figure zones_flight --kind map --out zones_map.png",
    ),
    "seen_ground.png": lambda: drawn_by(
        "seen_ground.png",
        "run mixed_fleet --planner lawnmower --out roles",
        "figure roles --kind map --out seen_ground.png",
    ),
}
PAGES: dict[str, Callable[[], None]] = {
    "replay.png": lambda: save_page(rollout("village", "tour"), "t=80", "replay.png", "light"),
    "replay-swarm.png": swarm,
    "replay-indoor.png": lambda: save_page(
        rollout("indoor", "trajectory"), "t=20", "replay-indoor.png", "light"
    ),
    "replay-air-taxi.png": lambda: save_page(
        rollout("air_taxi", "trajectory", dynamics="nonlinear"),
        "t=150",
        "replay-air-taxi.png",
        "light",
    ),
}


def draw(names: list[str]) -> int:
    """Make some pictures: `maps`, `pages`, or by name."""
    makers = {**DRAWN, **PAGES}
    sets = {"maps": list(DRAWN), "pages": list(PAGES)}
    wanted = [one for name in names or sets for one in sets.get(name, [name])]
    if unknown := set(wanted) - set(makers):
        sys.stderr.write(f"error: no picture {sorted(unknown)[0]}; one of {', '.join(makers)}\n")
        return 2
    for name in wanted:
        makers[name]()
    return 0


if __name__ == "__main__":
    sys.exit(draw(sys.argv[1:]))
