"""Blocks with data of their own, and the rows that hold a plan, by name."""

import numpy as np
import pytest
from practice_missions import mission
from radio_range import RadioRange
from toy_problems import planned, state, toy
from uas_coverage_baselines.milp_mpc import OCP, PAPER_OCP, MilpMpc, MilpMpcPaper
from uas_coverage_baselines.milp_mpc.model import ocp
from uas_coverage_baselines.milp_mpc.model.own_data import with_data
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems, write_problems
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp
from uas_coverage_baselines.milp_mpc.search.row_prices import row_prices

from uas_coverage_env import MissionBrief, World
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import rollout
from uas_coverage_env.world import Velocity

STATION_M = (50.0, 50.0, -1.0)
FAR = mission([((165.0, 50.0, -10.0), 8.0)], [STATION_M, (50.0, 70.0, -1.0)])


def farthest_m(flight, samples=slice(None)):
    away_m = flight.x[samples, :, :2] - np.array(STATION_M[:2])
    return float(np.linalg.norm(away_m, axis=2).max())


@pytest.fixture(scope="module")
def options():
    return MilpMpc.Options(horizon=8, teams=1)


def test_a_block_with_data_of_its_own_bounds_the_flight_as_its_data_say(options):
    free = rollout(FAR, MilpMpc(options), max_steps=12)
    bound = rollout(FAR, MilpMpc(options, (*OCP, RadioRange(70.0))), max_steps=12)
    assert farthest_m(free) > 80.0
    assert 50.0 < farthest_m(bound) < 70.1


@pytest.mark.parametrize("planner", [MilpMpc, MilpMpcPaper])
def test_data_are_those_of_now(planner):
    block = RadioRange(70.0, share=0.5, from_s=2.0)
    made, world = planner(planner.Options(horizon=8), (*PAPER_OCP, block)), World(FAR)
    made.reset(MissionBrief.of(FAR), 0)
    ranges_m = []
    for _ in range(4):
        swarm = world.swarm_state()
        own = made.problem(swarm).data_of(block)
        assert own["station_m"].tolist() == list(STATION_M)
        ranges_m.append(own["range_m"])
        world.step(dict.fromkeys(swarm.active, Velocity(0.0, 0.0, 1.0)))
    assert ranges_m == [70.0, 70.0, 35.0, 35.0]


def test_data_survive_a_file_of_decisions(tmp_path, options):
    block = RadioRange(60.0)
    made = MilpMpc(options, (*OCP, block))
    made.reset(MissionBrief.of(FAR), 0)
    problem = made.problem(World(FAR).swarm_state())
    write_problems(tmp_path / "one.json", "test", [problem], [0])
    read = read_problems(tmp_path / "one.json")[0].data_of(block)
    assert read["range_m"] == 60.0
    assert read["station_m"].tolist() == list(STATION_M)


class Named(RadioRange):
    name = "RadioRange"


class NoMapping:
    name = "NoMapping"

    def add_to(self, milp, v, problem):
        pass

    def data(self, brief, swarm):
        return 70.0


@pytest.mark.parametrize(
    ("blocks", "said"),
    [((NoMapping(),), "return a mapping"), ((RadioRange(), Named()), "two blocks are called")],
)
def test_data_that_cannot_be_told_apart_or_read_are_one_line(blocks, said):
    problem = toy(state((50.0, 50.0, -10.0)))
    brief, swarm = MissionBrief.of(FAR), World(FAR).swarm_state()
    with pytest.raises(InputError, match=said) as told:
        with_data(problem, blocks, brief, swarm)
    assert "\n" not in str(told.value)


def test_a_problem_without_the_blocks_data_says_where_it_comes_from():
    with pytest.raises(KeyError, match="no data of block RadioRange"):
        toy(state((50.0, 50.0, -10.0))).data_of(RadioRange())


def test_the_papers_list_of_blocks_is_the_papers():
    assert [type(block).__name__ for block in PAPER_OCP] == [
        *("Dynamics", "Capabilities", "Slack", "InsideGeofence", "TargetDistance", "Collision"),
        *("Obstacles", "MovingObstacles", "CornerCutting", "Coverage"),
    ]
    ours = {type(block).__name__ for block in OCP} - {type(b).__name__ for b in PAPER_OCP}
    assert ours == {"MinHeight", "TimeToGo", "BatteryReserve"}
    assert ocp.PAPER_OCP is PAPER_OCP


def test_rows_keep_their_names_in_the_program_that_is_solved():
    start = state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0))
    problem = toy(start, horizon=8, waypoints=[((90.0, 60.0, -10.0), 8.0)])
    program = RestrictedMilp(problem, first="state")
    names = program.row_names()
    assert len(names) == len(set(names)) == len(program.built.row_lower)
    assert len(names) < len(program.milp.row_names()), "some rows have become bounds"
    whole = program.milp.build()
    for row, name in enumerate(names):
        there = program.milp.row_names().index(name)
        span = slice(program.built.row_start[row], program.built.row_start[row + 1])
        other = slice(whole.row_start[there], whole.row_start[there + 1])
        assert program.built.column[span].tolist() == whole.column[other].tolist()


def test_the_row_that_holds_a_plan_is_named_and_its_dual_is_what_a_metre_is_worth():
    start = state((60.0, 60.0, -10.0), (6.0, 0.0, 0.0))
    waypoints = [((100.0, 60.0, -16.0), 6.0)]

    class Ceiling:
        def __init__(self, height_m):
            self.height_m = height_m

        def add_to(self, milp, v, problem):
            milp.subject_to("ceiling", (1.0, v.position[:, 1:, 2:]), lower=-self.height_m)
            milp.minimize(0.3, v.position[:, -1, 2])  # at the end the higher the better

    problem = toy(start, horizon=8, waypoints=waypoints)
    blocks = (*OCP, Ceiling(15.0))
    plan = planned(decide(problem, None, 1.0, Effort(teams=1), blocks=blocks))
    prices = row_prices(problem, plan, blocks)
    # a metre more gains 0.3 at the end and takes a little lift
    assert 0.2 < prices["ceiling(0,7)"] < 0.3
    assert not any(name.startswith("dynamics") for name in prices)
    free = row_prices(problem, plan, (*OCP, Ceiling(40.0)))
    assert not any(name.startswith("ceiling") for name in free)
