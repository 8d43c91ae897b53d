"""The legs of a flight: from a start to each waypoint that is covered, in order, to the landing."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.metrics import energy_until_Wh
from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.flight.take_offs import sorties_of
from uas_coverage_env.world.coverage import covering_samples


@dataclass(frozen=True)
class Leg:
    """One of them; what it took.

    Attributes:
        uas: Who flew it.
        leaves: Where it begins: `start`, or the waypoints that were covered there.
        reaches: Where it ends: waypoints, `landing`, `lost` or `in the air`.
        begins_s: When [s].
        ends_s: When [s].
        way_m: Length of the way flown [m].
        energy_Wh: Drawn from the battery [Wh].
        soc_begins: State of charge at its beginning [-].
        soc_ends: State of charge at its end [-].
        above_reserve: How much of it is more than has to be left on landing [-].
    """

    uas: str
    leaves: str
    reaches: str
    begins_s: float
    ends_s: float
    way_m: float
    energy_Wh: float
    soc_begins: float
    soc_ends: float
    above_reserve: float


def legs_of(flight: FlightRecord) -> list[Leg]:
    """The legs of all UAS, each UAS's in their order; none of one that never left the ground.

    Their energies add up to what the flight drew from the batteries (`energy_Wh`).
    """
    covered = _covered_by(flight)
    return [leg for i in range(len(flight.names)) for leg in _legs(flight, i, covered[i])]


def _legs(flight: FlightRecord, i: int, covered: dict[int, list[int]]) -> Iterator[Leg]:
    moved_m = np.linalg.norm(np.diff(flight.x[:, i, :3], axis=0), axis=1)
    way_m = np.append(0.0, np.cumsum(moved_m))
    drawn_Wh, soc = energy_until_Wh(flight)[:, i], flight.soc[:, i]
    least = 1.0 - flight.scenario.dod_landed[i]
    last = len(flight.x) - 1
    sorties = sorties_of(flight, i)
    for sortie in sorties:
        end = min(sortie.landed, last)
        final = sortie is sorties[-1]
        at = [sortie.first, *(k for k in covered if sortie.first < k <= end)]
        places = ["start", *(_named(covered[k]) for k in at[1:])]
        if at[-1] < end:
            at.append(end)
            places.append(_END.get(int(flight.mode[end, i]), "in the air") if final else "landing")
        for n in range(len(at) - 1):
            begins, ends = at[n], at[n + 1]
            yield Leg(
                uas=flight.names[i],
                leaves=places[n],
                reaches=places[n + 1],
                begins_s=float(flight.time_s[begins]),
                ends_s=float(flight.time_s[ends]),
                way_m=float(way_m[ends] - way_m[begins]),
                energy_Wh=float(drawn_Wh[ends] - drawn_Wh[begins]),
                soc_begins=float(soc[begins]),
                soc_ends=float(soc[ends]),
                above_reserve=float(soc[ends] - least),
            )


_END = {LANDED: "landing", LOST: "lost"}


def _covered_by(flight: FlightRecord) -> list[dict[int, list[int]]]:
    """Of each UAS, sample -> the waypoints that it covered then, in order of time."""
    history, found = SceneHistory.of(flight), [{} for _ in flight.names]
    at: NDArray[np.int64] = history.covered_at
    for w in np.argsort(at, kind="stable").tolist():
        if at[w] < len(flight.x):
            x = flight.x[at[w]]
            covers = covering_samples(history.scenario, w, x[None])[0]
            away_m = np.linalg.norm(x[:, :3] - history.scenario.waypoints[w].position_m, axis=1)
            # of a log, what covered it was between two samples
            i = int(covers.argmax()) if covers.any() else int(away_m.argmin())
            found[i].setdefault(int(at[w]), []).append(w)
    return found


def _named(waypoints: list[int]) -> str:
    return f"waypoint {' '.join(map(str, waypoints))}"
