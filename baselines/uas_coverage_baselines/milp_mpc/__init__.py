"""The paper's MILP-MPC (Gasche et al., Sec. III), and ours that follows a global order."""

from uas_coverage_baselines.milp_mpc.guided import MilpMpcGuided
from uas_coverage_baselines.milp_mpc.planner import MilpMpc

__all__ = ["MilpMpc", "MilpMpcGuided"]
