"""The constraint families of the OCP, one file each, named after the paper's (Sec. III-C)."""

from uas_coverage_baselines.milp_mpc.blocks.battery_reserve import BatteryReserve
from uas_coverage_baselines.milp_mpc.blocks.capabilities import Capabilities
from uas_coverage_baselines.milp_mpc.blocks.collision import Collision
from uas_coverage_baselines.milp_mpc.blocks.corner_cutting import CornerCutting
from uas_coverage_baselines.milp_mpc.blocks.coverage import Coverage, coverable
from uas_coverage_baselines.milp_mpc.blocks.dynamics import Dynamics
from uas_coverage_baselines.milp_mpc.blocks.geofence import Geofence
from uas_coverage_baselines.milp_mpc.blocks.moving_obstacles import MovingObstacles
from uas_coverage_baselines.milp_mpc.blocks.obstacles import Obstacles
from uas_coverage_baselines.milp_mpc.blocks.slack import Slack
from uas_coverage_baselines.milp_mpc.blocks.target_distance import TargetDistance
from uas_coverage_baselines.milp_mpc.blocks.time_to_go import TimeToGo

__all__ = [
    "BatteryReserve",
    "Capabilities",
    "Collision",
    "CornerCutting",
    "Coverage",
    "Dynamics",
    "Geofence",
    "MovingObstacles",
    "Obstacles",
    "Slack",
    "TargetDistance",
    "TimeToGo",
    "coverable",
]
