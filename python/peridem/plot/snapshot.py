"""One state, ready to be drawn: positions, fields and elements, of a VTU file or a model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..body_table import BodyRow
from ..errors import InputError
from ..strain import StrainField
from ..vtu import Array, read_vtu
from .fields import FIELDS, Field, find_field

__all__ = ["SOLID", "FieldLike", "Mask", "Snapshot", "is_3d"]

Mask = npt.NDArray[np.bool_]
FieldLike = str | Field | Array | Callable[["Snapshot"], Any]

SOLID = ("triangle", "quad", "tetra")
"""Elements that fill a body; the others are its points and lines."""


@dataclass(frozen=True)
class Snapshot:
    """What a picture needs of one state.

    Attributes
    ----------
    points : ndarray, shape (n_nodes, 3)
        Current positions [m].
    fields : dict of str to ndarray, shape (n_nodes,), (n_nodes, 3) or (n_nodes, 6)
        Nodal values by tag.
    cells : list of (str, ndarray of shape (m, k))
        Elements with global node numbers; may be empty.
    wall : ndarray of bool, shape (n_nodes,)
        Nodes of walls and of bodies whose motion is prescribed, drawn in grey.
    time : float or None
        Simulated time [s].
    element_fields : dict of str to ndarray, shape (n_elements,) or (n_elements, 6)
        Values of triangles, quads and tetrahedra, in the order of `cells`.
    contacts : DataFrame, Path or None
        Forces between bodies as `ContactNetwork.to_frame` has them, or their csv file.
    """

    points: npt.NDArray[np.float64]
    fields: dict[str, Array]
    cells: list[tuple[str, Array]] = field(default_factory=list)
    wall: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    time: float | None = None
    element_fields: dict[str, Array] = field(default_factory=dict)
    contacts: Any = None

    def __post_init__(self) -> None:
        if len(self.wall) != len(self.points):
            object.__setattr__(self, "wall", np.zeros(len(self.points), dtype=bool))

    @classmethod
    def from_vtu(
        cls,
        path: Path | str,
        *,
        wall_zones: Sequence[int] = (),
        bodies: Sequence[BodyRow] = (),
        only: Collection[str] | None = None,
    ) -> Snapshot:
        """Read a snapshot from a VTU file.

        Parameters
        ----------
        path : Path or str
            The file.
        wall_zones : sequence of int
            Zones (counted from 0) whose bodies are walls, when the file has the tag
            ``Zone_ID``. With the tags ``Particle_ID`` and ``Fixity`` bodies whose motion is
            prescribed are walls as well.
        bodies : sequence of BodyRow
            Bodies of the run, when they are known.
        only : collection of str, optional
            Arrays to read; all when left out.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        content = read_vtu(path, only)
        fields, points = content["arrays"], content["points"]
        wall = np.zeros(len(points), dtype=bool)
        if bodies and bodies[-1].stop == len(points):
            for row in bodies:
                wall[row.start : row.stop] = row.is_wall
        if "Zone_ID" in fields:
            wall |= np.isin(fields["Zone_ID"], list(wall_zones))
        if "Particle_ID" in fields and "Fixity" in fields:
            wall |= _prescribed(fields["Particle_ID"], fields["Fixity"], is_3d(points))
        return cls(points, fields, content["cells"], wall, content["time"])

    @classmethod
    def from_model(
        cls, model: Any, *, stress: bool = False, pieces: bool = False, contacts: bool = False
    ) -> Snapshot:
        """Copy the present state of a `DEMModel`, with what takes time only when it is wanted.

        Parameters
        ----------
        model : DEMModel
            The model.
        stress : bool
            With strain and stress.
        pieces : bool
            With the fragments of broken bodies, ``Fragment_ID``.
        contacts : bool
            With the forces between bodies.
        """
        from ..diagnostics import contact_network, fragments

        state = model.state
        fields = {
            tag: np.array(getattr(state, known.attribute))
            for tag, known in FIELDS.items()
            if known.attribute
        }
        fields["Force"] = fields["Force_Density"] * fields["Nodal_Volume"][:, None]
        damage = model.broken_fraction()
        n = len(state.x)  # before its bonds are found a model has none that could be broken
        fields["Damage"] = damage if len(damage) == n else np.zeros(n)
        wall = _prescribed(state.particle_id, state.fixity, model.dimension == 3)
        for body in model.particles:
            wall[body.start : body.stop] |= body.type == "wall" or body.constrained
        if pieces:
            fields["Fragment_ID"] = fragments(model).labels
        cells = [(name, np.array(nodes)) for name, nodes in model.cells]
        network = contact_network(model).to_frame() if contacts else None
        snapshot = cls(np.array(state.x), fields, cells, wall, float(model.time), contacts=network)
        if stress:
            measured = StrainField(model)
            strain, stresses = measured.compute()
            return snapshot.with_elements(
                {"Strain": strain, "Stress": stresses, "Particle_ID": measured.particle_id},
                measured.points(),
            )
        return snapshot

    @property
    def is_3d(self) -> bool:
        """Whether the nodes span a space rather than the xy-plane."""
        return is_3d(self.points)

    @property
    def names(self) -> list[str]:
        """Names of all arrays."""
        return [*self.fields, *(tag for tag in self.element_fields if tag not in self.fields)]

    def solids(self) -> list[tuple[str, Array]]:
        """Elements that fill bodies."""
        return [(name, nodes) for name, nodes in self.cells if name in SOLID]

    def values(self, tag: FieldLike) -> npt.NDArray[np.float64]:
        """Scalar to be coloured on the nodes: the field itself, or the length of a vector.

        Raises
        ------
        InputError
            If there is no such field.
        """
        if not isinstance(tag, str | Field):
            return self._given(tag)
        wanted = find_field(tag, self.names) if isinstance(tag, str) else tag
        if wanted.tag in self.fields:
            return wanted.of(self.fields[wanted.tag])
        return self._to_nodes(wanted.of(self.element_fields[wanted.tag]))

    def cell_values(self, tag: FieldLike) -> list[npt.NDArray[np.float64]]:
        """Scalar to be coloured for each of `solids`: that of the element, or its nodes' mean."""
        wanted = find_field(tag, self.names) if isinstance(tag, str) else tag
        solids = self.solids()
        if isinstance(wanted, Field) and wanted.tag not in self.fields:
            values = wanted.of(self.element_fields[wanted.tag])
            ends = np.cumsum([len(nodes) for _, nodes in solids])
            return np.split(values, ends[:-1])
        values = self.values(wanted)
        if isinstance(wanted, Field) and wanted.kind == "labels":
            return [values[nodes[:, 0]] for _, nodes in solids]
        return [values[nodes].mean(axis=1) for _, nodes in solids]

    def _given(self, values: Any) -> npt.NDArray[np.float64]:
        """Check an array of the caller's, or what a function of the snapshot gives."""
        found = values(self) if callable(values) else values
        try:
            array = np.asarray(found, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.empty(0)
        n = len(self.points)
        if array.ndim not in (1, 2) or len(array) != n or (array.ndim == 2 and len(array[0]) != 3):
            raise InputError(
                f"render: field: an array of shape {np.shape(found)}: must be ({n},) or ({n}, 3), "
                "a row for each node; correct it"
            )
        return array if array.ndim == 1 else np.asarray(np.linalg.norm(array, axis=1))

    def _to_nodes(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Mean over the elements at each node; NaN at nodes of none."""
        total, count = np.zeros(len(self.points)), np.zeros(len(self.points))
        first = 0
        for _, nodes in self.solids():
            for corner in nodes.T:
                np.add.at(total, corner, values[first : first + len(nodes)])
                np.add.at(count, corner, 1.0)
            first += len(nodes)
        with np.errstate(invalid="ignore"):
            return np.asarray(total / count)

    def with_elements(self, arrays: dict[str, Array], points: Array) -> Snapshot:
        """Add values at quadrature points: each element gets the mean of its own.

        Where the elements are not known (a file of points), the quadrature points are drawn in
        place of the nodes.
        """
        count = sum(len(nodes) for _, nodes in self.solids())
        wanted = {tag: values for tag, values in arrays.items() if tag not in self.fields}
        kinds = {name for name, _ in self.solids()}
        if count and len(points) % count == 0 and len(kinds) == 1:
            each = {tag: _means(values, count) for tag, values in wanted.items()}
            return replace(self, element_fields={**self.element_fields, **each})
        wall = np.zeros(len(points), dtype=bool)
        body = self.fields.get("Particle_ID")
        if body is not None and "Particle_ID" in arrays:
            wall = np.isin(arrays["Particle_ID"], np.unique(body[self.wall]))
        return Snapshot(
            np.asarray(points, dtype=float), dict(arrays), [], wall, self.time,
            contacts=self.contacts,
        )  # fmt: skip

    def deformed(self, scale: float) -> Snapshot:
        """Return the state with displacements `scale` times as large.

        Raises
        ------
        InputError
            If the displacement is not known.
        """
        if scale == 1.0:
            return self
        moved = self.fields.get("Displacement")
        if moved is None:
            raise InputError(
                f"render: scale = {scale:g}: needs the array Displacement, which is not in the "
                "data; run with the tag Displacement, or leave scale out"
            )
        return replace(self, points=self.points + (scale - 1.0) * moved)

    def without_walls(self) -> Snapshot:
        """Return the state without its walls' nodes."""
        kept = ~self.wall
        number = np.cumsum(kept) - 1
        cells: list[tuple[str, Array]] = []
        element_kept: list[Mask] = [np.empty(0, dtype=bool)]
        for name, nodes in self.cells:
            inside = np.asarray(kept[nodes].all(axis=1), dtype=bool)
            cells.append((name, number[nodes[inside]]))
            if name in SOLID:
                element_kept.append(inside)
        chosen = np.concatenate(element_kept)
        return Snapshot(
            self.points[kept],
            {tag: values[kept] for tag, values in self.fields.items()},
            cells,
            self.wall[kept],
            self.time,
            {tag: values[chosen] for tag, values in self.element_fields.items()},
        )

    @property
    def bodies(self) -> list[BodyRow]:
        """Bodies of the array Particle_ID, by first and last node."""
        ids = self.fields.get("Particle_ID")
        if ids is None:
            return []
        starts = np.flatnonzero(np.diff(np.asarray(ids), prepend=np.asarray(ids)[0] - 1))
        stops = np.append(starts[1:], len(ids))
        return [
            BodyRow(int(ids[a]), "", "wall" if self.wall[a] else "particle", 0, a, b, False)
            for a, b in zip(starts.tolist(), stops.tolist(), strict=True)
        ]


def is_3d(points: Array) -> bool:
    """Whether positions span a space rather than the xy-plane."""
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        return False
    size = np.ptp(finite, axis=0)
    return bool(size[2] > 1e-9 * size.max())


def _means(values: Array, count: int) -> Array:
    grouped = values.reshape(count, -1, *values.shape[1:])
    return np.asarray(grouped[:, 0] if values.dtype.kind in "iu" else grouped.mean(axis=1))


def _prescribed(body: Array, fixity: Array, in_space: bool) -> Mask:
    """Nodes of the bodies that are held or moved in all directions at all their nodes."""
    directions = 0b111 if in_space else 0b011
    free = (np.asarray(fixity) & directions) != directions
    return np.asarray(~np.isin(body, np.unique(np.asarray(body)[free])))
