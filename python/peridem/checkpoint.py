"""Checkpoints: everything a run needs to go on, in one HDF5 file that is whole and checked.

The first 512 bytes, HDF5's user block, hold two lines of text: the schema and the SHA-256 of
schema and contents. They are checked before HDF5 opens the file, so that a file cut short or
with a single wrong bit is recognised. The rest is plain HDF5: attributes, and the groups
``nodes``, ``bonds``, ``friction``, ``inputs`` and, when it is tracked, ``energy``.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._core import __version__
from .errors import InputError
from .files import make_folder, replace_file
from .identity import bonds_sha256, input_hashes, physics_sha256

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = [
    "SCHEMA",
    "Checkpoint",
    "CheckpointWriter",
    "DamagedCheckpointError",
    "has_checkpoint",
    "list_checkpoints",
    "newest_checkpoint",
    "own_checkpoints",
    "read_checkpoint",
]

SCHEMA = 1
"""Version of the files' layout. The user block stays as it is in later ones."""

KEPT = 2
"""Checkpoints of a run that stay in its folder."""

NODE_ARRAYS = ("x_ref", "x", "u", "v", "f", "theta", "damage_z")

_BLOCK_BYTES = 512
_HEADER = re.compile(rb"peridem checkpoint, schema (\d{1,9})\n")
_NAME = re.compile(r"checkpoint_(?:(?P<tag>.+)_)?(?P<step>\d+)\.h5")


class DamagedCheckpointError(InputError):
    """The file is cut short, changed, or no checkpoint at all."""


@dataclass(frozen=True)
class EnergyAccounts:
    """What the energy balance of a run needs to go on.

    Attributes
    ----------
    flows : dict of str to float
        Works and dissipations so far, and what there was at the beginning [J].
    forces : tuple of ndarray, shape (n_nodes, 3)
        Force densities of friction, dampers and force sets at the last evaluation [N/m^3].
    prescribed_works : ndarray, shape (n_bodies,)
        Work of prescribed motion on each body so far [J].
    """

    flows: dict[str, float]
    forces: tuple[NDArray[np.float64], ...]
    prescribed_works: NDArray[np.float64]


_ENERGY_FORCES = ("friction", "damping", "sets")


@dataclass(frozen=True)
class Checkpoint:
    """The contents of a checkpoint.

    Attributes
    ----------
    path : Path
        The file.
    version : str
        Version of the package that wrote it.
    step : int
        Number of steps taken.
    time, dt : float
        Simulated time and time step [s].
    compatibility : {"original", "corrected"}
        Mode of the run.
    instruction_set : str
        Processor instructions that the forces were computed with.
    every : int or None
        Steps between the checkpoints of the run; None when there was one at a signal only.
    output_interval : int
        Steps between outputs at that moment: ``New_Interval`` once the criterion is met.
    deck_paths : tuple of Path
        Where the deck may be: relative to the checkpoint's folder, then absolute.
    deck_sha256 : str
        Hash of the deck's bytes.
    physics_sha256 : str
        Hash of what the deck says about the physics, see `physics_sha256`.
    inputs : dict of str to str
        Hash of each file that the deck names, by key path (``Mesh.Zone_1.File``).
    nodes : dict of str to ndarray
        ``x_ref, x, u, v, f`` of shape (n_nodes, 3); ``theta, damage_z`` of shape (n_nodes,).
    intact : ndarray of uint8, shape (n_bonds,)
        1 for unbroken directed bonds.
    bonds_sha256 : str
        Hash of the bond lists, see `bonds_sha256`.
    spring_nodes : ndarray of int32, shape (k, 2)
        Node pairs whose tangential springs (friction with history) are stretched.
    spring_elongations : ndarray, shape (k, 3)
        Elongations [m] of these springs.
    energy : EnergyAccounts or None
        Accounts of a run with `DEMModel.track_energy`.
    recorded : str
        Names of the recorders of the run, which only its script can make again.
    """

    path: Path
    version: str
    step: int
    time: float
    dt: float
    compatibility: str
    instruction_set: str
    every: int | None
    output_interval: int
    deck_paths: tuple[Path, ...]
    deck_sha256: str
    physics_sha256: str
    inputs: dict[str, str]
    nodes: dict[str, NDArray[np.float64]]
    intact: NDArray[np.uint8]
    bonds_sha256: str
    spring_nodes: NDArray[np.int32]
    spring_elongations: NDArray[np.float64]
    energy: EnergyAccounts | None
    recorded: str


class CheckpointWriter:
    """Writes the checkpoints of one run and keeps the last two.

    Older ones of the run, and those that an earlier run left under the same names, are removed
    once a new one is safely on disk.

    Parameters
    ----------
    folder : Path or str
        Output folder; created when missing.
    model : DEMModel
        The initialised model.
    every : int, optional
        Steps between checkpoints; None for those at a signal only.
    resumed_from : Path, optional
        Checkpoint that the run goes on from: one of its own.
    recorded : str
        Names of the recorders of the run.

    Raises
    ------
    InputError
        If `every` is below 1, or the folder cannot be created or written.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        model: DEMModel,
        every: int | None = None,
        resumed_from: Path | None = None,
        recorded: str = "",
    ) -> None:
        if every is not None and every < 1:
            raise InputError(
                f"checkpoint_every = {every}: must be at least 1; leave it out for none"
            )
        self.folder = Path(folder).resolve()
        self.every = every
        self._tag = model.deck.output.tag_pp or None
        self._identity = {**_identity(model, self.folder), "recorded": recorded}
        self._inputs = input_hashes(model.deck)
        own = resumed_from is not None and resumed_from.resolve().parent == self.folder
        self._kept: list[Path] = [resumed_from.resolve()] if own and resumed_from else []
        self.last_step: int | None = None
        make_folder(self.folder)

    @property
    def last(self) -> Path | None:
        """The newest checkpoint of the run, None before the first."""
        return self._kept[-1] if self._kept else None

    def is_due(self, step: int) -> bool:
        """Whether a checkpoint is to be written after this step."""
        return self.every is not None and step % self.every == 0

    def write(self, model: DEMModel) -> Path:
        """Write ``checkpoint_<step>.h5`` (``checkpoint_<Tag_PP>_<step>.h5``).

        Parameters
        ----------
        model : DEMModel
            The model, between two steps.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If it cannot be written; the checkpoints before stay as they are.
        """
        return self.take(model)()

    def take(self, model: DEMModel) -> Callable[[], Path]:
        """Copy the state of the model; the function returned writes it, as `write` does.

        Functions of several states are to be called in the order of the states.
        """
        stem = "checkpoint" if self._tag is None else f"checkpoint_{self._tag}"
        path = self.folder / f"{stem}_{model.n}.h5"
        contents = _contents(model, {**self._identity, "every": self.every or 0}, self._inputs)
        self.last_step = model.n

        def write() -> Path:
            with replace_file(path) as temporary:
                temporary.write_bytes(_pack(contents))
            self._kept = [*(kept for kept in self._kept if kept != path), path][-KEPT:]
            self._remove_others(stem)
            return path

        return write

    def _remove_others(self, stem: str) -> None:
        """Remove older checkpoints and what a killed run left half written."""
        name = re.compile(rf"{re.escape(stem)}_\d+\.h5|\.{re.escape(stem)}_\d+\.h5\.tmp")
        with suppress(OSError):
            for path in list(self.folder.iterdir()):
                if name.fullmatch(path.name) and path not in self._kept:
                    path.unlink(missing_ok=True)


def list_checkpoints(folder: Path | str, tag: str | None = None) -> list[Path]:
    """List the checkpoints of a folder, newest (largest step) first.

    Parameters
    ----------
    folder : Path or str
        Output folder of a run.
    tag : str, optional
        The run's ``Output.Tag_PP``; needed when the folder has several.

    Raises
    ------
    InputError
        If the folder has no checkpoint, or those of several tags and `tag` is not given.
    """
    folder = Path(folder)
    try:
        names = [(path, _NAME.fullmatch(path.name)) for path in folder.iterdir()]
    except OSError as error:
        raise InputError(
            f"{folder}: the output folder cannot be read: {error.strerror}; check its name"
        ) from error
    found = [(path, match["tag"], int(match["step"])) for path, match in names if match]
    tags = sorted({of_file or "" for _, of_file, _ in found})
    if tag is None and len(tags) > 1:
        raise InputError(
            f"{folder}: has checkpoints of several runs (Tag_PP "
            f"{', '.join(repr(name) for name in tags)}); say which with --tag"
        )
    found = [entry for entry in found if tag is None or (entry[1] or "") == tag]
    if not found:
        of_tag = f" of Tag_PP {tag!r}" if tag else ""
        raise InputError(
            f"{folder}: no checkpoint{of_tag} (checkpoint_<step>.h5) is there; run the deck with "
            "--checkpoint-every N, or give the output folder of such a run"
        )
    return [path for path, _, _ in sorted(found, key=lambda entry: -entry[2])]


def own_checkpoints(folder: Path, tag: str | None) -> list[Path]:
    """Checkpoints in a folder that are named as those of a run with this tag, oldest first."""
    found = [(path, _NAME.fullmatch(path.name)) for path in folder.iterdir()]
    own = [(int(match["step"]), path) for path, match in found if match and match["tag"] == tag]
    return [path for _, path in sorted(own)]


def has_checkpoint(folder: Path | str) -> bool:
    """Whether a folder has a checkpoint, whole or not."""
    folder = Path(folder)
    return folder.is_dir() and any(_NAME.fullmatch(path.name) for path in folder.iterdir())


def newest_checkpoint(folder: Path | str, tag: str | None = None) -> tuple[Checkpoint, list[str]]:
    """Read the newest checkpoint of a folder that is not damaged.

    Parameters
    ----------
    folder, tag
        As in `list_checkpoints`.

    Returns
    -------
    Checkpoint
        The checkpoint.
    list of str
        A warning for each newer one that is damaged.

    Raises
    ------
    InputError
        If there is none, all are damaged, or it comes from a newer version.
    """
    problems: list[str] = []
    for path in list_checkpoints(folder, tag):
        try:
            checkpoint = read_checkpoint(path)
        except DamagedCheckpointError as error:
            problems.append(str(error))
            continue
        return checkpoint, [f"{text}; going on from {path.name}" for text in problems]
    raise InputError("\n".join([*problems, f"{folder}: no checkpoint is usable; run anew"]))


def read_checkpoint(path: Path | str) -> Checkpoint:
    """Read a checkpoint and check that it is whole.

    Parameters
    ----------
    path : Path or str
        The file.

    Raises
    ------
    DamagedCheckpointError
        If the file is cut short, changed, or no checkpoint.
    InputError
        If it comes from a newer version of the package.
    """
    import h5py

    path = Path(path)
    schema = _verified_schema(path)
    if schema > SCHEMA:
        raise InputError(
            f"{path}: checkpoint schema = {schema}: this version reads up to {SCHEMA}; "
            "update peridem"
        )
    try:
        with h5py.File(path, "r") as file:
            return _unpack(path, file)
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise DamagedCheckpointError(f"{path}: the checkpoint lacks contents: {error}") from error


def _identity(model: DEMModel, folder: Path) -> dict[str, Any]:
    """Attributes that stay the same during a run."""
    deck = model.deck
    return {
        "version": __version__,
        "dt": model.dt,
        "compatibility": model.compatibility,
        "instruction_set": model.instruction_set,
        "deck_path": np.bytes_(os.fsencode(deck.path)),
        "deck_path_relative": np.bytes_(os.fsencode(os.path.relpath(deck.path, folder))),
        "deck_sha256": deck.sha256,
        "physics_sha256": physics_sha256(deck),
        "bonds_sha256": bonds_sha256(model),
    }


@dataclass(frozen=True)
class _Contents:
    """Copies of what goes into a file: attributes and arrays by the names of their groups."""

    attributes: dict[str, dict[str, Any]]
    arrays: dict[str, NDArray[Any]]


def _contents(model: DEMModel, identity: dict[str, Any], inputs: dict[str, str]) -> _Contents:
    intact = model.bonds.intact
    spring_nodes, spring_elongations = model.friction_springs()
    contents = _Contents(
        attributes={
            "/": {
                **identity,
                "step": model.n,
                "time": model.time,
                "output_interval": model.output_interval,
            },
            "bonds": {"count": len(intact)},
            "inputs": inputs,
        },
        arrays={
            **{f"nodes/{name}": getattr(model.state, name).copy() for name in NODE_ARRAYS},
            "bonds/intact_bits": np.packbits(intact),
            "friction/nodes": spring_nodes,
            "friction/elongations": spring_elongations,
        },
    )
    if model.track_energy:
        contents.attributes["energy"] = model._core.energy_flows()
        forces = zip(_ENERGY_FORCES, model._core.energy_forces(), strict=True)
        contents.arrays.update({f"energy/{name}": force for name, force in forces})
        contents.arrays["energy/prescribed_works"] = model._core.prescribed_works()
    return contents


def _pack(contents: _Contents) -> bytearray:
    """Make the bytes of a checkpoint: in memory, so that only plain writes meet a full disk."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=_BLOCK_BYTES) as file:
        for name, array in contents.arrays.items():
            file[name] = array
        for name, attributes in contents.attributes.items():
            file.require_group(name).attrs.update(attributes)
    image = bytearray(buffer.getbuffer())
    digest = _digest(SCHEMA)
    digest.update(memoryview(image)[_BLOCK_BYTES:])
    image[:_BLOCK_BYTES] = _user_block(SCHEMA, digest.hexdigest())
    return image


def _unpack(path: Path, file: Any) -> Checkpoint:
    attributes = file.attrs
    relative, absolute = (
        Path(os.fsdecode(bytes(attributes[name]))) for name in ("deck_path_relative", "deck_path")
    )
    bits, count = file["bonds/intact_bits"][:], int(file["bonds"].attrs["count"])
    return Checkpoint(
        path=path,
        version=str(attributes["version"]),
        step=int(attributes["step"]),
        time=float(attributes["time"]),
        dt=float(attributes["dt"]),
        compatibility=str(attributes["compatibility"]),
        instruction_set=str(attributes["instruction_set"]),
        every=int(attributes["every"]) or None,
        output_interval=int(attributes["output_interval"]),
        deck_paths=(path.resolve().parent / relative, absolute),
        deck_sha256=str(attributes["deck_sha256"]),
        physics_sha256=str(attributes["physics_sha256"]),
        inputs={key: str(value) for key, value in file["inputs"].attrs.items()},
        nodes={name: file[f"nodes/{name}"][:] for name in NODE_ARRAYS},
        intact=np.unpackbits(bits, count=count),
        bonds_sha256=str(attributes["bonds_sha256"]),
        spring_nodes=file["friction/nodes"][:],
        spring_elongations=file["friction/elongations"][:],
        energy=_unpack_energy(file),
        recorded=str(attributes.get("recorded", "")),
    )


def _unpack_energy(file: Any) -> EnergyAccounts | None:
    if "energy" not in file:
        return None
    accounts = file["energy"]
    return EnergyAccounts(
        {name: float(value) for name, value in accounts.attrs.items()},
        tuple(accounts[name][:] for name in _ENERGY_FORCES),
        accounts["prescribed_works"][:],
    )


def _digest(schema: int) -> Any:
    return hashlib.sha256(f"schema {schema}\n".encode())


def _user_block(schema: int, digest: str) -> bytes:
    text = f"peridem checkpoint, schema {schema}\nsha256 {digest}\n"
    return text.encode("ascii").ljust(_BLOCK_BYTES, b"\0")


def _verified_schema(path: Path) -> int:
    """Check that the contents have the hash in the user block, and return the schema."""
    try:
        with path.open("rb") as stream:
            block = stream.read(_BLOCK_BYTES)
            header = _HEADER.match(block)
            schema = int(header[1]) if header else 0
            digest = _digest(schema)
            while chunk := stream.read(1 << 20):
                digest.update(chunk)
    except OSError as error:
        raise DamagedCheckpointError(f"{path}: cannot be read: {error.strerror}") from error
    if header is None or block != _user_block(schema, digest.hexdigest()):
        raise DamagedCheckpointError(
            f"{path}: the checkpoint is damaged (cut short or changed) and cannot be used"
        )
    return schema
