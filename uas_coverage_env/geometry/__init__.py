"""Convex hulls, the paper's round shapes, and exact tests of straight segments against them."""

from uas_coverage_env.geometry.polytope import ConvexPolytope
from uas_coverage_env.geometry.round_shapes import cylinder_faces, sphere_faces

__all__ = ["ConvexPolytope", "cylinder_faces", "sphere_faces"]
