"""The figures of docs/from_area_to_flight.md, area_methods.md and sorties.md, in one table.

    python benchmarks/area_to_flight.py
    python benchmarks/area_to_flight.py --quick    # a minute of processor time, fewer of everything
    python benchmarks/area_to_flight.py --parts frame,recorded

| part | what is measured |
|---|---|
| `frame` | local metres of places up to 5 km from the origin, beside geodesics |
| `exports` | exported corners, read back by MAVSDK and pymavlink (`exports.py`) |
| `recorded` | times of recorded flights, beside the leg model |
| `promise` | times of files, beside those of flights planned with `--flown-by` (`flown_by.py`) |
| `town` | the shipped town from several take-off places, flown by planners |
| `patrol` | the same, each waypoint asked for again twice, after 180 s each time |
| `sorties` | towns larger than one charge (`sorties.py`) |

Figures are medians (ranges). Exits 0 where all that is claimed is kept, 1 otherwise. Needs the
extras `ops` and `test`.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Annotated, NamedTuple

import exports
import flown_by
import numpy as np
import sorties
import typer
from geographiclib.geodesic import Geodesic
from mavlink_vehicle import Bench
from recorded_flights import NAMES, modelled, recorded

from uas_coverage_env import Scenario, generate_scenario
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import ImportOptions, LocalFrame, make_scenario, read_drawings

PLANNERS = ("nearest-waypoint", "lawnmower", "tour", "trajectory")
TOWN = Path("karhula")
HOME_DEG = 60.5269, 26.9456
"""The take-off place of the shipped drawing."""


class Row(NamedTuple):
    """A line of the table.

    Attributes:
        what: Was measured.
        found: The figures.
        claim: What is claimed of them; empty: nothing.
        kept: Whether they keep it.
    """

    what: str
    found: str
    claim: str = ""
    kept: bool = True


def frame(quick: bool) -> Iterator[Row]:
    """Places and distances of the local metres."""
    rng, pairs, worst_m = np.random.default_rng(0), 200 if quick else 5_000, 0.0
    for number in range(pairs):
        place = exports.place_of(number, rng)
        local, ends = LocalFrame(place), []
        for away_m, bearing in zip(rng.uniform(0, 5e3, 2), rng.uniform(-180, 180, 2), strict=True):
            end = Geodesic.WGS84.Direct(place.latitude_deg, place.longitude_deg, bearing, away_m)
            ends.append((end["lat2"], end["lon2"]))
        (lat1, lon1), (lat2, lon2) = ends
        apart_m = Geodesic.WGS84.Inverse(lat1, lon1, lat2, lon2)["s12"]
        north_m, east_m, _ = local.to_ned(lat1, lon1) - local.to_ned(lat2, lon2)
        worst_m = max(worst_m, abs(float(np.hypot(north_m, east_m)) - apart_m))
    what = f"distances of places up to 5 km from the origin, {pairs} pairs all over the Earth"
    yield Row(what, f"off by at most {1e3 * worst_m:.2f} mm", "below 1 cm", worst_m < 0.01)


def read_back(quick: bool) -> Iterator[Row]:
    """Corners of exports."""
    missions, bench, rng = 10 if quick else 500, Bench(), np.random.default_rng(0)
    try:
        with tempfile.TemporaryDirectory() as folder:
            found = [exports.check(n, bench, Path(folder), rng) for n in range(missions)]
    finally:
        bench.close()
    corners, worst_m = sum(row[0] for row in found), max(max(row[1:]) for row in found)
    yield Row(
        f"{corners} corners of {missions} exports, read by MAVSDK and pymavlink",
        f"off by at most {100 * worst_m:.2f} cm",
        "within 1 cm",
        worst_m <= exports.MOST_OFF_M,
    )


def leg_model(quick: bool) -> Iterator[Row]:
    """Times of recorded flights; all four take seconds."""
    off = [modelled(name)[0].duration_s / recorded(name)[0][-1] - 1.0 for name in NAMES]
    kept = len(off) == 4 and max(map(abs, off)) <= 0.10
    yield Row("leg model, time of 4 recorded flights", f"{_percent(off)} off", "within 10 %", kept)


def promise(quick: bool) -> Iterator[Row]:
    """Times of files."""
    planners = ("lawnmower", "trajectory") if quick else ("lawnmower", "trajectory", "tour")
    for planner in planners:
        off: list[float] = []
        refused = 0
        with tempfile.TemporaryDirectory() as folder:
            for number in range(2 if quick else 6):
                scenario = flown_by.mission(number, Path(folder), "autopilot")
                found = flown_by.deviations(scenario, planner)
                off += [] if isinstance(found, str) else found[0]
                refused += isinstance(found, str)
        kept = not refused and max(map(abs, off)) <= flown_by.ALLOWED
        what = f"`{planner}`, --flown-by autopilot, time of {len(off)} files beside the flight's"
        yield Row(what, f"{_percent(off)} off", "within 15 %", kept)


def town(quick: bool) -> Iterator[Row]:
    """The shipped town."""
    missions = list(_town_missions(2 if quick else 7))
    yield from _flown("the town", missions, PLANNERS[:2] if quick else PLANNERS)


def patrol(quick: bool) -> Iterator[Row]:
    """The shipped town, seen three times."""
    missions = list(_town_missions(1 if quick else 5, (180.0, 180.0)))
    planners = ("nearest-waypoint",) if quick else ("nearest-waypoint", "tour", "trajectory")
    yield from _flown("the town three times", missions, planners)


def larger(quick: bool) -> Iterator[Row]:
    """Towns larger than one charge, packs swapped together and by each on its own."""
    seeds = range(7, 8 if quick else 10)
    towns = [generate_scenario(seed, n_uas=3, n_waypoints=90) for seed in seeds]
    planner = "nearest-waypoint" if quick else "trajectory"
    charge = 0.4 if quick else 0.35
    for form, fly in (sorties.FORMS[name] for name in ("together", "alone")):
        flown = [fly(sorties.mission(charge, 60.0, one), planner, {}) for one in towns]
        yield _row(f"{len(towns)} towns, packs of {charge:.0%}, swapped {form}", planner, flown)


def _town_missions(number: int, again_after_s: tuple[float, ...] = ()) -> Iterator[Scenario]:
    """The town, with take-off places drawn around that of the drawing; the first is that one."""
    rng, drawn = np.random.default_rng(0), read_drawings([TOWN])
    shift = np.zeros(2)
    while number:
        home = tuple((HOME_DEG + shift).tolist())
        options = ImportOptions(
            height_m=60.0, homes=(home,), town=TOWN, again_after_s=again_after_s
        )
        shift = rng.uniform((-0.0005, -0.002), (0.0005, 0.002))
        try:
            yield make_scenario(drawn, "town", options).scenario
        except InputError:  # among buildings
            continue
        number -= 1


def _flown(what: str, missions: Sequence[Scenario], planners: Sequence[str]) -> Iterator[Row]:
    for planner in planners:
        flown = [sorties.in_one(one, planner, {}) for one in missions]
        yield _row(f"{what}, {len(missions)} take-off places", planner, flown)


def _row(what: str, planner: str, flown: Sequence[sorties.Flown]) -> Row:
    """How much is covered is measured, not claimed: a planner may run out of charge before."""
    covered, time_s, spent_wh, packs, harm = sorties.row(flown)
    found = f"{covered} covered, {time_s} s, {spent_wh} Wh, {packs} packs"
    return Row(f"{what}: `{planner}`", found, "without harm", harm == "0")


def _percent(off: Sequence[float]) -> str:
    low, middle, high = (100.0 * f(off) for f in (min, median, max))
    return f"{middle:.1f} % ({low:.1f} to {high:.1f})"


PARTS = {
    "frame": frame,
    "exports": read_back,
    "recorded": leg_model,
    "promise": promise,
    "town": town,
    "patrol": patrol,
    "sorties": larger,
}


def main(
    parts: Annotated[str, typer.Option(help="Which figures.")] = ",".join(PARTS),
    quick: Annotated[bool, typer.Option("--quick", help="Fewer of everything.")] = False,
) -> None:
    """Print the table."""
    print("| what | measured | claimed | |")
    print("|---|---|---|---|")
    kept = True
    for part in parts.split(","):
        for row in PARTS[part](quick):
            verdict = "" if not row.claim else "kept" if row.kept else "NOT KEPT"
            print(f"| {row.what} | {row.found} | {row.claim} | {verdict} |", flush=True)
            kept &= row.kept
    sys.exit(0 if kept else 1)


if __name__ == "__main__":
    typer.run(main)
