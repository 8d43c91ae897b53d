"""R2: the judge's distances on random segments against those of the independent checker."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.segments import cylinder_clearance, segment_clearance
from uas_coverage_env.independent_check.distances import (
    cylinder_distance,
    hull_distance,
    least_on_segments,
)

FIRST_SEED = 12000
SEGMENTS = 1000
SAME_M = 1e-6
_RADIUS_M = 0.4
_SHAPES = ("hull", "cylinder", "UAS")
_LENGTHS_M = (0.0, 1e-6, 0.1, 12.0, 100.0)

FloatArray = NDArray[np.float64]


def _segments(rng: np.random.Generator, size_m: float) -> tuple[FloatArray, FloatArray]:
    """Segments (n, 3) around a body at the origin: long, short, of no length, along an axis."""
    start = rng.uniform(-2.0, 2.0, (SEGMENTS, 3)) * size_m
    way = rng.normal(size=(SEGMENTS, 3))
    way[rng.random((SEGMENTS, 3)) < 0.2] = 0.0  # along an axis, a plane, or nowhere
    length_m = rng.choice(_LENGTHS_M, SEGMENTS) * rng.random(SEGMENTS)
    way *= (length_m / np.maximum(np.linalg.norm(way, axis=1), 1e-12))[:, None]
    towards = rng.random(SEGMENTS) < 0.3  # ends in the body or beyond it
    end = np.where(towards[:, None], -start * rng.random((SEGMENTS, 1)), start + way)
    return start, end


def compare(shape: str, seed: int) -> Result:
    """Distances from one body: how far the two are apart, and how often they judge otherwise.

    Args:
        shape: One of `_SHAPES`.
        seed: Of the body and of the segments.
    """
    rng = np.random.default_rng([seed, _SHAPES.index(shape)])
    size_m = float(rng.uniform(1.0, 40.0))
    start, end = _segments(rng, size_m)
    if shape == "hull":
        points = rng.uniform(-size_m, size_m, (int(rng.integers(4, 13)), 3))
        points[:, int(rng.integers(3))] *= float(rng.choice([1.0, 0.02]))  # walls and slabs, too
        faces = ConvexPolytope.from_points(points)
        body = faces.normals, faces.offsets_m, 0, faces.n_faces
        distance = hull_distance(points)
        ours = [segment_clearance(*body, *p, *q) for p, q in zip(start, end, strict=True)]
    else:
        cylinder = (0.0, 0.0) if shape == "UAS" else (size_m, float(rng.uniform(0.5, 20.0)))
        distance = cylinder_distance(*cylinder)
        ours = [cylinder_clearance(*cylinder, *p, *q) for p, q in zip(start, end, strict=True)]
    theirs = least_on_segments(distance, start, end)
    off = np.abs(np.array(ours) - theirs)
    other = (np.array(ours) < _RADIUS_M) != (theirs < _RADIUS_M)
    return {
        "shape": shape,
        "segments": SEGMENTS,
        "apart": int((off > SAME_M).sum()),
        "judged_otherwise": int((other & (off > SAME_M)).sum()),
        "contacts": int((theirs < _RADIUS_M).sum()),
        "worst_m": float(off.max()),
    }


def trials(quick: bool) -> list[Trial]:
    """Bodies of every shape."""
    seeds = range(FIRST_SEED, FIRST_SEED + (20 if quick else 334))
    return [Trial(f"{shape} {seed}", compare, (shape, seed)) for shape in _SHAPES for seed in seeds]


def finding(results: Mapping[str, Result]) -> Finding:
    """A segment whose distances are not the same has failed."""
    rows = []
    good = [one for one in results.values() if "error" not in one]
    for shape in _SHAPES:
        mine = [one for one in good if one["shape"] == shape]
        if mine:
            counts = [sum(one[k] for one in mine) for k in ("segments", "contacts", "apart")]
            judged = sum(one["judged_otherwise"] for one in mine)
            worst_m = max(one["worst_m"] for one in mine)
            rows.append([shape, len(mine), *(f"{n:,}" for n in counts), judged, f"{worst_m:.1e}"])
    headings = ("body", "bodies", "segments", "contacts", "apart", "judged otherwise", "worst, m")
    failed = sum(one["apart"] for one in good) + SEGMENTS * len(errors(results))
    return Finding(SEGMENTS * len(results), failed, markdown(headings, rows))


ROW = Row(
    "R2",
    "The judge against the independent checker",
    "segments",
    f"the smallest distances of a straight segment from a body are the same to {SAME_M:g} m: that "
    "of the judge, in closed form, and that of `independent_check/distances.py`, by narrowing a "
    "convex function",
    trials,
    finding,
    lambda quick: (
        f"from {FIRST_SEED} on: hulls (thin ones among them), upright cylinders and pairs of UAS, "
        f"{SEGMENTS:,} segments each, of no length up to 100 m"
    ),
    "Whole flights: the option `--check` of `compare` has each judged by both. The "
    "geofence, whose distance counts at samples.",
)
