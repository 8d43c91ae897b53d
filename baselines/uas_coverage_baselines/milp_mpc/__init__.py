"""The MILP-MPC of Gasche et al., Sec. III, as it is and in real time."""

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, PAPER_OCP, Block, formulate
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.paper_planner import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.planner import MilpMpc
from uas_coverage_baselines.milp_mpc.search.row_prices import row_prices

__all__ = [
    "OCP",
    "PAPER_OCP",
    "Block",
    "Milp",
    "MilpMpc",
    "MilpMpcPaper",
    "PlanningProblem",
    "Variables",
    "formulate",
    "row_prices",
]
