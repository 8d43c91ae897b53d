"""Missions of a level flown side by side: what a policy scores, in the time of a few."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import LANDED, LOST
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.api.forms import shown
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.report import COVERED, ENERGY, FIRST_TERM, STATUS
from uas_coverage_env.env.versions import Version
from uas_coverage_env.flight.metrics import covered_share, share_of_available
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.world import visits_to_come

BatchPolicy = Callable[[Any], Any]
"""From observations (N, …) of N UAS, or swarms, to N actions."""


class BatchedPolicy(NamedTuple):
    """What a planner that is a policy offers as `in_batch`, where it answers many rows at once.

    Attributes:
        policy: See `BatchPolicy`.
        swarm_of: It is one for whole swarms of so many UAS; None: for one UAS.
        version: Of the environments that it belongs to.
        chosen: Its choice of the settings of a level, see `Task.settings`.
    """

    policy: BatchPolicy
    swarm_of: int | None
    version: Version
    chosen: Mapping[str, Any]

    @classmethod
    def of(
        cls, policy: BatchPolicy, keywords: Mapping[str, Any], swarm_of: int | None = None
    ) -> Self:
        """One that was learned in the environments of these keyword arguments."""
        names = ("action", "observation", "mask_in_observation", "images_apart")
        chosen = {name: keywords[name] for name in names if name in keywords}
        return cls(policy, swarm_of, MissionSettings.of(keywords).version, chosen)


def flown_in_batches(
    policy: BatchPolicy,
    missions: Mapping[int, Scenario],
    settings: Mapping[str, Any],
    batch: int,
    swarm_of: int | None,
) -> Iterator[tuple[int, dict[str, bool | int | float | None]]]:
    """Fly missions by a policy, many at once.

    Args:
        policy: See `BatchPolicy`.
        missions: By their seeds, which are the seeds of what disturbances draw, too.
        settings: Of the environments.
        batch: How many missions fly side by side; neither this nor the others in a batch change
            what becomes of a mission, as long as the policy answers each row by itself.
        swarm_of: The policy is one for whole swarms of so many UAS; None: for one UAS.

    Yields:
        The seed of a mission, and those figures of a flight that a batch knows.

    Raises:
        ValueError: An action is invalid; names it.
    """
    for first in range(0, len(missions), batch):
        seeds = list(missions)[first : first + batch]
        scenarios = [missions[seed] for seed in seeds]
        flown = CoverageBatch(len(seeds), scenarios, autoreset="rest", **settings)
        yield from zip(seeds, _flown(flown, policy, seeds, scenarios, swarm_of), strict=True)


def _flown(
    batch: CoverageBatch,
    policy: BatchPolicy,
    seeds: Sequence[int],
    scenarios: Sequence[Scenario],
    swarm_of: int | None,
) -> Iterator[dict[str, bool | int | float | None]]:
    n, lanes, learners = len(scenarios), batch.lanes, batch.learners
    batch.reset(seeds, scenarios=np.arange(n))
    terms = np.zeros((n, len(batch.settings.reward)))
    steps = np.zeros(n, np.int64)
    while True:
        flies = ~(lanes.terminated | lanes.truncated)
        if not flies.any():
            break
        steps += flies
        batch.step(_actions(batch, policy, flies, swarm_of))
        # in the order in which a flight adds them up: equal to the last digit
        for i in range(batch.n_uas):
            terms += learners.amounts[:, i, FIRST_TERM:]
    for lane, scenario in enumerate(scenarios):
        report = learners.report[lane, : len(scenario.uas)]
        energy_Wh = float(learners.amounts[lane, : len(scenario.uas), ENERGY].sum())
        home = int((report[:, STATUS] == LANDED).sum())
        left = visits_to_come(batch.scenario_of(lane), batch.state_of(lane))
        yield {
            "coverage": covered_share(int(report[0, COVERED]), left),
            "steps": int(steps[lane]),
            "energy_Wh": energy_Wh,
            "energy_share": share_of_available(energy_Wh, scenario),
            "episode_return": float(sum(terms[lane].tolist())),
            "all_home": home == len(report),
            "n_uas": len(report),
            "home": home,
            "lost": int((report[:, STATUS] == LOST).sum()),
        }


def _actions(
    batch: CoverageBatch, policy: BatchPolicy, flies: NDArray[np.bool_], swarm_of: int | None
) -> NDArray[Any]:
    """The actions of all lanes: the policy is asked once, for all that fly."""
    settings, seen = batch.settings, batch.observation
    asked = np.zeros(batch.learners.asked.shape)
    masks = batch.action_masks() if settings.mask_in_observation else None
    if swarm_of is None:
        acts = batch.deciding
        told = shown(settings, seen[acts], None if masks is None else masks[acts])
        asked[acts] = np.asarray(policy(told)).reshape(-1, asked.shape[2])
    else:
        rows = _for_swarms(seen[flies], swarm_of)
        masks = None if masks is None else _for_swarms(masks[flies], swarm_of)
        given = np.asarray(policy(shown(settings, rows, masks, swarm_of)))
        asked[flies] = given.reshape(len(rows), swarm_of, -1)[:, : batch.n_uas]
    return asked.astype(np.int64)[..., 0] if batch.chooses else asked


def _for_swarms(rows: NDArray[Any], n_uas: int) -> NDArray[Any]:
    """(N, n_uas · size) rows of N swarms with room for more UAS than they have."""
    room = n_uas - rows.shape[1]
    return np.pad(rows, ((0, 0), (0, room), (0, 0))).reshape(len(rows), -1)
