"""Force chains: lines between bodies in contact, as thick as the force is large."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..modelling.arguments import show_value
from .scene import Scene, bodies_centres, prefix
from .snapshot import Snapshot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "ChainSource",
    "Chains",
    "chain_source",
    "draw_chains",
    "explain_chains",
    "make_chains",
]

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


@dataclass
class ChainSource:
    """Where the pictures of a series have their forces from.

    Attributes
    ----------
    given : Chains or None
        Forces for all states; None: each state has its own.
    largest : float
        The largest force of all states [N, N/m in 2D], which sets the widths of all lines.
    """

    given: Chains | None
    largest: float = 0.0

    def of(self, snapshot: Snapshot) -> Chains:
        """Return the forces of a state.

        Raises
        ------
        InputError
            If they are not known, or their file cannot be read.
        """
        if self.given is not None:
            return self.given
        found = snapshot.contacts
        if found is None:
            raise InputError(
                "render: chains = True: the outputs have no forces of contact; run with the tag "
                "Contact_Network, or give a table"
            )
        return make_chains(_read(found) if isinstance(found, Path) else found)

    def add(self, snapshot: Snapshot) -> None:
        """Take a state into account."""
        self.largest = max(self.largest, float(self.of(snapshot).forces.max(initial=0.0)))


def chain_source(chains: Any) -> ChainSource | None:
    """Take the argument `chains` of `render`: True, a table of forces, None or False."""
    if chains is None or chains is False:
        return None
    return ChainSource(None if chains is True else make_chains(chains))


def _read(path: Path) -> Any:
    import pandas as pd

    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}; run the model again") from error


def make_chains(source: Any) -> Chains:
    """Take forces between bodies as a table or arrays.

    Parameters
    ----------
    source : DataFrame, mapping or object with `to_frame`
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
    if not hasattr(source, "columns") and callable(getattr(source, "to_frame", None)):
        source = source.to_frame()
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
    some = forces != 0
    return Chains(
        pairs[some].astype(np.int64), np.abs(forces[some]), None if places is None else places[some]
    )


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


def draw_chains(axes: Axes, snapshot: Snapshot, scene: Scene, source: ChainSource) -> None:
    """Draw lines between the centres of bodies, as wide as the forces.

    At a wall, whose centre may be far from the contact, a line ends at the place of the contact,
    or where that is not known at the node of the wall nearest to the other body.
    """
    from matplotlib.collections import LineCollection

    chains = source.of(snapshot)
    if not len(chains.forces):
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
    ends = _ends(snapshot, points, centres, chains, order)
    plane = ends[..., :2] if scene.camera is None else scene.camera.project(ends)
    widths = THICKEST * chains.forces[order] / source.largest
    lines = LineCollection(
        list(plane * scene.length[0]), linewidths=widths, colors=_ink(scene), zorder=4, alpha=0.85
    )
    lines.set(capstyle="round", in_layout=False)
    axes.add_collection(lines, autolim=False)


def _ends(
    snapshot: Snapshot, points: FloatArray, centres: Mapping[int, FloatArray], chains: Chains,
    order: NDArray[np.intp],
) -> FloatArray:  # fmt: skip
    """Corners of the lines, shape (n, 2 or 3, 3) [m]."""
    ids = np.asarray(snapshot.fields["Particle_ID"])
    walls = set(np.unique(ids[snapshot.wall]).tolist())
    nodes = {wall: points[ids == wall] for wall in walls & set(chains.pairs.ravel().tolist())}
    lines = []
    for row in order:
        i, j = (int(one) for one in chains.pairs[row])
        place = None if chains.places is None else chains.places[row]
        a, b = (
            _end(centres[other], centres[one], nodes.get(one), place)
            for one, other in ((i, j), (j, i))
        )
        lines.append([a, b] if place is None else [a, place, b])
    return np.array(lines)


def _end(other: FloatArray, centre: FloatArray, wall: FloatArray | None, place: Any) -> FloatArray:
    if wall is None:
        return centre
    if place is not None:
        return np.asarray(place)
    return np.asarray(wall[((wall - other) ** 2).sum(axis=1).argmin()])


def explain_chains(figure: Figure, scene: Scene, source: ChainSource) -> None:
    """Say below the pictures which force a line has that is so thick."""
    from matplotlib.lines import Line2D

    largest = source.largest
    if not largest > 0:
        return
    size, unit = prefix([largest], "N/m" if scene.camera is None else "N")
    ink = scene.look.ink
    marks = [Line2D([], [], linestyle="none", label="contact force:")]
    marks += [
        Line2D(
            [], [], color=_ink(scene), linewidth=THICKEST * part,
            label=f"{largest * part / size:.3g} {unit}",
        )
        for part in (1.0, 0.5)
    ]  # fmt: skip
    figure.legend(
        handles=marks, loc="outside lower center", ncols=3, frameon=False, fontsize=9,
        labelcolor=ink, handlelength=2.5,
    )  # fmt: skip


def _ink(scene: Scene) -> str:
    return _COLOUR if scene.look.ink == "0.25" else _ON_DARK
