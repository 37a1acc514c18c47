"""The crushing strength of a grain between plates: measured, and reached by its fracture energy.

A grain lies between two plates, without gravity; the lower one is fixed, the upper one comes down
at a constant speed. The force is the mean of what both plates take up, averaged over the time
that sound needs to go through the grain and back.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..materials import Material, PDElasticBond
from ..model import DEMModel
from ..modelling.arguments import checked, number, show_value, whole
from ..shapes import Circle, Cuboid, Rectangle, Sphere
from .search import Calibration, Search

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Crushing", "crushing", "measure_crushing"]

_SPEED = 2e-3
"""Speed of the plate when none is given, over the speed of sound."""
_SAMPLES = 20
"""Forces that are averaged."""
_SPENT = 0.2
"""Part of the largest force below which a grain has nothing left, once it is broken."""
_BROKEN = 0.05
"""Part of its bonds that must be broken for that."""


@dataclass(frozen=True)
class Crushing:
    """A grain crushed between plates.

    Attributes
    ----------
    force : float
        Largest force [N], per unit thickness in 2D.
    stress : float
        Nominal stress [Pa]: force / d in 2D, force / d^2 in 3D, d between the plates.
    squeeze : float
        Approach of the plates at that force, over d.
    broke : bool
        Whether the force has fallen below half of it afterwards; else the strength is at least
        `force`, and the plates have to go farther.
    speed : float
        Speed of the plate [m/s].
    diameter : float
        Extent d of the grain between the plates [m].
    table : DataFrame
        Over time [s]: ``squeeze``, ``force`` averaged [N], ``broken`` part of the grain's bonds.
    model : DEMModel
        The model at the end.
    """

    force: float
    stress: float
    squeeze: float
    broke: bool
    speed: float
    diameter: float
    table: pd.DataFrame = field(repr=False)
    model: DEMModel = field(repr=False)


@checked
def measure_crushing(
    material: Material,
    *,
    mesh_size: float,
    radius: float | None = None,
    shape: Any = None,
    dimension: int = 2,
    speed: float | None = None,
    squeeze: float = 0.3,
    plate_material: Material | None = None,
    contact: Mapping[str, Any] | None = None,
    dt: float | None = None,
    threads: int | None = None,
) -> Crushing:
    """Crush a grain between two plates.

    Parameters
    ----------
    material : Material
        Its material. With ``bond_breaking="tension"`` it splits, as grains do; otherwise it is
        ground down at the plates.
    mesh_size : float
        Mesh size of grain and plates [m].
    radius : float, optional
        Radius of a disc, or a sphere in 3D [m]; or
    shape : shape, optional
        the shape of the grain, pressed along y in 2D and z in 3D.
    dimension : {2, 3}
        Dimension when `radius` is given.
    speed : float, optional
        Speed of the upper plate [m/s]; 1/500 of the speed of sound when left out.
    squeeze : float
        Approach of the plates, over the extent of the grain, after which the run ends.
    plate_material : Material, optional
        Material of the plates; that of the grain when left out.
    contact : mapping, optional
        Arguments of `DEMModel.set_contact`.
    dt : float, optional
        Time step [s]; half the stable one when left out.
    threads : int, optional
        Number of threads.

    Returns
    -------
    Crushing

    Raises
    ------
    InputError
        If an argument breaks its rule.
    NumericalError
        If the run leaves the finite numbers.
    """
    setup = _Setup(
        "measure_crushing", material=material, mesh_size=mesh_size, radius=radius, shape=shape,
        dimension=dimension, speed=speed, squeeze=squeeze, plate_material=plate_material,
        contact=contact, dt=dt, threads=threads,
    )  # fmt: skip
    return setup.run(material)


@checked
def crushing(
    material: Material,
    *,
    mesh_size: float,
    force: float | None = None,
    stress: float | None = None,
    tolerance: float = 0.03,
    between: Sequence[float] | None = None,
    radius: float | None = None,
    shape: Any = None,
    dimension: int = 2,
    speed: float | None = None,
    squeeze: float = 0.3,
    plate_material: Material | None = None,
    contact: Mapping[str, Any] | None = None,
    dt: float | None = None,
    threads: int | None = None,
) -> Calibration:
    """Find the fracture energy that gives a wanted crushing strength.

    Parameters
    ----------
    material : Material
        Its material; the search starts from its fracture energy.
    force : float, optional
        Wanted force [N], per unit thickness in 2D; or
    stress : float, optional
        wanted nominal stress [Pa]: force / d in 2D, force / d^2 in 3D.
    tolerance : float
        Largest difference between the wanted and the achieved strength, over the wanted one.
    between : pair of float, optional
        Range of the fracture energy [J/m^2].
    mesh_size, radius, shape, dimension, speed, squeeze, plate_material, contact, dt, threads
        As in `measure_crushing`.

    Returns
    -------
    Calibration
        ``value`` is the fracture energy; ``material.with_fracture_energy(value)`` has it.

    Raises
    ------
    InputError
        If an argument breaks its rule, the strength cannot be reached, or the grain does not
        break within `squeeze`.
    NumericalError
        If a run leaves the finite numbers.
    """
    who = "crushing"
    setup = _Setup(
        who, material=material, mesh_size=mesh_size, radius=radius, shape=shape,
        dimension=dimension, speed=speed, squeeze=squeeze, plate_material=plate_material,
        contact=contact, dt=dt, threads=threads,
    )  # fmt: skip
    if (force is None) == (stress is None):
        raise InputError(f"{who}: force, stress: one of them is needed; give the force in N")
    kind, given = ("force", force) if stress is None else ("stress", stress)
    wanted = number(given, f"{who}: {kind}", above=0)
    search = Search(
        lambda energy: setup.run(material.with_fracture_energy(energy)),
        lambda one: float(getattr(one, kind)),
        who=who, name="fracture_energy", outcome=kind, wanted=wanted,
        tolerance=wanted * number(tolerance, f"{who}: tolerance", above=0), logarithmic=True,
    )  # fmt: skip
    found = search.find(_energies(who, search, wanted, setup.start, between))
    if not found.measured.broke:
        raise InputError(
            f"{who}: squeeze = {setup.squeeze:g}: the grain of fracture_energy = {found.value:.4g} "
            f"has carried {wanted:g} but is not broken by then; give a larger one"
        )
    return found


def _energies(
    who: str, search: Search, wanted: float, start: float, between: Any
) -> Iterator[float]:
    """Fracture energies to try: strength goes about with their square root."""
    if between is not None:
        low, high = between
        low = number(low, f"{who}: between", above=0)
        yield from np.geomspace(low, number(high, f"{who}: between", above=low), 5).tolist()
        return
    value = start
    yield value
    for _ in range(12):
        strength = search.tried[-1][1]
        if strength < wanted and not search.measured.broke:
            return  # what holds is no stronger with a larger energy
        factor = (wanted / strength) ** 2
        factor *= 1.3 if factor > 1 else 1 / 1.3  # beyond, to have it in between
        value *= min(max(factor, 1 / 30), 30)
        yield value


class _Setup:
    """A grain between plates, checked; each run makes a model of it."""

    def __init__(
        self, who: str, *, material: Any, mesh_size: Any, radius: Any, shape: Any, dimension: Any,
        speed: Any, squeeze: Any, plate_material: Any, contact: Any, dt: Any, threads: Any,
    ) -> None:  # fmt: skip
        self.who = who
        self._check_material(material)
        if dimension not in (2, 3):
            raise InputError(f"{who}: dimension = {dimension!r}: must be 2 or 3; choose one")
        if (radius is None) == (shape is None):
            raise InputError(f"{who}: radius, shape: one of them is needed; give the radius in m")
        if shape is None:
            size = number(radius, f"{who}: radius", above=0, unit="m")
            shape = (Circle if dimension == 2 else Sphere)(radius=size)
        if not hasattr(shape, "geometry"):
            raise InputError(
                f"{who}: shape = {show_value(shape)}: must be a shape; give for instance "
                "Circle(radius=1e-3)"
            )
        self.shape = shape
        self.mesh_size = number(mesh_size, f"{who}: mesh_size", above=0, unit="m")
        low, high = shape.geometry.box
        self.low, self.high = np.asarray(low), np.asarray(high)
        self.diameter = float((self.high - self.low)[shape.dimension - 1])
        constants = material.constants
        sound = math.sqrt((constants.k + 4 / 3 * constants.g) / material.block.density)
        self.echo = 2 * self.diameter / sound
        self.speed = number(
            _SPEED * sound if speed is None else speed, f"{who}: speed", above=0, unit="m/s"
        )
        self.squeeze = number(squeeze, f"{who}: squeeze", above=0)
        self.plate_material = plate_material
        self.contact = dict(contact or {})
        self.dt = None if dt is None else number(dt, f"{who}: dt", above=0, unit="s")
        self.threads = None if threads is None else whole(threads, f"{who}: threads", 1)
        self.start = float(constants.gc)

    def _check_material(self, material: Any) -> None:
        if not isinstance(material, Material):
            raise InputError(
                f"{self.who}: material = {show_value(material)}: must be a material; give "
                "PDState(...)"
            )
        if isinstance(material, PDElasticBond) or not (material.constants.gc or 0) > 0:
            raise InputError(
                f"{self.who}: material: {material.label} never breaks; give a law that does, "
                "with a fracture_energy"
            )

    def run(self, material: Material) -> Crushing:
        """Crush a grain of a material."""
        import pandas as pd

        model, gap = self._model(material)
        rows = list(self._samples(model, gap))
        names = ["time", "squeeze", "force", "broken"]
        table = pd.DataFrame(rows, columns=names).set_index("time")
        peak = int(np.argmax(table["force"]))
        force = float(table["force"].iloc[peak])
        after = float(table["force"].iloc[peak:].min())
        return Crushing(
            force=force,
            stress=force / self.diameter ** (model.dimension - 1),
            squeeze=float(table["squeeze"].iloc[peak]),
            broke=after < 0.5 * force and float(table["broken"].iloc[-1]) > 0,
            speed=self.speed,
            diameter=self.diameter,
            table=table,
            model=model,
        )

    def _samples(self, model: DEMModel, gap: float) -> Iterator[tuple[float, float, float, float]]:
        """Drive a model; yield time, squeeze, force and broken part."""
        axis = model.dimension - 1
        low, high = model.nodes_of("lower plate"), model.nodes_of("upper plate")
        offsets, grain = model.bonds.offsets, model.nodes_of("grain")
        bonds = slice(offsets[grain[0]], offsets[grain[-1] + 1])
        every = max(1, round(self.echo / _SAMPLES / model.dt))
        last: deque[float] = deque(maxlen=_SAMPLES)
        largest = squeeze = 0.0
        while squeeze < self.squeeze:
            model.step(every)
            forces = model.contact_forces()[:, axis] * model.state.volume
            last.append(float(forces[high].sum() - forces[low].sum()) / 2)
            force = sum(last) / _SAMPLES
            broken = float((model.bonds.intact[bonds] == 0).mean())
            squeeze = max(0.0, self.speed * model.time - gap) / self.diameter
            largest = max(largest, force)
            yield model.time, squeeze, force, broken
            if broken > _BROKEN and force < _SPENT * largest:
                return

    def _model(self, material: Material) -> tuple[DEMModel, float]:
        """Make the model; find how far the plate goes before the grain is touched on both sides."""
        dimension, h = self.shape.dimension, self.mesh_size
        axis = np.eye(3)[dimension - 1]
        side = 1.5 * float(np.max(self.high - self.low))
        thick = 2 * h
        plate: Any = Rectangle(width=side, height=thick)
        if dimension == 3:
            plate = Cuboid(width=side, depth=side, height=thick)
        model = DEMModel(dimension, dt=self.dt, threads=self.threads)
        model.add_particle(self.shape, material=material, mesh_size=h, name="grain")
        middle = (self.low + self.high) / 2
        reach = self.diameter / 2 + h + thick / 2
        for name, way, velocity in (("lower", -1, None), ("upper", 1, -self.speed * axis)):
            model.add_wall(
                plate,
                material=self.plate_material or material,
                mesh_size=h,
                at=(middle + way * reach * axis).tolist(),
                velocity=velocity if velocity is None else velocity.tolist(),
                name=f"{name} plate",
            )
        if self.contact:
            model.set_contact(**self.contact)
        model.init()
        radius = model.contact_radius(*(model.ids_of(one)[0] for one in ("grain", "lower plate")))
        return model, 2 * max(0.0, h - radius)
