"""What `render` shows of many missions: a picture of each, or the first of them as tiles of one."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw.window import Window
from uas_coverage_env.env.rendering.screen import RENDER_FPS, Screen
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import SwarmState

BATCH_RENDER_MODES = ("human", "rgb_array", "rgb_array_tiled")

MOST_TILES = 16
"""More missions than these are flown, but not shown in a tiled picture."""

_TILED_PX = 1024
_LARGEST_TILE_PX = 512
_PAPER = 250


class Tiles:
    """Draws the missions of a batch as `render_mode` says.

    Args:
        num_envs: How many there are.
        render_mode: None, "human" (a window with the tiled picture), "rgb_array" (a tuple, one
            picture for each) or "rgb_array_tiled" (one picture of the first `MOST_TILES`).

    Raises:
        ValueError: There is no such render mode.
        ImportError: The mode is "human" and pygame-ce is not installed.
        NoDisplayError: The mode is "human" and there is no display.
    """

    def __init__(self, num_envs: int, render_mode: str | None) -> None:
        if render_mode is not None and render_mode not in BATCH_RENDER_MODES:
            allowed = ", ".join(BATCH_RENDER_MODES)
            raise ValueError(f"render_mode is {render_mode!r}; it is None or one of {allowed}")
        self._render_mode = render_mode
        tiled = render_mode in ("human", "rgb_array_tiled")
        shown = min(num_envs, MOST_TILES) if tiled else num_envs
        columns = math.ceil(math.sqrt(shown))
        self._columns = columns
        self._size_px = min(_LARGEST_TILE_PX, _TILED_PX // columns) if tiled else None
        self._missions = [-1] * (shown if render_mode is not None else 0)
        self._screens: list[Screen] = []
        self._window: Window | None = None
        if render_mode == "human":
            self._window = Window(f"{num_envs} missions", RENDER_FPS)

    def forget(self, lanes: Sequence[int]) -> None:
        """New missions begin there, whatever their numbers are."""
        for lane in lanes:
            if lane < len(self._missions):
                self._missions[lane] = -1

    def see(
        self,
        missions: Sequence[int],
        scenario_of: Callable[[int], Scenario],
        positions_m: NDArray[np.float64],
    ) -> None:
        """Remember where the UAS are at this sample.

        Args:
            missions: Number of the mission that is flown in each lane.
            scenario_of: The scenario of a lane.
            positions_m: (num_envs, U, 3) [m].
        """
        for lane, before in enumerate(self._missions):
            scenario = scenario_of(lane)
            if before != missions[lane]:
                self._missions[lane] = missions[lane]
                self._begin(lane, scenario)
            self._screens[lane].change(scenario)
            self._screens[lane].see(positions_m[lane, : len(scenario.uas)])

    def render(self, swarm_state: Callable[[int], SwarmState]) -> Any:
        """A tuple of pictures, a tiled one, or nothing, as the mode says.

        Args:
            swarm_state: What is the state of a lane.
        """
        if self._render_mode is None or (self._window is not None and self._window.dismissed):
            return None
        pictures = [screen.render(swarm_state(lane)) for lane, screen in enumerate(self._screens)]
        if self._render_mode == "rgb_array":
            return tuple(pictures)
        picture = _tiled(pictures, self._columns)
        if self._window is None:
            return picture
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _begin(self, lane: int, scenario: Scenario) -> None:
        screens = self._screens
        if lane < len(screens) and screens[lane].scenario is scenario:
            screens[lane].begin()
            return
        # a background is megabytes: missions in the same scenario share it
        alike = next((screen for screen in screens if screen.scenario is scenario), None)
        new = alike.clone() if alike else Screen(scenario, "rgb_array", size_px=self._size_px)
        screens[lane : lane + 1] = [new]

    def __getstate__(self) -> dict[str, Any]:
        # a window cannot travel to another process: the copy flies unseen
        unseen = {"_window": None, "_render_mode": None} if self._window is not None else {}
        return {**self.__dict__, **unseen}


def _tiled(pictures: Sequence[Any], columns: int) -> NDArray[np.uint8]:
    """Pictures of one size, row by row from the upper left; what is left over is paper."""
    size_px = len(pictures[0])
    rows = math.ceil(len(pictures) / columns)
    tiled = np.full((rows * size_px, columns * size_px, 3), _PAPER, dtype=np.uint8)
    for k, picture in enumerate(pictures):
        row, column = size_px * (k // columns), size_px * (k % columns)
        tiled[row : row + size_px, column : column + size_px] = picture
    return tiled
