"""A global order of the open waypoints for the whole swarm: which UAS visits which, and when."""

from uas_coverage_baselines.order.beginning import Beginning
from uas_coverage_baselines.order.search import Effort, Order, improved, no_order
from uas_coverage_baselines.order.task import Task

__all__ = ["Beginning", "Effort", "Order", "Task", "improved", "no_order"]
