"""Exact reductions of the OCP: the same optimum from a smaller or tighter program.

One reduction per file, with the proof that it is exact; `formulations` names what they add up to.
"""

from uas_coverage_baselines.milp_mpc.model.reductions.formulations import FORMULATIONS

__all__ = ["FORMULATIONS"]
