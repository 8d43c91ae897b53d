"""What `run --watch` opens where there is a display: the flight as it is planned, in a window."""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import Picture
from uas_coverage_env.draw.window import Window
from uas_coverage_env.flight import Planner, Progress
from uas_coverage_env.scenario import Scenario

_FPS = 20
_SIZE_PX = 720


class FlightWindow:
    """The paths flown and what the planner predicts, in every step.

    Args:
        scenario: The scenario flown.
        planner: Its `last_decision` is drawn, where it has one.

    Raises:
        ImportError: pygame-ce is not installed.
        NoDisplayError: There is no display.
    """

    def __init__(self, scenario: Scenario, planner: Planner) -> None:
        self._planner = planner
        self._path_m: list[NDArray[np.float64]] = []
        self._window = Window(scenario.name, _FPS)
        self._window.open((_SIZE_PX, _SIZE_PX))
        self._scenario, self._picture = scenario, Picture(scenario, size_px=_SIZE_PX)

    def __call__(self, progress: Progress) -> None:
        """Show where the flight stands; waits while a person has paused it."""
        swarm = progress.swarm
        self._path_m.append(swarm.x[:, :3].copy())
        if self._window.dismissed:
            return
        if progress.scenario is not self._scenario:  # an event has changed it
            self._scenario = progress.scenario
            self._picture = Picture(progress.scenario, size_px=_SIZE_PX)
        # before the first decision it is that of another flight
        decided = progress.decision_time_s is not None
        decision = getattr(self._planner, "last_decision", None) if decided else None
        self._window.show(
            self._picture.draw(
                swarm,
                paths_m=np.array(self._path_m),
                planned_m=decision.predicted_m if decision is not None else None,
            )
        )

    def stay(self) -> None:
        """Show the end until a person closes the window, or stops the program."""
        with suppress(KeyboardInterrupt):
            self._window.stay()

    def close(self) -> None:
        """Close the window; closing it twice does no harm."""
        self._window.close()
