"""The constraint families of the OCP, one file each, named after the paper's (Sec. III-C)."""

from uas_coverage_baselines.milp_mpc.model.blocks.battery_reserve import BatteryReserve
from uas_coverage_baselines.milp_mpc.model.blocks.capabilities import Capabilities
from uas_coverage_baselines.milp_mpc.model.blocks.collision import Collision
from uas_coverage_baselines.milp_mpc.model.blocks.corner_cutting import CornerCutting
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import Coverage
from uas_coverage_baselines.milp_mpc.model.blocks.dynamics import Dynamics
from uas_coverage_baselines.milp_mpc.model.blocks.geofence import InsideGeofence
from uas_coverage_baselines.milp_mpc.model.blocks.min_height import MinHeight
from uas_coverage_baselines.milp_mpc.model.blocks.moving_obstacles import MovingObstacles
from uas_coverage_baselines.milp_mpc.model.blocks.obstacles import Obstacles
from uas_coverage_baselines.milp_mpc.model.blocks.slack import Slack
from uas_coverage_baselines.milp_mpc.model.blocks.target_distance import TargetDistance

__all__ = [
    "BatteryReserve",
    "Capabilities",
    "Collision",
    "CornerCutting",
    "Coverage",
    "Dynamics",
    "InsideGeofence",
    "MinHeight",
    "MovingObstacles",
    "Obstacles",
    "Slack",
    "TargetDistance",
]
