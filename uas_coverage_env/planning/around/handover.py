"""Which UAS have waypoints, and which leave theirs to the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import SwarmState

BoolArray = NDArray[np.bool_]

SILENT_S = 5.0
"""A UAS that takes no commands for so long leaves its waypoints to the others [s]."""


class Handover:
    """The rule by which waypoints change hands.

    A UAS works while it flies and takes commands. One that takes none, without its radio or before
    a late start, works on for `SILENT_S`, so that a short gap upsets no plan; then its waypoints
    are those of the others, until it takes commands again. Where none takes any, all work on:
    there is none to hand over to.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._dt_s = brief.dt_s
        self._heard_at = np.zeros(len(brief.uas), np.int64)

    def workers(self, swarm: SwarmState) -> BoolArray:
        """(U,) UAS that may be given waypoints; to be called once per sample.

        Args:
            swarm: What is seen.
        """
        works = self.at_work(swarm)
        return works if works.any() else swarm.status == FLYING

    def at_work(self, swarm: SwarmState) -> BoolArray:
        """(U,) UAS that fly and take commands, if any; likewise once per sample, instead.

        Args:
            swarm: What is seen.
        """
        self._heard_at[swarm.responds] = swarm.step
        flies = swarm.status == FLYING
        return flies & (self._dt_s * (swarm.step - self._heard_at) < SILENT_S)


def without(swarm: SwarmState, uas: BoolArray) -> SwarmState:
    """What is seen, some UAS out of the mission as if they had landed for good.

    `away` says that they fly nevertheless, and have to be kept clear of.

    Args:
        swarm: What is seen.
        uas: (U,) those.
    """
    if not uas.any():
        return swarm
    packs_left = np.where(uas, 0, swarm.packs_left) if len(swarm.packs_left) else swarm.packs_left
    status, away = np.where(uas, LANDED, swarm.status), uas | away_of(swarm)
    return replace(swarm, status=status, away=away, packs_left=packs_left)


def away_of(swarm: SwarmState) -> BoolArray:
    """(U,) UAS that fly without a part in the mission."""
    return swarm.away if len(swarm.away) else np.zeros(len(swarm.status), np.bool_)
