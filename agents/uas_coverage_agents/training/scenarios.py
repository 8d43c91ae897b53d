"""Generated towns that a policy is validated on."""

from uas_coverage_agents.policy.description import ScenarioFamily, Towns
from uas_coverage_env.scenario import Scenario, load_scenario, sample_scenario

VALIDATION = Towns(first_seed=900_000, n_uas=(1, 4), n_waypoints=(20, 60), n_obstacles=(5, 20))
"""What learners are validated on; nothing is trained on these seeds."""


def town(towns: Towns, number: int) -> Scenario:
    """One of the towns: seed `first_seed + number` draws the counts, then the town itself."""
    return sample_scenario(
        towns.first_seed + number, towns.n_uas, towns.n_waypoints, towns.n_obstacles
    )


def validation_scenarios(family: ScenarioFamily, count: int) -> list[Scenario]:
    """What a policy of a family is validated on: unseen towns, or the one scenario itself."""
    if family.towns is None:
        return [load_scenario(family.name)]
    seen = family.towns.model_copy(update={"first_seed": VALIDATION.first_seed})
    return [town(seen, number) for number in range(count)]
