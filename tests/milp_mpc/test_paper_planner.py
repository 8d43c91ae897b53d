"""`milp-mpc-paper` flies the paper's program: its rows and no others, to a stated gap."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from practice_missions import mission, obstacle
from test_exact_reductions import smaller
from toy_problems import S500, TO_OPTIMALITY, box, moving, state, toy, written
from uas_coverage_baselines.milp_mpc import PAPER_OCP, MilpMpc, MilpMpcPaper, paper_planner
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.blocks import Capabilities, Dynamics
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolveStatus

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX, VY
from uas_coverage_env.vehicle.params import return_threshold
from uas_coverage_env.world import Velocity, Wrench

FLOWN = read_problems(Path(__file__).parents[2] / "benchmarks" / "village_decisions.json")
CLOSED = SolverLimits(relative_gap=1e-6, absolute_gap=1e-5)
SHED = obstacle((70.0, 45.0, -12.0), (80.0, 60.0, 0.0))
BALLOON = {
    "name": "balloon",
    "radius_m": 4.0,
    "height_m": 8.0,
    "safe_distance_m": 2.0,
    "start_m": (70.0, 80.0, -6.0),
    "schedule": [{"from_s": 0.0, "velocity_mps": (0.0, 0.5, 0.0)}],
}


def field(**fields):
    places = [((90.0, 52.0, -8.0), 10.0), ((75.0, 75.0, -8.0), 10.0), ((60.0, 95.0, -8.0), 10.0)]
    return mission(places, [(50.0, 50.0, -1.0), (50.0, 90.0, -1.0)], obstacles=[SHED], **fields)


def paper(scenario=None, **options):
    """The planner, ready for the mission."""
    made = MilpMpcPaper(MilpMpcPaper.Options(**options))
    made.reset(MissionBrief.of(scenario or field(moving_obstacles=[BALLOON])), 0)
    return made


def first_problem(planner, scenario=None):
    return planner.problem(World(scenario or field(moving_obstacles=[BALLOON])).swarm_state())


@pytest.fixture(scope="module")
def flight():
    """A whole mission, and what was solved at each step."""
    planner, solved = MilpMpcPaper(MilpMpcPaper.Options(horizon=6)), []
    scenario = field(moving_obstacles=[BALLOON])
    flown = rollout(scenario, planner, on_step=lambda _: solved.append(planner.last_program))
    return flown, solved[1:]  # the first is of before take-off


def test_a_whole_mission_is_flown_to_its_end_without_a_violation(flight):
    flown, _ = flight
    assert accomplished(flown)
    assert flown.breaches == 0
    assert not any(decision.fallback for decision in flown.decisions)


def test_every_decision_is_solved_to_the_gap_that_was_asked_for(flight):
    flown, solved = flight
    assert len(solved) == flown.steps
    for decision, program in zip(flown.decisions, solved, strict=True):
        assert program.status is SolveStatus.OPTIMAL
        missing = program.objective - program.bound
        assert missing <= max(0.01 * abs(program.objective), 0.01) + 1e-9
        assert decision.mip_gap == pytest.approx(missing / abs(program.objective), abs=1e-9)


def test_the_sizes_that_are_told_are_those_of_the_program(flight):
    _, solved = flight
    planner = paper(horizon=6)
    form = FORMULATIONS[planner.options.formulation]
    built, _ = form.build(first_problem(planner), PAPER_OCP)
    first = solved[0]
    assert (first.rows, first.columns) == (len(built.row_lower), len(built.cost))
    assert first.whole == (built.integer & (built.lower < built.upper)).sum()
    assert first.solve_s > 0.0


def families(milp):
    """How many rows each family has."""
    return {name: len(rows) for name, rows in milp._row_names}


def test_the_program_has_the_rows_of_the_paper_and_no_others():
    planner = paper(formulation="paper", horizon=5)
    problem = first_problem(planner)
    milp, _ = FORMULATIONS["paper"].write(problem, planner.blocks)
    U, N, W, F, H = 2, 5, 3, 6, 8  # the shed has six faces, a closed cylinder H_O + 2
    rows = families(milp)
    assert rows["dynamics"] == U * N * 14
    assert rows["geofence"] == U * N * 6
    assert rows["coverage.inside"] <= U * N * W * 6  # H_WP = 4: a box; at n = 0 some hold anyway
    assert rows["coverage.inside"] >= U * (N - 1) * W * 6
    assert rows["coverage.open"] == rows["coverage.state"] == N * W
    assert rows["shed.outside"] == U * N * F
    assert rows["shed.one_face"] == U * N
    assert rows["shed.corner"] == U * N * F
    assert rows["shed.one_face_stays"] == U * N
    assert rows["balloon.outside"] == U * N * (H + 2)
    assert rows["collision.outside"] == N * (H + 2)
    for name in ("speed", "tilt", "rate"):
        assert rows[f"capabilities.{name}"] == U * N * 8
    cut = {name.partition(".")[0] for name in rows if "corner" in name}
    assert cut == {"shed"}, "the paper cuts no corners of what moves"
    assert not any(name.startswith(("reserve", "time_to_go")) for name in rows)


def test_what_departs_from_the_paper_is_an_option_that_is_off():
    plain = first_problem(paper())
    assert plain.obstacle_clearance_m == pytest.approx(0.36 + 2.0, abs=1e-4)
    assert plain.moving_clearance_m == pytest.approx(0.36 + 2.0, abs=1e-4)
    assert plain.separation_m[0, 1] == pytest.approx(2 * 0.36 + 5.0, abs=1e-4)
    assert plain.fence_margin_m == pytest.approx(0.5, abs=1e-4)
    assert set(plain.waypoint_weight) == {1.0}
    on = {"margin_m": 0.5, "moving_margin_m": 2.0, "priority_per_s": 0.1}
    planner = paper(**on, corner_cutting="all", battery_reserve=True)
    departed = first_problem(planner)
    assert departed.obstacle_clearance_m == pytest.approx(0.36 + 2.5)
    assert departed.moving_clearance_m == pytest.approx(0.36 + 4.0)
    assert departed.waypoint_weight.max() > 1.0
    assert len(planner.blocks) == len(PAPER_OCP) + 2
    assert "collision.crossed" in FORMULATIONS["corner"].write(departed, planner.blocks)[0]


def test_sides_order_and_horizon_reach_the_problem():
    chosen = {"physical_sides": 12, "obstacle_sides": 6, "waypoint_sides": 8, "horizon": 2}
    problem = first_problem(paper(**chosen, taylor_order=2, limits="outer"))
    assert (problem.physical_sides, problem.limit_sides) == (12, 12)
    assert (problem.obstacle_sides, problem.waypoint_sides) == (6, 8)
    assert (problem.horizon, problem.order, problem.outer_limits) == (2, 2, True)
    lowest, usual = problem.models[0].B, first_problem(paper()).models[0].B
    assert not lowest[0].any(), "in a series of order 2 no torque moves the position"
    assert usual[0].any()


@pytest.mark.parametrize("order", [2, 3, 5])
def test_reachable_sets_hold_for_every_order_of_the_series(order):
    start = state((100.0, 100.0, -20.0), (5.0, -3.0, 0.0))
    problem = toy(start, horizon=6, order=order)
    milp, v = written(problem, Dynamics(), Capabilities())
    built = milp.build()
    directions = np.array([[1.0, 0, 0], [0, -1, 0], [0.6, 0.8, 0], [0, 0, 1], [-0.5, 0.5, -0.7]])
    reach = problem.reach.support(directions)[0, 6]
    for direction, most in zip(directions, reach, strict=True):
        built.cost[:] = 0.0
        built.cost[v.position[0, 6]] = -direction
        farthest = -solve(built, TO_OPTIMALITY).objective
        assert most - 30.0 <= farthest <= most + 1e-6


def test_outer_polygons_let_a_plan_exceed_the_limits_and_inner_ones_do_not():
    for outer, most in ((False, 12.0), (True, 12.0 / np.cos(np.pi / 8))):
        problem = toy(
            state((0.0, 0.0, -20.0), (8.0, 3.0, 0.0)),
            horizon=10,
            fence=box((-500.0, -500.0, -50.0), (500.0, 500.0, 0.0)),
            limit_sides=8,
            outer_limits=outer,
        )
        milp, v = written(problem, Dynamics(), Capabilities())
        built = milp.build()
        built.cost[:] = 0.0
        built.cost[v.x[0, 10, [VX, VY]]] = -np.cos(np.pi / 8), -np.sin(np.pi / 8)
        values = solve(built, TO_OPTIMALITY).values
        assert np.hypot(*values[v.x[0, 10, [VX, VY]]]) == pytest.approx(most, rel=1e-3)
        assert problem.reach.support(np.eye(3))[0, 10, 0] >= values[v.position[0, 10]][0]


def optima(problem, blocks):
    result = {}
    for name, formulation in FORMULATIONS.items():
        solution = solve(formulation.build(problem, blocks)[0], CLOSED)
        assert solution.status is SolveStatus.OPTIMAL, name
        result[name] = solution.objective
    return result


@pytest.mark.parametrize(("step", "uas"), [(0, 0), (35, 1), (95, 0)])
def test_every_formulation_has_the_optimum_of_the_papers_own_rows(step, uas):
    problem = smaller(FLOWN[step].only(uas), 7, 3)
    found = optima(replace(problem, corners_of_all=False, limit_sides=8), PAPER_OCP)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=5e-5)


def test_the_formulations_agree_where_nothing_is_asked_between_samples():
    start = state((50.0, 50.0, -10.0), (8.0, 0.0, 0.0))
    other = state((84.0, 58.0, -10.0), (-6.0, 0.0, 0.0))
    balloon = moving([(66.0 - n, 50.0, -10.0) for n in range(4)], radius_m=2.0)
    problem = toy(
        *(start, other),
        horizon=3,
        moving_obstacles=[balloon],
        waypoints=[((78.0, 53.0, -10.0), 7.0)],
        corners_of_all=False,
    )
    found = optima(problem, PAPER_OCP)
    assert found == pytest.approx(dict.fromkeys(found, found["paper"]), abs=5e-5)
    assert found["paper"] < optima(replace(problem, corners_of_all=True), PAPER_OCP)["paper"] + 5e-5


def test_what_moves_may_be_jumped_over_unless_corner_cutting_is_asked_for():
    start = state((50.0, 50.0, -10.0), (12.0, 0.0, 0.0))
    thin = moving([(57.0, 50.0, -10.0)] * 3, radius_m=0.5, half_height_m=40.0)
    wide = box((40.0, 49.5, -50.0), (90.0, 50.5, 0.0))
    allowed = []
    for corners in (False, True):
        problem = toy(
            start,
            horizon=2,
            moving_obstacles=[thin],
            fence=wide,
            fence_margin_m=0.1,
            moving_clearance_m=0.4,
            corners_of_all=corners,
        )
        built, _ = FORMULATIONS["lift"].build(problem, PAPER_OCP)
        allowed.append(solve(built, CLOSED).values is not None)
    assert allowed == [True, False]


@pytest.mark.parametrize("options", [{"horizon": 2}, {"taylor_order": 2, "horizon": 6}])
def test_short_horizons_and_low_orders_fly(options):
    scenario = field()
    world, planner = World(scenario), paper(scenario, **options)
    for _ in range(4):
        commands = planner.act(world.swarm_state())
        assert all(isinstance(command, Wrench) for command in commands.values())
        world.step(commands)
    assert not planner.last_decision.fallback


def test_the_threads_are_the_solvers_and_change_no_optimum(monkeypatch):
    seen = []

    def noting(milp, limits, **more):
        seen.append(limits.threads)
        return solve(milp, limits, **more)

    monkeypatch.setattr(paper_planner, "solver_named", lambda name: noting)
    objectives = []
    for threads in (1, 2, 1):
        planner = paper(horizon=6, threads=threads, gap=0.0, absolute_gap=1e-6)
        planner.act(World(field(moving_obstacles=[BALLOON])).swarm_state())
        assert planner.last_program.status is SolveStatus.OPTIMAL
        objectives.append(planner.last_program.objective)
    assert seen == [1, 2, 1]
    assert objectives == pytest.approx([objectives[0]] * 3, abs=1e-4)


def test_where_the_time_is_up_the_rest_of_the_last_plan_is_flown(monkeypatch):
    scenario = field()
    world, planner = World(scenario), paper(scenario, horizon=4, time_limit_s=60.0)
    planner.act(world.swarm_state())
    promised = planner.plan.u[:, 0]
    world.step(planner.act(world.swarm_state()))
    planner.plan = replace(planner.plan, u=np.stack([promised] * 3, axis=1))

    def out_of_time(milp, limits, **more):
        return replace(
            solve(milp, SolverLimits(nodes=0)),
            status=SolveStatus.NO_SOLUTION,
            values=None,
        )

    planner._solve = out_of_time
    commands = planner.act(world.swarm_state())
    decision = planner.last_decision
    assert (decision.fallback, decision.reason, decision.mip_gap) == (True, Reason.NO_TIME, None)
    flown = [command.lift_N for command in commands.values() if isinstance(command, Wrench)]
    assert flown == promised[:, 0].tolist()
    planner.plan = None
    hovering = planner.act(world.swarm_state())
    assert all(isinstance(command, Velocity) for command in hovering.values())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"formulation": "tight"}, "no formulation is called 'tight'"),
        ({"gap": "2"}, "gap"),
        ({"time_limit_s": "0"}, "time_limit_s"),
        ({"horizon": "1"}, "horizon"),
        ({"taylor_order": "1"}, "taylor_order"),
        ({"order": "4"}, "taylor_order"),
        ({"physical_sides": "6"}, "physical_sides"),
        ({"solver": "scip", "threads": "2"}, "give threads=1"),
    ],
)
def test_an_option_that_cannot_be_is_one_line(options, said):
    with pytest.raises(InputError, match=said) as error:
        load_planner("milp-mpc-paper", options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("typed", ["none", "inf"])
def test_no_time_limit_can_be_typed_and_is_kept_in_the_record(typed, tmp_path):
    options = {"time_limit_s": typed, "horizon": "2"}
    planner = MilpMpcPaper(MilpMpcPaper.Options.model_validate(options))
    assert planner.options.time_limit_s is None
    flown = rollout(field(), planner, max_steps=1)
    flown.save(tmp_path / "flight")
    assert Flight.load(tmp_path / "flight").planner_options["time_limit_s"] is None


@pytest.mark.parametrize("planner_class", [MilpMpc, MilpMpcPaper])
def test_the_vehicles_own_return_rule_can_be_asked_for(planner_class):
    scenario = field()
    planner = planner_class(planner_class.Options(return_rule="vehicle"))
    planner.reset(MissionBrief.of(scenario), 0)
    swarm = World(scenario).swarm_state()
    threshold = return_threshold(S500, 0.75)
    assert threshold == pytest.approx(0.75 - 193.816 * 180.0 / (3600.0 * 5.0 * 14.8))
    for dod, mode in ((threshold - 1e-3, "covering"), (threshold + 1e-3, "return")):
        swarm.x[:, 12] = dod
        planner.problem(swarm)
        assert planner.mode("uas_1") == mode


@pytest.mark.parametrize(
    ("rule", "modes"),
    [
        (None, ("covering", "return")),
        ("vehicle", ("return", "return")),
        ("waypoints", ("covering", "covering")),
    ],
)
def test_who_lands_elsewhere_keeps_back_the_way_there_and_who_comes_back_the_vehicles(rule, modes):
    there, back = field().uas
    there = there.model_copy(update={"land_m": (95.0, 95.0, -1.0)})
    scenario = field().model_copy(update={"uas": (there, back)})
    planner, swarm = paper(scenario, return_rule=rule), World(scenario).swarm_state()
    swarm.x[:, DOD] = return_threshold(S500, 0.75) + 0.03
    planner.problem(swarm)
    assert tuple(planner.mode(uas.name) for uas in scenario.uas) == modes


@pytest.mark.parametrize(
    ("name", "routed"),
    [
        *(("village", False), ("corridor", False), ("open_field", False)),  # as the paper aims
        *(("indoor", True), ("air_taxi", True), ("walls:2", True)),
    ],
)
def test_targets_are_aimed_at_along_routes_where_a_wall_is_longer_than_the_horizon(name, routed):
    brief = MissionBrief.of(load_scenario(name))
    assert paper_planner.needs_routes(brief, MilpMpcPaper.Options()) is routed


def test_a_uas_sets_off_for_what_is_farther_than_its_horizon():
    city = load_scenario("air_taxi")
    planner, swarm = paper(city), World(city).swarm_state()
    planner.act(swarm)  # covers nothing: from the next decision on there is a target
    problem = planner.problem(swarm).only(0)
    assert planner.mode("taxi_1") == "transit"
    flown = planner.solved(problem, 0).x[0, :, :2]
    assert np.hypot(*(flown[-1] - flown[0])) > 500.0
