"""What all public shapes share: how they are made, compared, shown and meshed."""

from __future__ import annotations

import dataclasses
import difflib
import hashlib
import math
from abc import ABCMeta, abstractmethod
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..geometry.base import FloatArray

if TYPE_CHECKING:
    from ..mesh import Mesh
    from .composite import Composite

Self = TypeVar("Self", bound="BodyShape")
Point = tuple[float, float, float]

SMALLEST, LARGEST = 1e-20, 1e20
"""Bounds [m] on every length of a shape: fifth powers of lengths must be numbers."""


_NEAR = 4.0
"""Shapes farther from the origin than this, by their bounding radius, are drawn at the origin."""


class NamedArguments(ABCMeta):
    """Checks the names of arguments, to say which was meant."""

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        """Make an object after all names of arguments were found right.

        Raises
        ------
        InputError
            If an argument has no name, an unknown one, or is missing.
        """
        every = sorted(dataclasses.fields(cls), key=_is_optional)  # type: ignore[arg-type]
        fields = [field for field in every if field.init]
        names = [field.name for field in fields]
        call = f"{cls.__name__}({', '.join(f'{name}=...' for name in names)})"
        if args:
            raise InputError(
                f"{cls.__name__}: {args[0]!r:.60} has no name: arguments are given by name; "
                f"write {call}"
            )
        for name in kwargs:
            if name not in names:
                near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
                remedy = f"did you mean {near[0]}?" if near else f"write {call}"
                raise InputError(f"{cls.__name__}: {name}: no such argument; {remedy}")
        for field in fields:
            if not _is_optional(field) and field.name not in kwargs:
                raise InputError(f"{cls.__name__}: {field.name}: is missing; write {call}")
        return super().__call__(**kwargs)


@dataclass(frozen=True, kw_only=True, repr=False)
class BodyShape(metaclass=NamedArguments):
    """A shape in its reference position, to be meshed and placed.

    Shapes are values: frozen, equal when their numbers are equal, usable as keys. A body
    made of a shape is its mesh, rotated about the origin, scaled and moved to its site.
    """

    _center_node: ClassVar[bool] = False

    @property
    @abstractmethod
    def geometry(self) -> Geometry:
        """The region of space it fills: centre, bounding radius, box, area, points inside."""

    @property
    def dimension(self) -> int:
        """2 for plane shapes, 3 for solids."""
        return self.geometry.dimension

    @property
    def deck_keys(self) -> dict[str, Any] | None:
        """Keys ``Type``, ``Parameters`` (and ``Vec_Type``, ``Vec_Flag``) of a deck.

        None when decks have no such shape; `nearest_deck_keys` has a stand-in then.
        """
        return None

    @property
    def nearest_deck_keys(self) -> dict[str, Any]:
        """Keys of a deck for bodies of this shape: `deck_keys`, else a circle or sphere.

        What a run takes from the shape of a body with a mesh of its own, its centre and its
        bounding radius, is the same; the box that loads without a region use is not.
        """
        if self.deck_keys is not None:
            return self.deck_keys
        ball = "circle" if self.dimension == 2 else "sphere"
        geometry = self.geometry
        return {
            "Type": ball,
            "Parameters": [geometry.bounding_radius, *geometry.center.tolist()],
        }

    @abstractmethod
    def scaled(self: Self, factor: float) -> Self:
        """Return the shape scaled about the origin.

        Parameters
        ----------
        factor : float
            Positive.
        """

    @abstractmethod
    def moved(self: Self, by: Sequence[float]) -> Self:
        """Return the shape moved.

        Parameters
        ----------
        by : sequence of 2 or 3 float
            Displacement [m].
        """

    def centered(self: Self) -> Self:
        """Return the shape moved so that its centre is the origin."""
        return self.moved((-self.geometry.center).tolist())

    def mesh(self, mesh_size: float, *, cache: bool = True) -> Mesh:
        """Mesh the shape: triangles in 2D, tetrahedra in 3D.

        Parameters
        ----------
        mesh_size : float
            Distance [m] that neighbouring nodes should have.
        cache : bool
            Take the mesh from the cache, in memory or on disk, when it was made before.

        Returns
        -------
        Mesh
            The same nodes in the same order every time.

        Raises
        ------
        InputError
            If the size is not positive, larger than the shape or gives millions of nodes, if
            gmsh is not installed or cannot mesh the shape.
        """
        from ..meshing import mesh_shape

        return mesh_shape(self, mesh_size, cache=cache)

    @property
    def has_center_node(self) -> bool:
        """Whether its meshes are made to have a node at its centre.

        The program damps bodies at the node nearest to their centres. Only shapes whose meshes
        do not become less even say so; spheres have such a node anyway.
        """
        return self._center_node

    @property
    def is_portable(self) -> bool:
        """Whether another process can draw it."""
        return True

    def draw(self, gmsh: Any) -> None:
        """Draw the shape in the current model of gmsh, for the mesher."""
        from ..meshing.drawing import draw

        draw(gmsh, self.geometry)

    def drawable(self) -> tuple[BodyShape, float, Point]:
        """Return the shape to be drawn, and scale and displacement [m] that bring it back.

        CAD kernels want bodies of about unit size near the origin. The scale is a power of two,
        so that it changes no digit.
        """
        geometry = self.geometry
        scale = 2.0 ** round(math.log2(geometry.bounding_radius))
        x, y, z = geometry.center.tolist()
        if math.hypot(x, y, z) <= _NEAR * geometry.bounding_radius:
            return self.scaled(1.0 / scale), scale, (0.0, 0.0, 0.0)
        return self.moved((-x, -y, -z)).scaled(1.0 / scale), scale, (x, y, z)

    @property
    def key(self) -> Hashable:
        """What tells its meshes from those of other shapes; a str if they may be kept on disk."""
        values = [repr(getattr(self, field.name)) for field in dataclasses.fields(self)]
        text = "\n".join([type(self).__name__, *values])
        return hashlib.sha256(text.encode()).hexdigest()

    def __add__(self, other: BodyShape) -> Composite:
        """Return both shapes together."""
        from .composite import combined

        return combined(self, other, plus=True)

    def __sub__(self, other: BodyShape) -> Composite:
        """Return the first shape without the second."""
        from .composite import combined

        return combined(self, other, plus=False)

    def __repr__(self) -> str:
        shown = [
            f"{field.name}={getattr(self, field.name)!r}"
            for field in sorted(dataclasses.fields(self), key=_is_optional)
            if field.repr and getattr(self, field.name) != field.default
        ]
        return f"{type(self).__name__}({', '.join(shown)})"

    def _set(self, **values: Any) -> None:
        """Put checked values in place of those given."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _lengths(self, *names: str) -> None:
        """Check positive lengths [m] and keep them as float."""
        self._set(
            **{name: length(type(self).__name__, name, getattr(self, name)) for name in names}
        )


def _is_optional(field: dataclasses.Field[Any]) -> bool:
    missing = dataclasses.MISSING
    return not (field.default is missing and field.default_factory is missing)


def number(where: str, name: str, value: Any, unit: str = "") -> float:
    """Return a finite number as float.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        if isinstance(value, (str, bytes, bool)):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{where}: {name} = {value!r:.60}: must be a number{unit}") from None
    if not math.isfinite(result):
        raise InputError(f"{where}: {name} = {result}: must be finite; give a number{unit}")
    return result


def length(where: str, name: str, value: Any) -> float:
    """Return a positive length [m] as float.

    Raises
    ------
    InputError
        If it is none.
    """
    result = number(where, name, value, " in m")
    if not SMALLEST < result < LARGEST:
        rule = "positive" if result <= 0.0 else f"between {SMALLEST:g} and {LARGEST:g} m"
        raise InputError(f"{where}: {name} = {result:g}: must be {rule}; give a length in m")
    return result


def point(where: str, name: str, value: Any) -> Point:
    """Return a point of two or three coordinates [m] as three floats.

    Raises
    ------
    InputError
        If it is none.
    """
    rows = points_of(where, name, [value] if np.ndim(value) == 1 else value)
    if len(rows) != 1:
        raise InputError(f"{where}: {name} = {value!r:.60}: must be one point; give (x, y) in m")
    return tuple(rows[0].tolist())


def points_of(where: str, name: str, values: ArrayLike) -> FloatArray:
    """Return points of two or three coordinates as an array of shape (n, 3) [m].

    Raises
    ------
    InputError
        If they are none, or not finite.
    """
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim != 2 or array.shape[1] not in (2, 3) or not len(array):
        raise InputError(
            f"{where}: {name}: must be points of two or three coordinates; give [(x, y), ...] in m"
        )
    bad = np.flatnonzero(~(np.abs(array) < LARGEST).all(axis=1))
    if len(bad):
        raise InputError(
            f"{where}: {name}[{bad[0]}] = {array[bad[0]].tolist()}: must be finite; "
            "give coordinates in m"
        )
    if array.shape[1] == 2:
        array = np.column_stack([array, np.zeros(len(array))])
    return array + 0.0  # no negative zeros, which would look different


def factor_of(where: str, value: Any) -> float:
    """Return a positive factor.

    Raises
    ------
    InputError
        If it is none.
    """
    result = number(where, "factor", value)
    if not SMALLEST < result < LARGEST:
        raise InputError(f"{where}: factor = {result:g}: must be positive; 1 changes nothing")
    return result
