import numpy as np
import pytest

from uas_coverage_env import MissionBrief, generate_scenario, load_scenario
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env import CoverageParallelEnv, MissionInterface


@pytest.mark.parametrize("assisted", [False, True])
@pytest.mark.parametrize("name", ["village", "generated"])
def test_a_planner_sees_what_a_learner_sees(name, assisted):
    scenario = (
        load_scenario(name)
        if name == "village"
        else generate_scenario(900_500, n_uas=3, n_waypoints=9, n_obstacles=5)
    )
    env = CoverageParallelEnv(scenario, return_mode=assisted, safety_filter=assisted)
    observations, _ = env.reset(seed=0)
    observer = MissionInterface(MissionBrief.of(scenario))
    rng = np.random.default_rng(4)
    held = {}
    for k in range(120):
        swarm = env.swarm_state()
        seen = observer.observe(swarm)
        for i, agent in enumerate(env.possible_agents):
            if swarm.status[i] == FLYING:
                assert np.array_equal(seen[i], observations[agent])
        if not env.agents:
            break
        if k % 5 == 0:
            held = {agent: rng.uniform(-1, 1, 3).astype(np.float32) for agent in env.agents}
        observations, *_ = env.step({agent: held[agent] for agent in env.agents})
    assert k > 10
