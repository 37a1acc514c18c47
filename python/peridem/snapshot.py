"""One state, ready to be drawn: positions, fields and elements, of a VTU file or a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError
from .vtu import Array, read_vtu

__all__ = ["FIELDS", "Field", "Mask", "Snapshot"]

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Field:
    """How a tag is drawn: where a model keeps it, its words, its unit, its colours."""

    attribute: str
    label: str
    unit: str = ""
    colours: str = "viridis"


FIELDS = {
    "Damage_Z": Field("damage_z", "Damage $Z = \\max\\,|s|/s_0$"),
    "Damage": Field("", "Fraction of broken bonds"),
    "Displacement": Field("u", "Displacement", "m"),
    "Velocity": Field("v", "Speed", "m/s"),
    "Force_Density": Field("f", "Force density", "N/m³"),
    "Force": Field("", "Force", "N"),
    "Theta": Field("theta", "Dilatation $\\theta$", "", "RdBu_r"),
    "Nodal_Volume": Field("volume", "Nodal volume"),
    "Particle_ID": Field("particle_id", "Body", "", "tab20"),
    "Zone_ID": Field("zone_id", "Zone", "", "tab10"),
}


@dataclass(frozen=True)
class Snapshot:
    """What a picture needs of one state.

    Attributes
    ----------
    points : ndarray, shape (n_nodes, 3)
        Current positions [m].
    fields : dict of str to ndarray, shape (n_nodes,) or (n_nodes, 3)
        Nodal values by tag.
    cells : list of (str, ndarray of shape (m, k))
        Elements with global node numbers; may be empty.
    wall : ndarray of bool, shape (n_nodes,)
        Nodes of walls and of bodies whose motion is prescribed, drawn in grey.
    time : float or None
        Simulated time [s].
    """

    points: npt.NDArray[np.float64]
    fields: dict[str, Array]
    cells: list[tuple[str, Array]] = field(default_factory=list)
    wall: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    time: float | None = None

    def __post_init__(self) -> None:
        if len(self.wall) != len(self.points):
            object.__setattr__(self, "wall", np.zeros(len(self.points), dtype=bool))

    @classmethod
    def from_vtu(cls, path: Path | str, *, wall_zones: Sequence[int] = ()) -> Snapshot:
        """Read a snapshot from a VTU file.

        Parameters
        ----------
        path : Path or str
            The file.
        wall_zones : sequence of int
            Zones (counted from 0) whose bodies are walls, when the file has the tag
            ``Zone_ID``. With the tags ``Particle_ID`` and ``Fixity`` bodies whose motion is
            prescribed are walls as well.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        content = read_vtu(path)
        fields, points = content["arrays"], content["points"]
        wall = np.zeros(len(points), dtype=bool)
        if "Zone_ID" in fields:
            wall |= np.isin(fields["Zone_ID"], list(wall_zones))
        if "Particle_ID" in fields and "Fixity" in fields:
            wall |= _prescribed(fields["Particle_ID"], fields["Fixity"], _is_3d(points))
        return cls(points, fields, content["cells"], wall, content["time"])

    @classmethod
    def from_model(cls, model: Any) -> Snapshot:
        """Copy the present state of a `DEMModel`."""
        state = model.state
        fields = {
            tag: np.array(getattr(state, known.attribute))
            for tag, known in FIELDS.items()
            if known.attribute
        }
        fields["Force"] = fields["Force_Density"] * fields["Nodal_Volume"][:, None]
        fields["Damage"] = model.broken_fraction()
        wall = _prescribed(state.particle_id, state.fixity, model.dimension == 3)
        for body in model.particles:
            wall[body.start : body.stop] |= body.type == "wall" or body.constrained
        return cls(
            points=np.array(state.x),
            fields=fields,
            cells=[(name, np.array(nodes)) for name, nodes in model.cells],
            wall=wall,
            time=float(model.time),
        )

    @property
    def is_3d(self) -> bool:
        """Whether the nodes span a space rather than the xy-plane."""
        return _is_3d(self.points)

    def values(self, tag: str) -> npt.NDArray[np.float64]:
        """Scalar to be coloured: the field itself, or the length of a vector.

        Raises
        ------
        InputError
            If there is no such field.
        """
        if tag not in self.fields:
            raise InputError(
                f"picture: field = {tag}: is not in the data; use one of {', '.join(self.fields)}"
            )
        values = np.asarray(self.fields[tag], dtype=np.float64)
        return values if values.ndim == 1 else np.linalg.norm(values, axis=1)


def _is_3d(points: Array) -> bool:
    size = np.ptp(points, axis=0)
    return bool(size[2] > 1e-9 * size.max())


def _prescribed(body: Array, fixity: Array, is_3d: bool) -> Mask:
    """Nodes of the bodies that are held or moved in all directions at all their nodes."""
    directions = 0b111 if is_3d else 0b011
    free = (np.asarray(fixity) & directions) != directions
    return np.asarray(~np.isin(body, np.unique(np.asarray(body)[free])))
