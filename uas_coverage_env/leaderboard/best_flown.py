"""The best flight known of each shipped scenario: what a flight of it can be held against."""

from pathlib import Path

from uas_coverage_env.files.strict_toml import StrictModel, read_toml
from uas_coverage_env.scenario import Scenario, load_scenario, scenario_names

_TABLE = Path(__file__).with_name("best_flown.toml")


class BestFlown(StrictModel):
    """A flight that accomplished its mission without a breach, with the LPV model.

    Attributes:
        planner: Its name; its options were those by default, its seed 0.
        energy_Wh: Of all UAS [Wh].
        steps: Until the last UAS was home.
    """

    planner: str
    energy_Wh: float
    steps: int


class _Table(StrictModel):
    missions: dict[str, BestFlown]


def best_flown(scenario: Scenario) -> BestFlown | None:
    """The flight of a scenario with the least energy that is known; None where none is.

    A scenario that was changed is another one, whatever its name.
    """
    if scenario.name not in scenario_names() or scenario != load_scenario(scenario.name):
        return None
    return read_toml(_TABLE, _Table).missions.get(scenario.name)
