"""What a step leaves of the record of the step before: nothing."""

import os
import subprocess
import sys

import numpy as np

from uas_coverage_env.world.outcome import NONE, NOTHING, OUTCOME_DTYPE

COUNTER = """
import numpy as np
from uas_coverage_env.compiled import memory

declared = memory.record_dtype
memory.record_dtype = lambda fields: declared(
    [*fields, ("looks", "i8")] if ("flew", "?") in fields else fields
)
from uas_coverage_env.simulation.step import begin_step
from uas_coverage_env.simulation import World
from uas_coverage_env import load_scenario
from uas_coverage_env.world.commands import COMMAND_DTYPE
from uas_coverage_env.world.outcome import OUTCOME_DTYPE

world = World(load_scenario("open_field"))
outcome = np.ones(len(world.names), OUTCOME_DTYPE)
begin_step(world.state, np.zeros(len(world.names), COMMAND_DTYPE), outcome)
assert not outcome["looks"].any(), outcome["looks"]
"""


def test_a_field_that_is_added_to_the_record_begins_each_step_at_zero():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", COUNTER], check=True, env=environment)


def test_a_step_begins_without_a_contact_and_with_nothing_near():
    assert NOTHING["contact"] == NONE
    assert NOTHING["contact_with"] == -1
    far = {name for name in OUTCOME_DTYPE.names if NOTHING[name].dtype.kind == "f"
           and np.isinf(NOTHING[name]).all()}  # fmt: skip
    assert far == {"obstacle_clearance_m", "separation_m", "fence_clearance_m"}
