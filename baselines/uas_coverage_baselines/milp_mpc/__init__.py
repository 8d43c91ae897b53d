"""The paper's MILP-MPC (Gasche et al., Sec. III)."""

from uas_coverage_baselines.milp_mpc.planner import MilpMpc

__all__ = ["MilpMpc"]
