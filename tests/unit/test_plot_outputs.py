"""Pictures of the outputs of a run: which states, grids, animations, 3D, what is damaged."""

from __future__ import annotations

import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from matplotlib.image import imread
from peridem.body_table import bodies_path
from peridem.cli import main
from peridem.errors import InputError
from peridem.output import OutputWriter
from peridem.plot import Outputs, RenderWarning, Snapshot, plot_series, render, vtk_engine
from peridem.plot.movie import FrameJob, draw_frames
from peridem.plot.render import _open, _Task, _Wish
from PIL import Image

SQUARE = 1e-3 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
TRIANGLES = np.array([[0, 1, 3], [0, 3, 2]])
FRAMES = 5


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Outputs of two squares, the second moving away: 5 states, 10 us apart, ever more broken."""
    out = tmp_path / "out"
    points = np.vstack([SQUARE, SQUARE + np.array([1.5e-3, 0, 0])])
    with OutputWriter(
        out, tags=[], interval=10, cells=[("triangle", TRIANGLES), ("triangle", TRIANGLES + 4)]
    ) as writer:
        for k in range(FRAMES):
            moved = np.zeros((8, 3))
            moved[4:, 0] = k * 1e-4
            arrays = {
                "Displacement": moved,
                "Damage_Z": np.repeat([0.0, 0.5 * k], 4),
                "Velocity": moved / 1e-5,
                "Particle_ID": np.repeat([0, 1], 4),
            }
            writer.write(k, 10 * k, k * 1e-5, arrays, points=points + moved)
    bodies_path(out / "output.pvd").write_text(
        "id,name,kind,zone,start,stop,constrained\n0,base,wall,0,0,4,1\n1,grain,particle,1,4,8,0\n"
    )
    return out


def times(frames: Any) -> list[float]:
    return [float(f"{frame.time:.9g}") for frame in frames]


def test_states_are_chosen_by_number_time_or_interval(folder: Path) -> None:
    outputs = Outputs.open(folder)
    assert times(outputs.select("last")) == [4e-5]
    assert times(outputs.select(-2)) == [3e-5]
    assert times(outputs.select([1.2e-5, "first"])) == [0.0, 1e-5]  # the nearest, in order
    assert times(outputs.select(every=2)) == [0.0, 2e-5, 4e-5]
    assert times(outputs.select(every=2e-5)) == [0.0, 2e-5, 4e-5]


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"at": 5}, "at = 5: there are 5 outputs; give a number from 0 to 4, or a time"),
        ({"at": 1.0}, "at = 1 s: is outside the outputs, which are from 0 to 4e-05 s"),
        ({"at": "end"}, "must be first, last, the number of an output or a time"),
        ({"at": []}, "names no output"),
        ({"every": 0}, "every = 0: must be positive"),
        ({"every": 1, "at": 1}, "is given besides at"),
    ],
)
def test_states_that_are_not_there_are_input_errors(
    folder: Path, choice: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        render(folder, **choice)


def test_bodies_known_as_walls_are_drawn_so(folder: Path) -> None:
    outputs = Outputs.open(folder)
    assert outputs.snapshot(outputs.frames[0]).wall.tolist() == [True] * 4 + [False] * 4


def test_several_states_make_a_grid_with_one_scale(folder: Path) -> None:
    figure: Any = render(folder, "velocity", every=2)
    pictures = figure.axes[:3]
    assert [one.get_title(loc="left") for one in pictures] == [
        "t = 0.0 µs",
        "t = 20.0 µs",
        "t = 40.0 µs",
    ]
    scales = {one.collections[-2].get_clim() for one in pictures}
    assert scales == {(0.0, 40.0)}  # 4e-4 m in 1e-5 s
    assert len({one.get_xlim() for one in pictures}) == 1


def test_gif_has_all_frames_and_they_move(folder: Path, tmp_path: Path) -> None:
    path = render(folder, "damage_z", tmp_path / "film.gif", fps=10, size=(400, 300))
    with Image.open(path) as film:
        assert film.n_frames == FRAMES
        assert film.info["duration"] == 100
        shown = []
        for k in (0, FRAMES - 1):
            film.seek(k)
            shown.append(np.asarray(film.convert("RGB"), dtype=float))
    assert (shown[0][2, 2] == 255).all()  # the page stays white to the last bit
    # Z = 2 in the end: dark red where the right square is, and nowhere at the start.
    dark = [(one[..., 0] < 100) & (one[..., 1] < 25) & (one[..., 2] < 40) for one in shown]
    bar = dark[0].sum()  # the end of the colour bar is as dark
    assert dark[1].sum() > 5 * bar > 0


def test_mp4_has_all_frames(folder: Path, tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = render(folder, None, tmp_path / "film.mp4", every=1, fps=5, size=(401, 301), workers=1)
    raw = ["-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), *raw], capture_output=True, check=True)
    frames = np.frombuffer(done.stdout, np.uint8).reshape(-1, 300, 400, 3)  # even sides
    assert len(frames) == FRAMES
    assert (frames[0] != frames[-1]).mean() > 0.01  # the square has moved


def test_mp4_without_ffmpeg_says_what_to_install(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(InputError, match=r'mp4 needs ffmpeg.*pip install "peridem\[render\]"'):
        render(folder, None, tmp_path / "film.mp4")
    assert not (tmp_path / "film.mp4").exists()


def test_processes_draw_the_same_frames(folder: Path, tmp_path: Path) -> None:
    films = [
        render(folder, "velocity", tmp_path / f"{n}.gif", size=(300, 200), workers=n)
        for n in (1, 2)
    ]
    assert films[0].read_bytes() == films[1].read_bytes()  # type: ignore[union-attr]


def test_frames_of_a_film_are_the_pictures_of_their_states(folder: Path, tmp_path: Path) -> None:
    options: dict[str, Any] = {"limits": (0, 2), "size": (400, 300)}
    image = imread(render(folder, "damage_z", tmp_path / "p.png", at=[0, 4], **options))
    assert image.std() > 0.02
    wish = _Wish("damage_z", None, None, None, "", is_movie=True)
    states = _open(folder, None, wish)
    from peridem.plot.look import make_look

    scene, engine = _Task(states, make_look(**options), None, None).survey()
    job = FrameJob(Outputs.open(folder), states.frames, scene, engine)
    frames = list(draw_frames(job))
    assert len(frames) == FRAMES
    assert len({frame.shape for frame in frames}) == 1
    again = list(draw_frames(job.part(states.frames[3:4])))  # nothing is left of other frames
    np.testing.assert_array_equal(frames[3], again[0])


def test_damaged_outputs_are_left_out_with_a_note(folder: Path, tmp_path: Path) -> None:
    whole = (folder / "output_2.vtu").read_bytes()
    (folder / "output_2.vtu").write_bytes(whole[: len(whole) // 2])
    with pytest.warns(RenderWarning, match=r"output_2\.vtu: not a readable VTU.*left out"):
        path = render(folder, None, tmp_path / "film.gif", size=(300, 200))
    with Image.open(path) as film:
        assert film.n_frames == FRAMES - 1
    with pytest.raises(InputError, match=r"output_2\.vtu: not a readable VTU"):
        render(folder, at=2)


def test_folders_without_outputs_are_input_errors(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: no such folder; give the folder that a run"):
        render(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"there are no outputs \(.vtu files\) in it"):
        render(tmp_path)
    result = SimpleNamespace(folder=None, series=None, summary={})
    with pytest.raises(InputError, match=r"has written no outputs.*give run\(output=...\)"):
        render(result)


def test_outputs_without_their_list_are_found(folder: Path) -> None:
    (folder / "output.pvd").unlink()
    assert times(Outputs.open(folder).frames) == [0.0, 1e-5, 2e-5, 3e-5, 4e-5]
    (folder / "output.pvd").write_text("<VTK")
    outputs = Outputs.open(folder)
    assert len(outputs.frames) == FRAMES
    assert "not a PVD time series" in outputs.notes[0]


def test_runs_in_one_folder_need_a_tag(folder: Path) -> None:
    for k in range(FRAMES):
        shutil.copy(folder / f"output_{k}.vtu", folder / f"output_b_{k}.vtu")
        (folder / f"output_{k}.vtu").rename(folder / f"output_a_{k}.vtu")
    (folder / "output.pvd").unlink()
    with pytest.raises(InputError, match="several runs: a, b; choose one with tag"):
        render(folder)
    assert len(Outputs.open(folder, "b").frames) == FRAMES


def test_force_chains_are_as_wide_as_the_forces(folder: Path) -> None:
    table = pd.DataFrame({"i": [0, 0], "j": [1, 1], "fx": [3.0, 6.0], "fy": [4.0, 8.0]})
    figure: Any = render(folder, at=0, chains=table)
    lines = figure.axes[0].collections[-1]
    widths = lines.get_linewidths()
    assert widths[1] == pytest.approx(2 * widths[0], rel=1e-12)  # 5 N and 10 N, in this order
    ends = lines.get_segments()[0]
    # From the wall's nearest node to the centre of the grain, in mm.
    np.testing.assert_allclose(ends, [[1.0, 0.0], [2.0, 0.5]], atol=1e-9)
    assert "10 N/m" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_contact_networks_and_fragments_are_taken_as_they_are(folder: Path) -> None:
    table = pd.DataFrame(
        {"body_i": [0, 0], "body_j": [1, 1], "normal_force": [0.0, 7.0], "x": [1e-3] * 2, "y": 0.0}
    )
    network = SimpleNamespace(to_frame=lambda: table)
    figure: Any = render(folder, at=0, chains=network)
    (line,) = figure.axes[0].collections[-1].get_segments()  # a force of zero is no line
    # From the contact at the wall to the centre of the grain, in mm.
    np.testing.assert_allclose(line, [[1.0, 0.0], [1.0, 0.0], [2.0, 0.5]], atol=1e-9)
    state = Outputs.open(folder).snapshot(Outputs.open(folder).frames[0])
    pieces = SimpleNamespace(labels=np.repeat([0, 1], 4))
    figure = render(state, pieces, walls="coloured")
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["0", "1"]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"i": [0], "j": [7], "force": [1.0]}, "body 7: there is none; ids are from 0 to 1"),
        ({"a1": [0], "j": [1], "force": [1.0]}, "i and j, the ids of the bodies, are missing"),
        ({"i": [0], "j": [1]}, "the column force, or fx and fy, is missing"),
        ({"i": [0], "j": [1], "force": [np.nan]}, "must be finite numbers"),
        ({"i": [0], "j": [1], "force": ["much"]}, "not made of numbers"),
    ],
)
def test_force_chains_say_what_is_wrong(folder: Path, table: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        render(folder, chains=table)


def cube() -> Snapshot:
    """A unit cube of 12 tetrahedra about its centre, node 8."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    tetra = np.array([t for a, b, c, d in faces for t in ((a, b, c, 8), (a, c, d, 8))])
    points = np.vstack([corners, [[0.5, 0.5, 0.5]]])
    return Snapshot(points, {"Damage_Z": np.full(9, 2.0)}, [("tetra", tetra)])


def test_3d_shows_the_surface_from_outside() -> None:
    from peridem.plot.camera import surface_of

    source = cube()
    surface = surface_of(source)
    assert len(surface.faces) == 12
    assert 8 not in surface.faces
    a, b, c = (source.points[surface.faces[:, k]] for k in range(3))
    outwards = (np.cross(b - a, c - a) * (a - 0.5)).sum(axis=1)
    assert (outwards > 0).all()
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(6.0)


def test_3d_is_drawn_by_matplotlib_where_rendering_is_impossible(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def crash(command: list[str], **_: Any) -> Any:
        return SimpleNamespace(returncode=-11)

    pytest.importorskip("pyvista")
    vtk_engine.why_not.cache_clear()
    monkeypatch.setattr(vtk_engine.subprocess, "run", crash)
    try:
        with pytest.warns(RenderWarning, match=r"cannot render.*-11.*libgl1.*by matplotlib"):
            path = render(cube(), path=tmp_path / "p.png")
        with pytest.raises(InputError, match="engine = pyvista: PyVista cannot render"):
            render(cube(), engine="pyvista")
    finally:
        vtk_engine.why_not.cache_clear()
    red = imread(path)
    assert ((red[..., 0] > 1.5 * red[..., 1]) & (red[..., 0] < 0.4)).mean() > 0.1


def test_3d_without_pyvista_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    vtk_engine.why_not.cache_clear()
    monkeypatch.setattr(vtk_engine.importlib.util, "find_spec", lambda name: None)
    try:
        with pytest.warns(RenderWarning, match=r'not installed \(pip install "peridem\[render\]"'):
            render(cube())
    finally:
        vtk_engine.why_not.cache_clear()


def test_both_engines_draw_the_same_picture_in_3d(tmp_path: Path) -> None:
    reason = vtk_engine.why_not()
    if reason is not None:
        pytest.skip(reason)
    source = cube()
    bodies = [
        imread(render(source, path=tmp_path / f"{engine}.png", engine=engine))[..., :3]
        for engine in ("pyvista", "matplotlib")
    ]
    # Dark red everywhere or nowhere: the outlines agree but for a pixel along them.
    seen = [one.max(axis=2) < 0.45 for one in bodies]
    assert seen[0].mean() > 0.1
    assert (seen[0] != seen[1]).mean() < 0.01


def test_3d_nodes_without_elements_are_drawn(tmp_path: Path) -> None:
    source = Snapshot(cube().points, {"Damage_Z": np.zeros(9)})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RenderWarning)
        assert imread(render(source, path=tmp_path / "p.png")).std() > 0.02
        with pytest.raises(InputError, match="there are no tetrahedra; use style nodes"):
            render(source, style="cells")


def test_series_are_drawn_with_units_and_unlike_columns_apart(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {
            "time": [0.0, 1e-4, 2e-4],
            "step": [0, 1, 2],
            "kinetic_energy": [2.0, 1.0, 0.5],
            "damage.fraction": [0.0, 0.01, 0.02],
            "damage.broken": [0, 300, 600],
            "stress.pressure": [0.0, 1e3, 2e3],
            "work_lid.work": [0.0, 0.1, 0.2],
        }
    )
    frame.to_csv(tmp_path / "series.csv", index=False)
    figure: Any = plot_series(tmp_path)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        "kinetic energy [J, in 2D J/m]",
        "damage: broken",
        "damage: fraction",
        "stress [Pa]",
        "work lid [J, in 2D J/m]",
    ]
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xdata(), [0, 100, 200])
    assert figure.axes[-1].get_xlabel() == "t [µs]"
    path = plot_series(frame, "damage", tmp_path / "s.png")
    assert imread(path).std() > 0.02
    with pytest.raises(InputError, match="columns = damge: there is none; did you mean damage"):
        plot_series(frame, "damge")
    with pytest.raises(InputError, match="nothing was recorded"):
        plot_series(frame[["time", "step"]])


def test_command_draws_and_says_where(folder: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(
        main, ["render", str(folder), "--field", "Velocity_X", "--at", "1e-5", "--range", "0", "9"]
    )
    assert done.exit_code == 0, done.output
    assert f"Look at {folder / 'velocity_x.png'}" in done.output
    assert imread(folder / "velocity_x.png").std() > 0.02
    film = tmp_path / "f.gif"
    done = runner.invoke(
        main, ["render", str(folder), "-o", str(film), "--every", "2", "--size", "300", "200"]
    )
    assert done.exit_code == 0, done.output
    with Image.open(film) as image:
        assert image.n_frames == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--field", "velocit"], "did you mean velocity?"),
        (["--at", "soon"], "'soon' is not first, last"),
        (["--zoom", "1,2"], "is not a factor or a box x0,y0,x1,y1"),
        (["--series"], "no such file; give the folder or file that a run has recorded to"),
    ],
)
def test_command_refuses_what_is_wrong(folder: Path, arguments: list[str], message: str) -> None:
    done = CliRunner().invoke(main, ["render", str(folder), *arguments])
    assert done.exit_code == 2
    assert message in done.output + getattr(done, "stderr", "")


def test_package_is_typed_and_plots_are_loaded_when_needed() -> None:
    import peridem

    assert (Path(peridem.__file__).parent / "py.typed").is_file()
    code = "import sys, peridem; sys.exit('matplotlib' in sys.modules or 'pyvista' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
