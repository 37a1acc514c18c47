"""Going on from a saved state: exactly from a checkpoint, as far as it goes from a vtu file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .checkpoint import NODE_ARRAYS, Checkpoint, read_checkpoint
from .errors import InputError
from .identity import bonds_sha256, input_hashes, physics_sha256
from .vtu import VtuContents, read_vtu

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = ["deduce_broken", "find_deck", "restart_from_deck", "restore"]

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

POSITION_TOLERANCE = 1e-6
"""Largest distance of a restart's nodes from where the deck has them, by the model's extent.

Files of the original hold positions in single precision.
"""
ROUND_OFF = 1e-12
"""Difference, by the largest value, that another machine's sine and cosine may cause."""


def find_deck(checkpoint: Checkpoint) -> Path:
    """Deck of the run that wrote a checkpoint.

    Raises
    ------
    InputError
        If it is no longer where it was, neither relative to the checkpoint nor absolutely.
    """
    if checkpoint.deck_paths[-1] == Path("model"):
        raise InputError(
            f"{checkpoint.path}: is of a model that a Python script makes and no deck can say; run "
            "the script again with model.run(..., resume=True)"
        )
    for path in checkpoint.deck_paths:
        if path.is_file():
            return path.resolve()
    places = " nor ".join(dict.fromkeys(str(path) for path in checkpoint.deck_paths))
    raise InputError(
        f"{checkpoint.path}: its deck is no longer there: neither {places}; put it back"
    )


def restore(model: DEMModel, checkpoint: Checkpoint, *, changed_deck: bool = False) -> None:
    """Set a model to the state of a checkpoint; it goes on bit for bit, on any number of threads.

    Parameters
    ----------
    model : DEMModel
        A model that has not started.
    checkpoint : Checkpoint
        The state.
    changed_deck : bool
        Accept another deck as long as it says the same about the physics.

    Raises
    ------
    InputError
        If the checkpoint is of another deck, mesh, placement, compatibility mode or time step,
        or does not fit the model. The model is then left as it was.
    """
    if model.started:
        raise InputError(f"{checkpoint.path}: the model has started already; make a new one")
    _check_mode(model, checkpoint)
    _check_deck(model, checkpoint, changed_deck)
    _check_inputs(model, checkpoint)
    model.init()
    _check_fit(model, checkpoint)
    if changed_deck:
        _check_time_step(model, checkpoint)
    if not changed_deck or _new_interval_had_set_in(model, checkpoint):
        model.output_interval = checkpoint.output_interval
    for name in NODE_ARRAYS:
        if name != "x_ref":
            getattr(model.state, name)[...] = checkpoint.nodes[name]
    model.set_intact(checkpoint.intact)
    springs = checkpoint.spring_nodes, checkpoint.spring_elongations
    model.mark_started(checkpoint.step, checkpoint.time, *springs)
    if checkpoint.energy is not None:
        model.restore_energy(checkpoint.energy)


def _new_interval_had_set_in(model: DEMModel, checkpoint: Checkpoint) -> bool:
    """Whether the run had met the criterion of a deck that may be another one by now."""
    criteria = model.deck.output.output_criteria
    return criteria is not None and checkpoint.output_interval == criteria.new_interval


def _check_mode(model: DEMModel, checkpoint: Checkpoint) -> None:
    if model.compatibility != checkpoint.compatibility:
        raise InputError(
            f"{checkpoint.path}: compatibility = {checkpoint.compatibility}: the model's is "
            f"{model.compatibility}; go on in the same mode"
        )


def _check_deck(model: DEMModel, checkpoint: Checkpoint, changed_deck: bool) -> None:
    deck = model.deck
    if not changed_deck and deck.sha256 != checkpoint.deck_sha256:
        raise InputError(
            f"{checkpoint.path}: is of another deck, or {deck.path} has changed since; "
            "restore it, or name the checkpoint in the Restart block of the new deck"
        )
    if changed_deck and physics_sha256(deck) != checkpoint.physics_sha256:
        raise InputError(
            f"{checkpoint.path}: is of a {'model' if model.scripted else 'deck'} with other "
            f"bodies, materials, contact or loads than {_this(model)}"
        )


def _this(model: DEMModel) -> str:
    if model.scripted:
        return "this one; make the model as it was, or give another output folder"
    return f"{model.deck.path}; only Restart, Output, Final_Time and Time_Steps may differ"


def _check_inputs(model: DEMModel, checkpoint: Checkpoint) -> None:
    now = input_hashes(model.deck)
    other = [
        key for key in now.keys() | checkpoint.inputs if now.get(key) != checkpoint.inputs.get(key)
    ]
    if other:
        raise InputError(
            f"{checkpoint.path}: the files of {', '.join(sorted(other))} have changed since; "
            "restore them"
        )


def _check_time_step(model: DEMModel, checkpoint: Checkpoint) -> None:
    if abs(model.dt - checkpoint.dt) > ROUND_OFF * checkpoint.dt:
        raise InputError(
            f"{checkpoint.path}: time step = {checkpoint.dt!r} s: the deck's is {model.dt!r} s; "
            "change Final_Time and Time_Steps in the same proportion"
        )
    if model.dt != checkpoint.dt:
        model.warnings.append(
            f"{checkpoint.path}: the time step {checkpoint.dt!r} s and the deck's {model.dt!r} s "
            "differ in the last digits: the run does not go on bit for bit"
        )


def _check_fit(model: DEMModel, checkpoint: Checkpoint) -> None:
    x_ref = checkpoint.nodes["x_ref"]
    if x_ref.shape != model.state.x_ref.shape:
        raise InputError(
            f"{checkpoint.path}: has {len(x_ref)} nodes, the deck {model.n_nodes}; "
            "use a checkpoint of this deck"
        )
    error = np.abs(model.state.x_ref - x_ref).max(initial=0.0)
    same_bonds = len(checkpoint.intact) == len(model.bonds.intact) and (
        checkpoint.bonds_sha256 == bonds_sha256(model)
    )
    if error > ROUND_OFF * np.abs(x_ref).max(initial=0.0) or not same_bonds:
        raise InputError(
            f"{checkpoint.path}: its nodes or bonds are not those of the deck; use the version of "
            f"peridem that wrote it ({checkpoint.version})"
        )
    if model.instruction_set != checkpoint.instruction_set:
        model.warnings.append(
            f"{checkpoint.path}: was computed with {checkpoint.instruction_set} instructions, this "
            f"run is with {model.instruction_set}: it does not go on bit for bit; set "
            f"PERIDEM_SIMD={checkpoint.instruction_set} where the processor has them"
        )
    if error > 0:
        model.warnings.append(
            f"{checkpoint.path}: reference positions differ by up to {error:.1e} m from those of "
            "this machine: the run does not go on bit for bit"
        )


def restart_from_deck(model: DEMModel) -> None:
    """Set a model to the state that the deck's ``Restart`` block names.

    A checkpoint (``.h5``) is exact. From a vtu file come displacements, velocities and, in
    double precision, positions; bonds are broken whose stretch exceeds the critical one in that
    state, and those that follow from the tag ``Damage``, the fraction of broken bonds at each
    node. What stays unknown goes into the model's warnings.

    Raises
    ------
    InputError
        If the file does not fit the deck, or the block asks for what is not supported.
    """
    deck = model.deck
    restart = deck.restart
    assert restart is not None
    if restart.change_reference_free_dofs:
        raise deck.error(
            "Restart.Change_Reference_Free_Dofs",
            "is not supported: strain and broken bonds of the state would be forgotten; leave it "
            "out, or start a new deck from the tag Particle_Locations",
        )
    if restart.step > deck.model.time_steps:
        raise deck.error(
            "Restart.Step",
            f"must be at most Time_Steps = {deck.model.time_steps}; increase Time_Steps "
            "and Final_Time",
        )
    if restart.file.suffix == ".h5":
        checkpoint = read_checkpoint(restart.file)
        if checkpoint.step != restart.step:
            raise deck.error(
                "Restart.Step", f"the checkpoint is of step {checkpoint.step}; give it"
            )
        restore(model, checkpoint, changed_deck=True)
    elif restart.file.suffix == ".vtu":
        _restart_from_vtu(model, restart.file, restart.step)
    else:
        raise deck.error("Restart.File", "must be a checkpoint (.h5) or a vtu file; give one")


def _restart_from_vtu(model: DEMModel, path: Path, step: int) -> None:
    content = read_vtu(path)
    x, u, v = _motion(model, path, content)
    model.init()
    state = model.state
    state.x[...], state.u[...], state.v[...] = x, u, v
    time = _start_time(model, content, step)
    model.mark_started(step, time, np.empty((0, 2), np.int32), np.empty((0, 3)))
    model.compute_forces()  # breaks the bonds that are beyond their critical stretch
    _restore_bonds(model, content["arrays"].get("Damage"))
    model.compute_forces()  # with the self-contact of the bonds just broken
    _warn_of_springs(model)


def _motion(
    model: DEMModel, path: Path, content: VtuContents
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, displacements and velocities of a file, checked against the deck."""
    x_ref, points, arrays = model.state.x_ref, content["points"], content["arrays"]
    if points.shape != x_ref.shape:
        raise InputError(
            f"{path}: has {len(points)} nodes, the deck {len(x_ref)}; use a file of this deck"
        )
    missing = [tag for tag in ("Displacement", "Velocity") if tag not in arrays]
    if missing:
        raise InputError(
            f"{path}: no {' and no '.join(missing)}: a restart needs both tags; "
            "add them to Output.Tags of the run that writes the file"
        )
    u, v = (_vectors(path, arrays, tag) for tag in ("Displacement", "Velocity"))
    x = x_ref + u
    off = np.linalg.norm(points - x, axis=1)
    tolerance = POSITION_TOLERANCE * float(np.abs(x).max())
    if not np.all(off <= tolerance):
        node = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        raise InputError(
            f"{path}: node {node} (counted from 0) is {off[node]:.3g} m from its place in the "
            f"deck: must be at most {tolerance:.1g} m; use a file of this deck"
        )
    is_double = not np.array_equal(points, points.astype(np.float32))
    return (points if is_double else x), u, v


def _vectors(path: Path, arrays: Mapping[str, NDArray[np.generic]], tag: str) -> FloatArray:
    values = np.asarray(arrays[tag], dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3 or not np.all(np.isfinite(values)):
        raise InputError(f"{path}: {tag}: must have three finite components; use another file")
    return values


def _start_time(model: DEMModel, content: VtuContents, step: int) -> float:
    """Step * dt, or the time in the file when that is the same but for round-off."""
    where = model.deck.where("Restart.Step")
    time, saved = step * model.dt, content["time"]
    if content["step"] not in (None, step):
        model.warnings.append(
            f"{where}: Restart.Step = {step}: the file is of step {content['step']}"
        )
    if saved is None:
        return time
    if abs(saved - time) > 0.5 * model.dt:
        model.warnings.append(
            f"{where}: Restart.Step = {step}: the file is of t = {saved:g} s, but the run goes on "
            f"from Step * dt = {time:g} s"
        )
        return time
    return saved


def _restore_bonds(model: DEMModel, damage: NDArray[np.generic] | None) -> None:
    """Break what must have been broken; say what is unknown."""
    bonds = model.bonds
    where = f"{model.deck.where('Restart.File')}: Restart.File"
    if damage is None or damage.shape != (model.n_nodes,):
        model.warnings.append(
            f"{where}: the file does not say which bonds are broken: "
            f"{model.summary()['broken_bonds']} beyond their critical stretch are, those that "
            "broke before and have closed since are whole again; use a checkpoint (.h5), or a "
            "file with the tag Damage"
        )
        return
    counts = np.rint(np.asarray(damage, np.float64) * np.diff(bonds.offsets)).astype(np.int64)
    broken, missing = deduce_broken(bonds.offsets, bonds.indices, bonds.intact == 0, counts)
    model.set_intact(~broken)
    if missing:
        model.warnings.append(
            f"{where}: {int(broken.sum()) // 2} broken bonds follow from stretch and Damage, about "
            f"{(missing + 1) // 2} more cannot be told and are whole again; use a checkpoint (.h5)"
        )


def _warn_of_springs(model: DEMModel) -> None:
    """Say that the springs of the friction with history are unknown."""
    deck = model.deck
    laws = deck.contacts.values()
    if any(law.friction_on and law.friction_model == "history" for law in laws):
        model.warnings.append(
            f"{deck.where('Restart.File')}: Restart.File: a vtu file does not hold the tangential "
            "springs of Friction_Model: history: they start unstretched; use a checkpoint (.h5)"
        )


def deduce_broken(
    offsets: NDArray[np.int64],
    indices: NDArray[np.int32],
    known: Mask,
    counts: NDArray[np.int64],
) -> tuple[Mask, int]:
    """Broken bonds that follow from their number at each node.

    Where all broken bonds of a node are known, its others are intact; where as many are missing
    as are open, all of these are broken. Each bond settled so may settle others.

    Parameters
    ----------
    offsets : ndarray, shape (n_nodes + 1,)
        Start of each node's bonds.
    indices : ndarray, shape (n_bonds,)
        Node at the other end; both directions of a bond are listed.
    known : ndarray of bool, shape (n_bonds,)
        Bonds known to be broken.
    counts : ndarray of int, shape (n_nodes,)
        Number of broken bonds at each node.

    Returns
    -------
    ndarray of bool, shape (n_bonds,)
        The bonds that must be broken, the known ones among them.
    int
        Number of broken bond ends that are still missing; 0 when everything is settled.
    """
    n = len(counts)
    i = np.repeat(np.arange(n), np.diff(offsets))
    broken, still_open = known.copy(), ~known
    while True:
        missing = counts - np.bincount(i[broken], minlength=n)
        n_open = np.bincount(i[still_open], minlength=n)
        full, all_open = missing <= 0, (missing == n_open) & (missing > 0)
        holds = still_open & (full[i] | full[indices])
        breaks = still_open & (all_open[i] | all_open[indices]) & ~holds
        settled = holds | breaks
        if not settled.any():
            return broken, int(np.maximum(missing, 0).sum())
        broken |= breaks
        still_open &= ~settled
