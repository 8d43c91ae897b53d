"""The features that a scenario asks for."""

from collections.abc import Sequence
from typing import Any

from uas_coverage_env.features.feature import MissionFeature, checked_features


def disturbances_of(scenario: Any) -> tuple[MissionFeature, ...]:
    """What the tables of a scenario say that acts on how UAS fly; empty where nothing does.

    Raises:
        ValueError: The table of another package makes no feature, or two have one name.
    """
    return checked_features([each for each in _of_tables(scenario) if each.disturbs])


def features_of(
    scenario: Any, disturbances: Sequence[MissionFeature] | None = None
) -> list[MissionFeature]:
    """What a mission has of what few missions have, but for packs.

    Args:
        scenario: Of the mission.
        disturbances: In place of `disturbances_of`; None: these.

    Raises:
        ValueError: See `disturbances_of`.
    """
    acting = disturbances_of(scenario) if disturbances is None else disturbances
    others = [each for each in _of_tables(scenario) if not each.disturbs]
    of_events = [event.feature for event in scenario.events if event.feature is not None]
    return list(dict.fromkeys([*checked_features(acting), *others, *of_events]))


def _of_tables(scenario: Any) -> list[MissionFeature]:
    return [each for table in scenario.feature_tables for each in table.features()]
