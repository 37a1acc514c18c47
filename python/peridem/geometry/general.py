"""Any region of the plane with straight edges, any solid within a closed surface."""
# ruff: noqa: D102 - the members are documented once, in Shape

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import FUZZ, MARGIN, BoolArray, FloatArray, Shape, join_loops


class _Cached:
    """Keeps what is worked out once out of pickles; libraries' objects cannot be pickled."""

    def __getstate__(self) -> dict[str, Any]:
        fields = self.__dataclass_fields__  # type: ignore[attr-defined]
        return {name: value for name, value in self.__dict__.items() if name in fields}


@dataclass(frozen=True, kw_only=True, eq=False)
class Region(_Cached, Shape):
    """Plane region within a closed polygon, with polygonal holes.

    The centre is the centroid, the bounding radius the distance of the farthest corner.

    Attributes
    ----------
    outline : ndarray, shape (k, 3)
        Corners [m] of the outer edge, one after the other; the last differs from the first.
    holes : tuple of ndarray, each of shape (k, 3)
        Corners [m] of the holes.
    """

    outline: FloatArray
    holes: tuple[FloatArray, ...] = ()

    @property
    def dimension(self) -> int:
        return 2

    @cached_property
    def _polygon(self) -> Any:
        import shapely

        flat = [loop[:, :2] for loop in (self.outline, *self.holes)]
        polygon = shapely.Polygon(flat[0], flat[1:])
        shapely.prepare(polygon)
        return polygon

    @property
    def center(self) -> FloatArray:
        middle = self._polygon.centroid
        return np.array([middle.x, middle.y, self.outline[0, 2]])

    @property
    def bounding_radius(self) -> float:
        return float(np.linalg.norm(self.outline - self.center, axis=1).max())

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return self.outline.min(axis=0), self.outline.max(axis=0)

    @property
    def volume(self) -> float:
        return float(self._polygon.area)

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        import shapely

        tolerance = MARGIN + FUZZ * self.bounding_radius
        found = _near(self, points[:, :2], tolerance)
        near = shapely.points(points[found, :2])
        if strict:
            edge = shapely.distance(self._polygon.boundary, near)
            found[found] = shapely.contains_properly(self._polygon, near) & (edge > tolerance)
        else:
            found[found] = shapely.distance(self._polygon, near) <= tolerance
        return found

    def boundary(self) -> FloatArray:
        return join_loops([np.vstack([loop, loop[:1]]) for loop in (self.outline, *self.holes)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid(_Cached, Shape):
    """Solid within a closed surface of triangles that are oriented outwards.

    The centre is the centroid, the bounding radius the distance of the farthest corner.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Corners [m].
    triangles : ndarray of int, shape (m, 3)
        Corners of the triangles, counter-clockwise seen from outside.
    """

    points: FloatArray
    triangles: NDArray[np.int64]

    @property
    def dimension(self) -> int:
        return 3

    @cached_property
    def _moments(self) -> tuple[float, FloatArray]:
        """Volume and centroid: sums over the tetrahedra between each triangle and a point."""
        origin = self.points.mean(axis=0)
        a, b, c = ((self.points - origin)[self.triangles[:, k]] for k in range(3))
        volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        total = float(volumes.sum())
        if total == 0.0:
            return total, origin
        return total, origin + (volumes @ (a + b + c)) / (4.0 * total)

    @property
    def center(self) -> FloatArray:
        return np.array(self._moments[1])

    @property
    def bounding_radius(self) -> float:
        return float(np.linalg.norm(self.points - self.center, axis=1).max())

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return self.points.min(axis=0), self.points.max(axis=0)

    @property
    def volume(self) -> float:
        return self._moments[0]

    @cached_property
    def _distance(self) -> Any:
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
        from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

        corners = vtkPoints()
        corners.SetData(_arrays().numpy_to_vtk(np.ascontiguousarray(self.points), deep=True))
        ids = _arrays().numpy_to_vtkIdTypeArray(
            np.ascontiguousarray(self.triangles.ravel()), deep=True
        )
        cells = vtkCellArray()
        cells.SetData(3, ids)
        surface = vtkPolyData()
        surface.SetPoints(corners)
        surface.SetPolys(cells)
        distance = vtkImplicitPolyDataDistance()
        distance.SetInput(surface)
        return distance

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        from vtkmodules.vtkCommonCore import vtkDoubleArray

        tolerance = MARGIN + FUZZ * self.bounding_radius
        found = _near(self, points, tolerance)
        if found.any():
            result = vtkDoubleArray()
            given = np.ascontiguousarray(points[found])
            self._distance.FunctionValue(_arrays().numpy_to_vtk(given), result)  # negative inside
            distance = _arrays().vtk_to_numpy(result)
            found[found] = distance < -tolerance if strict else distance <= tolerance
        return found

    def boundary(self) -> FloatArray:
        import shapely

        flat = self.points[self.triangles][:, :, :2]
        shadow = shapely.union_all(shapely.polygons(flat[np.abs(_areas(flat)) > 0.0]))
        loops = []
        for part in shapely.get_parts(shadow):
            loops += [np.asarray(ring.coords)[:, :2] for ring in (part.exterior, *part.interiors)]
        z = self.points[:, 2].min()
        return join_loops([np.column_stack([loop, np.full(len(loop), z)]) for loop in loops])


def _near(shape: Shape, points: FloatArray, tolerance: float) -> BoolArray:
    """Tell which points, of two or three coordinates, lie in the box of a shape."""
    lower, upper = (corner[: points.shape[1]] for corner in shape.box)
    return np.asarray(((points >= lower - tolerance) & (points <= upper + tolerance)).all(axis=1))


def _arrays() -> Any:
    """VTK's bridge to NumPy, which has no types."""
    return importlib.import_module("vtkmodules.util.numpy_support")


def _areas(flat: FloatArray) -> FloatArray:
    """Signed areas of plane triangles, shape (m, 3, 2)."""
    (ax, ay), (bx, by) = (flat[:, 1] - flat[:, 0]).T, (flat[:, 2] - flat[:, 0]).T
    return np.asarray(0.5 * (ax * by - ay * bx))
