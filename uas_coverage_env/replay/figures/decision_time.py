"""How long the planner took for each decision, over time and as a distribution."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.replay.figures.style import printed, shade, width_in

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_MILLISECONDS_BELOW_S = 0.1
_WIDE_IN = 4.5
_OFF_SCALE = 1.3
"""Times the longest of the others, from which on the first decision does not set the axis."""


def decision_time_figure(flight: Flight) -> Figure:
    """Each decision's time at its step, and the share of decisions that are faster.

    Raises:
        InputError: The flight holds no decision.
    """
    if not flight.decisions:
        raise InputError("the flight holds no decision: it ended before the first step")
    durations_s = np.array([decision.duration_s for decision in flight.decisions])
    fallback = np.array([decision.fallback for decision in flight.decisions])
    # the first often plans the whole mission: it is told in words where it would set the axis
    later_s = durations_s[1:].max() if len(durations_s) > 1 else durations_s[0]
    fast = later_s < _MILLISECONDS_BELOW_S
    unit, scale = ("ms", 1e3) if fast else ("s", 1.0)
    times_s = flight.time_s[: len(durations_s)]
    given = flight.planner_options.get("time_limit_s")
    limit_s = float(given) if isinstance(given, int | float) and np.isfinite(given) else 0.0
    with printed():
        wide = width_in() >= _WIDE_IN
        figure = Figure(figsize=(width_in(), 2.7 if wide else 4.4), layout="constrained")
        if wide:
            series, shares = figure.subplots(1, 2, width_ratios=[1.4, 1.0], sharey=True)
        else:
            series, shares = figure.subplots(2, 1, sharey=True)
            shares.set_ylabel(f"Decision time, {unit}")
        _draw_series(series, times_s, scale * durations_s, fallback)
        series.set(xlabel="Time of flight, s", ylabel=f"Decision time, {unit}")
        _draw_shares(shares, np.sort(scale * durations_s))
        if limit_s > 0.0:
            for axes in (series, shares):
                axes.axhline(scale * limit_s, color=shade(colours.RED), linewidth=0.8, ls=":")
            place = {"xycoords": ("axes fraction", "data"), "xytext": (-2, 3), "ha": "right"}
            _say(series, "limit", (1.0, scale * limit_s), **place)
        off_scale = durations_s[0] > _OFF_SCALE * later_s
        shown_s = later_s if off_scale else durations_s.max()
        series.set_ylim(bottom=0, top=1.12 * scale * max(float(shown_s), limit_s))
        if off_scale:
            words = f"first: {three_digits(scale * durations_s[0])} {unit} ↑"
            _say(series, words, (0.0, 1.0), xycoords="axes fraction", xytext=(6, -9))
    return figure


def _draw_series(axes: Axes, times_s: FloatArray, times: FloatArray, fallback: BoolArray) -> None:
    ink = shade(colours.BLUE)
    axes.plot(times_s, times, color=ink, linewidth=0.6, alpha=0.5)
    axes.plot(times_s, times, "o", color=ink, markersize=2.2)
    if fallback.any():
        label = f"on a fallback ({fallback.sum()})"
        ink = shade(colours.VERMILLION)
        axes.plot(times_s[fallback], times[fallback], "x", color=ink, label=label)
        axes.legend(loc="lower left")


def _draw_shares(axes: Axes, ordered: FloatArray) -> None:
    ink = shade(colours.BLUE)
    axes.plot(np.arange(1, len(ordered) + 1) / len(ordered), ordered, color=ink)
    for percent in (50, 99):
        value = float(np.percentile(ordered, percent))
        axes.plot(percent / 100, value, "o", color=ink, markersize=3.5)
        place = percent / 100, value
        _say(axes, f"{percent} %: {three_digits(value)}", place, xytext=(-6, 5), ha="right")
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set(xlabel="Share of decisions", xlim=(0, 1.02))


def _say(axes: Axes, words: str, place: tuple[float, float], **how: Any) -> None:
    """Words beside a place, by so many points."""
    axes.annotate(words, place, textcoords="offset points", fontsize=8, **how)
