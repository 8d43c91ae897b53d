"""What `render` shows: the picture of the present state with the paths flown so far."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import Picture, Window
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import SwarmState

RENDER_MODES = ("human", "rgb_array")
RENDER_FPS = 20


class Screen:
    """Draws one mission after another, as `render_mode` says.

    Args:
        scenario: The scenario flown.
        render_mode: None, "human" or "rgb_array".

    Raises:
        ValueError: There is no such render mode.
        ImportError: The mode is "human" and pygame-ce is not installed.
    """

    def __init__(self, scenario: Scenario, render_mode: str | None) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            allowed = ", ".join(RENDER_MODES)
            raise ValueError(f"render_mode is {render_mode!r}; it is None or one of {allowed}")
        self.render_mode = render_mode
        self._scenario = scenario
        self._picture: Picture | None = None
        self._window: Window | None = None
        self._path_m: list[NDArray[np.float64]] = []
        if render_mode == "human":
            self._window = Window(scenario.name, RENDER_FPS)

    def begin(self) -> None:
        """Forget the paths: a new mission begins."""
        self._path_m.clear()

    def see(self, positions_m: NDArray[np.float64]) -> None:
        """Remember where the UAS are at this sample.

        Args:
            positions_m: (U, 3) [m].
        """
        self._path_m.append(positions_m.copy())

    def render(self, swarm: SwarmState) -> NDArray[np.uint8] | None:
        """The picture for "rgb_array", the window for "human", else nothing."""
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = Picture(self._scenario)
        picture = self._picture.draw(swarm, paths_m=np.array(self._path_m))
        if self.render_mode == "rgb_array":
            return picture
        if self._window is None:
            self._window = Window(self._scenario.name, RENDER_FPS)
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def __getstate__(self) -> dict[str, Any]:
        # a window cannot travel to another process, and pictures are drawn again in no time
        return {**self.__dict__, "_window": None, "_picture": None}
