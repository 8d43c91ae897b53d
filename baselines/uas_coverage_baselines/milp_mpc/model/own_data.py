"""Data that blocks bring themselves: what a block of a user knows of the mission and of now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from uas_coverage_baselines.milp_mpc.model.ocp import Block, Informed
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, name_of
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import SwarmState


def with_data(
    problem: PlanningProblem, blocks: Sequence[Block], brief: MissionBrief, swarm: SwarmState
) -> PlanningProblem:
    """The decision with what its blocks bring to it.

    Args:
        problem: the decision.
        blocks: of the OCP; those with a method `data` are asked.
        brief: the mission.
        swarm: what is seen now.

    Raises:
        InputError: a block gives no mapping, or two blocks have one name; one line.
    """
    data: dict[str, Mapping[str, object]] = {}
    for block in blocks:
        if not (isinstance(block, Informed) and callable(block.data)):
            continue
        name, own = name_of(block), block.data(brief, swarm)
        if not isinstance(own, Mapping):
            raise InputError(f"block {name}: data(brief, swarm) gives {own!r}; return a mapping")
        if name in data:
            raise InputError(f"two blocks are called {name}: give one an attribute `name`")
        data[name] = own
    return replace(problem, data=data) if data else problem
