"""Force chains: lines between bodies in contact, as thick as the force is large."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..modelling.arguments import show_value
from .scene import Scene, bodies_centres, prefix
from .snapshot import Snapshot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Chains", "draw_chains", "make_chains"]

FloatArray = NDArray[np.float64]

_ENDS = (("i", "j"), ("body_i", "body_j"), ("p", "q"), ("body_1", "body_2"), ("a", "b"))
_FORCES = ("force", "normal_force", "normal", "f")
_VECTORS = (("fx", "fy", "fz"), ("force_x", "force_y", "force_z"), ("x_force", "y_force"))
_PLACES = ("x", "y", "z")
THICKEST = 7.0
"""Width [points] of the line of the largest force."""
_COLOUR = "#1b1b1b"
_ON_DARK = "#f5f5f5"


@dataclass(frozen=True)
class Chains:
    """Forces between pairs of bodies.

    Attributes
    ----------
    pairs : ndarray of int, shape (n, 2)
        Ids of the bodies.
    forces : ndarray, shape (n,)
        Sizes of the forces [N, N/m in 2D].
    places : ndarray, shape (n, 3), or None
        Where they touch [m]; lines then bend there.
    """

    pairs: NDArray[np.int64]
    forces: FloatArray
    places: FloatArray | None = None


def make_chains(source: Any) -> Chains:
    """Take forces between bodies as a table or arrays.

    Parameters
    ----------
    source : DataFrame or mapping
        With the columns i and j (ids of the bodies), and force, or fx and fy [and fz]; x and y
        [and z] of the contacts may be there too.

    Raises
    ------
    InputError
        If a column is missing or not made of numbers.
    """
    where = "render: chains"
    if isinstance(source, Chains):
        return source
    if not isinstance(source, Mapping) and not hasattr(source, "columns"):
        raise InputError(
            f"{where} = {show_value(source)}: must be a table of pairs of bodies and forces; give "
            "a DataFrame with the columns i, j and force"
        )
    known = {str(name).lower(): name for name in source}
    ends = next((pair for pair in _ENDS if all(one in known for one in pair)), None)
    if ends is None:
        raise InputError(
            f"{where}: has the columns {', '.join(known)}: i and j, the ids of the bodies, are "
            "missing; name them so"
        )
    try:
        pairs = np.column_stack([np.asarray(source[known[one]], dtype=float) for one in ends])
        columns = {name: np.asarray(source[known[name]], dtype=float) for name in _numeric(known)}
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: a column is not made of numbers: {error}; correct it") from None
    forces = _sizes(columns, where)
    if not (np.isfinite(pairs).all() and np.isfinite(forces).all()):
        raise InputError(f"{where}: must be finite numbers; leave out rows with nan")
    places = None
    if "x" in columns and "y" in columns:
        z = columns.get("z", np.zeros(len(pairs)))
        places = np.column_stack([columns["x"], columns["y"], z])
    return Chains(pairs.astype(np.int64), np.abs(forces), places)


def _numeric(known: Mapping[str, Any]) -> list[str]:
    wanted = {*_FORCES, *_PLACES, *(name for names in _VECTORS for name in names)}
    return [name for name in known if name in wanted]


def _sizes(columns: Mapping[str, FloatArray], where: str) -> FloatArray:
    for name in _FORCES:
        if name in columns:
            return columns[name]
    for names in _VECTORS:
        parts = [columns[name] for name in names if name in columns]
        if len(parts) >= 2:
            return np.asarray(np.linalg.norm(np.stack(parts), axis=0))
    raise InputError(f"{where}: the column force, or fx and fy, is missing; name it so")


def draw_chains(axes: Axes, snapshot: Snapshot, scene: Scene, chains: Chains) -> None:
    """Draw lines between the centres of bodies, as wide as the forces, with a legend."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    if not len(chains.forces) or not chains.forces.max() > 0:
        return
    points = snapshot.deformed(scene.look.scale).points
    centres = bodies_centres(snapshot, points)
    missing = sorted({int(k) for k in chains.pairs.ravel()} - set(centres))
    if missing:
        raise InputError(
            f"render: chains: body {missing[0]}: there is none; ids are from {min(centres)} to "
            f"{max(centres)}: correct the columns i and j"
        )
    order = np.argsort(chains.forces)
    ends = np.array([[centres[int(i)] for i in pair] for pair in chains.pairs[order]])
    if chains.places is not None:
        # From centre to contact to centre: the centre of a long wall is far from its contacts.
        places = chains.places[order][:, None]
        wall = _wall_bodies(snapshot)
        at_wall = np.isin(chains.pairs[order], wall)[:, :, None]
        ends = np.where(at_wall, places, ends)
        ends = np.concatenate([ends[:, :1], places, ends[:, 1:]], axis=1)
    plane = ends[..., :2] if scene.camera is None else scene.camera.project(ends)
    largest = float(chains.forces.max())
    ink = _COLOUR if scene.look.ink == "0.25" else _ON_DARK
    widths = THICKEST * chains.forces[order] / largest
    lines = LineCollection(
        list(plane * scene.length[0]), linewidths=widths, colors=ink, zorder=4, alpha=0.85
    )
    lines.set_capstyle("round")
    axes.add_collection(lines, autolim=False)
    per_thickness = "/m" if scene.camera is None else ""
    size, unit = prefix([largest], f"N{per_thickness}")
    marks = [
        Line2D(
            [],
            [],
            color=ink,
            linewidth=THICKEST * part,
            label=f"{largest * part / size:.3g} {unit}",
        )
        for part in (1.0, 0.5)
    ]
    legend = axes.legend(
        handles=marks, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, frameon=False,
        fontsize=9, labelcolor=scene.look.ink, title="Contact force", title_fontsize=9,
        handlelength=2.5,
    )  # fmt: skip
    legend.get_title().set_color(scene.look.ink)


def _wall_bodies(snapshot: Snapshot) -> NDArray[Any]:
    return np.unique(np.asarray(snapshot.fields["Particle_ID"])[snapshot.wall])
