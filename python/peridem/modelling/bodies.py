"""Bodies of a model being built: handles to name them by, and where they stand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import Shape
from ..materials import Material
from ..mesh import Mesh

if TYPE_CHECKING:
    from .plan import Layout

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]


class MeshableShape(Protocol):
    """What a body needs of a shape; the shapes of the package have it."""

    @property
    def dimension(self) -> int:
        """2 or 3."""

    @property
    def geometry(self) -> Shape:
        """Outline in the reference position."""

    @property
    def deck_keys(self) -> dict[str, Any] | None:
        """Keys of a deck that describe the shape; None when there are none."""

    def mesh(self, mesh_size: float) -> Mesh:
        """Mesh in the reference position, edges of about `mesh_size` [m]."""


@dataclass(frozen=True, eq=False)
class Form:
    """What bodies of a zone share: shape and mesh.

    Attributes
    ----------
    shape : MeshableShape or None
        The shape; None for a mesh given without one.
    mesh_size : float or None
        Edge length [m] asked for; None when the mesh was given.
    given : Mesh or None
        The mesh, when it was given.
    """

    shape: MeshableShape | None
    mesh_size: float | None
    given: Mesh | None

    @property
    def key(self) -> tuple[Any, ...]:
        """Equal for forms with the same mesh."""
        if self.given is not None:
            return ("mesh", id(self.given), self.shape)
        return ("shape", self.shape, self.mesh_size)

    @property
    def label(self) -> str:
        """What messages call it."""
        if self.shape is None:
            return "mesh"
        return type(self.shape).__name__.lower()


class Body:
    """A body of a model: a handle for loads, contact and recorders.

    Made by `DEMModel.add_particle` and its like.

    Attributes
    ----------
    name : str
        Its name, unique in the model.
    material : Material
        Its material.
    at : tuple of three floats
        Where the origin of its reference mesh is placed [m].
    angle : float
        Turn [rad] about `axis`.
    axis : tuple of three floats
        Axis of the turn.
    scale : float
        Factor on the reference mesh.
    velocity, spin : tuple of three floats
        Velocity [m/s] and angular velocity [rad/s] at the start.
    is_wall, fixed : bool
        Whether it is a wall; whether it never moves.
    """

    def __init__(
        self,
        *,
        name: str,
        form: Form,
        material: Material,
        at: Vector,
        angle: float = 0.0,
        axis: Vector = (0.0, 0.0, 1.0),
        scale: float = 1.0,
        velocity: Vector = (0.0, 0.0, 0.0),
        spin: Vector = (0.0, 0.0, 0.0),
        is_wall: bool = False,
        fixed: bool = False,
    ) -> None:
        self.name = name
        self.form = form
        self.material = material
        self.at = at
        self.angle = angle
        self.axis = axis
        self.scale = scale
        self.velocity = velocity
        self.spin = spin
        self.is_wall = is_wall
        self.fixed = fixed
        self._layout: Layout | None = None

    @property
    def id(self) -> int:
        """Number of the body in `DEMModel.particles`, known once the model is built."""
        return self._placed("id").ids[self]

    @property
    def nodes(self) -> slice:
        """Its rows in the arrays of `DEMModel.state`, known once the model is built."""
        layout = self._placed("nodes")
        start = layout.starts[layout.ids[self]]
        return slice(start, layout.starts[layout.ids[self] + 1])

    def _placed(self, what: str) -> Layout:
        if self._layout is None:
            raise InputError(
                f"body {self.name!r}: {what}: is known once the model is built; call model.init()"
            )
        return self._layout

    def __repr__(self) -> str:
        kind = "wall" if self.is_wall else "particle"
        place = ", ".join(f"{value:g}" for value in self.at)
        return (
            f"<{kind} {self.name!r}: {self.form.label} of {self.material.label} at ({place})"
            f"{', fixed' if self.fixed else ''}>"
        )


class Bodies(Sequence[Body]):
    """Several bodies added together: a sequence of handles that stands for all of them.

    Attributes
    ----------
    name : str
        Name of the group; its members are ``<name>-1``, ``<name>-2``, ...
    """

    def __init__(self, name: str, members: Iterable[Body]) -> None:
        self.name = name
        self._members = tuple(members)

    @property
    def ids(self) -> list[int]:
        """Numbers of the bodies, known once the model is built."""
        return [body.id for body in self._members]

    def select(self, mask: Any) -> Bodies:
        """Return the members for which `mask`, shape (n,), is true."""
        chosen = np.asarray(mask, dtype=bool)
        if chosen.shape != (len(self),):
            raise InputError(
                f"select: mask of shape {chosen.shape}: must have one flag for each of the "
                f"{len(self)} bodies; correct it"
            )
        return Bodies(self.name, [b for b, kept in zip(self._members, chosen, strict=True) if kept])

    @overload
    def __getitem__(self, index: int) -> Body: ...
    @overload
    def __getitem__(self, index: slice) -> Bodies: ...
    def __getitem__(self, index: int | slice) -> Body | Bodies:
        found = self._members[index]
        return found if isinstance(found, Body) else Bodies(self.name, found)

    def __len__(self) -> int:
        return len(self._members)

    def __iter__(self) -> Iterator[Body]:
        return iter(self._members)

    def __repr__(self) -> str:
        return f"<{len(self)} bodies {self.name!r}>"
