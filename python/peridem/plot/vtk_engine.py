"""Pictures in 3D by PyVista, where it is installed and this machine can render.

Off-screen rendering crashes the whole program where the graphics libraries are missing: it is
tried once in a program of its own.
"""

from __future__ import annotations

import functools
import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .scene import Scene
from .space import AMBIENT, WALL_ALPHA, Faces

__all__ = ["choose_engine", "photograph", "why_not"]

INSTALL = 'pip install "peridem[render]"'
LIBRARIES = "libgl1 libegl1 libx11-6"
_PROBE_SECONDS = 60
_PROBE = """
import numpy as np, pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere(), color="red", lighting=False)
picture = plotter.screenshot(return_img=True)
raise SystemExit(0 if np.ptp(np.asarray(picture)[..., 1]) > 100 else 3)
"""


@functools.cache
def why_not() -> str | None:
    """Say why PyVista cannot draw here; None when it can."""
    if importlib.util.find_spec("pyvista") is None:
        return f"PyVista is not installed ({INSTALL})"
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            timeout=_PROBE_SECONDS,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"PyVista could not be tried ({error})"
    if done.returncode:
        return (
            f"PyVista cannot render on this machine (the trial ended with {done.returncode}; on "
            f"Debian and Ubuntu it needs {LIBRARIES})"
        )
    return None


def choose_engine(wanted: str, is_3d: bool) -> tuple[str, str | None]:
    """Choose what draws: the engine, and a note where it is not the one that is best.

    Raises
    ------
    InputError
        If PyVista is asked for and cannot draw.
    """
    if wanted == "matplotlib" or (wanted == "auto" and not is_3d):
        return "matplotlib", None
    if not is_3d:
        raise InputError(
            "render: engine = pyvista: draws states in 3D only; leave engine out for one in 2D"
        )
    reason = why_not()
    if reason is None:
        return "pyvista", None
    if wanted == "pyvista":
        raise InputError(f"render: engine = pyvista: {reason}; install it, or leave engine out")
    return "matplotlib", f"{reason}: drawn by matplotlib instead"


def photograph(faces: Faces, scene: Scene, pixels: tuple[int, int]) -> NDArray[np.uint8]:
    """Draw the surface of a state; the rest of the picture is transparent.

    Parameters
    ----------
    faces : Faces
        The surface.
    scene : Scene
        Camera and box of the picture.
    pixels : tuple of int
        Width and height.

    Returns
    -------
    ndarray of uint8, shape (height, width, 4)
    """
    import pyvista
    from matplotlib.colors import to_rgb

    assert scene.camera is not None
    camera = scene.camera
    with _quiet():
        plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(pixels), lighting="none")
    light = camera.towards_viewer + 0.5 * camera.up - 0.5 * camera.right
    plotter.add_light(
        pyvista.Light(position=light, focal_point=(0, 0, 0), light_type="scene light")
    )
    shading = {"ambient": AMBIENT, "diffuse": 1 - AMBIENT, "specular": 0.0}
    if len(faces.walls):
        plotter.enable_depth_peeling(8)
        walls = _mesh(faces.points, faces.walls)
        plotter.add_mesh(walls, color=to_rgb(scene.look.wall_colour), opacity=WALL_ALPHA, **shading)
    if len(faces.grains):
        grains = _mesh(faces.points, faces.grains)
        grains.cell_data["colour"] = (255 * faces.colours[:, :3]).round().astype(np.uint8)
        plotter.add_mesh(grains, scalars="colour", rgb=True, **shading)
    middle, height = scene.box.mean(axis=0), float(np.diff(scene.box[:, 1])[0])
    focus = middle[0] * camera.right + middle[1] * camera.up
    focus = focus + camera.towards_viewer * float((faces.points @ camera.towards_viewer).mean())
    reach = 4.0 * float(np.ptp(faces.points, axis=0).max())
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + reach * camera.towards_viewer
    plotter.camera.up = camera.up
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * height
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    with _quiet():
        picture = plotter.screenshot(return_img=True, transparent_background=True)
    plotter.close()
    return np.asarray(picture)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what VTK says about displays that it does not need off the terminal."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)


def _mesh(points: NDArray[np.float64], faces: NDArray[np.int64]) -> Any:
    import pyvista

    used, numbers = np.unique(faces, return_inverse=True)
    triangles: Any = numbers.reshape(-1, 3)
    return pyvista.PolyData.from_regular_faces(points[used], triangles)
