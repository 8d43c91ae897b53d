"""The figures of a flight, each declared once: what a flight is in numbers.

`FIGURES` decides what `summary.json` holds, what `show` prints, what a row of `compare` and an
episode of `evaluate` have, which columns their tables have, and what the docs say of them. A new
figure is one `Figure`, here or in an installed package that names it in the entry points
`uas_coverage.figures`:

    CLOSEST = Figure("home_distance_m", float, distance, "from home at the end, the farthest UAS")
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from functools import lru_cache
from operator import attrgetter
from typing import Any

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import metrics
from uas_coverage_env.flight.figure import Figure, FigureError
from uas_coverage_env.flight.record import FlightRecord
from uas_coverage_env.flight.seen import seen_shares
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described

_BESIDE = ("failed_figures", "versions", "seed", "planner")
"""Keys of `summary.json` that are no figures."""

GROUP = "uas_coverage.figures"
"""Entry points: each is a `Figure`."""


class FlightFigures(Mapping[str, Any]):
    """The figures of one flight by name, each computed when it is asked for.

    Looking one up raises a `FigureError` where it cannot be computed.
    """

    def __init__(self, flight: FlightRecord) -> None:
        self._flight = flight

    def __getitem__(self, name: str) -> Any:
        return figures()[name].computed(self._flight)

    def __iter__(self) -> Iterator[str]:
        return iter(figures())

    def __len__(self) -> int:
        return len(figures())


def figures() -> Mapping[str, Figure]:
    """Every figure by name: ours, then those of installed packages.

    Raises:
        InputError: A package names one that cannot be loaded, or has the name of another.
    """
    return _figures(entry_points(GROUP))


@lru_cache(maxsize=1)
def _figures(installed: tuple[Any, ...]) -> Mapping[str, Figure]:
    found = {figure.name: figure for figure in FIGURES}
    for point in installed:
        where = f"entry point {point.name} = {point.value} of {GROUP}"
        try:
            figure = point.load()
        except Exception as error:
            raise InputError(f"{where}: cannot be loaded: {described(error)}") from error
        if not isinstance(figure, Figure):
            raise InputError(f"{where}: is a {type(figure).__name__}; name a Figure")
        keys = {*_BESIDE, *(each.key_in_file for each in found.values())}
        if figure.name in found or figure.key_in_file in keys - {""}:
            raise InputError(f"{where}: there is a figure {figure.name!r} already; rename it")
        found[figure.name] = figure
    return found


def computed(flight: FlightRecord) -> tuple[dict[str, Any], dict[str, str]]:
    """All figures of a flight, and why some could not be computed: these are None.

    A flight is kept, and compared, also where one of its figures fails.
    """
    values: dict[str, Any] = {}
    failed: dict[str, str] = {}
    for name, figure in figures().items():
        try:
            values[name] = figure.computed(flight)
        except FigureError as error:
            values[name], failed[name] = None, str(error)
    return values, failed


def repeated() -> list[str]:
    """The names of those in rows that a repeatable flight repeats."""
    return [name for name, figure in figures().items() if figure.in_rows and figure.repeats]


def rows_part(values: Mapping[str, Any] | None) -> dict[str, Any]:
    """Of figures as they are computed, what rows hold; None: of a flight that failed."""
    return {
        name: figure.in_row(None if values is None else values[name])
        for name, figure in figures().items()
        if figure.in_rows
    }


def summary(flight: FlightRecord) -> dict[str, Any]:
    """What `summary.json` holds: keys in the order of the figures, then what was flown by what.

    Where figures could not be computed they are null, and `failed_figures` says why.
    """
    values, failed = computed(flight)
    result = {}
    for name, figure in figures().items():
        key, value = figure.key_in_file, values[name]
        if key and not (figure.optional and value is None and name not in failed):
            result[key] = value
    return {
        **result,
        **({"failed_figures": failed} if failed else {}),
        "versions": dict(flight.versions),
        "seed": flight.seed,
        "planner": {"name": flight.planner, "options": dict(flight.planner_options)},
    }


def printed(flight: FlightRecord) -> dict[str, str]:
    """The figures of a flight as a person reads them, by heading."""
    values, failed = computed(flight)
    result = {}
    for name, figure in figures().items():
        if figure.shown:
            try:
                text = "failed" if name in failed else figure.printed(values[name])
            except Exception as error:  # of a text of a user's own
                text = f"cannot be printed: {described(error)}"
            result[figure.label] = text
    return result


def _entries(field: str) -> Callable[[FlightRecord], list[Any] | None]:
    """What happened, as the file has it; None where nothing did."""
    return lambda flight: [each.entry() for each in getattr(flight, field)] or None


def _of_log(field: str) -> Callable[[FlightRecord], list[Any] | None]:
    def entries(flight: FlightRecord) -> list[Any] | None:
        if flight.of_log is None:
            return None
        return [asdict(each) for each in getattr(flight.of_log, field)]

    return entries


def _parts(form: Callable[[Any], str]) -> Callable[[Mapping[str, Any]], str]:
    """Values by name, in a line."""
    return lambda values: ", ".join(f"{name} {form(value)}" for name, value in values.items())


def _percentile(field: str, name: str) -> Callable[[FlightRecord], float | None]:
    return lambda flight: metrics.percentiles(flight, field)[name]


def _when_swapped(of: Callable[[FlightRecord], Any]) -> Callable[[FlightRecord], Any]:
    return lambda flight: of(flight) if flight.swaps else None


_WALL, _PROCESSOR = "duration_s", "processor_s"

FIGURES = (
    Figure("accomplished", bool, metrics.accomplished,
           "everything covered, every UAS home, no [violation](rules.md)",
           over="total", table="outcome", absent=False),
    Figure("coverage", float, metrics.coverage,
           "share of the waypoints covered, 0 to 1; [events](faults.md) may add and drop some",
           "covered", "%", 1, absent=0.0, counts="all", table="outcome"),
    Figure("seen_ground", dict, lambda flight: seen_shares(flight) or None,
           "sensor → share of the ground that it has [seen](from_area_to_flight.md#seen-ground); "
           "absent unless a UAS carries a camera",
           "ground seen", text=_parts("{:.1%}".format), optional=True),
    Figure("steps", int, attrgetter("steps"),
           "until the last UAS is home, lost, or the run ends", digits=1, counts="accomplished"),
    Figure("energy_Wh", float, metrics.total_energy_Wh,
           "sum over samples of voltage × current × dt", counts="unharmed"),
    Figure("energy_share", float, metrics.energy_share,
           "of the energy that all batteries may give", "energy of the batteries", digits=1,
           counts="unharmed", table=""),
    Figure("ground_phases", list, metrics.ground_phases,
           "of each UAS seconds and Wh of take-off and landing, which lie outside of the samples "
           "and are not in `energy_Wh`, and the charge on the ground afterwards; absent unless the "
           "scenario says `from_ground`", optional=True, shown=False),
    Figure("packs", dict, _when_swapped(metrics.packs_used),
           "UAS → battery packs that it has flown with; absent where no UAS "
           "[swapped packs on its own](rules.md#swapping-packs)",
           "packs used", text=_parts(str), optional=True),
    Figure("swaps", list, _entries("swaps"),
           "of packs, in order of time: `t_s`, the sample from which it flies with the fresh one, "
           "`uas`, and `landed_s`; likewise",
           optional=True, counted=True, absent=0, over="total", table=""),
    Figure("min_soc_share", float, metrics.min_soc,
           "least charge of any battery, 0 to 1", "least charge left", digits=1, over="least",
           table=""),
    Figure("episode_return", float, metrics.episode_return,
           "sum of the rewards of all steps and UAS, not discounted; absent where there is no "
           "`rewards.csv`", "return", digits=1, key="return", optional=True, table="outcome"),
    Figure("reward_terms", dict, lambda flight: metrics.reward_sums(flight) or None,
           "the parts of it; likewise", optional=True, shown=False),
    Figure("estimated", list, _of_log("estimates"),
           "of a flight from logs, what was not measured: `uas`, `what` (charge, current, voltage, "
           "height, position, attitude, flight), `how`; absent of other flights",
           optional=True, shown=False),
    Figure("not_known", list, _of_log("unknown"),
           "likewise, when it is not known where a UAS was and nothing is judged: `uas`, `from_s`, "
           "`to_s`, `why`", optional=True, shown=False),
    Figure("all_home", bool, metrics.all_home, "whether every UAS has landed",
           over="total", table="outcome", absent=False),
    Figure("not_home", list, metrics.not_home, "names of those that have not; absent where all are",
           text=metrics.named, optional=True),
    Figure("n_uas", int, lambda flight: len(flight.names), "UAS of the mission", "UAS",
           over="total", absent=0, table=""),
    Figure("flew", int, metrics.flew, "UAS that have left their starts by more than 1 m",
           "UAS that flew", over="median", absent=0, table=""),
    Figure("home", int, metrics.n_home, "UAS that have landed", over="total", absent=0,
           shown=False, table=""),
    Figure("lost", int, metrics.n_lost, "UAS that were lost", over="total", absent=0, table=""),
    Figure("min_separation_m", float, attrgetter("min_separation_m"),
           "smallest distance between two flying UAS; null where there were never two",
           "least separation of UAS", over="least", table=""),
    Figure("min_obstacle_clearance_m", float, attrgetter("min_obstacle_clearance_m"),
           "smallest clearance from any obstacle; null where there is none",
           "least clearance of obstacles", over="least", table=""),
    Figure("violations", list, lambda flight: [each.entry() for each in flight.violations],
           "[contacts](rules.md): `t_s`, `uas`, `kind`, `with`; and "
           "[limits of the vehicle](rules.md) exceeded, one entry for each UAS and limit: `t_s` of "
           "the first sample, `uas`, `kind` = `limit`, `with` = which, `value` at the worst, "
           "`limit`, and at how many `samples`",
           counted=True, absent=0, over="total", table="outcome"),
    Figure("events", list, _entries("events"),
           "[what happened](faults.md): `t_s`, `kind`, `uas`; absent where nothing did",
           optional=True),
    Figure("left_open", list, _entries("left_open"),
           "waypoints left open: `waypoint`, its index; [`why`](#left-open); `detail`, with names "
           "and figures; absent where everything is covered, and of logs",
           text=metrics.reasons_left_open, optional=True),
    Figure("breaches", int, attrgetter("breaches"),
           "samples closer than the safe distances, or below the least height; landings with less "
           "charge than the reserve",
           absent=0, over="total", table="outcome"),
    Figure("height_breaches", int, metrics.height_breaches,
           "how many of these are below the least height; absent where the scenario has none",
           "of them too low", optional=True, absent=0, over="total", table=""),
    Figure("reserve_breaches", int, metrics.reserve_breaches,
           "how many are landings below the [reserve](rules.md#reserve); absent where the scenario "
           "has none",
           "of them below the reserve", optional=True, absent=0, over="total", table=""),
    Figure("wall_time_s", float, attrgetter("wall_time_s"),
           "what the flight took to compute, without compilation", shown=False, table="",
           repeats=False),
    Figure("decision_time_s", dict, lambda flight: metrics.percentiles(flight, _WALL),
           "`p50`, `p95`, `p99`, `max` of the time of a decision", shown=False),
    Figure("decision_processor_s", dict, metrics.processor_time_s,
           "the same of its processor time, all threads added; absent of flights of versions "
           "before", optional=True, shown=False),
    Figure("decisions", int, lambda flight: len(flight.decisions), "of the planner, one a step",
           over="total", absent=0, key="", table=""),
    Figure("decision_p50_s", float, _percentile(_WALL, "p50"), "median time of a decision",
           "decision p50", "ms", over="median", key="", repeats=False),
    Figure("decision_p95_s", float, _percentile(_WALL, "p95"), "95th percentile",
           "decision p95", "ms", over="most", key="", repeats=False),
    Figure("decision_max_s", float, _percentile(_WALL, "max"), "longest decision",
           "decision max", "ms", over="most", key="", repeats=False, table=""),
    Figure("processor_p50_s", float, _percentile(_PROCESSOR, "p50"),
           "median processor time of a decision, all threads added",
           "processor p50", "ms", over="median", key="", repeats=False),
    Figure("processor_p95_s", float, _percentile(_PROCESSOR, "p95"), "95th percentile",
           "processor p95", "ms", over="most", key="", repeats=False),
    Figure("fallbacks", int, metrics.n_fallbacks, "decisions flown on a fallback",
           absent=0, over="total", table="outcome"),
    Figure("fallback_reasons", dict, lambda flight: metrics.fallback_reasons(flight) or None,
           "why there were fallbacks → how many; absent where there were none",
           text=lambda reasons: ", ".join(f"{n} {why}" for why, n in reasons.items()),
           optional=True),
    Figure("flown_by", dict, lambda flight: metrics.flown_by(flight) or None,
           "who flew in place of the planner → in which share of the decisions: another planner, "
           "the world's `guidance`, or `legs` of an autopilot; absent where the planner flew alone",
           text=_parts("{:.0%}".format), optional=True),
    Figure("by_others_share", float, metrics.by_others_share,
           "share of the decisions in which any of them did", "flown by others", digits=1,
           key="", shown=False, absent=0.0, over="average", table="outcome"),
    Figure("filtered_share", float,
           lambda flight: metrics.filtered_share(flight) if flight.safety_filter else None,
           "share of the commands that the safety filter replaced; absent where it is off",
           "filtered", digits=1, optional=True, absent=0.0, over="average",
           table="outcome"),
    Figure("mip_gap_p50", float, metrics.mip_gap_p50,
           "median gap of the joint program, relative to what the plan can influence; null where "
           "none was solved", "gap of the joint program", "%", 1, table=""),
)  # fmt: skip
"""In the order of the file and of `show`."""
