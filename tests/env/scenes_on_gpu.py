"""Scenes that change on numba's simulated GPU, and the same as episodes: see `simulated_gpu`."""

import numpy as np
from beside_episodes import compare
from changing_missions import AGAIN, EVENTS, STEPS, mission

# guidance, which brings UAS home, does not run there
EVERY_KIND = tuple(
    {**event, "then": "hover"} if event.get("then") == "return" else event for event in EVENTS
)
EVERYTHING = mission(*EVERY_KIND, relaunch=True, **AGAIN)


def compare_all():
    """All kinds of events at once, and waypoints that are asked for again."""
    return {
        "all": compare(EVERYTHING, np.full((2, 3), 0.2), STEPS + 8),
        "again": compare(
            mission(relaunch=True, **AGAIN), np.full((2, 4), 0.0), STEPS + 8, action="wrench"
        ),
    }
