"""Energies of a model, what flows in and out of them, and whether the balance closes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

if TYPE_CHECKING:
    from ..model import DEMModel

__all__ = ["FLOWS", "STORED", "energies", "energy_warnings", "prescribed_work"]

STORED = ("kinetic", "bond", "self_contact", "contact", "gravity")
"""Energies of a state."""

FLOWS = ("work_prescribed", "work_forces", "created", "damping", "friction", "fracture")
"""Energies that flow: the first three in, the others out."""

RESIDUAL_LIMIT = 0.01
"""Part of the input beyond which a balance does not close: ten times the residual of a run with a
time step of a fifth of the stable one."""

CREATED_LIMIT = 0.01
"""Part of the input beyond which energy from nowhere makes a run unphysical."""


def energies(model: DEMModel) -> dict[str, float]:
    r"""Measure the energies [J] of a model, per unit thickness in 2D.

    Parameters
    ----------
    model : DEMModel
        The model; it is started when it has not been.

    Returns
    -------
    dict of str to float
        Stored now: ``kinetic``; ``bond``, the strain energy; ``self_contact``, springs that keep
        the ends of broken bonds apart; ``contact``, springs between nodes in contact, the
        tangential ones of friction with history among them; ``gravity``, 0 in the reference
        positions. With `DEMModel.track_energy` also what has flowed since tracking began: in,
        ``work_prescribed`` of prescribed motion, ``work_forces`` of force sets and ``created``
        with springs of bonds that broke when squeezed; out, by ``damping``, ``friction`` and
        ``fracture``; the ``input``: what was stored at the beginning, the positive works and what
        gravity has released; and the ``residual``: stored now + out - in - stored at the
        beginning.

    Notes
    -----
    The kinetic energy is :math:`\sum \rho V v_{n-1/2} \cdot v_{n+1/2} / 2`: with it the residual is
    the error of the integrator alone. docs/diagnostics.md has all formulas.
    """
    core = model._core
    model.start()
    now = core.energies()
    tangential = now.pop("tangential")
    now["contact"] += tangential
    if not model.track_energy:
        return {name: float(now[name]) for name in STORED}
    flows = core.energy_flows()
    # What friction has taken is work done against it, but for what its springs still hold.
    flows["friction"] -= tangential - flows["tangential_start"]
    stored = sum(now[name] for name in STORED)
    out = flows["damping"] + flows["friction"] + flows["fracture"]
    into = flows["work_prescribed"] + flows["work_forces"] + flows["created"]
    works = (flows["work_prescribed"], flows["work_forces"], -now["gravity"])
    given = flows["start"] + sum(max(0.0, work) for work in works)
    return {
        **{name: float(now[name]) for name in STORED},
        **{name: float(flows[name]) for name in FLOWS},
        "input": float(given),
        "residual": float(stored + out - into - flows["start"]),
    }


def prescribed_work(model: DEMModel, bodies: Any = None) -> NDArray[np.float64]:
    """Measure the work that prescribed motion has done on bodies since tracking began.

    Parameters
    ----------
    model : DEMModel
        The model, with `DEMModel.track_energy`.
    bodies : Body, Bodies, int, str or sequence of them, optional
        One or several bodies; all when left out.

    Returns
    -------
    ndarray, shape (number of bodies,)
        Work [J], per unit thickness in 2D, in the order of ids; 0 for a body without prescribed
        motion. The sum over all bodies is ``work_prescribed`` of `energies`.

    Raises
    ------
    InputError
        If the model does not keep accounts, or there is no such body.
    """
    if not model.track_energy:
        raise InputError(
            "prescribed_work: model.track_energy = False: must be on from the moment that works "
            "count from; set model.track_energy = True, or record 'energy'"
        )
    model.start()
    works: NDArray[np.float64] = model._core.prescribed_works()
    if bodies is None:
        return works
    ids = np.unique(model.state.particle_id[model.nodes_of(bodies)])
    return np.asarray(works[ids])


def energy_warnings(row: Mapping[str, float]) -> list[str]:
    """Say what an energy balance tells against a run.

    Parameters
    ----------
    row : mapping of str to float
        What `energies` gives of a model with `DEMModel.track_energy`.

    Returns
    -------
    list of str
        Warnings: the balance does not close, or springs of broken bonds or friction have created
        energy; empty when the run looks physical.
    """
    given = max(row["input"], 1e-300)
    parts = {name: row[name] / given for name in ("residual", "created", "friction", "damping")}
    texts = []
    if not abs(parts["residual"]) <= RESIDUAL_LIMIT:
        texts.append(
            f"energy: the balance is open by {100 * parts['residual']:.2g} % of the input "
            f"({row['residual']:.3g} of {given:.3g} J): the time step is too long for what happens "
            "(stiff springs between broken neighbours, hard impacts), or the state was written to; "
            "use a smaller dt (in Python: safety=0.1), or bond_breaking='tension'"
        )
    if parts["created"] > CREATED_LIMIT:
        texts.append(
            f"energy: bonds that broke when squeezed have left springs with {row['created']:.3g} "
            f"J, {100 * parts['created']:.2g} % of the input: energy from nowhere; use "
            "bond_breaking='tension'"
        )
    texts += [
        f"energy: {name} has given {-row[name]:.3g} J, {-100 * parts[name]:.2g} % of the input, "
        f"where it should take: {remedy}"
        for name, remedy in (
            ("friction", "use compatibility='corrected', a smaller dt or friction_model='history'"),
            ("damping", "use a smaller dt, or less damping"),
        )
        if parts[name] < -CREATED_LIMIT
    ]
    return texts
