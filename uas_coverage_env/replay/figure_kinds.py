"""The kinds of figures of a flight, known without matplotlib."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from uas_coverage_env.flight import Flight

KINDS: Mapping[str, str] = {
    "map": "map:map_figure",
    "battery": "battery:battery_figure",
    "modes": "modes:modes_figure",
    "decision-time": "decision_time:decision_time_figure",
}
"""Kind -> module of `replay.figures`, and function `flight -> Figure` of it."""


def figure_of(kind: str) -> Callable[[Flight], Figure]:
    """What draws a kind (needs the extra `view`)."""
    module, _, function = KINDS[kind].partition(":")
    return getattr(import_module(f"uas_coverage_env.replay.figures.{module}"), function)
