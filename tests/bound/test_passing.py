"""What passing a waypoint costs at least, against passes that are flown."""

import itertools

import numpy as np
import pytest
from bound_missions import plain
from uas_coverage_baselines.tour import Tour

from uas_coverage_env import rollout
from uas_coverage_env.bound import MissionBound
from uas_coverage_env.bound.passing import Half, Passages, Passing, at_least, exactly, some
from uas_coverage_env.bound.program import least_routes
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, VY, WX, WY

HOME = (20.0, 20.0, -1.0)
PLACES = [
    (90.0, 40.0, -8.0),
    (150.0, 30.0, -8.0),
    (190.0, 80.0, -8.0),
    (150.0, 120.0, -8.0),
    (210.0, 150.0, -8.0),
    (120.0, 170.0, -8.0),
    (60.0, 130.0, -8.0),
    (30.0, 80.0, -8.0),
]


@pytest.fixture(scope="module")
def mission():
    return plain([HOME], PLACES, radius_m=15.0)


@pytest.fixture(scope="module")
def bound(mission):
    return MissionBound(mission)


@pytest.fixture(scope="module")
def passing(bound) -> Passing:
    return bound._carried._passing


def random_passages(passing, n, seed):
    rng = np.random.default_rng(seed)
    heading = rng.uniform(0.0, 2.0 * np.pi, (n, 1)) + np.stack(
        [np.zeros(n), rng.uniform(-2.5, 2.5, n)], axis=1
    )
    along = np.stack([np.cos(heading), np.sin(heading)], axis=2)
    return Passages(
        radius_m=rng.uniform(8.0, 20.0, n),
        along=along,
        half_m=rng.uniform(25.0, 40.0, (n, 2)),
        price=random_prices(passing, along, rng),
        enough=np.full(n, np.inf),
    )


def random_prices(passing, along, rng):
    """Of the whole state at each middle."""
    price = rng.normal(0.0, 40.0, (len(along), 2, 4, 2)) / scale_of(passing)
    price[:, :, 0] = 0.3 * price[:, :, 0] + passing.costs.per_m * along
    return price


def scale_of(passing):
    return np.append(passing.costs.step_m, passing.motion.largest)[:, None]


def at_prices(passages, paid, state):
    """What a flight costs with the prices of its states at both middles."""
    sides = np.einsum("nesa,nesa->ne", passages.price, state)
    return paid + sides[:, 0] - sides[:, 1]


@pytest.mark.parametrize(
    "halves",
    [
        (exactly(2), exactly(3)),
        (exactly(1), exactly(2)),
        (at_least(2, 2), exactly(3)),
        (exactly(3), at_least(2, 3)),
        (some(3), exactly(3)),
    ],
)
def test_the_bound_and_the_best_flight_found_are_close(passing, halves):
    passages = random_passages(passing, 12, seed=3)
    found = passing.least(halves, passages)
    flown = at_prices(passages, found.paid, found.state)
    assert (found.cost <= flown + 1e-6).all()
    assert (found.cost > 0.0).all()
    # the others cannot reach the middles in so many steps: what they miss has a price, too
    assert (flown - found.cost < 2.0).sum() >= 3


def passes(mission, bound, flight):
    """(waypoint, node before, node after, samples of the middles and of the visit) as flown."""
    x, carried = flight.x[:, 0], bound._carried
    centre = carried._legs.centre_m[: carried._n]
    covered = np.array([one.position_m for one in mission.waypoints])
    away = np.linalg.norm(x[:, None, :3] - covered, axis=2)
    rows = np.linalg.norm(covered[:, None, :2] - centre, axis=2).argmin(axis=1)
    first = (away <= mission.waypoints[0].radius_m + 1e-6).argmax(axis=0)
    order = sorted((int(first[k]), int(rows[k])) for k in range(len(rows)))
    middles = []
    for (begin, i), (end, j) in itertools.pairwise(order):
        if not carried._priced[i, j]:
            middles.append(None)
            continue
        beyond = (x[begin : end + 1, :2] - 0.5 * (centre[i] + centre[j])) @ carried._along[i, j]
        middles.append(begin + int((beyond >= 0.0).argmax()))
    for k in range(1, len(order) - 1):
        if middles[k - 1] is not None and middles[k] is not None:
            visit, j = order[k]
            yield j, order[k - 1][1], order[k + 1][1], middles[k - 1], visit, middles[k]


def test_no_pass_that_is_flown_costs_less(mission, bound, passing, monkeypatch):
    flight = rollout(mission, Tour())
    carried, motion, costs = bound._carried, passing.motion, passing.costs
    x = flight.x[:, 0]
    speed = np.hypot(x[:, VX], x[:, VY])
    beyond = np.hypot(x[:, PHI] - motion.trim * x[:, VY], x[:, THETA] + motion.trim * x[:, VX])
    of_step = costs.step + costs.mps * speed + costs.rad * beyond
    axes = np.stack([x[:, [VX, VY]], np.stack([-x[:, THETA], x[:, PHI]], axis=1)], axis=1)
    rate = np.stack([-x[:, WY], x[:, WX]], axis=1)
    state = np.concatenate([axes, rate[:, None]], axis=1)
    potential = np.einsum("i,nia->na", motion.potential, state)
    rng, seen = np.random.default_rng(0), 0
    for j, i, k, first, visit, last in passes(mission, bound, flight):
        along = np.stack([-carried._along[j, i], carried._along[j, k]])[None]
        half_m = np.array([[carried._half_m[j, i], carried._half_m[j, k]]])
        middle = (
            carried._legs.centre_m[j] + np.array([[-1.0], [1.0]]) * half_m[0, :, None] * along[0]
        )
        price = random_prices(passing, along, rng)
        passages = Passages(carried._legs.radius_m[[j]], along, half_m, price, np.array([np.inf]))
        ends = [first, last]
        free = x[ends, :2] - potential[ends] - middle
        carries = np.concatenate([free[:, None], state[ends]], axis=1)[None]
        flown = at_prices(passages, np.array([of_step[first:last].sum()]), carries)
        beyond_table = np.zeros_like(carried._price)
        beyond_table[i, j], beyond_table[j, k] = price[0]
        beyond_table[i, j, 0] -= costs.per_m * along[0, 0]
        beyond_table[j, k, 0] -= costs.per_m * along[0, 1]
        monkeypatch.setattr(carried, "_price", beyond_table)
        assert -np.inf < carried._by_the_table()[j, i, k] <= flown[0] + 1e-3
        before, after = visit - first, last - visit
        gaps = at_least(1, max(before - 1, 0)) if before > 1 else exactly(before)
        for halves in ((exactly(before), exactly(after)), (gaps, exactly(after))):
            assert passing.least(halves, passages).cost[0] <= flown[0] + 1e-3
        seen += 1
    assert seen >= 3


def test_a_gap_costs_no_more_than_the_steps_in_it(passing):
    passages = random_passages(passing, 8, seed=5)
    joined = passing.least((exactly(4), exactly(2)), passages).cost
    apart = passing.least((at_least(2, 2), exactly(2)), passages).cost
    assert (apart <= joined + 1.5).all()
    assert Half(2, 2, False, True) == at_least(2, 2)


def test_what_is_carried_between_turns_raises_the_bound(bound):
    triples_alone = bound._cost(bound._prices_turning)
    cuts, step_J = (), bound._prices.step
    alone = least_routes(triples_alone, step_J, cuts=cuts)
    assert bound._carried.least_routes(step_J, cuts) > 1.005 * alone
