"""Convex hulls as plane inequalities (Gasche et al., Sec. III-B.4)."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, HalfspaceIntersection, KDTree, QhullError

# Thinner bodies have no face that separates one side from the other.
_THINNEST_M = 1e-3
# Two triangles belong to one face when their normals differ by less than this [rad].
_SAME_NORMAL = 1e-7


@dataclass(frozen=True, eq=False)
class ConvexPolytope:
    """A convex body {p : d_h(p) ≤ 0 for all faces h} (Gasche et al., Sec. III-B.4).

    d_h(p) = normals[h] · p + offsets_m[h], with unit normals that point out of the body.

    Attributes:
        normals: (F, 3) [-] outward unit normals, in a fixed order.
        offsets_m: (F,) [m] the paper's c_0.
        vertices_m: (V, 3) [m] the corners, in the order in which they were given.
    """

    normals: NDArray[np.float64]
    offsets_m: NDArray[np.float64]
    vertices_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name, shape in (("normals", (-1, 3)), ("offsets_m", (-1,)), ("vertices_m", (-1, 3))):
            values = np.array(getattr(self, name), dtype=np.float64, order="C")
            if values.ndim != len(shape) or values.shape[1:] != shape[1:]:
                expected = "(F,)" if len(shape) == 1 else "(…, 3)"
                raise ValueError(f"{name} has shape {values.shape}; it should be {expected}")
            if not np.isfinite(values).all():
                raise ValueError(f"{name} should be finite; remove NaN and infinity")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        if len(self.normals) != len(self.offsets_m):
            counts = f"{len(self.normals)} normals and {len(self.offsets_m)} offsets_m"
            raise ValueError(f"{counts}; give one of each per face")

    @classmethod
    def from_points(cls, points_m: ArrayLike) -> Self:
        """The convex hull of points; coplanar triangles are one face.

        The faces come in lexicographic order of their normals, so that the same body always
        has the same rows.

        Args:
            points_m: (P, 3) [m] at least four points that do not lie in one plane.

        Raises:
            ValueError: The points span no volume, or are not finite.
        """
        points = _checked_points(points_m)
        centre = points.mean(axis=0)
        try:
            # about the centre: far from the origin, Qhull would lose digits of the offsets
            hull = ConvexHull(points - centre)
        except QhullError:
            raise ValueError(
                f"the {len(points)} points span no volume; give points that are not in one plane"
            ) from None
        normals = _merged(hull.equations[:, :3])
        corners = points[np.sort(hull.vertices)]
        # a face supports the body: no corner may lie outside by a rounding error
        offsets_m = -(normals @ (corners - centre).T).max(axis=1) - normals @ centre
        order = np.lexsort(np.column_stack([normals, offsets_m]).round(9).T[::-1])
        return cls(normals[order], offsets_m[order], corners)

    @property
    def n_faces(self) -> int:
        """Number of faces, the paper's N_f."""
        return len(self.offsets_m)

    def face_distances(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """d_h(p): signed distance of points from every face plane.

        Args:
            points_m: (..., 3) [m].

        Returns:
            (..., F) [m], positive outside.
        """
        return np.asarray(points_m, dtype=np.float64) @ self.normals.T + self.offsets_m

    def signed_distance(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """D(p) = max_h d_h(p): the largest face distance, negative inside.

        Args:
            points_m: (..., 3) [m].

        Returns:
            (...) [m].
        """
        return self.face_distances(points_m).max(axis=-1)

    def raised(self, height_m: float, kept_m: float = 0.0) -> Self:
        """The body with its upper faces raised straight up; what stands upright stays.

        A point over the roof lies in it where it is less than `height_m` above the roof. A roof
        that slopes down to the edge of the body goes on beyond the edge as it slopes.

        Args:
            height_m: By how much the upper faces are raised [m].
            kept_m: Distance that is kept from every face anyway [m]: a face is moved outward by
                no more than what is missing to that.

        Returns:
            The raised body with the same faces in the same order; this one where none is raised.
        """
        out_m = self._upward_m(height_m) - kept_m
        if not (out_m > 0.0).any():
            return self
        offsets_m = self.offsets_m - np.maximum(out_m, 0.0)
        corners_m = corners_of(self.normals, offsets_m, self.vertices_m.mean(axis=0))
        return type(self)(self.normals, offsets_m, np.unique(corners_m.round(9), axis=0))

    def distance_when_raised(self, points_m: ArrayLike, height_m: float) -> NDArray[np.float64]:
        """`raised(height_m).signed_distance(points_m)`, without looking for the corners.

        Args:
            points_m: (..., 3) [m].
            height_m: By how much the upper faces are raised [m].

        Returns:
            (...) [m].
        """
        offsets_m = self.offsets_m - self._upward_m(height_m)
        distances_m = np.asarray(points_m, dtype=np.float64) @ self.normals.T + offsets_m
        return distances_m.max(axis=-1)

    def _upward_m(self, height_m: float) -> NDArray[np.float64]:
        """(F,) how far faces move outward where the upper ones are raised."""
        return height_m * np.maximum(-self.normals[:, 2], 0.0)


def corners_of(
    normals: NDArray[np.float64], offsets_m: NDArray[np.float64], inside_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Corners of {p : normals · p + offsets_m ≤ 0}, some of them several times.

    Args:
        normals: (F, 3) [-] outward.
        offsets_m: (F,) [m].
        inside_m: (3,) [m] a point inside the body.

    Returns:
        (V, 3) [m].
    """
    planes = np.column_stack([normals, offsets_m + normals @ inside_m])
    return HalfspaceIntersection(planes, np.zeros(3)).intersections + inside_m


def _checked_points(points_m: ArrayLike) -> NDArray[np.float64]:
    points = np.asarray(points_m, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points have shape {points.shape}; give rows of x, y, z")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"point {row} is {points[row].tolist()}; give finite coordinates")
    if len(points) < 4:
        raise ValueError(f"a hull needs at least 4 points, not {len(points)}")
    centred = points - points.mean(axis=0)
    thinnest = np.linalg.svd(centred, full_matrices=False)[2][-1]
    thickness_m = np.ptp(centred @ thinnest)
    if thickness_m < _THINNEST_M:
        raise ValueError(
            f"the {len(points)} points lie in one plane (thickness {thickness_m:.2g} m); "
            f"give at least one point outside it"
        )
    return points


def _merged(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """One normal for each set of triangles that share a plane.

    A convex body has exactly one face in each outward direction, so equal normals suffice.
    """
    # zeros that are exact keep golden files and LP rows free of 1e-17
    normals = np.where(np.abs(normals) < 1e-12, 0.0, normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # the triangles of a face have the very same normal, mostly; the first of each stays
    normals = normals[np.sort(np.unique(normals, axis=0, return_index=True)[1])]
    near = KDTree(normals).query_pairs(_SAME_NORMAL, p=np.inf, output_type="ndarray")
    keep = np.ones(len(normals), np.bool_)
    for first, second in near[np.lexsort((near[:, 0], near[:, 1]))]:
        if keep[first]:
            keep[second] = False
    return normals[keep]
