"""Scores as a table."""

from collections.abc import Mapping

from uas_coverage_env.leaderboard.statistics import Estimate
from uas_coverage_env.tasks.scoring import Score

HEADER = (
    "planner", "score [95 %]", "value", "covered, %", "lost or not home", "energy, %", "return",
    "missions",
)  # fmt: skip


def cells(scores: Mapping[str, Score]) -> list[tuple[str, ...]]:
    """A row for each planner, the best mean value first."""
    ordered = sorted(scores.items(), key=lambda item: -item[1].mean("value"))
    return [
        (
            planner,
            shown(score.score),
            f"{score.mean('value'):.3f}",
            f"{100.0 * score.mean('coverage'):.1f}",
            _missing(score),
            f"{100.0 * score.mean('energy_share'):.1f}",
            f"{score.mean('episode_return'):.1f}",
            f"{len(score.missions)}",
        )
        for planner, score in ordered
    ]


def markdown(scores: Mapping[str, Score]) -> str:
    """The same in Markdown."""
    rows = [HEADER, ("---", *["---:"] * (len(HEADER) - 1)), *cells(scores)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _missing(score: Score) -> str:
    away = sum(mission.n_uas - mission.home for mission in score.missions)
    return f"{away} of {sum(mission.n_uas for mission in score.missions)}"


def shown(estimate: Estimate) -> str:
    """A score with its interval, where there is one."""
    if estimate.value is None:
        return "-"
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.2f}"
    return f"{estimate.value:.2f} [{estimate.low:.2f}, {estimate.high:.2f}]"
