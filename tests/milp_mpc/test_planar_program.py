"""The program in a plane: no column, row or binary is about heights, and its plans are flown."""

import numpy as np
import pytest
from small_worlds import box, meadow, mover, waypoint
from uas_coverage_baselines.milp_mpc import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, ELIMINATED
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.paper_planner import PaperOptions
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp

from uas_coverage_env import World
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario.planar import Planar
from uas_coverage_env.vehicle.layout import LIFT, VZ, Z

HEIGHT_M = 10.0
WALL = box("wall", (110.0, 90.0, -30.0), (114.0, 110.0, 0.0))
LINTEL = box("lintel", (118.0, 40.0, -30.0), (122.0, 160.0, -16.0))


def decision(planar=True, movers=(), formulation="clique"):
    ground = meadow(
        ((100.0, 100.0, -HEIGHT_M), (100.0, 60.0, -HEIGHT_M)),
        obstacles=(WALL, LINTEL),
        moving_obstacles=movers,
        waypoints=[waypoint((124.0, 100.0, -HEIGHT_M), 6.0), waypoint((90.0, 60.0, -HEIGHT_M))],
    )
    if planar:
        ground = ground.model_copy(update={"planar": Planar(height_m=HEIGHT_M)})
    planner = MilpMpcPaper(PaperOptions(horizon=6, formulation=formulation))
    planner.reset(MissionBrief.of(ground), 0)
    world = World(ground)
    return planner, world, planner.problem(world.swarm_state())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_heights_have_no_columns_in_any_formulation(formulation):
    _, _, problem = decision(formulation=formulation)
    program = RestrictedMilp(problem, MilpMpcPaper(PaperOptions()).blocks, first=formulation)
    v = program.variables
    assert (v.x[..., Z] == ELIMINATED).all()
    assert (v.x[..., VZ] == ABSENT).all()
    assert (v.u[..., LIFT] == ABSENT).all()
    families = {name.partition("(")[0] for name in program.row_names()}
    assert not families & {"capabilities.climb", "capabilities.lift", "thrust.correction_descent"}
    assert not any(name.startswith(("slack.lift", "slack.climb")) for name in families)


def test_what_is_passed_under_has_no_rows_and_the_rest_is_smaller_than_in_space():
    _, _, flat = decision()
    _, _, space = decision(planar=False)
    blocks = MilpMpcPaper(PaperOptions()).blocks
    programs = [RestrictedMilp(problem, blocks, first="clique") for problem in (flat, space)]
    assert not any("lintel" in name for name in programs[0].row_names())
    assert any("lintel" in name for name in programs[1].row_names())
    whole, columns = (
        [count(program.built) for program in programs]
        for count in (lambda b: int(b.integer.sum()), lambda b: len(b.cost))
    )
    assert whole[0] < 0.8 * whole[1]
    assert columns[0] < 0.8 * columns[1]


def test_a_plan_in_the_plane_is_what_the_world_flies():
    planner, world, _ = decision()
    for _ in range(4):
        commands = planner.act(world.swarm_state())
        expected = planner.last_decision.predicted_m
        world.step(commands)
        for i, name in enumerate(("uas_1", "uas_2")):
            assert world.state.x[i, :3] == pytest.approx(expected[name][1], abs=1e-6)
        assert world.state.x[:, Z] == pytest.approx([-HEIGHT_M] * 2, abs=1e-9)
    assert not world.state.uncovered[1]


def test_what_moves_over_the_plane_has_no_rows_and_what_moves_in_it_is_passed_at_one_side():
    def names(down_m):
        kite = mover((115.0, 60.0, down_m), (0.0, (0.0, 0.0, 0.0)), height_m=4.0)
        _, _, problem = decision(movers=(kite,))
        program = RestrictedMilp(problem, MilpMpcPaper(PaperOptions()).blocks, first="clique")
        return [name for name in program.row_names() if name.startswith("mover")]

    assert names(-30.0) == []
    assert names(-12.0)
    assert names(-HEIGHT_M - 2.0 - 3.0 - 0.3)  # nearer than half its height and what is kept


def test_circles_round_waypoints_are_larger_than_what_fits_into_spheres():
    _, _, flat = decision()
    _, _, space = decision(planar=False)
    assert flat.waypoint_faces.shape == (4, 3)
    assert np.all(flat.waypoint_reach_m > space.waypoint_reach_m)
    assert np.all(flat.waypoint_reach_m < 10.0)
