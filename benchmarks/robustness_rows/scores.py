"""R12: the shipped policies on the missions that their published scores are from."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import uas_coverage_agents.velocity.planner as velocity
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training.scenarios import validation_scenarios
from uas_coverage_agents.training.score import MEASURES, fly

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown

POLICIES = {"learned-velocity": velocity.SHIPPED}
_SHOWN = ("coverage", "all_home", "violations", "energy_Wh", "flight_steps")


def mission(name: str, number: int) -> Result:
    """One validation mission, the network alone, and what is published as the mean of all."""
    policy = load_policy(POLICIES[name])
    town = validation_scenarios(policy.description.scenarios, number + 1)[-1]
    measured = dict(zip(MEASURES, fly(policy, [town])[0].tolist(), strict=True))
    published = policy.description.score
    assert published is not None
    return {
        "policy": name,
        "measured": measured,
        "published": {key: published.measures[key].mean for key in _SHOWN},
        "missions": published.missions,
    }


def trials(quick: bool) -> list[Trial]:
    """The first missions of each, or as many as were published."""
    published = {"learned-velocity": 40}
    return [
        Trial(f"{name} {number}", mission, (name, number))
        for name in POLICIES
        for number in range(6 if quick else published[name])
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """Means beside the published ones; a mission fails that is not accomplished."""
    cells: dict[str, list[Result]] = defaultdict(list)
    for result in results.values():
        if "error" not in result:
            cells[result["policy"]].append(result)
    rows, failed = [], len(errors(results))
    for name, flown in cells.items():
        means = {key: sum(one["measured"][key] for one in flown) / len(flown) for key in MEASURES}
        published = flown[0]["published"]
        rows.append(
            [f"`{name}`", f"{len(flown)} of {flown[0]['missions']}"]
            + [f"{means[key]:.4g} ({published[key]:.4g})" for key in _SHOWN]
        )
        failed += sum(
            one["measured"]["coverage"] < 1.0
            or one["measured"]["all_home"] < 1.0
            or one["measured"]["violations"] > 0.0
            for one in flown
        )
    headings = ("policy", "missions", *(f"{key} (published)" for key in _SHOWN))
    return Finding(len(results), failed, markdown(headings, rows))


ROW = Row(
    "R12",
    "Published scores",
    "missions",
    "everything covered, all home and no violation on the missions of the published score, which "
    "says so of all of them",
    trials,
    finding,
    lambda quick: "the validation missions of the policies, in their order",
    "Where fewer missions are flown than were published, a comparison of the means.",
)
