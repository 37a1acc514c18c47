"""What all pictures of a series share: colours, box, units, so that they can be compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera
from .fields import Field, colour_scale, value_range
from .look import Look
from .snapshot import FieldLike, Snapshot
from .torn import torn

if TYPE_CHECKING:
    from matplotlib.colors import Colormap, Normalize

__all__ = ["Scene", "Survey", "box_of", "prefix", "shown_mask", "time_text"]

FloatArray = NDArray[np.float64]
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
MISSING = "0.86"
"""Grey of elements without a number (stress of a material without elastic constants)."""


@dataclass(frozen=True)
class Scene:
    """How the states of a series are drawn.

    Attributes
    ----------
    look : Look
        Options.
    field : Field
        Words and unit.
    source : str, Field, array or callable
        What is drawn.
    colours, norm : Colormap, Normalize
        Colours of numbers.
    extend : {"neither", "min", "max", "both"}
        Ends of the scale beyond which there are numbers.
    box : ndarray, shape (2, 3) or (2, 2)
        Corners of the picture [m]; in 3D in the plane of the camera.
    camera : Camera or None
        In 3D.
    last_time : float or None
        Latest time [s], which chooses the unit of the titles.
    several : bool
        Whether there are several states, whose titles are to have the same digits.
    """

    look: Look
    field: Field
    source: FieldLike
    colours: Colormap
    norm: Normalize
    extend: str
    box: FloatArray
    camera: Camera | None
    last_time: float | None
    several: bool = False

    @property
    def length(self) -> tuple[float, str]:
        """Factor and unit of the ticks: the largest in which the picture spans ten or more."""
        size = float(np.diff(self.box, axis=0).max())
        if size >= 0.1:
            return 1.0, "m"
        return (1e3, "mm") if size >= 1e-4 else (1e6, "µm")


@dataclass
class Survey:
    """Goes through the states of a series once, to fix what their pictures share."""

    look: Look
    field: Field
    source: FieldLike
    _boxes: list[FloatArray] = dataclasses.field(default_factory=list)
    _ranges: list[tuple[float, float]] = dataclasses.field(default_factory=list)
    _extremes: list[tuple[float, float]] = dataclasses.field(default_factory=list)
    _times: list[float] = dataclasses.field(default_factory=list)
    _camera: Camera | None = None

    def add(self, snapshot: Snapshot) -> None:
        """Take a state into account."""
        if self.look.walls == "hidden":
            snapshot = snapshot.without_walls()
        points = snapshot.deformed(self.look.scale).points
        if snapshot.is_3d and self._camera is None:
            self._camera = Camera.towards(*self.look.view)
        plane = points[:, :2] if self._camera is None else self._camera.project(points)
        self._boxes.append(box_of(plane))
        if snapshot.time is not None:
            self._times.append(snapshot.time)
        values = self._values(snapshot)
        if not len(values):
            return
        self._extremes.append((float(values.min()), float(values.max())))
        found = value_range(self.field, values)
        if found is not None:
            self._ranges.append(found)

    def _values(self, snapshot: Snapshot) -> FloatArray:
        """Numbers that will be seen: not those of walls, nor of elements that are torn open."""
        chosen = shown_mask(snapshot, self.look)
        on_elements = isinstance(self.source, Field) and self.source.tag not in snapshot.fields
        if snapshot.solids() and self.look.style != "nodes" and (on_elements or not snapshot.is_3d):
            groups = snapshot.cell_values(self.source)
            kept = [
                values[chosen[nodes[:, 0]] & ~torn(snapshot, nodes)]
                for values, (_, nodes) in zip(groups, snapshot.solids(), strict=True)
            ]
            values = np.concatenate([np.empty(0), *kept])
        else:
            values = snapshot.values(self.source)[chosen]
        return np.asarray(values[np.isfinite(values)])

    def scene(self) -> Scene:
        """Fix the colours, the box and the units."""
        limits = self.look.limits
        if limits is None and self._ranges:
            limits = min(low for low, _ in self._ranges), max(high for _, high in self._ranges)
        limits = _opened(limits or (0.0, 1.0))
        colours, norm = colour_scale(self.field, limits, self.look.colours)
        slack = 1e-9 * (limits[1] - limits[0])
        below = any(low < limits[0] - slack for low, _ in self._extremes)
        above = any(high > limits[1] + slack for _, high in self._extremes)
        above = above or (self.field.kind == "damage" and self.look.limits is None)
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}
        return Scene(
            look=self.look,
            field=self.field,
            source=self.source,
            colours=colours.with_extremes(bad=MISSING),
            norm=norm,
            extend=extend.get((below, above), "neither"),
            box=self._box(),
            camera=self._camera,
            last_time=max(self._times, default=None),
            several=len(self._boxes) > 1,
        )

    def _box(self) -> FloatArray:
        box = np.stack(
            [
                np.min([one[0] for one in self._boxes], axis=0),
                np.max([one[1] for one in self._boxes], axis=0),
            ]
        )
        zoom = self.look.zoom
        if isinstance(zoom, float):
            middle, half = box.mean(axis=0), 0.5 * np.diff(box, axis=0)[0] / zoom
            return np.stack([middle - half, middle + half])
        if self._camera is not None:
            raise InputError(
                "render: zoom: a box is for states in 2D; give a factor such as 2.0 in 3D"
            )
        x0, y0, x1, y1 = zoom
        wanted = np.array([[x0, y0], [x1, y1]])
        if np.any(wanted[0] > box[1]) or np.any(wanted[1] < box[0]):
            low, high = (", ".join(f"{value:.3g}" for value in corner) for corner in box)
            raise InputError(
                f"render: zoom = ({x0:g}, {y0:g}, {x1:g}, {y1:g}): shows nothing: the bodies are "
                f"within ({low}) and ({high}) m; give a box in there"
            )
        return wanted


def _opened(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = limits
    if low < high:
        return low, high
    # All numbers are the same: a scale about them that is not mistaken for a signal.
    reach = 0.5 * abs(low) or 1.0
    return (0.0, 1.0) if low == 0 else (low - reach, low + reach)


def shown_mask(snapshot: Snapshot, look: Look) -> NDArray[np.bool_]:
    """Nodes that are coloured by numbers: not those of walls, unless there is nothing else."""
    if look.walls == "coloured" or snapshot.wall.all():
        return np.ones(len(snapshot.points), dtype=bool)
    return ~snapshot.wall


def box_of(plane: FloatArray) -> FloatArray:
    """Corners of a picture of points, with a margin of 4 %.

    A few fragments far away do not shrink the bodies: beyond a quarter of the size of the
    middle 98 % of the nodes they are cut off.
    """
    finite = plane[np.isfinite(plane).all(axis=1)]
    if not len(finite):
        raise InputError("picture: no node has a finite position; draw an earlier state")
    low, high = np.quantile(finite, (0.01, 0.99), axis=0)
    reach = 0.25 * float((high - low).max())
    low = np.maximum(finite.min(axis=0), low - reach)
    high = np.minimum(finite.max(axis=0), high + reach)
    margin = 0.04 * float((high - low).max()) or 1.0
    return np.stack([low - margin, high + margin])


def prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Size and text of a unit with a prefix in which the largest number has 1 to 3 digits."""
    largest = max((abs(value) for value in values), default=0.0)
    if not unit or not largest > 0 or not np.isfinite(largest):
        return 1.0, unit
    for size, sign in _PREFIXES:
        if largest >= size * (1 - 1e-9):
            return size, sign + unit
    return 1.0, unit


def time_text(time: float | None, last: float | None, *, several: bool = False) -> str:
    """Title of a state: its time, in the unit (and with the digits) of the last of a series."""
    if time is None:
        return ""
    size, unit = prefix([last or time], "s")
    if not several or not last:
        return f"t = {time / size:.4g} {unit}"
    digits = max(0, 3 - len(str(int(last / size))))
    return f"t = {time / size:.{digits}f} {unit}"


def bodies_centres(snapshot: Snapshot, positions: FloatArray) -> dict[int, Any]:
    """Mean position of the nodes of each body, by its id."""
    ids = snapshot.fields.get("Particle_ID")
    if ids is None:
        raise InputError(
            "render: chains: need the array Particle_ID, which is not in the data; run with the "
            "tag Particle_ID"
        )
    found, inverse = np.unique(np.asarray(ids), return_inverse=True)
    sums = np.stack([np.bincount(inverse, positions[:, k]) for k in range(positions.shape[1])], 1)
    centres = sums / np.bincount(inverse)[:, None]
    return dict(zip(found.tolist(), centres, strict=True))
