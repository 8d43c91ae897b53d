"""Flying along an order of the waypoints, by the world's guidance, and searching it again."""

from uas_coverage_env.planning.following.following import Following, Order, Seen
from uas_coverage_env.planning.following.searched_order import SearchedAgain, SearchedOrder

__all__ = ["Following", "Order", "SearchedAgain", "SearchedOrder", "Seen"]
