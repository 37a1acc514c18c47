"""The result of packing: which shape lies where, and what can be asked about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..files import path_of, replace_file
from ..geometry import Shape
from ..geometry.base import FloatArray
from .arguments import choice, integer, number, vector
from .outlines import equivalent_radius, geometry_of, placed_polygons
from .overlaps import overlapping, part_inside

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_READ_ONLY = ("shape_index", "positions", "scales", "angles", "axes")
_LINES = ("sieve", "passing")


@dataclass(frozen=True, eq=False, repr=False)
class Packing:
    """Grains in their places.

    Grain k is the shape ``shapes[shape_index[k]]``, scaled by ``scales[k]`` and turned by
    ``angles[k]`` about ``axes[k]``, both about the origin of the shape, which then lies at
    ``positions[k]``.

    Attributes
    ----------
    shapes : tuple of shape
        The distinct shapes.
    shape_index : ndarray of int, shape (n,)
        Shape of each grain.
    positions : ndarray, shape (n, 3)
        Origins of the shapes [m].
    scales : ndarray, shape (n,)
        Factor on the shape as given.
    angles : ndarray, shape (n,)
        Angle [rad] about the axis.
    axes : ndarray, shape (n, 3)
        Axis of the turn; z in the plane.
    domain : float
        Area [m^2] or volume [m^3] packed into.
    container : geometry.Shape or None
        The domain itself, where it is a shape.
    """

    shapes: tuple[Any, ...]
    shape_index: NDArray[np.intp]
    positions: FloatArray
    scales: FloatArray
    angles: FloatArray
    axes: FloatArray
    domain: float
    container: Shape | None = None

    def __post_init__(self) -> None:
        for name in _READ_ONLY:
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.scales)

    def __repr__(self) -> str:
        kinds = [g.type for g in self.geometries[:4]] + ["..."] * (len(self.shapes) > 4)
        size = ""
        if len(self):
            radii = self.radii
            size = f", radii {radii.min():.3g} to {radii.max():.3g} m"
        return (
            f"Packing({len(self)} grains of {len(self.shapes)} shapes ({', '.join(kinds)}){size}, "
            f"porosity {self.porosity:.3f})"
        )

    @cached_property
    def geometries(self) -> tuple[Shape, ...]:
        """The geometry of each shape."""
        return tuple(geometry_of("Packing", shape) for shape in self.shapes)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.geometries[0].dimension

    @property
    def radii(self) -> FloatArray:
        """Radii [m] that enclose the grains, as placed, shape (n,)."""
        return self._per_shape([g.bounding_radius for g in self.geometries]) * self.scales

    @property
    def volumes(self) -> FloatArray:
        """Areas [m^2] or volumes [m^3] of the grains, shape (n,)."""
        of_shape = self._per_shape([g.volume for g in self.geometries])
        return np.asarray(of_shape * self.scales**self.dimension)

    @property
    def porosity(self) -> float:
        """One less the part of the domain that the grains fill.

        Of a grain that is partly outside only the part inside counts: in the plane cut out
        exactly, in 3D estimated by 4096 points. Grains that overlap count twice. Without a
        container all grains count as inside.
        """
        inside = 1.0 if self.container is None else part_inside(self)
        porosity = float(1.0 - (self.volumes * inside).sum() / self.domain)
        return 0.0 if abs(porosity) < 1e-12 else porosity  # cells that tile: round-off

    def _per_shape(self, values: Sequence[float]) -> FloatArray:
        return np.array(values, dtype=float)[self.shape_index]

    # sizes

    def sizes(self, measure: str = "bounding") -> FloatArray:
        """Return the sizes [m] of the grains, shape (n,).

        Parameters
        ----------
        measure : {"bounding", "equivalent"}
            Radius that encloses the grain, or of the circle or sphere of its area or volume.
        """
        choice("Packing.sizes", "measure", measure, ("bounding", "equivalent"))
        if measure == "bounding":
            return self.radii
        return self._per_shape([equivalent_radius(g) for g in self.geometries]) * self.scales

    def grading(
        self, sieves: ArrayLike | None = None, *, measure: str = "bounding"
    ) -> pd.DataFrame:
        """Return the grading curve: which part of the mass passes each sieve.

        Parameters
        ----------
        sieves : array_like, optional
            Openings [m]; by default 20 from the smallest to the largest grain.
        measure : {"bounding", "equivalent"}
            Which radius, see `sizes`; a grain passes a sieve as wide as twice that.

        Returns
        -------
        DataFrame
            Columns sieve [m] and passing (0 to 1).
        """
        import pandas as pd

        diameters = 2.0 * self.sizes(measure)
        if sieves is None:
            sieves = np.linspace(diameters.min(), diameters.max(), 20) if len(self) else []
        openings = np.array(
            [number("Packing.grading", "sieves", s, above=0) for s in np.ravel(sieves)]
        )
        order = np.argsort(diameters, kind="stable")
        mass = np.concatenate([[0.0], np.cumsum(self.volumes[order])])
        # a grain as large as the sieve passes, round-off allowed
        count = np.searchsorted(diameters[order], openings * (1.0 + 1e-12), side="right")
        passing = mass[count] / mass[-1] if len(self) else np.zeros(0)
        return pd.DataFrame(dict(zip(_LINES, (openings, passing), strict=True)))

    # checks

    def overlaps(self, tolerance: float = 0.0) -> pd.DataFrame:
        """Return the pairs of grains that overlap.

        In the plane the outlines are compared (curves as polygons of 128 sides), in 3D balls by
        their radii, convex polyhedra by their vertices and all else by the enclosing ball.

        Parameters
        ----------
        tolerance : float
            Depth [m] that is not yet an overlap; in the plane the depth of two grains is taken
            as the side of a square of the area they share.

        Returns
        -------
        DataFrame
            Columns first, second (numbers of grains) and depth [m].
        """
        import pandas as pd

        tolerance = number("Packing.overlaps", "tolerance", tolerance, least=0)
        first, second, depth = overlapping(self)
        deep = depth > tolerance
        return pd.DataFrame({"first": first[deep], "second": second[deep], "depth": depth[deep]})

    # parts

    def select(self, mask: ArrayLike) -> Packing:
        """Return some of the grains.

        Parameters
        ----------
        mask : array_like of bool, shape (n,), or of int
            Which to keep.

        Raises
        ------
        InputError
            If the mask does not fit.
        """
        chosen = np.asarray(mask)
        if chosen.dtype == bool and chosen.shape != (len(self),):
            raise InputError(
                f"Packing.select: mask: has shape {chosen.shape}: must be ({len(self)},), one for "
                "each grain; correct it"
            )
        if chosen.dtype != bool:
            if chosen.size and chosen.dtype.kind not in "iu":
                raise InputError("Packing.select: mask: must be of bool or int; correct it")
            chosen = chosen.astype(int).reshape(-1)
            if chosen.size and not (-len(self) <= chosen.min() and chosen.max() < len(self)):
                raise InputError(
                    f"Packing.select: mask: names a grain beyond the {len(self)} there are; "
                    f"use 0 to {len(self) - 1}"
                )
        return replace(self, **{name: getattr(self, name)[chosen] for name in _READ_ONLY})

    def __add__(self, other: Packing) -> Packing:
        if not isinstance(other, Packing):
            return NotImplemented
        if other.dimension != self.dimension:
            raise InputError("Packing + Packing: must be both plane or both in 3D; pack again")
        shapes = list(self.shapes)
        places = []
        for shape in other.shapes:
            if shape not in shapes:
                shapes.append(shape)
            places.append(shapes.index(shape))
        arrays = {name: np.concatenate([getattr(self, name), getattr(other, name)])
                  for name in _READ_ONLY}  # fmt: skip
        arrays["shape_index"][len(self) :] = np.array(places, dtype=np.intp)[other.shape_index]
        same = self.container is other.container and self.container is not None
        domain = self.domain if same else self.domain + other.domain
        container = self.container if same else None
        return replace(self, shapes=tuple(shapes), domain=domain, container=container, **arrays)

    def moved(self, by: ArrayLike) -> Packing:
        """Return the packing moved by a vector [m]; it forgets its container.

        Parameters
        ----------
        by : array_like
            2 or 3 numbers [m].
        """
        d = 2 if np.size(by) == 2 and self.dimension == 2 else 3
        shift = np.zeros(3)
        shift[:d] = vector("Packing.moved", "by", by, d)
        positions = self.positions + shift
        filled = (1.0 - self.porosity) * self.domain
        if not np.isclose(filled, self.volumes.sum(), rtol=1e-9):
            raise InputError(
                "Packing.moved: some grains stick out of the domain, which is not moved with them; "
                "use select to leave them out"
            )
        return replace(self, positions=positions, container=None)

    # tables and pictures

    def to_frame(self) -> pd.DataFrame:
        """Return a table of the grains.

        Returns
        -------
        DataFrame
            Columns shape, x, y, z [m], scale, angle [rad], radius [m] and, in 3D, ax, ay, az.
        """
        import pandas as pd

        columns = {"shape": self.shape_index, **dict(zip("xyz", self.positions.T, strict=True))}
        columns |= {"scale": self.scales, "angle": self.angles, "radius": self.radii}
        if self.dimension == 3:
            columns |= dict(zip(("ax", "ay", "az"), self.axes.T, strict=True))
        return pd.DataFrame(columns)

    def to_csv(self, path: Path | str, *, first_zone: int = 0) -> Path:
        """Write the placement file of a deck: columns i, x, y, z, r, o (3D: and ax, ay, az).

        Parameters
        ----------
        path : Path or str
            File to write; whole or absent.
        first_zone : int
            Zone of the first shape, counted from 0; the others follow.

        Returns
        -------
        Path

        Raises
        ------
        InputError
            If a shape has no leading length, by which a deck scales it.
        """
        first_zone = integer("Packing.to_csv", "first_zone", first_zone, least=0)
        lengths = [g.scale_length for g in self.geometries]
        for k, length in enumerate(lengths):
            if length is None and (self.shape_index == k).any():
                raise InputError(
                    f"Packing.to_csv: shapes[{k}], a {self.geometries[k].type}: has no leading "
                    "length, by which a deck scales a body; use to_frame().to_csv(...)"
                )
        r = self._per_shape([length or 0.0 for length in lengths]) * self.scales
        columns = [self.shape_index + first_zone, *self.positions.T, r, self.angles]
        names = "i, x, y, z, r, o"
        if self.dimension == 3:
            columns += list(self.axes.T)
            names += ", ax, ay, az"
        lines = [names]
        for zone, *values in zip(*columns, strict=True):
            lines.append(", ".join([str(int(zone)), *(repr(float(v)) for v in values)]))
        path = path_of(path, "to_csv: path")
        with replace_file(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    def plot(self, ax: Axes | None = None, *, color: str = "shape") -> Axes:
        """Draw the packing with matplotlib.

        Parameters
        ----------
        ax : Axes, optional
            Where to draw, with ``projection="3d"`` in 3D; a new figure by default.
        color : {"shape", "radius", "order"}
            What the colours mean.

        Returns
        -------
        Axes
            The axes; ``ax.figure`` is the figure.
        """
        from .pictures import draw

        return draw(self, ax, color)

    def polygons(self) -> NDArray[Any]:
        """Return the outlines of plane grains as shapely polygons, shape (n,).

        Raises
        ------
        InputError
            In 3D.
        """
        if self.dimension != 2:
            raise InputError("Packing.polygons: of solids there are none; use radii")
        return placed_polygons(
            self.geometries, self.shape_index, self.positions[:, :2], self.scales, self.angles
        )
