"""Convex hulls, the paper's round shapes, and exact tests of straight segments against them."""

from uas_coverage_env.geometry.nearest import Nearest, nearest_on_segment
from uas_coverage_env.geometry.polytope import ConvexPolytope, corners_of
from uas_coverage_env.geometry.round_shapes import (
    closed_cylinder_faces,
    cylinder_faces,
    inner_factor,
    sphere_faces,
)
from uas_coverage_env.geometry.segments import (
    cylinder_clearance,
    cylinder_gap,
    outside_cylinder,
    segment_clearance,
    segment_meets,
    signed_distance,
)

__all__ = [
    "ConvexPolytope",
    "Nearest",
    "closed_cylinder_faces",
    "corners_of",
    "cylinder_clearance",
    "cylinder_faces",
    "cylinder_gap",
    "inner_factor",
    "nearest_on_segment",
    "outside_cylinder",
    "segment_clearance",
    "segment_meets",
    "signed_distance",
    "sphere_faces",
]
