"""Grains as they are moved about while packing, and the contacts between them.

A grain is a set of convex pieces: discs (spheres in 3D) and, in the plane, polygons. Two polygons
are told apart by the separating axis theorem, a disc and a polygon by the nearest point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.base import FloatArray
from .outlines import Outline
from .pairs import IndexArray, near_pairs

_FAR = 1e300


@dataclass(frozen=True)
class Contacts:
    """Overlaps between grains.

    Attributes
    ----------
    first, second : ndarray of int, shape (c,)
        Grains; `second` is -1 where the first touches the wall.
    normal : ndarray, shape (c, d)
        Direction in which the first must move.
    depth : ndarray, shape (c,)
        How far [m].
    point : ndarray, shape (c, d)
        Where they touch [m].
    """

    first: IndexArray
    second: IndexArray
    normal: FloatArray
    depth: FloatArray
    point: FloatArray

    @staticmethod
    def joined(parts: Sequence[Contacts]) -> Contacts:
        """Return the contacts of several sets as one."""
        return Contacts(
            np.concatenate([part.first for part in parts]),
            np.concatenate([part.second for part in parts]),
            np.vstack([part.normal for part in parts]),
            np.concatenate([part.depth for part in parts]),
            np.vstack([part.point for part in parts]),
        )


class Assembly:
    """Centres and angles of grains, which change, and their pieces, which do not.

    Parameters
    ----------
    outlines : sequence of Outline
        Shapes.
    index : ndarray of int, shape (n,)
        Shape of each grain.
    scales : ndarray, shape (n,)
        Factor on the shape.
    centers : ndarray, shape (n, d)
        Where the centres of the shapes are [m].
    angles : ndarray, shape (n,)
        Angles about z [rad]; without meaning in 3D.
    """

    def __init__(
        self,
        outlines: Sequence[Outline],
        index: IndexArray,
        scales: FloatArray,
        centers: FloatArray,
        angles: FloatArray,
    ) -> None:
        self.center, self.angle = centers.copy(), angles.copy()
        self.radius = scales * np.array([outline.radius for outline in outlines])[index]
        self._add_discs(outlines, index)
        self._add_polygons(outlines, index, scales)

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.center.shape[1])

    def _add_discs(self, outlines: Sequence[Outline], index: IndexArray) -> None:
        round_ = np.array([not outline.pieces for outline in outlines])
        self.is_disc = round_[index]

    def _add_polygons(
        self, outlines: Sequence[Outline], index: IndexArray, scales: FloatArray
    ) -> None:
        most = max([len(p) for outline in outlines for p in outline.pieces], default=1)
        rows = [(g, p) for g in range(len(index)) for p in outlines[index[g]].pieces]
        self.owner = np.array([g for g, _ in rows], dtype=np.intp)
        self.starts = np.searchsorted(self.owner, np.arange(len(index) + 1))
        self.sides = np.array([len(p) for _, p in rows], dtype=np.intp)
        # all arrays of polygons are of shape (2,) most, m, polygons last: so numpy is fastest;
        # short polygons repeat their last vertex, the sides in excess are never the nearest
        self.vertices = np.zeros((2, most, len(rows)))
        for k, (g, p) in enumerate(rows):
            self.vertices[:, : len(p), k] = p.T * scales[g]
            self.vertices[:, len(p) :, k] = p[-1:].T * scales[g]
        corner = np.arange(most)[:, None]
        self.real = corner < self.sides
        after = np.where(corner + 1 < self.sides, corner + 1, 0)
        edge = np.take_along_axis(self.vertices, after[None], axis=1) - self.vertices
        edge[:, ~self.real] = 0.0
        self.length = np.where(self.real, np.hypot(*edge), 1.0)
        self.tangent = edge / self.length
        self.normal = np.stack([self.tangent[1], -self.tangent[0]])
        self.offset = np.where(self.real, (self.normal * self.vertices).sum(axis=0), _FAR)
        self.middle = (self.vertices * self.real).sum(axis=1) / np.maximum(self.sides, 1)
        self.extent = np.hypot(*(self.vertices - self.middle[:, None])).max(axis=0, initial=0.0)

    # where the pieces are now

    def turn(self) -> None:
        """Turn the pieces to the present angles; to be called before `contacts`."""
        if len(self.owner) == 0:
            return
        c, s = np.cos(self.angle)[self.owner], np.sin(self.angle)[self.owner]

        def turned(v: FloatArray) -> FloatArray:
            return np.stack([c * v[0] - s * v[1], s * v[0] + c * v[1]])

        self.now_vertices, self.now_middle = turned(self.vertices), turned(self.middle)
        self.now_tangent = turned(self.tangent)
        self.now_normal = np.stack([self.now_tangent[1], -self.now_tangent[0]])

    # candidates

    def candidates(self, reach: float) -> Candidates:
        """Return the pairs of pieces that come within `reach` [m] of each other."""
        self.turn()
        i, j = near_pairs(self.center, self.radius, reach)
        round_i, round_j = self.is_disc[i], self.is_disc[j]
        discs = (i[round_i & round_j], j[round_i & round_j])
        disc = np.concatenate([i[round_i & ~round_j], j[round_j & ~round_i]])
        other = np.concatenate([j[round_i & ~round_j], i[round_j & ~round_i]])
        mixed = self._pieces_of(disc, other, reach)
        both = ~round_i & ~round_j
        first, second = self._pieces_of_both(i[both], j[both], reach)
        return Candidates(*discs, *mixed, first, second)

    def _pieces_of(
        self, disc: IndexArray, grain: IndexArray, reach: float
    ) -> tuple[IndexArray, IndexArray]:
        """Spread pairs disc-grain over the pieces of the grain, the far ones left out."""
        row, piece = _spread(grain, self.starts)
        disc = disc[row]
        if len(disc) == 0:
            return disc, piece
        middle = self.center[self.owner[piece]] + self.now_middle[:, piece].T
        distance = np.linalg.norm(self.center[disc] - middle, axis=1)
        near = distance <= self.radius[disc] + self.extent[piece] + reach
        return disc[near], piece[near]

    def _pieces_of_both(
        self, i: IndexArray, j: IndexArray, reach: float
    ) -> tuple[IndexArray, IndexArray]:
        row, first = _spread(i, self.starts)
        row, second = _spread(j[row], self.starts)
        first = first[row]
        if len(first) == 0:
            return first, second
        near = self._distance(first, second) <= self.extent[first] + self.extent[second] + reach
        return first[near], second[near]

    def _distance(self, first: IndexArray, second: IndexArray) -> FloatArray:
        shift = self.center[self.owner[first]] - self.center[self.owner[second]]
        middle = self.now_middle[:, first] - self.now_middle[:, second]
        return np.asarray(np.hypot(shift[:, 0] + middle[0], shift[:, 1] + middle[1]))

    # contacts

    def contacts(self, near: Candidates, gap: float) -> Contacts:
        """Return where grains are less than `gap` [m] apart; call `turn` before.

        Distances between two corners are taken too small, so a gap is kept, but where corners
        meet it may be kept a bit too well.
        """
        parts = [self._between_discs(near.disc_1, near.disc_2, gap)]
        if len(near.disc):
            parts.append(self._disc_on_polygon(near.disc, near.polygon, gap))
        if len(near.polygon_1):
            parts.append(self._between_polygons(near.polygon_1, near.polygon_2, gap))
        return Contacts.joined(parts)

    def _between_discs(self, i: IndexArray, j: IndexArray, gap: float) -> Contacts:
        d = self.center[i] - self.center[j]
        distance = np.sqrt((d * d).sum(axis=1))
        touch = distance < self.radius[i] + self.radius[j] + gap
        i, j, d, distance = i[touch], j[touch], d[touch], distance[touch]
        d[distance == 0.0, 0] = 1.0
        normal = d / np.where(distance == 0.0, 1.0, distance)[:, None]
        depth = self.radius[i] + self.radius[j] + gap - distance
        return Contacts(i, j, normal, depth, self.center[j] + normal * self.radius[j][:, None])

    def _disc_on_polygon(self, disc: IndexArray, piece: IndexArray, gap: float) -> Contacts:
        grain = self.owner[piece]
        p = (self.center[disc] - self.center[grain]).T
        near = np.hypot(*(p - self.now_middle[:, piece])) < (
            self.radius[disc] + self.extent[piece] + gap
        )
        disc, piece, grain, p = disc[near], piece[near], grain[near], p[:, near]
        normals, tangents = self.now_normal[:, :, piece], self.now_tangent[:, :, piece]
        height = normals[0] * p[0] + normals[1] * p[1] - self.offset[:, piece]
        side = height.argmax(axis=0)
        rows = np.arange(len(disc))
        away = p[:, None] - self.now_vertices[:, :, piece]
        along = (away[0] * tangents[0] + away[1] * tangents[1]).clip(0.0, self.length[:, piece])
        away -= along * tangents
        apart2 = np.where(self.real[:, piece], away[0] ** 2 + away[1] ** 2, _FAR)
        nearest = apart2.argmin(axis=0)
        outside = height[side, rows] > 0.0
        apart = np.where(outside, np.sqrt(apart2[nearest, rows]), height[side, rows])
        outward = away[:, nearest, rows] / np.where(outside, apart, 1.0)
        normal = np.where(outside, outward, normals[:, side, rows]).T
        depth = self.radius[disc] + gap - apart
        touch = depth > 0.0
        point = self.center[disc] - normal * self.radius[disc][:, None]
        return Contacts(disc[touch], grain[touch], normal[touch], depth[touch], point[touch])

    def _between_polygons(self, first: IndexArray, second: IndexArray, gap: float) -> Contacts:
        near = self._distance(first, second) < self.extent[first] + self.extent[second] + gap
        first, second = first[near], second[near]
        over_second = self._highest(first, second)  # sides of the second
        over_first = self._highest(second, first)
        by_second = over_second[0] >= over_first[0]
        depth = gap - np.where(by_second, over_second[0], over_first[0])
        touch = np.flatnonzero(depth > 0.0)
        sign = np.where(by_second, 1.0, -1.0)
        face = np.where(by_second, second, first)[touch]
        guest = np.where(by_second, first, second)[touch]
        side = np.where(by_second, over_second[1], over_first[1])[touch]
        point = self._touching_point(guest, face, side, gap)
        normal = sign[touch, None] * self.now_normal[:, side, face].T
        return Contacts(
            self.owner[first[touch]], self.owner[second[touch]], normal, depth[touch], point
        )

    def _relative(self, guest: IndexArray, face: IndexArray) -> FloatArray:
        """Vertices of `guest` about the centre of the grain of `face`, shape (2, most, c)."""
        shift = self.center[self.owner[guest]] - self.center[self.owner[face]]
        return np.asarray(self.now_vertices[:, :, guest] + shift.T[:, None])

    def _highest(self, guest: IndexArray, face: IndexArray) -> tuple[FloatArray, IndexArray]:
        """Separation by the best side of `face`, and which it is."""
        v, n = self._relative(guest, face)[:, :, None], self.now_normal[:, None, :, face]
        lowest = (n[0] * v[0] + n[1] * v[1]).min(axis=0) - self.offset[:, face]
        side = lowest.argmax(axis=0)
        return lowest[side, np.arange(len(face))], side

    def _touching_point(
        self, guest: IndexArray, face: IndexArray, side: IndexArray, gap: float
    ) -> FloatArray:
        """Mean of the vertices below the side, by depth, each moved to within the side."""
        v = self._relative(guest, face)
        n, t = self.now_normal[:, side, face], self.now_tangent[:, side, face]
        corner = self.now_vertices[:, side, face]
        below = gap + self.offset[side, face] - (v[0] * n[0] + v[1] * n[1])
        weight = np.where(self.real[:, guest], np.maximum(below, 0.0), 0.0)
        off = v - corner[:, None]
        along = (off[0] * t[0] + off[1] * t[1]).clip(0.0, self.length[side, face])
        mean = (weight * along).sum(axis=0) / weight.sum(axis=0)
        return np.asarray(self.center[self.owner[face]] + (corner + mean * t).T)


@dataclass(frozen=True)
class Candidates:
    """Pairs that may touch: grains that are discs, a disc and a piece, two pieces."""

    disc_1: IndexArray
    disc_2: IndexArray
    disc: IndexArray
    polygon: IndexArray
    polygon_1: IndexArray
    polygon_2: IndexArray


def _spread(grain: IndexArray, starts: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Return, for each piece of each entry of `grain`, the entry's row and the piece."""
    count = starts[grain + 1] - starts[grain]
    row = np.repeat(np.arange(len(grain)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    return row, starts[grain][row] + np.arange(len(row)) - first
