"""Recorded flights of ArduCopter's simulator, beside the model of how an autopilot flies files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations import LocalFrame
from uas_coverage_env.planning.execution.leg_model import Autopilot, Followed, follow
from uas_coverage_env.scenario import Place

FOLDER = Path(__file__).parents[1] / "tests" / "operations" / "recorded"
NAMES = sorted(path.name.removesuffix("_items.csv") for path in FOLDER.glob("*_items.csv"))
ORIGIN = LocalFrame(Place(latitude_deg=60.525, longitude_deg=26.947))
_CHANGE_SPEED = "178"


def modelled(name: str) -> tuple[Followed, NDArray[np.float64]]:
    """How the model flies the file of a recorded flight, and its (N, 3) corners [m]."""
    corners, speeds, now = [], [], 10.0
    for command, speed, *place in rows_of(f"{name}_items.csv"):
        if command == _CHANGE_SPEED:
            now = float(speed)
        else:
            corners.append(ORIGIN.to_ned(*map(float, place)))
            speeds.append(now)
    holds = [0.0] * (len(corners) - 1)
    return follow(corners, speeds[1:], holds, Autopilot(up_mps=3.0)), np.array(corners)


def recorded(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N,) seconds since the command to take off and (N, 3) where the vehicle was [m]."""
    rows = np.array(rows_of(f"{name}_flown.csv"), float)
    return rows[:, 0], ORIGIN.to_ned(*rows[:, 1:].T)


def rows_of(name: str) -> list[list[str]]:
    """The rows of one of the recorded tables, without its head."""
    with (FOLDER / name).open(newline="") as file:
        return list(csv.reader(file))[1:]
