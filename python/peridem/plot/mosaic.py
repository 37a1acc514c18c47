"""Triangles of one colour each, drawn in one call: 1e5 of them in well under a second."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import allow_rasterization
from matplotlib.collections import Collection
from matplotlib.colors import to_rgba_array
from matplotlib.transforms import Bbox, IdentityTransform
from numpy.typing import NDArray

__all__ = ["Mosaic"]

FloatArray = NDArray[np.float64]


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
        if not len(self.triangles):
            return Bbox.null()
        corners = (self.get_transform() - transData).transform(self.triangles.reshape(-1, 2))
        return Bbox.from_extents(*corners.min(axis=0), *corners.max(axis=0))

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
