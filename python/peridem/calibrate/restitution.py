"""The coefficient of restitution of two grains: measured, and reached by their damping.

A disc (2D) or sphere (3D) flies at a fixed one of another radius and material, a node of its rim
ahead and one of the other's rim in its way. Gravity is left out of the short run: a fall from
height H0 arrives at the contact radius Rc with the speed sqrt(2 g (H0 - Rc)), and a rebound at e
times that speed rises to H1 = Rc + e^2 (H0 - Rc).

References
----------
Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376, section 4.1, eq. 37: CR = sqrt(H1/H0).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..errors import InputError
from ..materials import Material
from ..mesh import Mesh
from ..model import DEMModel
from ..modelling.arguments import checked, choice, number, show_value, whole
from ..shapes import Circle, Sphere
from .search import Calibration, Search

__all__ = ["Restitution", "measure_restitution", "restitution"]

_SAFETY = 0.25
"""Part of the stable time step: damping is not in its estimate."""
_START = 1.05
"""Gap at the start, in contact radii."""
_CLEAR = 1.02
"""Gap in contact radii from which neither contact nor damping (up to 1.01) acts."""
_PATIENCE = 40.0
"""How long the discs have to part, in times that the speed of impact needs for Rc."""

_RATIOS = (1.0, 0.95, 0.85, 0.7, 0.5, 0.3, 0.1, 0.01)
_FACTORS = (0.0, 1.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)


@dataclass(frozen=True)
class Restitution:
    """A rebound.

    Attributes
    ----------
    value : float
        Coefficient of restitution: sqrt(H1/H0) when a height was given, else `speed_ratio`.
    speed_ratio : float
        Speed after over speed before; 0 when the grains did not part.
    speed : float
        Speed of the impact [m/s].
    height : float or None
        Height H0 of the fall [m].
    contact_radius : float
        Contact radius Rc [m].
    time : float
        Simulated time [s] until the grains were apart again.
    steps : int
        Number of steps.
    contact : dict
        Arguments of `DEMModel.set_contact` that were used.
    """

    value: float
    speed_ratio: float
    speed: float
    height: float | None
    contact_radius: float
    time: float
    steps: int
    contact: dict[str, Any] = field(repr=False)


@checked
def measure_restitution(
    material: Material | Sequence[Material],
    *,
    radius: float | Sequence[float],
    mesh_size: float | Sequence[float] | None = None,
    mesh: Mesh | Sequence[Mesh] | None = None,
    height: float | None = None,
    speed: float | None = None,
    gravity: float = 10.0,
    damping_ratio: float | None = None,
    damping_factor: float = 1.0,
    damping_criterion: str = "nodes",
    contact: Mapping[str, Any] | None = None,
    dimension: int = 2,
    turn: float = 0.0,
    dt: float | None = None,
    threads: int = 1,
) -> Restitution:
    """Measure the coefficient of restitution of two grains by a short run.

    Parameters
    ----------
    material : Material or pair
        Material of both, or of the lower, fixed grain and the upper one.
    radius : float or pair
        Radius [m] of both, or of the lower and the upper one.
    mesh_size : float or pair, optional
        Mesh size [m]; of both, or of the lower and the upper one. Or
    mesh : Mesh or pair, optional
        their meshes.
    height : float, optional
        Height [m] of the fall, from surface to surface; or
    speed : float, optional
        the speed of the impact [m/s].
    gravity : float
        Acceleration of gravity [m/s^2] of the fall from `height`.
    damping_ratio : float, optional
        Epsilon of a deck, up to 1; no damping when left out.
    damping_factor : float
        Beta_n_Factor of a deck.
    damping_criterion : {"nodes", "centers"}
        Where damping acts: nodes closer than Rc, as in the paper, or the centre nodes of the
        grains closer than the radii and 1.01 Rc, as in the original program. The latter depends
        on how far the centre nodes of the meshes are from the centres.
    contact : mapping, optional
        More arguments of `DEMModel.set_contact`.
    dimension : {2, 3}
        Discs or spheres.
    turn : float
        Angle [rad] by which the upper grain is turned, about z or y in 3D, from node facing node.
    dt : float, optional
        Time step [s]; a quarter of the stable one when left out.
    threads : int
        Number of threads.

    Returns
    -------
    Restitution

    Raises
    ------
    InputError
        If an argument breaks its rule.
    NumericalError
        If the run leaves the finite numbers.
    """
    who = "measure_restitution"
    setup = _Setup(
        who, material=material, radius=radius, mesh_size=mesh_size, mesh=mesh, height=height,
        speed=speed, gravity=gravity, contact=contact, dimension=dimension, turn=turn, dt=dt,
        threads=threads,
    )  # fmt: skip
    return setup.run(_damping(who, damping_ratio, damping_factor, damping_criterion))


@checked
def restitution(
    wanted: float,
    material: Material | Sequence[Material],
    *,
    radius: float | Sequence[float],
    mesh_size: float | Sequence[float] | None = None,
    mesh: Mesh | Sequence[Mesh] | None = None,
    height: float | None = None,
    speed: float | None = None,
    gravity: float = 10.0,
    vary: str = "damping_ratio",
    damping_ratio: float = 0.95,
    damping_factor: float = 100.0,
    damping_criterion: str = "nodes",
    between: Sequence[float] | None = None,
    tolerance: float = 2e-3,
    contact: Mapping[str, Any] | None = None,
    dimension: int = 2,
    turn: float = 0.0,
    dt: float | None = None,
    threads: int = 1,
) -> Calibration:
    """Find the damping that gives a wanted coefficient of restitution.

    Parameters
    ----------
    wanted : float
        Coefficient of restitution, between 0 and 1: sqrt(H1/H0) with `height`, else the ratio of
        the speeds after and before the impact.
    vary : {"damping_ratio", "damping_factor"}
        What to find; the other one stays as given.
    between : pair of float, optional
        Range of what is found; 0.01 to 1 for the ratio and 0 to 3000 for the factor when left
        out.
    tolerance : float
        Largest difference between the wanted and the achieved value. Values depend on where
        nodes are at the moment of contact, by some thousandths.
    material, radius, mesh_size, mesh, height, speed, gravity, damping_ratio, damping_factor, \
damping_criterion, contact, dimension, turn, dt, threads
        As in `measure_restitution`.

    Returns
    -------
    Calibration
        ``measured.contact`` are the arguments for `DEMModel.set_contact`.

    Raises
    ------
    InputError
        If an argument breaks its rule, or the value cannot be reached; then with the range
        that can.
    NumericalError
        If a run leaves the finite numbers.
    """
    who = "restitution"
    goal = number(wanted, f"{who}: wanted", least=0)
    if goal > 1:
        raise InputError(f"{who}: wanted = {wanted!r}: must be at most 1; no rebound gains energy")
    allowed = number(tolerance, f"{who}: tolerance", above=0)
    choice(vary, ("damping_ratio", "damping_factor"), f"{who}: vary")
    setup = _Setup(
        who, material=material, radius=radius, mesh_size=mesh_size, mesh=mesh, height=height,
        speed=speed, gravity=gravity, contact=contact, dimension=dimension, turn=turn, dt=dt,
        threads=threads,
    )  # fmt: skip
    given = {"damping_ratio": damping_ratio, "damping_factor": damping_factor}

    def measure(value: float) -> Restitution:
        values = {**given, vary: value}
        return setup.run(_damping(who, criterion=damping_criterion, **values))

    search = Search(
        measure, lambda one: float(one.value), who=who, name=vary, outcome="restitution",
        wanted=goal, tolerance=allowed,
    )  # fmt: skip
    return search.find(_values(who, vary, between))


def _values(who: str, vary: str, between: Any) -> Sequence[float]:
    """Values to try, from weak damping to strong."""
    ratio = vary == "damping_ratio"
    if between is None:
        return _RATIOS if ratio else _FACTORS
    low, high = _pair(between, f"{who}: between")
    low = number(low, f"{who}: between", above=0 if ratio else None, least=0)
    high = number(high, f"{who}: between", above=low)
    if ratio and high > 1:
        raise InputError(f"{who}: between = {show_value(between)}: ratios are at most 1; lower it")
    values = [float(one) for one in np.linspace(low, high, 5)]
    return values[::-1] if ratio else values


def _damping(who: str, damping_ratio: Any, damping_factor: Any, criterion: Any) -> dict[str, Any]:
    """Arguments of `set_contact` for the damping."""
    known = ("nodes", "centers")
    values = {"damping_criterion": choice(criterion, known, f"{who}: damping_criterion")}
    if damping_ratio is None:
        return {}
    ratio = number(damping_ratio, f"{who}: damping_ratio", above=0)
    if ratio > 1:
        raise InputError(
            f"{who}: damping_ratio = {damping_ratio!r}: must be at most 1; 1 is no damping"
        )
    factor = number(damping_factor, f"{who}: damping_factor", least=0)
    return {"damping_ratio": ratio, "damping_factor": factor, **values}


def _pair(value: Any, where: str) -> tuple[Any, Any]:
    """Give two values, of the lower grain and of the upper, for one or two."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        if len(value) != 2:
            raise InputError(
                f"{where} = {show_value(value)}: must be one value or two, of the lower grain and "
                "the upper; correct it"
            )
        return value[0], value[1]
    return value, value


class _Setup:
    """Two grains and how they meet, checked; each run makes a model of them."""

    def __init__(
        self, who: str, *, material: Any, radius: Any, mesh_size: Any, mesh: Any, height: Any,
        speed: Any, gravity: Any, contact: Any, dimension: Any, turn: Any, dt: Any, threads: Any,
    ) -> None:  # fmt: skip
        if dimension not in (2, 3):
            raise InputError(f"{who}: dimension = {dimension!r}: must be 2 or 3; choose one")
        self.who, self.dimension = who, int(dimension)
        self.materials = _pair(material, f"{who}: material")
        radii = _pair(radius, f"{who}: radius")
        self.radii = tuple(number(one, f"{who}: radius", above=0, unit="m") for one in radii)
        self.shapes = [(Circle if dimension == 2 else Sphere)(radius=one) for one in self.radii]
        self.meshes = self._made(mesh_size, mesh)
        self.turn = number(turn, f"{who}: turn", unit="rad")
        self.dt = None if dt is None else number(dt, f"{who}: dt", above=0, unit="s")
        self.threads = whole(threads, f"{who}: threads", 1)
        self.contact = dict(contact or {})
        if (height is None) == (speed is None):
            raise InputError(f"{who}: height, speed: one of them is needed; give the height in m")
        self.height = None if height is None else number(height, f"{who}: height", above=0)
        self.gravity = number(gravity, f"{who}: gravity", above=0, unit="m/s^2")
        self.speed = None if speed is None else number(speed, f"{who}: speed", above=0)
        for one in self.materials:
            if not isinstance(one, Material):
                raise InputError(
                    f"{who}: material = {show_value(one)}: must be a material; give PDState(...)"
                )

    def _made(self, mesh_size: Any, mesh: Any) -> list[Mesh]:
        if (mesh_size is None) == (mesh is None):
            raise InputError(
                f"{self.who}: mesh_size: one of mesh_size and mesh is needed; give it in m"
            )
        if mesh is not None:
            return list(_pair(mesh, f"{self.who}: mesh"))
        sizes = _pair(mesh_size, f"{self.who}: mesh_size")
        return [shape.mesh(size) for shape, size in zip(self.shapes, sizes, strict=True)]

    def run(self, damping: Mapping[str, Any]) -> Restitution:
        """Let the grains collide."""
        contact = {**self.contact, **damping}
        probe = _Flight(self._model(contact, sum(self.radii), 0.0), sum(self.radii))
        radius = probe.model.contact_radius(0, 1)
        speed = self.speed or self._speed_of_fall(radius)
        start = _START * radius + sum(self.radii) - probe.gap()
        flight = _Flight(self._model(contact, start, speed), sum(self.radii))
        patience = _PATIENCE * radius / speed
        every = max(1, int(0.01 * radius / (speed * flight.model.dt)))
        parted = False
        while not parted and flight.model.time < patience:
            flight.model.step(every)
            parted = flight.gap() > _CLEAR * radius and flight.velocity() > 0
        ratio = flight.velocity() / speed if parted else 0.0
        value = ratio
        if self.height is not None:
            value = math.sqrt((radius + ratio**2 * (self.height - radius)) / self.height)
        return Restitution(
            value, ratio, speed, self.height, radius, flight.model.time, flight.model.n, contact
        )

    def _speed_of_fall(self, radius: float) -> float:
        assert self.height is not None
        if self.height <= _START * radius:
            raise InputError(
                f"{self.who}: height = {self.height:g}: must be above {_START * radius:g} m, "
                "where contact begins; give a larger one"
            )
        return math.sqrt(2 * self.gravity * (self.height - radius))

    def _model(self, contact: Mapping[str, Any], gap: float, speed: float) -> DEMModel:
        model = DEMModel(self.dimension, dt=self.dt, safety=_SAFETY, threads=self.threads)
        low, high = self.materials
        axis = np.eye(3)[self.dimension - 1]
        below = _rotation(_facing(self.meshes[0], axis), 0.0, self.dimension)
        above = _rotation(_facing(self.meshes[1], -axis), self.turn, self.dimension)
        model.add_particle(
            self.shapes[0], mesh=self.meshes[0], material=low, fixed=True, name="lower", **below
        )
        model.add_particle(
            self.shapes[1], mesh=self.meshes[1], material=high, name="upper",
            at=((sum(self.radii) + gap) * axis).tolist(), velocity=(-speed * axis).tolist(),
            **above,
        )  # fmt: skip
        if contact:
            model.set_contact(**contact)
        model.init()
        return model


class _Flight:
    """Where the upper grain is, and how fast it rises."""

    def __init__(self, model: DEMModel, reach: float) -> None:
        self.model, self._reach, self._axis = model, reach, model.dimension - 1
        self._bodies = [model.nodes_of(k) for k in (0, 1)]
        masses = [model.state.volume[nodes] * model.state.density[nodes] for nodes in self._bodies]
        self._shares = [mass / mass.sum() for mass in masses]

    def gap(self) -> float:
        """Gap between the surfaces [m], by the centres of mass or the centre nodes: the smaller."""
        x, axis = self.model.state.x, self._axis
        low, high = (
            share @ x[nodes, axis] for share, nodes in zip(self._shares, self._bodies, strict=True)
        )
        below, above = (self.model.particle(k).center[axis] for k in (0, 1))
        return float(min(high - low, above - below) - self._reach)

    def velocity(self) -> float:
        """Velocity of the centre of mass, up [m/s]."""
        return float(self._shares[1] @ self.model.state.v[self._bodies[1], self._axis])


def _facing(mesh: Mesh, direction: NDArray[np.float64]) -> Rotation:
    """Smallest turn about the origin that brings a node of the rim into a direction."""
    distances = np.linalg.norm(mesh.points, axis=1)
    rim = mesh.points[distances > (1 - 1e-6) * distances.max()]
    node = rim[np.argmax(rim @ direction)] / distances.max()
    axis = np.cross(node, direction)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return Rotation.identity()
    return Rotation.from_rotvec(axis / length * math.atan2(length, node @ direction))


def _rotation(rotation: Rotation, turn: float, dimension: int) -> dict[str, Any]:
    """Arguments of `add_particle` for a rotation, and after it a turn about z, or y in 3D."""
    more = Rotation.from_rotvec(turn * np.eye(3)[2 if dimension == 2 else 1])
    vector = (more * rotation).as_rotvec()
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return {}
    if dimension == 2:
        return {"angle": float(vector[2])}
    return {"angle": angle, "axis": (vector / angle).tolist()}
