"""In light wind `trajectory` plans flights ahead, and `tour` flies what is safe."""

import numpy as np
import pytest
from small_fleets import every_waypoint, field
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory.flight_model import (
    flight_model,
    in_wind,
    reduced_state,
)
from uas_coverage_baselines.trajectory.in_wind import tour_in_wind
from uas_coverage_baselines.trajectory.lead import Lead

from uas_coverage_env import rollout
from uas_coverage_env.autopilot.belief import wind_growth
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.lookahead import fly_kinematically
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY, WRENCH
from uas_coverage_env.flight.metrics import accomplished, energy_Wh
from uas_coverage_env.mission import MissionBrief, WorldView, first_sight
from uas_coverage_env.mission.learnt_wind import MEAN_HEIGHT_M, LearntWind, in_disturbances
from uas_coverage_env.planning.routing import SearchEffort
from uas_coverage_env.scenario import Wind
from uas_coverage_env.vehicle.layout import N_INPUTS, VX, VY, VZ

WIND_MPS = np.array([3.0, -4.0])


def steady(mean_mps=5.0):
    """A field in a wind that is the same at all heights and does not change."""
    wind = Wind(mean_mps=mean_mps, from_deg=127.0, power="rotor")
    return field().model_copy(update={"wind": wind})


@pytest.fixture
def led():
    """A mission in a wind that is known: what leads, its arena, the state and what is learnt."""
    brief = MissionBrief.of(steady())
    arena = in_disturbances(WorldView(brief).arena)
    learnt = LearntWind(brief)
    learnt.wind_mps[:] = WIND_MPS
    return Lead(brief, arena, 0.3), arena, first_sight(brief).x[0], learnt


def test_the_model_in_a_wind_is_what_the_autopilot_believes_of_it(led):
    _, arena, x, learnt = led
    vehicle, rng = arena.vehicles[0], np.random.default_rng(1)
    model, command = in_wind(flight_model(vehicle), WIND_MPS), np.zeros(1, COMMAND_DTYPE)[0]
    for _ in range(10):
        u = rng.uniform(model.input_low, model.input_high)
        expected = model.A @ reduced_state(x) + model.B @ u + model.drift
        roll_Nm, pitch_Nm = u[1] * vehicle.inertia_kgm2[0], -u[0] * vehicle.inertia_kgm2[1]
        write_command(command, WRENCH, u[2], roll_Nm, pitch_Nm)
        fly_kinematically(vehicle, x, np.zeros(2), command, np.zeros(N_INPUTS), learnt.belief[0])
        np.testing.assert_allclose(reduced_state(x), expected, atol=1e-9)


@pytest.mark.parametrize("wind_mps", [(0.0, 0.0), (3.0, -4.0), (-6.0, 8.0)])
def test_a_plan_in_a_wind_leaves_room_for_gusts(led, wind_mps):
    # gusts of a tenth of the wind, and a twenty-fifth of it upwards (`autopilot.belief`)
    vehicle, speed_mps = led[1].vehicles[0], np.hypot(*wind_mps)
    still = flight_model(vehicle, 0.0)
    windy = in_wind(still, np.array(wind_mps))
    assert windy.norms[0] == pytest.approx(12.0 - 0.1 * speed_mps)
    np.testing.assert_array_equal(windy.norms[1:], still.norms[1:])
    np.testing.assert_allclose(windy.vertical, np.array([3.0, 1.5]) - 0.04 * speed_mps)


def test_what_leads_visits_all_waypoints_and_lands_within_its_airspeed(led):
    lead, arena, x, learnt = led
    scenario = steady()
    points_m = np.array([w.position_m for w in scenario.waypoints])
    radius_m = np.array([w.radius_m for w in scenario.waypoints])
    vehicle, command = arena.vehicles[0], np.zeros(1, COMMAND_DTYPE)[0]
    route, reference, home_m = every_waypoint(scenario), np.zeros(2), x[:3].copy()
    for step in range(120):
        learnt.mean_mps = WIND_MPS / wind_growth(-x[2], MEAN_HEIGHT_M)
        wanted = lead.commands(0, step, x, route, learnt, 8)
        write_command(command, VELOCITY, *wanted[0])
        fly_kinematically(vehicle, x, reference, command, np.zeros(N_INPUTS), learnt.belief[0])
        assert np.hypot(*(x[VX : VY + 1] - WIND_MPS)) < vehicle.v_xy_max_mps + 0.1
        route = route[np.linalg.norm(points_m[route] - x[:3], axis=1) > radius_m[route]]
        landed = np.linalg.norm(x[:3] - home_m) < scenario.landing_distance_m
        if landed and not len(route) and np.linalg.norm(x[VX : VZ + 1]) < 1.0:
            break
    assert not len(route)
    assert step < 70


def test_a_mission_in_a_steady_wind_takes_less_than_by_the_pursuit_alone():
    effort = SearchEffort(20_000, total_weight=0.6)
    pursued, led = (
        rollout(steady(), Tour(effort=effort, make_leader=make_leader))
        for make_leader in (None, lambda brief, arena: Lead(brief, arena, 0.3))
    )
    assert accomplished(pursued)
    assert accomplished(led)
    assert led.safety_filter
    assert float(energy_Wh(led).sum()) < float(energy_Wh(pursued).sum())
    assert led.steps < pursued.steps


class _AtTheTower:
    """Leads every UAS into the tower, whatever its route is."""

    def commands(self, uas, step, x, route, learnt, n_steps):
        away_m = np.array([125.0, 125.0]) - x[:2]
        wanted = np.full((n_steps, 3), 20.0)
        wanted[:, :2] = 12.0 * away_m / max(np.linalg.norm(away_m), 1e-9)
        return wanted


def test_what_leads_into_an_obstacle_is_not_flown():
    effort = SearchEffort(20_000, total_weight=0.6)
    planner = Tour(effort=effort, make_leader=lambda brief, arena: _AtTheTower())
    flight = rollout(steady(), planner, max_steps=60, safety_filter=False)
    assert not flight.violations
    assert flight.breaches == 0


@pytest.mark.parametrize(("mean_mps", "leads"), [(2.0, True), (4.0, True), (4.5, False)])
def test_flights_are_planned_ahead_in_light_wind(monkeypatch, mean_mps, leads):
    asked = []
    monkeypatch.setattr(Lead, "commands", lambda self, *args: asked.append(args))
    tour, brief = tour_in_wind(SearchEffort(1000), 0.3), MissionBrief.of(steady(mean_mps))
    tour.reset(brief, 0)
    tour.act(first_sight(brief))
    assert bool(asked) == leads
