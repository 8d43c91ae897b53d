"""What `render` shows: the picture of the present state with the paths flown so far."""

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import Picture
from uas_coverage_env.draw.window import Window, window_possible
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import SwarmState

RENDER_MODES = ("human", "rgb_array")
RENDER_FPS = 20

_PICTURE_PX = 512
_WINDOW_PX = 720


def offered(modes: Sequence[str]) -> list[str]:
    """The modes of `metadata["render_modes"]`, all of which checkers of environments try out.

    "human" is among them only where a window can be opened; `render_mode="human"` says elsewhere
    what is missing.
    """
    return [mode for mode in modes if mode != "human" or window_possible()]


class Screen:
    """Draws one mission after another, as `render_mode` says.

    A window that a person has closed stays closed: the missions go on unseen, at full speed.

    Args:
        scenario: The scenario flown.
        render_mode: None, "human" or "rgb_array".
        size_px: Side of the pictures; by default 512, and 720 in a window.

    Raises:
        ValueError: There is no such render mode.
        ImportError: The mode is "human" and pygame-ce is not installed.
        NoDisplayError: The mode is "human" and there is no display.
    """

    def __init__(
        self, scenario: Scenario, render_mode: str | None, *, size_px: int | None = None
    ) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            allowed = ", ".join(RENDER_MODES)
            raise ValueError(f"render_mode is {render_mode!r}; it is None or one of {allowed}")
        self.render_mode = render_mode
        self._scenario = scenario
        self._size_px = size_px or (_WINDOW_PX if render_mode == "human" else _PICTURE_PX)
        self._picture: Picture | None = None
        self._window: Window | None = None
        self._path_m: list[NDArray[np.float64]] = []
        if render_mode == "human":
            self._window = Window(scenario.name, RENDER_FPS)

    @property
    def scenario(self) -> Scenario:
        """The scenario that it draws."""
        return self._scenario

    def clone(self) -> "Screen":
        """A screen for another mission in the same scenario; both share what they draw on."""
        clone = copy(self)
        clone._picture = self._painter().clone()
        clone._path_m = []
        return clone

    def begin(self, scenario: Scenario | None = None) -> None:
        """Forget the paths: a new mission begins.

        Args:
            scenario: What it flies; None: the same as before.
        """
        if scenario is not None:
            self.change(scenario)
        self._path_m.clear()

    def change(self, scenario: Scenario) -> None:
        """Draw this scenario from now on, with the same paths."""
        if scenario is not self._scenario:
            self._scenario, self._picture = scenario, None

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
        if self.render_mode == "rgb_array":
            return self._drawn(swarm)
        if self._window is None:
            self._window = Window(self._scenario.name, RENDER_FPS)
        if not self._window.dismissed:
            self._window.show(self._drawn(swarm))
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _painter(self) -> Picture:
        if self._picture is None:
            self._picture = Picture(self._scenario, size_px=self._size_px)
        return self._picture

    def _drawn(self, swarm: SwarmState) -> NDArray[np.uint8]:
        return self._painter().draw(swarm, paths_m=np.array(self._path_m))

    def __getstate__(self) -> dict[str, Any]:
        # a window cannot travel to another process, and pictures are drawn again in no time
        return {**self.__dict__, "_window": None, "_picture": None}
