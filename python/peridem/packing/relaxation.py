"""Moving grains apart, and letting them fall.

Overlaps push like springs of stiffness 1 on grains of mass 1, so that time has the unit of one
and forces are lengths. `separate` goes downhill on the energy of the overlaps by the fast inertial
relaxation engine (FIRE); `settle` adds weight and drag.

References
----------
E. Bitzek et al., Structural relaxation made simple, Phys. Rev. Lett. 97 (2006) 170201.
C. S. O'Hern et al., Jamming at zero temperature and zero applied stress, Phys. Rev. E 68 (2003)
011306.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..geometry.base import FloatArray
from .assembly import Assembly, Candidates, Contacts
from .regions import Region

_SKIN = 0.4
"""Reach of the lists of candidates beyond contact, in mean radii."""
_LONGEST_MOVE = 0.15
"""Largest move in a step, in radii of the grain."""
_TIME_STEP = 0.35
_PATIENCE, _STUCK = 100, 0.975
"""Every so many steps progress is looked at: a smaller part of the energy must be left."""
_CAUGHT = 0.2
"""Overlap, in radii, that after that many steps means a grain is caught in another."""
_DASHPOT = 0.5
"""Force [mean radii] per speed at which grains in contact close."""
_PLACES = 400
"""Random places looked at for a caught grain."""
_MARGIN = 2e-3
"""How far grains are driven apart beyond the gap, in mean radii, so that relaxation ends."""


@dataclass(frozen=True)
class Outcome:
    """How a relaxation ended: largest overlap left [m], overlapping grains, steps taken."""

    worst: float
    count: int
    steps: int


class Mover:
    """An assembly between walls, with the lists that its contacts need.

    Parameters
    ----------
    grains : Assembly
        Moved in place.
    region : Region
        The domain.
    gap : float
        Smallest distance [m] between grains and from walls.
    fixed : int
        So many grains, the last ones, do not move.
    """

    def __init__(self, grains: Assembly, region: Region, gap: float, fixed: int = 0) -> None:
        self.grains, self.region, self.gap = grains, region, gap
        self.moving = len(grains) - fixed
        self.scale = float(grains.radius[: self.moving].mean())
        self.margin = _MARGIN * self.scale
        self._built: FloatArray | None = None

    def contacts(self, gap: float) -> Contacts:
        """Return the overlaps of grains grown by the `gap` [m], and of grains and walls."""
        self._refresh()
        self.grains.turn()
        found = self.grains.contacts(self._near, gap)
        if self.moving < len(self.grains):
            kept = (found.first < self.moving) | (found.second < self.moving)
            found = Contacts(*(getattr(found, name)[kept] for name in Contacts.__annotations__))
        return Contacts.joined([found, *self._on_walls(gap)])

    def _refresh(self) -> None:
        """Renew the candidates when some grain may have left their reach."""
        g, skin = self.grains, _SKIN * self.scale
        # a turn moves the outermost point by at most the angle times the radius
        here = np.column_stack([g.center, g.angle * g.radius * ~g.is_disc])
        if self._built is not None:
            d = here - self._built
            moved = np.sqrt((d[:, :-1] ** 2).sum(axis=1)) + np.abs(d[:, -1])
            if 2.0 * moved.max() < skin:
                return
        self._built = here
        reach = self.gap + self.margin + skin
        self._near: Candidates = g.candidates(reach)
        depth, _ = self.region.push(g.center[: self.moving], g.radius[: self.moving] + reach)
        self._wall = np.flatnonzero(depth > 0.0)

    def _on_walls(self, gap: float) -> list[Contacts]:
        g = self.grains
        discs = self._wall[g.is_disc[self._wall]]
        found = [self._pushed(discs, g.center[discs], g.radius[discs] + gap)]
        if len(g.owner):
            near = np.zeros(len(g), dtype=bool)
            near[self._wall] = True
            rows = np.flatnonzero(near[g.owner])
            corner, row = np.nonzero(g.real[:, rows])
            row = rows[row]
            owner = g.owner[row]
            points = g.now_vertices[:, corner, row].T + g.center[owner]
            found.append(self._pushed(owner, points, np.full(len(points), gap)))
        return found

    def _pushed(self, owner: NDArray[np.intp], centers: FloatArray, radii: FloatArray) -> Contacts:
        if len(owner) == 0:
            nothing = np.empty((0, self.grains.dimension))
            return Contacts(owner, owner, nothing, np.empty(0), nothing)
        out, depth, normal = self.region.walls(centers, radii)
        point = centers[out] - normal * radii[out, None]
        return Contacts(owner[out], np.full(len(out), -1, dtype=np.intp), normal, depth, point)

    def forces(self, found: Contacts) -> FloatArray:
        """Sum the contacts: forces, and torques over the radius of gyration, shape (n, d + 1)."""
        g, n = self.grains, len(self.grains)
        d = g.dimension
        total = np.zeros((n, d + 1))
        push = found.normal * found.depth[:, None]
        inner = found.second >= 0
        second = found.second[inner]
        for axis in range(d):
            total[:, axis] = np.bincount(found.first, push[:, axis], n)
            total[:, axis] -= np.bincount(second, push[inner, axis], n)
        if d == 2 and len(g.owner):
            arm = found.point - g.center[found.first]
            total[:, 2] = np.bincount(found.first, _cross(arm, push), n)
            arm = found.point[inner] - g.center[second]
            total[:, 2] -= np.bincount(second, _cross(arm, push[inner]), n)
            total[:, 2] *= np.where(g.is_disc, 0.0, 1.0) / self.gyration
        total[self.moving :] = 0.0
        return total

    def parting(self, found: Contacts, velocity: FloatArray) -> FloatArray:
        """Return how fast the two sides of each contact part, shape (c,)."""
        inner = found.second >= 0
        speed = (self._at(found.first, found.point, velocity) * found.normal).sum(axis=1)
        second = self._at(found.second[inner], found.point[inner], velocity)
        speed[inner] -= (second * found.normal[inner]).sum(axis=1)
        return np.asarray(speed)

    def _at(self, grain: NDArray[np.intp], point: FloatArray, velocity: FloatArray) -> FloatArray:
        """Velocity of a point of each grain."""
        moved = velocity[grain, :-1].copy()
        if self.grains.dimension == 2:
            spin = velocity[grain, -1] / self.gyration[grain]
            arm = point - self.grains.center[grain]
            moved += spin[:, None] * np.column_stack([-arm[:, 1], arm[:, 0]])
        return np.asarray(moved)

    @property
    def gyration(self) -> FloatArray:
        """Radius of gyration [m] given to each grain: that of a disc."""
        return np.asarray(np.maximum(self.grains.radius, 1e-300) / np.sqrt(2.0))

    def move(self, step: FloatArray) -> None:
        """Move by `step`, shape (n, d + 1), cut to a part of the radius."""
        length = np.sqrt((step * step).sum(axis=1))
        most = _LONGEST_MOVE * self.grains.radius
        step = (
            step * np.where(length > most, most / np.where(length > 0, length, 1.0), 1.0)[:, None]
        )
        self.grains.center += step[:, :-1]
        self.grains.angle += step[:, -1] / self.gyration

    def caught(self, found: Contacts) -> NDArray[np.intp]:
        """Return the grains so deep in others that pushing does not free them.

        Of each two the smaller one: crossed long grains, one in the bay of another.
        """
        radius = np.append(self.grains.radius, np.inf)  # the last stands for the wall, -1
        first_is = radius[found.first] <= radius[found.second]
        smaller = np.where(first_is, found.first, found.second)
        # a fixed corner has no radius and cannot go
        smaller = np.where(smaller < self.moving, smaller, found.first + found.second - smaller)
        deep = found.depth - self.gap > _CAUGHT * self.grains.radius[smaller]
        return np.asarray(np.unique(smaller[deep]))

    def transplant(self, caught: NDArray[np.intp], rng: np.random.Generator) -> None:
        """Put grains, turned at random, where random places have most room around them."""
        g = self.grains
        for grain in caught:
            places = self.region.sample(rng, _PLACES)
            others = np.delete(np.arange(self.moving), grain)
            near = cKDTree(g.center[others]).query(places, k=min(6, len(others)))
            distance, who = (np.asarray(part).reshape(len(places), -1) for part in near)
            room = (distance - 0.8 * g.radius[others][who]).min(axis=1, initial=np.inf)
            depth, _ = self.region.push(places, np.zeros(len(places)))
            best = np.argmax(np.minimum(room, -depth))
            g.center[grain] = places[best]
            g.angle[grain] = 2.0 * np.pi * rng.random()
        self._built = None

    def outcome(self, found: Contacts, steps: int, extra: float) -> Outcome:
        """Return what is left of overlaps that were found with an `extra` gap [m]."""
        left = found.depth - extra
        grains = found.first[left > 0.0]
        return Outcome(float(left.max(initial=0.0)), len(np.unique(grains)), steps)


def separate(mover: Mover, steps: int, rng: np.random.Generator) -> Outcome:
    """Move grains until none overlap, or until that gets nowhere.

    Parameters
    ----------
    mover : Mover
    steps : int
        Most steps to take.
    rng : Generator
        For new places of grains that are caught in others.
    """
    velocity = np.zeros((len(mover.grains), mover.grains.dimension + 1))
    step, mixing, downhill = 0.5 * _TIME_STEP, 0.1, 0
    before = np.inf
    gap = mover.gap + mover.margin
    for k in range(steps):
        found = mover.contacts(gap)
        if found.depth.max(initial=0.0) <= mover.margin:
            return mover.outcome(found, k, mover.margin)
        if k % _PATIENCE == _PATIENCE - 1:
            caught = mover.caught(found)
            energy = float((found.depth**2).sum())
            if len(caught):
                velocity[caught] = 0.0
                mover.transplant(caught, rng)
                before = np.inf
                continue
            if energy > _STUCK * before:
                return mover.outcome(found, k, mover.margin)
            before = energy
        force = mover.forces(found)
        power = float((force * velocity).sum())
        if power > 0.0:
            ratio = np.linalg.norm(velocity) / max(float(np.linalg.norm(force)), 1e-300)
            velocity = (1.0 - mixing) * velocity + mixing * ratio * force
            downhill += 1
            if downhill > 5:
                step, mixing = min(1.1 * step, _TIME_STEP), 0.99 * mixing
        else:
            velocity[:] = 0.0
            step, mixing, downhill = max(0.5 * step, 0.05), 0.1, 0
        velocity += step * force
        mover.move(step * velocity)
    return mover.outcome(mover.contacts(gap), steps, mover.margin)


def settle(
    mover: Mover, weight: FloatArray, speed: float, steps: int, *, rest: float = 0.25
) -> int:
    """Let grains sink with drag until they rest.

    Parameters
    ----------
    mover : Mover
    weight : ndarray, shape (d,)
        Force [m] on each grain.
    speed : float
        Speed [m] per unit of time of a falling grain.
    steps : int
        Most steps to take.
    rest : float
        Grains rest when none sank by so many mean radii in as many steps as `_PATIENCE`.

    Returns
    -------
    int
        Steps taken.
    """
    velocity = np.zeros((len(mover.grains), mover.grains.dimension + 1))
    heavy = float(np.linalg.norm(weight))
    drag, down, here = heavy / speed, weight / heavy, mover.grains.center.copy()
    for k in range(steps):
        found = mover.contacts(mover.gap)
        braked = found.depth - _DASHPOT * mover.parting(found, velocity)
        force = mover.forces(replace(found, depth=np.maximum(braked, 0.0)))
        force[: mover.moving, :-1] += weight
        velocity *= 1.0 - drag * _TIME_STEP
        velocity[:, -1] *= 0.95
        velocity += _TIME_STEP * force
        mover.move(_TIME_STEP * velocity)
        if k % _PATIENCE == _PATIENCE - 1:
            sunk = (mover.grains.center - here)[: mover.moving] @ down
            if sunk.max() < rest * mover.scale:
                return k
            here = mover.grains.center.copy()
    return steps


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
