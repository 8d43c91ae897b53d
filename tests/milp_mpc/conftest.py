"""One decision that several files look at: two UAS around a tower."""

import pytest
from toy_problems import BY_NODES, planned, two_around_a_tower
from uas_coverage_baselines.milp_mpc.search.decision import decide


@pytest.fixture(scope="module")
def problem():
    """The decision."""
    return two_around_a_tower()


@pytest.fixture(scope="module")
def by_nodes(problem):
    """What is planned for it."""
    return planned(decide(problem, None, 1.0, BY_NODES))
