"""Exact distances of points and straight segments from hulls and cylinders, compiled.

A hull is the range [first, last) of rows of `normals` (F, 3) and `offsets_m` (F,), so that all
hulls of a scenario fit in two arrays. Coordinates are scalars: no array is made in a time step.
Loops go over views of a hull's own rows: of their indices the compiler knows that none is negative.
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.compiled.views import rows_view

_SURE_M = 1e-6
"""More than rounding can change in a distance [m]."""


@kernel
def signed_distance(normals, offsets_m, first, last, x, y, z):
    """D(p): largest face distance of a point (Gasche et al., Sec. III-B.4).

    Args:
        normals: (F, 3) [-] outward unit normals.
        offsets_m: (F,) [m].
        first: First row of the hull.
        last: Row after its last; greater than `first`.
        x: North [m].
        y: East [m].
        z: Down [m].

    Returns:
        [m], negative inside.
    """
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    largest = -math.inf
    for h in range(away_m.shape[0]):
        distance = faces[h, 0] * x + faces[h, 1] * y + faces[h, 2] * z + away_m[h]
        if distance > largest:
            largest = distance
    return largest


@kernel
def segment_clearance(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1):
    """Smallest D(p) on the straight segment from p0 to p1, exact.

    Along the segment each face distance is a straight line, and D is their upper envelope, which
    is convex: follow it from p0, line by line, until it rises or the segment ends.

    Args:
        normals: (F, 3) [-] outward unit normals.
        offsets_m: (F,) [m].
        first: First row of the hull.
        last: Row after its last; greater than `first`.
        x0: Start, north [m].
        y0: Start, east [m].
        z0: Start, down [m].
        x1: End, north [m].
        y1: End, east [m].
        z1: End, down [m].

    Returns:
        [m], negative where the segment enters the hull.
    """
    dx = x1 - x0
    dy = y1 - y0
    dz = z1 - z0
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    n_faces = away_m.shape[0]
    height = -math.inf
    slope = 0.0
    for h in range(n_faces):
        a = faces[h, 0] * x0 + faces[h, 1] * y0 + faces[h, 2] * z0 + away_m[h]
        s = faces[h, 0] * dx + faces[h, 1] * dy + faces[h, 2] * dz
        # both computed before: a selection takes less time than a branch that is guessed wrong
        slope = s if a > height else slope
        height = a if a > height else height
    at = 0.0
    while slope < 0.0:
        # of the lines that fall less, the first to cross takes over
        at = 1.0
        takes_over = -1
        for h in range(n_faces):
            s = faces[h, 0] * dx + faces[h, 1] * dy + faces[h, 2] * dz
            a = faces[h, 0] * x0 + faces[h, 1] * y0 + faces[h, 2] * z0 + away_m[h]
            if (s > slope) & (height - a < at * (s - slope)):
                at = (height - a) / (s - slope)
                takes_over = h
        if takes_over < 0:
            break
        h = takes_over
        height = faces[h, 0] * x0 + faces[h, 1] * y0 + faces[h, 2] * z0 + away_m[h]
        slope = faces[h, 0] * dx + faces[h, 1] * dy + faces[h, 2] * dz
    return height + slope * at


@kernel
def segment_meets(normals, offsets_m, first, last, inflation_m, x0, y0, z0, x1, y1, z1):
    """Whether the segment enters the inflated hull: segment_clearance < inflation_m.

    Clips the segment to each inflated half-space in turn and stops when nothing is left, which
    for most obstacles is at once.

    Args:
        normals: (F, 3) [-] outward unit normals.
        offsets_m: (F,) [m].
        first: First row of the hull.
        last: Row after its last; greater than `first`.
        inflation_m: Distance that should be kept [m].
        x0: Start, north [m].
        y0: Start, east [m].
        z0: Start, down [m].
        x1: End, north [m].
        y1: End, east [m].
        z1: End, down [m].

    Returns:
        True where some point of the segment is closer than `inflation_m`.
    """
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    enters = 0.0
    leaves = 1.0
    for h in range(away_m.shape[0]):
        offset = away_m[h] - inflation_m
        d0 = faces[h, 0] * x0 + faces[h, 1] * y0 + faces[h, 2] * z0 + offset
        d1 = faces[h, 0] * x1 + faces[h, 1] * y1 + faces[h, 2] * z1 + offset
        if d0 >= 0.0:
            if d1 >= 0.0:
                return False
            enters = max(enters, d0 / (d0 - d1))
        elif d1 >= 0.0:
            leaves = min(leaves, d0 / (d0 - d1))
        if enters >= leaves:
            return False
    return True


@inlined_kernel
def _gap(a, b):
    """How far the range between two numbers is from zero."""
    return max(0.0, min(a, b), -max(a, b))


@inlined_kernel
def outside_cylinder(radius_m, half_height_m, x, y, z):
    """Distance of a point from a closed upright cylinder about the origin [m]."""
    return max(math.sqrt(x * x + y * y) - radius_m, abs(z) - half_height_m)


@kernel
def cylinder_clearance(radius_m, half_height_m, x0, y0, z0, x1, y1, z1):
    """Smallest distance from a closed upright cylinder about the origin on a segment, exact.

    The distance of a point is max(hypot(x, y) - radius, |z| - half_height): far enough
    horizontally or vertically. With the positions of two moving bodies relative to each other,
    this is the clearance between them; with radius and half height zero, the separation of two
    UAS.

    Both terms are convex along the segment. So the smallest maximum is at an end, at the closest
    horizontal approach, at equal height, or where the two terms are equal.

    Args:
        radius_m: Radius [m].
        half_height_m: Half the height [m].
        x0: Start relative to the centre, north [m].
        y0: Start relative to the centre, east [m].
        z0: Start relative to the centre, down [m].
        x1: End relative to the centre, north [m].
        y1: End relative to the centre, east [m].
        z1: End relative to the centre, down [m].

    Returns:
        [m], negative inside the cylinder.
    """
    dx = x1 - x0
    dy = y1 - y0
    dz = z1 - z0
    travelled = dx * dx + dy * dy
    approach = x0 * dx + y0 * dy
    smallest = min(
        outside_cylinder(radius_m, half_height_m, x0, y0, z0),
        outside_cylinder(radius_m, half_height_m, x1, y1, z1),
    )
    # closest horizontal approach, and equal height
    for turn in range(2):
        at = 0.0
        if turn == 0:
            if travelled > 0.0:
                at = -approach / travelled
        elif dz != 0.0:
            at = -z0 / dz
        if 0.0 < at < 1.0:
            distance = outside_cylinder(
                radius_m, half_height_m, x0 + at * dx, y0 + at * dy, z0 + at * dz
            )
            smallest = min(smallest, distance)
    for turn in range(2):
        # equal terms: x² + y² = (side z + c)² with c = radius - half_height: two roots a side
        side = 1.0 if turn == 0 else -1.0
        level = side * z0 + radius_m - half_height_m
        rise = side * dz
        a = travelled - rise * rise
        b = approach - level * rise
        c = x0 * x0 + y0 * y0 - level * level
        root = math.sqrt(max(b * b - a * c, 0.0))
        q = -(b + root) if b >= 0.0 else root - b
        at = q / a if abs(q) < abs(a) else 0.0
        if 0.0 < at < 1.0:
            distance = outside_cylinder(
                radius_m, half_height_m, x0 + at * dx, y0 + at * dy, z0 + at * dz
            )
            smallest = min(smallest, distance)
        at = c / q if abs(c) < abs(q) else 0.0
        if 0.0 < at < 1.0:
            distance = outside_cylinder(
                radius_m, half_height_m, x0 + at * dx, y0 + at * dy, z0 + at * dz
            )
            smallest = min(smallest, distance)
    return smallest


@inlined_kernel
def cylinder_gap(radius_m, half_height_m, x0, y0, z0, x1, y1, z1):
    """A lower bound of `cylinder_clearance`, from the box around the segment."""
    beside_m = max(_gap(x0, x1), _gap(y0, y1)) - radius_m
    return max(beside_m, _gap(z0, z1) - half_height_m) - _SURE_M
