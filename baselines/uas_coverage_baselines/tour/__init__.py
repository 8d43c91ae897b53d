"""`tour`: one global route per UAS, flown by commands that are tried out in simulation first."""

from uas_coverage_baselines.tour.planner import Tour, TourOptions

__all__ = ["Tour", "TourOptions"]
