"""What the actions of v1 are worth to a learner, beside those of v0, without learning.

    python benchmarks/learner_actions.py                # on 50 missions of `hard`
    python benchmarks/learner_actions.py --missions 10

Noise, on missions for validation: each UAS flies out for 15 s and then home by a hand-written rule,
and Gaussian noise is added to each number of its action, as a learner explores. Shown is the share
that lands within 200 s of those that fly when they turn home. The rule flies by a share of the way
that is left, in m/s; of four shares the best counts for each kind and noise, since a learner would
find it, too.

Choices, on missions for test (the distances of the rule were chosen on those for validation): UAS
fly to the nearest open waypoint that their charge allows, and home; the rule that dodges holds or
climbs where another UAS or a moving obstacle comes near. Nothing is filtered.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from uas_coverage_env.entities.codes import ContactKind
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.env import ActionKind, CoverageBatch, observation_columns
from uas_coverage_env.env.actions import CLIMB_CHOICE, HOLD_CHOICE, HOME_CHOICE
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.actions.velocity import VELOCITY, VELOCITY_V1, finely
from uas_coverage_env.env.actions.waypoint import WAYPOINT, WAYPOINT_V1
from uas_coverage_env.env.observation.scales import HEIGHT_M, NEARBY_M
from uas_coverage_env.env.report import CONTACT, COVERED, STATUS
from uas_coverage_env.tasks import score
from uas_coverage_env.tasks.levels import level_named

LEVEL = "hard"
NOISE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5)
PER_S = (0.3, 0.15, 0.08, 0.05)
OUT_S, HOME_S = 15, 200
CAUSES = (
    *(ContactKind.UAS, ContactKind.MOVING_OBSTACLE, ContactKind.OBSTACLE, ContactKind.BATTERY),
)

Array = NDArray[Any]
Act = Callable[[Array, int], Array]


def seen(observation: Array, group: str, feature: str) -> Array:
    """(..., repeats) or (..., repeats, width) numbers of a feature."""
    columns = observation_columns(group, feature)
    values = observation[..., columns]
    return values[..., 0] if columns.shape[1] == 1 else values


def metres(closeness: Array) -> Array:
    """Distances of what is observed as 1/(1 + distance / 30 m)."""
    return NEARBY_M / np.maximum(closeness, 1e-3) - NEARBY_M


class Missions:
    """The missions of a split side by side, once with each kind of action."""

    def __init__(self, kind: ActionKind, split: str, n: int) -> None:
        task = level_named(LEVEL)
        drawn = task.scenarios(split, n)
        self.seeds, self.scenarios = list(drawn), list(drawn.values())
        settings = task.settings(action=kind)
        self.batch = CoverageBatch(n, self.scenarios, autoreset="rest", **settings)
        self.fleet = np.array([len(scenario.uas) for scenario in self.scenarios])

    def flown(self, act: Act, most_steps: int = 10_000) -> Iterator[tuple[Array, Array]]:
        """(flew before, report) of every step."""
        batch, lanes = self.batch, self.batch.lanes
        observation = batch.reset(self.seeds, scenarios=np.arange(len(self.seeds)))
        for step in range(most_steps):
            if (lanes.terminated | lanes.truncated).all():
                break
            flew = batch.flying.copy()
            observation = batch.step(act(observation, step))
            yield flew, batch.learners.report


def velocities(missions: Missions, kind: ActionKind) -> Callable[[Array, Array], Array]:
    """The numbers that ask for velocities (m, u, 2) [m/s] and altitudes (m, u) [m]."""
    ranges = np.zeros((*missions.batch.flying.shape, 3, 3))
    for m, scenario in enumerate(missions.scenarios):
        ranges[m, : len(scenario.uas)] = actions_of(kind, scenario).ranges
    ranges[ranges[..., 0, 2] == 0.0] = ranges[0, 0]
    limits = ranges[..., :2, 2]
    slope = kind.parameters[0] if kind.parameters else 1.0
    straight = np.linspace(0.0, 1.0, 4001)
    bent = np.array([finely(share, 1.0, slope) for share in straight])

    def numbers(level_mps: Array, altitude_m: Array) -> Array:
        share = level_mps / limits
        level = np.sign(share) * np.interp(np.abs(share), bent, straight)
        low, middle, high = np.moveaxis(ranges[..., 2, :], -1, 0)
        above = altitude_m - middle
        height = above / np.where(above > 0.0, high - middle, middle - low)
        return np.clip(np.concatenate([level, height[..., np.newaxis]], axis=-1), -1.0, 1.0)

    return numbers


def landed_share(missions: Missions, kind: ActionKind, noise: float, per_s: float) -> float:
    """Who lands of those that turn home."""
    rng, numbers = np.random.default_rng(0), velocities(missions, kind)
    cruise_m = 10.0 + 4.0 * np.arange(missions.batch.n_uas)

    def act(observation: Array, step: int) -> Array:
        if step < OUT_S:
            out = 7.0 * seen(observation, "waypoints", "direction")[..., 0, :]
            return numbers(out, np.broadcast_to(18.0, out.shape[:2]))
        away_m = metres(seen(observation, "home", "closeness"))[..., 0]
        braking_mps = np.sqrt(0.6 * away_m) + 0.2
        speed_mps = np.minimum(np.minimum(per_s * away_m, braking_mps), 12.0)
        level = seen(observation, "home", "direction")[..., 0, :] * speed_mps[..., np.newaxis]
        altitude_m = np.clip(0.5 * (away_m - 6.0), 0.0, cruise_m)
        action = numbers(level, altitude_m)
        return np.clip(action + noise * rng.standard_normal(action.shape), -1.0, 1.0)

    steps = list(missions.flown(act, OUT_S + HOME_S))
    turned, _ = steps[OUT_S]
    _, report = steps[-1]
    return float((report[..., STATUS][turned] == LANDED).mean())


def noise_table(n: int) -> Table:
    """A row for each kind."""
    title = f"`{LEVEL}`: share of noisy flights home that land, by the noise of a number"
    table = Table("velocity of", *map(str, NOISE), title=title)
    for version, kind in (("v0", VELOCITY), ("v1", VELOCITY_V1)):
        missions = Missions(kind, "validation", n)
        best = (max(landed_share(missions, kind, sigma, k) for k in PER_S) for sigma in NOISE)
        table.add_row(version, *(f"{share:.0%}" for share in best))
    return table


def nearest(observation: Array) -> Array:
    """The choice of each UAS: the nearest that it can do and no other is nearer to, or home."""
    closeness = seen(observation, "waypoints", "closeness")
    mine = closeness >= seen(observation, "waypoints", "nearest_uas")
    allowed = (seen(observation, "waypoints", "valid") > 0.5) & (
        seen(observation, "waypoints", "energy_margin") > 0.05
    )
    wished = np.where(allowed, closeness + 0.5 * mine, 0.0)
    return np.where(wished.max(axis=-1) > 0.0, wished.argmax(axis=-1), HOME_CHOICE)


def dodging(observation: Array) -> Array:
    """The same, but where two come near, the upper one climbs and the lower one holds."""
    choice = nearest(observation)
    for group, near_m, high_m in (("others", 20.0, 6.0), ("moving_obstacles", 40.0, 20.0)):
        below_m = HEIGHT_M * seen(observation, group, "below")
        velocity = seen(observation, group, "velocity")[..., :2]
        near = (velocity * seen(observation, group, "direction")).sum(axis=-1) < 0.0
        near &= seen(observation, group, "valid") > 0.5
        near &= np.abs(below_m) < high_m
        near &= metres(seen(observation, group, "closeness")) < near_m
        climbs = (near & ((below_m >= 0.0) | (group != "others"))).any(axis=-1)
        choice = np.where(near.any(axis=-1), HOLD_CHOICE, choice)
        choice = np.where(climbs, CLIMB_CHOICE, choice)
    return choice


def choice_row(n: int, kind: ActionKind, rule: Callable[[Array], Array]) -> tuple[str, ...]:
    """Score, covered, home, and why others are lost [%]."""
    missions = Missions(kind, "test", n)
    lost: Counter[int] = Counter()
    report = np.zeros(0)
    for flew, report in missions.flown(lambda observation, _: rule(observation)):
        lost.update(report[..., CONTACT][flew].tolist())
    total = int(missions.fleet.sum())
    places = np.array([len(scenario.waypoints) for scenario in missions.scenarios])
    covered = (report[:, 0, COVERED] / places).mean()
    home = (report[..., STATUS] == LANDED).sum() / total
    causes = (lost[kind] / total for kind in CAUSES)
    scored = score(rule, LEVEL, missions=n, batch=n, action=kind).score
    shares = (f"{share:.0%}" for share in (covered, home, *causes))
    return str(scored and f"{scored.value:.2f} [{scored.low:.2f}, {scored.high:.2f}]"), *shares


def choice_table(n: int) -> Table:
    """A row for each rule."""
    causes = (f"lost: {kind.name.lower().replace('_', ' ')}" for kind in CAUSES)
    title = f"`{LEVEL}`: a rule over waypoint choices"
    table = Table("rule", "score [95 %]", "covered", "home", *causes, title=title)
    table.add_row("nearest (v0)", *choice_row(n, WAYPOINT, nearest))
    table.add_row("nearest, holds and climbs (v1)", *choice_row(n, WAYPOINT_V1, dodging))
    return table


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--missions", type=int, default=50)
    n = parser.parse_args().missions
    console = Console(width=120)
    console.print(noise_table(n))
    console.print(choice_table(n))


if __name__ == "__main__":
    main()
