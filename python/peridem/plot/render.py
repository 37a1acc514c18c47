"""`render`: a picture, a grid of pictures or an animation of a state or a series of states."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import make_folder, replace_file
from ..modelling.arguments import checked, number, whole
from .chains import ChainSource, chain_source, explain_chains
from .fields import Field, find_field, label_colours
from .look import Look, make_look
from .movie import MOVIES, FrameJob, draw_frames, find_ffmpeg, frame_images, write_movie
from .outputs import Frame, Outputs
from .scene import Scene, Survey
from .sheet import colour_bar, draw_state, new_sheet, settle
from .snapshot import FieldLike, Snapshot
from .vtk_engine import choose_engine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["RenderWarning", "picture", "render"]

MOST_IN_A_GRID = 36


class RenderWarning(UserWarning):
    """Something was drawn otherwise than asked for, or left out."""


@checked
def render(
    source: Any,
    field: FieldLike | None = None,
    path: str | Path | None = None,
    *,
    at: Any = None,
    every: int | float | None = None,
    tag: str | None = None,
    label: str | None = None,
    unit: str = "",
    chains: Any = None,
    limits: Sequence[float] | None = None,
    colours: str | None = None,
    size: Sequence[int] | None = None,
    zoom: float | Sequence[float] = 1.0,
    background: str = "white",
    walls: str = "filled",
    scale: float = 1.0,
    title: str | None = None,
    style: str | None = None,
    engine: str = "auto",
    view: Sequence[float] = (-60.0, 25.0),
    axes: bool = True,
    fps: float = 12.0,
    workers: int | None = None,
) -> Path | Figure:
    """Draw a state, several in a grid, or an animation.

    Parameters
    ----------
    source : path-like, Result, DEMModel or Snapshot
        Folder of outputs, a PVD or VTU file, what a run handed back, a model (its present
        state), or a state.
    field : str, ndarray or callable, optional
        What the colours show: the name of an array in the outputs in any case (``damage_z``,
        ``damage``, ``displacement``, ``velocity``, ``particle_id``, ...), perhaps with a part
        (``velocity_x``, ``stress_xx``, ``stress_mean``, ``stress_max``); an array of shape
        (n_nodes,) or (n_nodes, 3); a function of the `Snapshot` that gives such an array; for one
        state, what has ``labels`` of the nodes (fragments).
        Vectors are shown by their length, stress by von Mises'. Damage when left out.
    path : path-like, optional
        File to write: .png, .pdf, .svg or another kind of picture, .gif or .mp4. Without it the
        figure is handed back, which a notebook shows.
    at : "first", "last", int, float or sequence of them, optional
        Outputs to draw, by number or by time [s] (the output nearest to it). The last one when
        left out, all for an animation. Several make a grid.
    every : int or float, optional
        Draw every so many outputs, or seconds: a grid, or an animation.
    tag : str, optional
        ``Output.Tag_PP`` of the run, when the folder has several.
    label, unit : str, optional
        Words and unit of the colour bar; those of the field when left out.
    chains : True, DataFrame, mapping or contact network, optional
        Forces between bodies, drawn as lines as thick as the force. True: those of each state, by
        `peridem.diagnostics.contact_network` for a model, and of outputs with the tag
        ``Contact_Network``. A table is for all states: columns i, j and force (or fx, fy[, fz]),
        perhaps x, y[, z] of the contact.
    limits : (float, float), optional
        Ends of the colour scale; those of the data, over all states drawn, when left out.
    colours : str, optional
        A colour map of matplotlib.
    size : (int, int), optional
        Width and height [pixels].
    zoom : float or (x0, y0, x1, y1)
        Factor about the middle; or the box [m] to show, in 2D.
    background : str
        A colour.
    walls : {"filled", "outline", "hidden", "coloured"}
        How walls and bodies whose motion is prescribed are drawn.
    scale : float
        Factor on the displacements; 0 shows the reference configuration.
    title : str, optional
        Put before the time.
    style : {"cells", "nodes"}, optional
        Elements or nodes; elements where there are any when left out.
    engine : {"auto", "pyvista", "matplotlib"}
        What draws in 3D.
    view : (float, float)
        Azimuth and elevation [degrees] from which a state in 3D is seen.
    axes : bool
        Draw axes with ticks, in 2D.
    fps : float
        Frames per second of an animation.
    workers : int, optional
        Processes that draw an animation; as many as pay when left out.

    Returns
    -------
    Path or Figure
        The file, or the figure when no path is given.

    Raises
    ------
    InputError
        If an argument breaks its rule, there is no such field or output, or the file cannot be
        written.

    Warns
    -----
    RenderWarning
        Where an output of several is damaged and left out, or PyVista cannot draw.
    """
    look = make_look(
        limits=limits, colours=colours, size=size, zoom=zoom, background=background, walls=walls,
        scale=scale, title=title, style=style, engine=engine, view=view, axes=axes,
    )  # fmt: skip
    target = _target(path)
    wish = _Wish(field, at, every, label, unit, is_movie=_is_movie(target))
    given = chain_source(chains)
    states = _open(source, tag, wish, with_contacts=given is not None and given.given is None)
    task = _Task(states, look, given, target)
    figure = None
    if wish.is_movie:
        _animate(task, number(fps, "render: fps", above=0), _checked_workers(workers))
    else:
        figure = _draw_sheet(task)
    for note in dict.fromkeys(states.notes):
        warnings.warn(note, RenderWarning, stacklevel=3)
    if target is None:
        assert figure is not None
        return figure
    return target


def picture(source: Any, field: FieldLike | None = None, **options: Any) -> bytes:
    """Return a PNG of a state; arguments as in `render`."""
    import io

    figure: Any = render(source, field, **options)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=figure.dpi)
    return stream.getvalue()


@dataclass(frozen=True)
class _Wish:
    """Which states are to be drawn, and what of them."""

    field: FieldLike | None
    at: Any
    every: Any
    label: str | None
    unit: str
    is_movie: bool

    def worded(self, field: Field) -> Field:
        """Give a field the caller's words."""
        if self.label is None and not self.unit:
            return field
        return dataclasses.replace(
            field, label=self.label or field.label, unit=self.unit or field.unit
        )


@dataclass
class _States:
    """States to be drawn: of files, which are read one by one, or of memory."""

    field: Field
    source: FieldLike
    outputs: Outputs | None = None
    frames: list[Frame] = dataclasses.field(default_factory=list)
    held: list[Snapshot] = dataclasses.field(default_factory=list)
    notes: list[str] = dataclasses.field(default_factory=list)

    def __iter__(self) -> Iterator[Snapshot]:
        """Read the states; those that cannot be read are left out with a note."""
        if self.outputs is None:
            yield from self.held
            return
        wanted = self.field if isinstance(self.source, Field) else None
        readable = []
        problem: InputError | None = None
        for frame in self.frames:
            try:
                snapshot = self.outputs.snapshot(frame, wanted)
            except InputError as error:
                problem = problem or error
                self.notes.append(f"{error} (left out)")
                continue
            readable.append(frame)
            yield snapshot
        self.frames = readable
        if problem is not None and not readable:
            raise problem


@dataclass(frozen=True)
class _Task:
    states: _States
    look: Look
    chains: ChainSource | None
    target: Path | None

    def survey(self) -> tuple[Scene, str]:
        """Go through the states once, and choose what draws them."""
        survey = Survey(self.look, self.states.field, self.states.source)
        for snapshot in self.states:
            survey.add(snapshot)
            if self.chains is not None:
                self.chains.add(snapshot)
        scene = survey.scene()
        engine, note = choose_engine(self.look.engine, scene.camera is not None)
        if note is not None:
            self.states.notes.append(note)
        return scene, engine


def _draw_sheet(task: _Task) -> Figure:
    states = task.states
    count = len(states.frames) or len(states.held)
    if count > MOST_IN_A_GRID:
        raise InputError(
            f"render: every: gives {count} pictures: a grid has at most {MOST_IN_A_GRID}; draw "
            "fewer, or write a .gif or .mp4"
        )
    scene, engine = task.survey()
    figure, axes = new_sheet(scene, len(states.frames) or len(states.held))
    for one, snapshot in zip(axes, states, strict=True):
        draw_state(one, snapshot, scene, engine=engine, chains=task.chains)
    colour_bar(figure, axes, scene)
    if task.chains is not None:
        explain_chains(figure, scene, task.chains)
    settle(figure)
    if task.target is not None:
        _save(figure, task.target, scene)
    return figure


def _save(figure: Figure, path: Path, scene: Scene) -> None:
    kind = path.suffix.lstrip(".").lower() or "png"
    canvas: Any = figure.canvas
    kinds = canvas.get_supported_filetypes()
    if kind not in kinds:
        raise InputError(
            f"{path}: ending .{kind} is no picture format known here; use .png, .pdf, .svg, .gif "
            "or .mp4"
        )
    if path.parent != Path():
        make_folder(path.parent)
    with replace_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=figure.dpi, facecolor=scene.look.background)


def _animate(task: _Task, fps: float, workers: int | None) -> None:
    assert task.target is not None
    if task.target.suffix.lower() == ".mp4":
        find_ffmpeg()  # before the work
    if task.states.outputs is None:
        raise InputError(
            f"render: path = {task.target}: an animation needs the outputs of a run, not one "
            "state; give their folder"
        )
    scene, engine = task.survey()
    job = FrameJob(task.states.outputs, task.states.frames, scene, engine, task.chains)
    own = not isinstance(scene.source, Field)  # functions do not travel to other processes
    images = draw_frames(job) if own or workers == 1 else frame_images(job, workers)
    if task.target.parent != Path():
        make_folder(task.target.parent)
    write_movie(task.target, images, fps, _shades(scene))


def _shades(scene: Scene) -> NDArray[np.uint8]:
    """Colours that may appear in a frame: those of the scale, in 3D also in the shade."""
    if scene.field.kind == "labels" and scene.look.colours is None:
        colours = label_colours(np.arange(-1.0, 16.0))[:, :3]
    else:
        colours = np.asarray(scene.colours(np.linspace(0, 1, 64)))[:, :3]
    lights = (1.0,) if scene.camera is None else (1.0, 0.85, 0.7, 0.55)
    return np.asarray(
        (255 * np.concatenate([light * colours for light in lights])).round(), np.uint8
    )


def _target(path: Any) -> Path | None:
    if path is None:
        return None
    try:
        target = Path(path)
    except TypeError:
        raise InputError(
            f"render: path = {path!r}: must be the name of a file; write it in quotes"
        ) from None
    return target if target.suffix else target.with_suffix(".png")


def _is_movie(target: Path | None) -> bool:
    return target is not None and target.suffix.lower() in MOVIES


def _checked_workers(workers: Any) -> int | None:
    return None if workers is None else whole(workers, "render: workers", 1)


def _open(source: Any, tag: str | None, wish: _Wish, *, with_contacts: bool = False) -> _States:
    """Find the states to be drawn, and the field in them."""
    if hasattr(source, "state") and hasattr(source, "bonds"):
        name = wish.field.lower() if isinstance(wish.field, str) else ""
        source = Snapshot.from_model(
            source,
            stress=name.startswith(("stress", "strain", "von_mises")),
            pieces=name.startswith("fragment"),
            contacts=with_contacts,
        )
    if isinstance(source, Snapshot):
        return _of_memory(source, wish)
    folder = getattr(source, "folder", source)
    if folder is None:
        raise InputError(
            "render: the run has written no outputs: there is nothing to draw; give run(output=...)"
        )
    if not isinstance(folder, str | Path):
        raise InputError(
            f"render: source = {type(source).__name__}: must be a folder of outputs, a file, a "
            "result or a model; give one of them"
        )
    outputs = Outputs.open(folder, tag)
    given = not (wish.field is None or isinstance(wish.field, str))
    named: Any = wish.field
    words = wish.worded(_own(wish) if given else outputs.find_field(named))
    default = "last" if wish.at is None and wish.every is None and not wish.is_movie else wish.at
    frames = outputs.select(default, wish.every)
    source_of: FieldLike = named if given else words
    if given and not callable(named) and len(frames) > 1:
        raise InputError(
            "render: field: an array is for one state; give a function of the snapshot for several"
        )
    return _States(words, source_of, outputs, frames, notes=list(outputs.notes))


def _of_memory(snapshot: Snapshot, wish: _Wish) -> _States:
    for name, value in (("at", wish.at), ("every", wish.every)):
        if value is not None:
            raise InputError(
                f"render: {name} = {value!r}: is for the outputs of a run, this is one state; "
                "leave it out"
            )
    labels = getattr(wish.field, "labels", None)  # of fragments
    if labels is not None:
        labels = np.asarray(labels)
        fields = {**snapshot.fields, "Fragment_ID": labels}
        snapshot._given(labels)
        wish = dataclasses.replace(wish, field="Fragment_ID")
        snapshot = dataclasses.replace(snapshot, fields=fields)
    given = not (wish.field is None or isinstance(wish.field, str))
    if given:
        chosen: Any = wish.field
        return _States(wish.worded(_own(wish)), chosen, held=[snapshot])
    usual = ("Damage_Z", "Damage", "Displacement", "Velocity", *snapshot.names)
    name = str(wish.field or next((one for one in usual if one in snapshot.names), ""))
    words = wish.worded(find_field(name, snapshot.names))
    return _States(words, words, held=[snapshot])


def _own(wish: _Wish) -> Field:
    """Words of an array or function of the caller's."""
    name = getattr(wish.field, "__name__", "")
    return Field("", "" if name == "<lambda>" else name.replace("_", " "), "")
