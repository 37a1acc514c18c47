"""gmsh, loaded when it is needed and left as it was found."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib
import importlib.metadata
import signal
import threading
from collections.abc import Iterator
from typing import Any

from ..errors import InputError

_LIBRARIES = "libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1"
_LOCK = threading.RLock()  # gmsh has one state for the whole process
_MODEL = "peridem"
_SIGACTION = 1024  # bytes, more than a struct sigaction has anywhere

_OPTIONS: dict[str, float] = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # the same nodes on every machine
    "General.Verbosity": 0,
    "Mesh.Algorithm": 6,  # Frontal-Delaunay: the most even nodes, see docs/shapes.md
    "Mesh.Algorithm3D": 1,
    "Mesh.ElementOrder": 1,
    "Mesh.RecombineAll": 0,
    "Mesh.RandomSeed": 1,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 8,  # elements around a circle, where the mesh size gives fewer
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.Smoothing": 10,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 0,
    "Mesh.MaxNumThreads1D": 1,
    "Mesh.MaxNumThreads2D": 1,
    "Mesh.MaxNumThreads3D": 1,
    "Geometry.Tolerance": 1e-8,
    "Geometry.AutoCoherence": 1,
    "Geometry.OCCBoundsUseStl": 0,
}


def load_gmsh() -> Any:
    """Import gmsh.

    Raises
    ------
    InputError
        If it is not installed or its system libraries are missing.
    """
    try:
        return importlib.import_module("gmsh")
    except ModuleNotFoundError:
        raise InputError(
            "meshing: gmsh is not installed, but meshes are made by it; pip install 'peridem[mesh]'"
        ) from None
    except (OSError, ImportError) as error:
        raise InputError(
            f"meshing: gmsh cannot be loaded ({error}): it needs system libraries even without a "
            f"screen; on Debian or Ubuntu: apt-get install {_LIBRARIES}"
        ) from error


@functools.cache
def gmsh_version() -> str:
    """Return the version of gmsh, without loading it when it was installed by pip.

    Raises
    ------
    InputError
        As `load_gmsh`.
    """
    try:
        return importlib.metadata.version("gmsh")
    except importlib.metadata.PackageNotFoundError:
        return str(load_gmsh().__version__)


@contextlib.contextmanager
def gmsh_model() -> Iterator[Any]:
    """Give gmsh with an empty model and our options; afterwards it is as it was before.

    Where the caller has gmsh open, the caller's models, current model and options stay.
    """
    gmsh = load_gmsh()
    with _LOCK:
        was_open = bool(gmsh.isInitialized())
        if not was_open:
            with _same_signals():
                # interruptible would take Ctrl-C away from Python
                gmsh.initialize([], readConfigFiles=False, run=False, interruptible=False)
        before = {name: gmsh.option.getNumber(name) for name in _OPTIONS} if was_open else {}
        current = gmsh.model.getCurrent() if was_open else ""
        try:
            set_options(gmsh)
            start_model(gmsh)
            yield gmsh
        finally:
            if was_open:
                _put_back(gmsh, before, current)
            else:
                gmsh.finalize()


def start_model(gmsh: Any) -> None:
    """Start with an empty model."""
    if _MODEL in gmsh.model.list():
        gmsh.model.setCurrent(_MODEL)
        gmsh.model.remove()
    gmsh.model.add(_MODEL)


def set_options(gmsh: Any) -> None:
    """Set our options, which a drawing may have changed."""
    for name, value in _OPTIONS.items():
        gmsh.option.setNumber(name, value)


def is_discrete(gmsh: Any) -> bool:
    """Tell whether the current model has surfaces of triangles rather than drawn ones."""
    kinds = {gmsh.model.getType(*entity) for entity in gmsh.model.getEntities()}
    return any(kind.startswith("Discrete") for kind in kinds)


@contextlib.contextmanager
def _same_signals() -> Iterator[None]:
    """Keep what the system does on signals; gmsh resets SIGPIPE and those of faulthandler."""
    try:
        sigaction = ctypes.CDLL(None).sigaction
    except (OSError, AttributeError, TypeError):  # not a POSIX system
        yield
        return
    before = {number: ctypes.create_string_buffer(_SIGACTION) for number in signal.valid_signals()}
    known = {n: buffer for n, buffer in before.items() if sigaction(n, None, buffer) == 0}
    try:
        yield
    finally:
        for number, buffer in known.items():
            sigaction(number, buffer, None)


def _put_back(gmsh: Any, options: dict[str, float], current: str) -> None:
    gmsh.model.setCurrent(_MODEL)
    gmsh.model.remove()
    if current in gmsh.model.list():
        gmsh.model.setCurrent(current)
    for name, value in options.items():
        gmsh.option.setNumber(name, value)
