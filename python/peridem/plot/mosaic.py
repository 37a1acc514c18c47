"""Triangles of one colour each, drawn in one call: 1e5 of them in well under a second."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.collections import Collection
from matplotlib.colors import to_rgba_array
from matplotlib.transforms import Bbox, IdentityTransform
from numpy.typing import NDArray

__all__ = ["Mosaic", "boundary_edges", "split"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Mosaic(Collection):
    """Triangles in one colour each, in the order in which they are given.

    Parameters
    ----------
    triangles : ndarray, shape (n, 3, 2)
        Corners in data coordinates.
    colours : colour or ndarray of shape (n, 4), optional
        Their colours; with `set_array` they follow from numbers instead.
    """

    def __init__(self, triangles: FloatArray, colours: Any = None, **options: Any) -> None:
        super().__init__(**options)
        self.triangles = np.asarray(triangles, dtype=float)
        # As pixels also in a PDF: hundreds of thousands of triangles open slowly, with seams.
        self.set_rasterized(True)
        self.set_in_layout(False)
        if colours is not None:
            self.set_facecolor(colours)

    def get_datalim(self, transData: Any) -> Bbox:  # noqa: N803  # its name in matplotlib
        """Return the box of the triangles, in data coordinates."""
        corners = self.triangles.reshape(-1, 2)
        to_data = self.get_transform() - transData
        return (
            Bbox.null()
            if not len(corners)
            else Bbox.from_extents(
                *to_data.transform(corners).min(axis=0), *to_data.transform(corners).max(axis=0)
            )
        )

    @allow_rasterization  # type: ignore[untyped-decorator]
    def draw(self, renderer: Any) -> None:
        """Draw all triangles."""
        if not self.get_visible() or not len(self.triangles):
            return
        self.update_scalarmappable()
        count = len(self.triangles)
        colours = np.broadcast_to(to_rgba_array(self.get_facecolor()), (count, 4))
        corners = self.get_transform().transform(self.triangles.reshape(-1, 2))
        gc = renderer.new_gc()
        artist: Any = self  # whose clipping matplotlib's types do not know
        artist._set_gc_clip(gc)
        renderer.draw_gouraud_triangles(
            gc,
            corners.reshape(-1, 3, 2),
            np.repeat(colours[:, None], 3, axis=1),
            IdentityTransform().frozen(),
        )
        gc.restore()
        self.stale = False


def split(cells: NDArray[Any]) -> NDArray[Any]:
    """Triangles, shape (m, 3), of triangles or quads; those of a quad follow each other."""
    if cells.shape[1] == 3:
        return cells
    return np.asarray(cells[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))


def boundary_edges(cells: list[NDArray[Any]], n_nodes: int) -> IntArray:
    """Edges, shape (m, 2), that belong to one element only, of plane elements."""
    pairs = [np.stack([c, np.roll(c, -1, axis=1)], axis=2).reshape(-1, 2) for c in cells if len(c)]
    if not pairs:
        return np.empty((0, 2), dtype=np.int64)
    edges = np.sort(np.concatenate(pairs).astype(np.int64), axis=1)
    keys, count = np.unique(edges[:, 0] * n_nodes + edges[:, 1], return_counts=True)
    once = keys[count == 1]
    return np.stack([once // n_nodes, once % n_nodes], axis=1)
