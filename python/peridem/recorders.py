"""Recorders: what a run writes down at intervals, by name, by body, or by a function of yours.

A recorder is called with the model and returns a number, a sequence of numbers, or a dict of
numbers by column. It may have the attributes ``name`` (of its table), ``columns`` (names of the
numbers) and ``every`` (its own interval, in steps or seconds). The functions of this module take
``every``, in steps (int) or seconds (float), and most ``name``, that of their table. Names stand
for recorders in the registry:

    @peridem.recorders.register("fastest")
    def fastest():
        return lambda model: np.linalg.norm(model.state.v, axis=1).max()

    model.run(until=1e-3, record=["fastest"])
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from . import diagnostics
from .errors import InputError
from .modelling.arguments import did_you_mean

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = [
    "Recorder",
    "contacts",
    "coordination",
    "damage",
    "energy",
    "fragments",
    "kinetic_energy",
    "momentum",
    "names",
    "network",
    "position",
    "reaction",
    "register",
    "stress",
    "velocity",
    "work",
]

Values = float | Sequence[float] | Mapping[str, float]


class Recorder(Protocol):
    """What is called at intervals and gives numbers."""

    def __call__(self, model: DEMModel, /) -> Values:
        """Return the numbers of this moment."""


Factory = Callable[[], Callable[["DEMModel"], Any]]
F = TypeVar("F", bound=Factory)

_REGISTRY: dict[str, Factory] = {}


def register(name: str) -> Callable[[F], F]:
    """Register what makes the recorder of a name.

    Parameters
    ----------
    name : str
        What to write in ``record=[...]``.

    Returns
    -------
    callable
        A decorator for a function without arguments that returns the recorder.
    """

    def keep(factory: F) -> F:
        _REGISTRY[name] = factory
        return factory

    return keep


def names() -> list[str]:
    """Names that ``record=[...]`` may have."""
    return sorted(_REGISTRY)


def by_name(name: str) -> Callable[[DEMModel], Any]:
    """Make the recorder of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in _REGISTRY:
        raise InputError(f"record = {name!r}: no such recorder; {did_you_mean(name, names())}")
    return _REGISTRY[name]()


class _Of:
    """A recorder made of a function."""

    def __init__(
        self, function: Callable[[DEMModel], Any], name: str, every: float | None = None
    ) -> None:
        self.function = function
        self.name = name
        self.every = every

    def __call__(self, model: DEMModel) -> Any:
        return self.function(model)

    def __repr__(self) -> str:
        return f"<recorder {self.name!r}>"


def _named(bodies: Any) -> str:
    if isinstance(bodies, str | int):
        return str(bodies)
    name = getattr(bodies, "name", None)
    return str(name) if name is not None else "+".join(_named(one) for one in bodies)


def _vector(model: DEMModel, values: Any) -> dict[str, float]:
    return {axis: float(values[k]) for k, axis in enumerate("xyz"[: model.dimension])}


def reaction(bodies: Any, *, every: float | None = None, name: str | None = None) -> Recorder:
    """Record the force of contact on bodies: x, y[, z] [N], per unit thickness in 2D.

    Parameters
    ----------
    bodies : Body, Bodies, int, str or sequence of them
        One or several bodies; the force is that on all of them together.
    every : int or float, optional
        Interval, in steps (int) or seconds (float).
    name : str, optional
        Name of the table, ``reaction_<body>`` when left out.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        nodes = model.nodes_of(bodies)
        return _vector(model, model.state.volume[nodes] @ model.contact_forces()[nodes])

    return _Of(measure, name or f"reaction_{_named(bodies)}", every)


def _mean(model: DEMModel, bodies: Any, attribute: str) -> dict[str, float]:
    nodes, state = model.nodes_of(bodies), model.state
    mass = state.volume[nodes] * state.density[nodes]
    return _vector(model, mass @ getattr(state, attribute)[nodes] / mass.sum())


def position(bodies: Any, *, every: float | None = None, name: str | None = None) -> Recorder:
    """Record the centre of mass of bodies: x, y[, z] [m]; arguments as in `reaction`."""
    label = name or f"position_{_named(bodies)}"
    return _Of(lambda model: _mean(model, bodies, "x"), label, every)


def velocity(bodies: Any, *, every: float | None = None, name: str | None = None) -> Recorder:
    """Record the velocity of the centre of mass of bodies: x, y[, z] [m/s]; as `reaction`."""
    label = name or f"velocity_{_named(bodies)}"
    return _Of(lambda model: _mean(model, bodies, "v"), label, every)


@register("momentum")
def momentum(*, every: float | None = None) -> Recorder:
    """Record linear momentum px, py[, pz] [kg m/s] and angular momentum about the origin.

    The latter is Lz in 2D and Lx, Ly, Lz in 3D [kg m^2/s]; all per unit thickness in 2D.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        s = model.state
        p = (s.volume * s.density)[:, None] * s.v
        linear, angular = p.sum(axis=0), np.cross(s.x, p).sum(axis=0)
        axes = "xyz" if model.dimension == 3 else "z"
        return {
            **{f"p{axis}": value for axis, value in _vector(model, linear).items()},
            **{f"L{axis}": float(angular["xyz".index(axis)]) for axis in axes},
        }

    return _Of(measure, "momentum", every)


@register("kinetic_energy")
def kinetic_energy(*, every: float | None = None) -> Recorder:
    """Record the kinetic energy [J], per unit thickness in 2D."""

    def measure(model: DEMModel) -> float:
        s = model.state
        return float(0.5 * (s.density * s.volume * (s.v**2).sum(axis=1)).sum())

    return _Of(measure, "kinetic_energy", every)


@register("damage")
def damage(*, every: float | None = None) -> Recorder:
    """Record the fraction of bonds that are broken, and their number."""

    def measure(model: DEMModel) -> dict[str, float]:
        intact = model.bonds.intact
        broken = int((intact == 0).sum()) // 2
        return {"fraction": broken / max(len(intact) // 2, 1), "broken": broken}

    return _Of(measure, "damage", every)


@register("contacts")
def contacts(*, every: float | None = None) -> Recorder:
    """Record the number of pairs of bodies, and of nodes, that touch."""

    def measure(model: DEMModel) -> dict[str, float]:
        pairs = model.touching_nodes()
        ids = np.sort(model.state.particle_id[pairs], axis=1)
        return {"bodies": len(np.unique(ids, axis=0)), "nodes": len(pairs)}

    return _Of(measure, "contacts", every)


class _Accounts(_Of):
    """A recorder that has the core keep accounts of energy."""

    def begin(self, model: DEMModel) -> None:
        """Before the first step of the run."""
        model.track_energy = True


class _Energy(_Accounts):
    """The recorder of `energy`: it looks at the accounts at the end."""

    def warnings(self, model: DEMModel) -> list[str]:
        """After its last step."""
        return diagnostics.energy_warnings(diagnostics.energies(model))


@register("energy")
def energy(*, every: float | None = None) -> Recorder:
    """Record all energies, works and dissipations [J], their input and the residual.

    See `peridem.diagnostics.energies`. The run keeps accounts from its first step on (or from
    where the recording begins); where they tell that the run is unphysical, it gets a warning.
    """
    return _Energy(diagnostics.energies, "energy", every)


def work(bodies: Any, *, every: float | None = None, name: str | None = None) -> Recorder:
    """Record the work of prescribed motion on bodies: ``work`` [J], per unit thickness in 2D.

    What a moving wall or grips have put in, all of them together; the run keeps accounts from its
    first step on, as for `energy`. Arguments as in `reaction`.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        return {"work": float(diagnostics.prescribed_work(model, bodies).sum())}

    return _Accounts(measure, name or f"work_{_named(bodies)}", every)


@register("fragments")
def fragments(
    bodies: Any = None,
    *,
    sieves: Sequence[float] | None = None,
    every: float | None = None,
    name: str | None = None,
) -> Recorder:
    """Record the number and masses [kg] of the fragments of bodies, all but walls by default.

    Columns: ``count``, ``single`` (fragments of one node), ``largest`` and ``mean`` mass, and
    ``mass`` of all; other arguments as in `reaction`. For the fragments themselves see
    `peridem.diagnostics.fragments`.

    Parameters
    ----------
    sieves : sequence of float, optional
        Diameters [m] of a grading curve: columns ``passing_<diameter>``, the part of the mass in
        fragments up to it (`Fragments.size_distribution`).
    """

    def measure(model: DEMModel) -> dict[str, float]:
        found = diagnostics.fragments(model, bodies)
        masses = found.masses
        return {
            "count": len(found),
            "single": int((found.nodes == 1).sum()),
            "largest": float(masses.max(initial=0.0)),
            "mean": float(masses.mean()) if len(found) else 0.0,
            "mass": float(masses.sum()),
            **{f"passing_{size:g}": part for size, part in grading(found)},
        }

    def grading(found: diagnostics.Fragments) -> Iterator[tuple[float, float]]:
        if sieves is not None:
            passing = found.size_distribution(sieves)["passing"]
            yield from zip(passing.index, passing.astype(float), strict=True)

    label = "fragments" if bodies is None else f"fragments_{_named(bodies)}"
    return _Of(measure, name or label, every)


@register("coordination")
def coordination(*, every: float | None = None) -> Recorder:
    """Record how many bodies touch a particle: the mean, and that without rattlers.

    Rattlers are particles with less than two contacts; ``rattlers`` is their part.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        network = diagnostics.contact_network(model)
        found = network.coordination()[~network.is_wall]
        firm = found[found >= 2]
        return {
            "mean": float(found.mean()) if len(found) else 0.0,
            "without_rattlers": float(firm.mean()) if len(firm) else 0.0,
            "rattlers": 1 - len(firm) / max(len(found), 1),
        }

    return _Of(measure, "coordination", every)


@register("network")
def network(*, every: float | None = None) -> Recorder:
    """Record the contact network: pairs of bodies, their normal forces [N], force chains.

    ``pairs`` touch, ``mean`` and ``largest`` normal force, ``strong`` part of the pairs with more
    than the mean, ``chains`` of at least three bodies, ``longest`` number of pairs in one.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        found = diagnostics.contact_network(model)
        force = found.normal_force[found.contacts > 0]
        chain = found.chains()
        mean = float(force.mean()) if len(force) else 0.0
        return {
            "pairs": len(force),
            "mean": mean,
            "largest": float(force.max(initial=0.0)),
            "strong": float((force > mean).mean()) if len(force) else 0.0,
            "chains": int(chain.max(initial=-1)) + 1,
            "longest": int(np.bincount(chain[chain >= 0]).max(initial=0)),
        }

    return _Of(measure, "network", every)


@register("stress")
def stress(
    region: Sequence[Sequence[float]] | None = None,
    *,
    volume: float | None = None,
    every: float | None = None,
    name: str | None = None,
) -> Recorder:
    """Record the bulk stress of all bodies but walls, or of a region: xx, yy, ... and pressure.

    In Pa, tension positive; arguments as in `peridem.diagnostics.bulk_stress`.
    """

    def measure(model: DEMModel) -> dict[str, float]:
        found = diagnostics.bulk_stress(model, region, volume=volume)
        parts = ("xx", "yy", "xy") if model.dimension == 2 else ("xx", "yy", "zz", "xy", "xz", "yz")
        values = {
            part: 0.5
            * float(
                found["xyz".index(part[0]), "xyz".index(part[1])]
                + found["xyz".index(part[1]), "xyz".index(part[0])]
            )
            for part in parts
        }
        d = model.dimension
        return {**values, "pressure": -float(np.trace(found[:d, :d])) / d}

    return _Of(measure, name or "stress", every)
