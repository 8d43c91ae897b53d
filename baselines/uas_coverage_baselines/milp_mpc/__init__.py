"""The paper's MILP-MPC (Gasche et al., Sec. III), and ours that follows a global order."""

from uas_coverage_baselines.milp_mpc.guided import MilpMpcGuided
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block, Priced, formulate
from uas_coverage_baselines.milp_mpc.model.problem import (
    PlanningProblem,
    Trajectories,
    Variables,
    Weights,
)
from uas_coverage_baselines.milp_mpc.planner import MilpMpc

__all__ = [
    "OCP",
    "Block",
    "Milp",
    "MilpMpc",
    "MilpMpcGuided",
    "PlanningProblem",
    "Priced",
    "Trajectories",
    "Variables",
    "Weights",
    "formulate",
]
