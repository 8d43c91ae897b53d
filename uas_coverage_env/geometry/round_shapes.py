"""Round shapes as sets of linear functions (Gasche et al., Sec. III-B.3).

Each function returns the coefficient rows of f_poly,h in the paper's order: row h - 1 is f_poly,h,
and f_poly,h(a) = row · a. The bound ‖a‖ ≤ a_max becomes rows · a ≤ a_max c_in (eq. const_Vec_ub).
"""

import numpy as np
from numpy.typing import NDArray


def cylinder_faces(H: int) -> NDArray[np.float64]:
    """Infinitely high cylinder as an H-sided polygon.

    Args:
        H: Number of sides; even, at least 4.

    Returns:
        (H, 3) [-] unit rows; row h - 1 points to α_h = 2πh/H.
    """
    alpha = 2 * np.pi * np.arange(1, _checked(H) + 1) / H
    return _exact_zeros(np.column_stack([np.cos(alpha), np.sin(alpha), np.zeros(H)]))


def closed_cylinder_faces(H: int) -> NDArray[np.float64]:
    """Closed cylinder: the H sides, then the lower and the upper end.

    Args:
        H: Number of sides; even, at least 4.

    Returns:
        (H + 2, 3) [-] unit rows; the last two are z and -z.
    """
    return np.vstack([cylinder_faces(H), _ends()])


def outside_upright_m(
    away_m: NDArray[np.float64], radius_m: float = 0.0, half_height_m: float = 0.0
) -> NDArray[np.float64]:
    """(...) distance of places from a closed upright cylinder about the origin [m].

    The same of many places as `segments.outside_cylinder` of one; without a size the distance of
    two points, level or upright, whichever is larger.

    Args:
        away_m: (..., 3) [m].
        radius_m: Of the cylinder.
        half_height_m: Of the cylinder.
    """
    level_m = np.hypot(away_m[..., 0], away_m[..., 1]) - radius_m
    return np.maximum(level_m, np.abs(away_m[..., 2]) - half_height_m)


def sphere_faces(H: int) -> NDArray[np.float64]:
    """Sphere, an H-sided polygon in the horizontal and in the vertical plane.

    Args:
        H: Number of sides; even, at least 4.

    Returns:
        (H (H/2 - 1) + 2, 3) [-] unit rows; the last two are z and -z.
    """
    rings = _checked(H) // 2 - 1
    h = np.arange(1, H * rings + 1)
    alpha = 2 * np.pi * ((h - 1) // rings + 1) / H
    beta = 2 * np.pi * ((h - 1) % rings + 1) / H
    sides = [np.cos(alpha) * np.sin(beta), np.sin(alpha) * np.sin(beta), np.cos(beta)]
    return np.vstack([_exact_zeros(np.column_stack(sides)), _ends()])


def inner_factor(H: int, dimensions: int) -> float:
    """c_in that shrinks the polygon or polyhedron until the round shape contains it.

    Args:
        H: Number of sides; even, at least 4.
        dimensions: 2 for a polygon (cylinder), 3 for a sphere.

    Returns:
        cos(π/H) in 2D, cos(π/H)² in 3D (eq. const_Vec_ub).
    """
    if dimensions not in (2, 3):
        raise ValueError(f"dimensions is {dimensions!r}; it should be 2 or 3")
    return float(np.cos(np.pi / _checked(H)) ** (dimensions - 1))


def _checked(H: int) -> int:
    if isinstance(H, bool) or not isinstance(H, int | np.integer) or H < 4 or H % 2:
        raise ValueError(f"H is {H!r}; the number of sides should be even and at least 4")
    return int(H)


def _ends() -> NDArray[np.float64]:
    return np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])


def _exact_zeros(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Make cos(π/2) zero: rows without 1e-17 are shorter and the same on every machine."""
    return np.where(np.abs(rows) < 1e-12, 0.0, rows)
