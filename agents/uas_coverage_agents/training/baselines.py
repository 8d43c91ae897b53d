"""Planners that do not learn, beside a learning curve: flown once, on the same missions."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from uas_coverage_agents.training import curve
from uas_coverage_agents.training.checkpoint import CurvePoint
from uas_coverage_agents.training.score import MEASURES, Validation
from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import PlannerSpec
from uas_coverage_env.replay.figures.training import BASELINES
from uas_coverage_env.scenario import Scenario

NO_PLANNER = "none"


def planners_of(names: str) -> list[str]:
    """The planners of `--baselines`.

    Args:
        names: With commas; `none` for none.

    Raises:
        InputError: There is no such planner.
    """
    if names == NO_PLANNER:
        return []
    planners = [name.strip() for name in names.split(",")]
    for name in planners:
        PlannerSpec.named(name, name)
    return planners


def fly_baselines(
    planners: Sequence[str],
    scenarios: Sequence[Scenario],
    directory: Path,
    say: Callable[[str], object],
    validation: Validation,
) -> None:
    """Fly what was not flown before: each leaves a learning curve of one row.

    Args:
        planners: Their names; they fly with their default options and assistants.
        scenarios: Those of the learning curve.
        directory: Of the training.
        say: Told what is flown, and which cannot fly these missions.
        validation: Who flies, and where the flights are kept.
    """
    for name in planners:
        folder = directory / BASELINES / re.sub(r"[/:\\]", "-", name)
        if (folder / curve.TABLE).exists():
            continue
        say(f"flying the {len(scenarios)} missions of the learning curve with {name}")
        try:
            flown = validation.fly(PlannerSpec.named(name, name), scenarios)
        except (InputError, PlannerError) as error:
            say(f"no baseline {name}: {error}")
            continue
        means = dict(zip(MEASURES, flown.mean(axis=0).tolist(), strict=True))
        fields = {key: value for key, value in means.items() if key in CurvePoint.model_fields}
        folder.mkdir(parents=True, exist_ok=True)
        curve.write_table([CurvePoint(steps=0, process_s=0.0, wall_s=0.0, **fields)], folder)
