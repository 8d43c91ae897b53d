"""What a step and a turn cost at least, against steps and turns that are flown."""

import itertools

import numpy as np
import pytest
from bound_missions import plain
from uas_coverage_baselines.tour import Tour

from uas_coverage_env import rollout
from uas_coverage_env.bound.prices import STEPS, WITHIN, Ends, Prices, cheapest, energy_prices
from uas_coverage_env.bound.program import Cut, least_routes
from uas_coverage_env.bound.turning import LONGEST, turning_of_fleet
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, VY

HOME = (20.0, 20.0, -1.0)
CORNERS = ((400.0, 60.0, -10.0), (440.0, 420.0, -30.0), (90.0, 460.0, -6.0), (200.0, 220.0, -18.0))
ENDS = Ends(dt_s=1.0, landing_distance_m=2.0, landing_speed_mps=0.5, height_m=50.0)


@pytest.fixture(scope="module")
def vehicle():
    return load_vehicle("s500_v2")


@pytest.fixture(scope="module")
def prices(vehicle):
    return energy_prices(vehicle, ENDS, 0.75)


@pytest.fixture(scope="module")
def turning(vehicle, prices):
    return turning_of_fleet([vehicle], 1.0, prices, 0.5)


@pytest.mark.parametrize("soc_0", [1.0, 0.6])
def test_a_flight_costs_what_its_steps_cost_at_least(vehicle, prices, soc_0):
    flight = rollout(plain([HOME], CORNERS, soc_0=soc_0), Tour())
    x = flight.x[:-1, 0]
    flown = flight.current_A[:-1, 0] > 0.0
    trim = vehicle.trim_tilt_rad_per_mps
    speed = np.hypot(x[:, VX], x[:, VY])
    beyond = np.hypot(x[:, PHI] - trim * x[:, VY], x[:, THETA] + trim * x[:, VX])
    least_J = (prices.step + prices.mps * speed + prices.rad * beyond)[flown].sum() - prices.once
    used_J = 3600.0 * energy_Wh(flight).sum()
    assert least_J <= used_J <= 1.06 * least_J


def test_what_holds_for_a_fleet_holds_for_each_of_it(vehicle, prices):
    other = energy_prices(load_vehicle("hexacopter"), ENDS, 0.75)
    both = cheapest([prices, other])
    assert both == cheapest([other, prices])
    assert both.step == min(prices.step, other.step)
    assert both.once == max(prices.once, other.once)
    alone, fleet = (
        turning_of_fleet(vehicles, 1.0, STEPS, 0.5)
        for vehicles in ([vehicle], [vehicle, load_vehicle("hexacopter")])
    )
    before, after, half = np.meshgrid([1, LONGEST], [1, LONGEST], np.linspace(0.0, 1.5, 7))
    costs = [one.turn_cost(before, after, half) for one in (fleet, alone)]
    assert (costs[0] <= costs[1] + 1e-9).all()
    assert (fleet.reach_m >= alone.reach_m - 1e-9).all()


def test_flying_on_costs_nothing_and_turning_back_costs_most(turning):
    steps = np.full(19, LONGEST)
    costs = turning.turn_cost(steps, steps, np.linspace(0.0, 0.5 * np.pi, 19))
    assert abs(costs[0]) < 3.0
    assert (np.diff(costs) > -1.0).all()
    assert costs[-1] > 500.0


def test_looking_farther_around_a_turn_finds_no_less_cost(turning):
    half = np.full(1, 0.8)
    for before, after in itertools.product(range(1, LONGEST), range(1, LONGEST)):
        near = turning.turn_cost(np.array([before]), np.array([after]), half)
        far = turning.turn_cost(np.array([before + 1]), np.array([after + 1]), half)
        assert far >= near - 2.0


def test_between_tabulated_angles_the_bound_holds(vehicle, prices):
    from uas_coverage_env.bound import turning as module

    motion = module.motion_of(vehicle, 1.0)
    speed = WITHIN * vehicle.limits.v_xy_max_mps
    table = turning_of_fleet([vehicle], 1.0, prices, 0.5)
    window = module._Window(motion, prices, speed, table.per_m)
    for half in (0.03, 0.21, 0.5, 0.9, 1.33):
        exact = window.turn(2, 3, half)
        bound = float(table.turn_cost(np.array([2]), np.array([3]), np.array([half]))[0])
        assert exact - 6.0 < bound <= exact + 1e-6


def test_reach_grows_by_less_than_full_speed_allows(turning):
    assert turning.reach_m[0] == 0.0
    assert (np.diff(turning.reach_m) <= WITHIN * 12.0 + 1.0).all()
    assert (turning.reach_from_rest_m <= turning.reach_m + 1e-9).all()
    assert turning.start[1] == pytest.approx(turning.start[2] / 2.0), "nothing moves at once"


def cheapest_routes(cost, n, uas):
    """The least cost of all routes, by trying all; none flies idle."""
    best = np.inf
    for order in itertools.permutations(range(n)):
        for splits in itertools.combinations_with_replacement(range(n + 1), uas - 1):
            ends = [0, *splits, n]
            total = 0.0
            for u in range(uas):
                route = [n + u, *order[ends[u] : ends[u + 1]], n + uas + u]
                inner = range(1, len(route) - 1)
                total += sum(cost[route[k], route[k - 1], route[k + 1]] for k in inner)
            best = min(best, total)
    return best


def random_costs(seed, n, uas):
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(0.0, 100.0, (n + uas, 2))
    nodes = np.concatenate([nodes, nodes[n:]])
    half = 0.5 * np.linalg.norm(nodes[:n, None] - nodes, axis=2)
    half[:, n:] *= 2.0
    cost = half[:, :, None] + half[:, None] + rng.uniform(0.0, 5.0, (n, 1, 1))
    cost[:, n + uas :, n + uas :] = cost[:, n : n + uas, n : n + uas] = np.inf
    start_end = cost[:, n : n + uas, n + uas :]
    start_end += np.where(np.eye(uas, dtype=bool), 0.0, np.inf)
    cost[np.arange(n), :, np.arange(n)] = cost[np.arange(n), np.arange(n)] = np.inf
    cost[:, np.arange(n), np.arange(n)] = np.inf
    return np.minimum(cost, cost.transpose(0, 2, 1))


@pytest.mark.parametrize("seed", range(6))
def test_the_program_is_a_close_bound_of_the_cheapest_routes(seed):
    n, uas = (6, 1) if seed % 2 else (5, 2)
    cost = random_costs(seed, n, uas)
    best = cheapest_routes(cost, n, uas)
    value = least_routes(cost)
    assert 0.9 * best < value <= best + 1e-6


def test_a_cut_forces_further_routes():
    cost = random_costs(3, 6, 2)
    everything = np.ones(6, dtype=bool)
    assert least_routes(cost, cuts=[Cut(everything, 2)]) > least_routes(cost)


def test_steps_cost_a_step():
    assert Prices(1.0, 0.0, 0.0, 0.0) == STEPS
