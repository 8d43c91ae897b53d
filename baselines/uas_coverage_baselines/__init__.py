"""Planners: the paper's MILP-MPC and simple baselines, found through `uas_coverage.planners`."""
