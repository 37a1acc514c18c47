"""Pictures: what is drawn, where, in which colour."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread
from peridem import plotting
from peridem.errors import InputError
from peridem.output import OutputWriter
from peridem.plotting import Snapshot, plot_cells, plot_nodes, save_picture

# A strip of two unit squares of four triangles, 2 mm long; nodes 0 to 5.
STRIP = 1e-3 * np.array(
    [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], dtype=float
)
TRIANGLES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])


def strip(**change: Any) -> Snapshot:
    given: dict[str, Any] = {
        "points": STRIP,
        "fields": {
            "Damage_Z": np.zeros(6),
            "Velocity": np.array([[3.0, 4.0, 0.0]] * 6),
            "Displacement": np.zeros((6, 3)),
        },
        "cells": [("triangle", TRIANGLES)],
        "time": 1.25e-4,
    }
    return Snapshot(**(given | change))


def drawn(axes: Any) -> list[Any]:
    """Collections of a picture with something in them."""
    return [c for c in axes.collections if len(c.get_paths()) and len(c.get_offsets())]


def texts(axes: Any) -> str:
    FigureCanvasAgg(axes.figure).draw()
    bar = axes.figure.axes[-1]
    labels = [label.get_text() for label in bar.get_yticklabels()]
    return " | ".join(
        [
            axes.get_title(loc="left"),
            axes.get_xlabel(),
            axes.get_ylabel(),
            bar.get_ylabel(),
            *labels,
        ]
    )


def test_damage_turns_from_blue_to_red_where_bonds_break() -> None:
    axes = plot_cells(strip())
    (cells,) = axes.collections
    # red minus blue of the colour: negative for the blues, positive for the reds
    tint = [cells.cmap(cells.norm(z))[0] - cells.cmap(cells.norm(z))[2] for z in (0.99, 1.01, 50.0)]
    assert tint[0] < 0 < tint[1]
    assert cells.cmap(cells.norm(50.0)) == cells.cmap(1.0)  # the scale is capped
    assert "1  bond\nbroken" in texts(axes)


def test_small_bodies_have_ticks_in_mm_and_a_title_with_the_time() -> None:
    axes = plot_cells(strip())
    text = texts(axes)
    assert "t = 0.125 ms" in text
    assert "x [mm]" in text and "y [mm]" in text
    assert axes.get_aspect() == 1.0
    # 2 mm long with a margin of 4 % of the length on both sides
    np.testing.assert_allclose(axes.get_xlim(), (-0.08, 2.08), rtol=1e-12)


def test_large_bodies_have_ticks_in_m() -> None:
    assert "x [m]" in texts(plot_cells(strip(points=1e3 * STRIP)))


def test_vectors_are_drawn_by_their_length_with_the_unit() -> None:
    axes = plot_cells(strip(), field="Velocity")
    np.testing.assert_allclose(axes.collections[0].get_array(), 5.0, rtol=1e-15)  # 3, 4, 5
    assert "Speed [m/s]" in texts(axes)


def test_cells_have_the_mean_of_their_nodes() -> None:
    z = np.array([0.0, 0.3, 0.6, 0.9, 1.2, 1.5])
    axes = plot_cells(strip(fields={"Damage_Z": z}))
    want = [z[nodes].sum() / 3 for nodes in TRIANGLES]
    np.testing.assert_allclose(axes.collections[0].get_array(), want, rtol=1e-15)


def test_cells_torn_by_a_crack_are_left_out() -> None:
    # Pull the right edge off: both triangles of the right square become twice as long.
    moved = np.zeros((6, 3))
    moved[[2, 5], 0] = 1e-3
    fields = {"Damage_Z": np.zeros(6), "Displacement": moved}
    axes = plot_cells(strip(points=STRIP + moved, fields=fields))
    assert len(axes.collections[0].get_array()) == 2
    without = {"Damage_Z": np.zeros(6)}  # nothing to compare with: all are drawn
    assert (
        len(plot_cells(strip(points=STRIP + moved, fields=without)).collections[0].get_array()) == 4
    )


def test_rotated_cells_are_whole() -> None:
    turned = STRIP @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    fields = {"Damage_Z": np.zeros(6), "Displacement": turned - STRIP}
    assert len(plot_cells(strip(points=turned, fields=fields)).collections[0].get_array()) == 4


def test_walls_are_grey_and_do_not_stretch_the_scale() -> None:
    wall = np.array([True, True, False, True, True, False])
    speed = np.array([100.0, 100.0, 1.0, 100.0, 100.0, 2.0])[:, None] * np.array([1.0, 0, 0])
    triangles = np.array([[0, 1, 4], [0, 4, 3], [2, 5, 5]])
    source = strip(wall=wall, fields={"Velocity": speed}, cells=[("triangle", triangles)])
    axes = plot_cells(source, field="Velocity")
    grey, grain = axes.collections
    assert grey.get_array() is None
    assert len(set(grey.get_facecolor()[0][:3])) == 1  # red = green = blue
    assert grain.get_clim() == (1.0, 2.0)


@pytest.mark.parametrize("draw", [plot_cells, plot_nodes])
def test_walls_alone_can_be_drawn(draw: Any) -> None:
    axes = draw(strip(wall=np.ones(6, dtype=bool)), field="Velocity")
    assert "Speed [m/s]" in texts(axes)


def test_prescribed_bodies_of_a_file_are_walls(tmp_path: Path) -> None:
    arrays = {
        "Damage_Z": np.zeros(6),
        "Particle_ID": np.array([0, 1, 2, 0, 1, 2]),
        "Fixity": np.array([3, 3, 3, 3, 1, 0]),  # body 0 wholly held, 1 and 2 in part
        "Zone_ID": np.array([0, 0, 1, 0, 0, 1]),
    }
    cells = [("triangle", TRIANGLES)]
    path = OutputWriter(tmp_path, tags=[], interval=1, cells=cells).write(
        0, 0, 0.0, arrays, points=STRIP
    )
    assert Snapshot.from_vtu(path).wall.tolist() == [True, False, False] * 2
    assert Snapshot.from_vtu(path, wall_zones=[1]).wall.tolist() == [True, False, True] * 2


def test_nodes_are_discs_with_areas_like_their_volumes() -> None:
    volume = np.array([1.0, 2.0, 1.0, 1.0, 4.0, 1.0]) * 1e-7
    axes = plot_nodes(strip(fields={"Damage_Z": np.arange(6.0), "Nodal_Volume": volume}))
    sizes = drawn(axes)[-1].get_sizes()  # sorted by damage, so in the order of the nodes
    np.testing.assert_allclose(sizes / sizes[0], volume / volume[0], rtol=1e-12)


def test_a_fragment_far_away_does_not_shrink_the_bodies() -> None:
    rng = np.random.default_rng(1)
    points = np.column_stack([1e-3 * rng.random((500, 2)), np.zeros(500)])
    points[0] = [1.0, 0.0, 0.0]
    axes = plot_nodes(Snapshot(points, {"Damage_Z": np.zeros(500)}))
    left, right = axes.get_xlim()  # in mm; at most a quarter of the bodies' size further
    assert -0.3 < left < 0.0
    assert 1.0 < right < 1.4


def test_3d_shows_the_nodes_of_the_surface_only() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    points = np.vstack([corners, [[0.5, 0.5, 0.5]]])
    # the faces of the cube, two triangles each, all joined to the centre, node 8
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    tetra = np.array([t for a, b, c, d in faces for t in ((a, b, c, 8), (a, c, d, 8))])
    source = Snapshot(points, {"Damage_Z": np.zeros(9)}, [("tetra", tetra)])
    assert source.is_3d
    axes = plot_nodes(source)
    assert axes.name == "3d"
    assert len(axes.collections[-1].get_offsets()) == 8


def test_cells_of_a_3d_state_are_refused() -> None:
    raised = STRIP + np.array([[0, 0, 1e-3]] + [[0, 0, 0]] * 5)
    with pytest.raises(InputError, match="3D state cannot be drawn; use style nodes"):
        plot_cells(strip(points=raised))


def test_file_and_model_give_the_same_picture(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    z, v = rng.random(6), rng.normal(size=(6, 3))
    state = SimpleNamespace(
        x=STRIP, u=np.zeros((6, 3)), v=v, f=v, damage_z=z, theta=z, volume=z,
        particle_id=np.zeros(6, int), zone_id=np.zeros(6, int), fixity=np.zeros(6, np.uint8),
    )  # fmt: skip
    body = SimpleNamespace(start=0, stop=6, type="particle", constrained=False)
    model = SimpleNamespace(
        state=state, cells=[("triangle", TRIANGLES)], particles=[body], time=2e-3,
        dimension=2, broken_fraction=lambda: np.zeros(6),
    )  # fmt: skip
    arrays = {"Damage_Z": z, "Velocity": v, "Displacement": state.u}
    path = OutputWriter(tmp_path, tags=[], interval=1, cells=model.cells).write(
        0, 0, model.time, arrays, points=STRIP
    )
    pictures = [
        imread(save_picture(tmp_path / f"{k}.png", source, dpi=50))
        for k, source in enumerate((path, str(path), model))
    ]
    assert pictures[0].std() > 0.05  # not an empty page
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_points_without_elements_are_drawn_as_nodes(tmp_path: Path) -> None:
    source = strip(cells=[("vertex", np.arange(6)[:, None])])
    assert imread(save_picture(tmp_path / "p.png", source, dpi=50)).std() > 0.02


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"field": "Stress"}, "field = Stress: is not in the data; use one of Damage_Z, Velocity"),
        ({"style": "voxels"}, "style = voxels: is unknown; use cells or nodes"),
    ],
)
def test_what_cannot_be_drawn_is_an_input_error(
    tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        save_picture(tmp_path / "p.png", strip(), **options)
    assert list(tmp_path.iterdir()) == []


def test_unknown_picture_format_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"p\.bmpx: ending \.bmpx is no picture format"):
        save_picture(tmp_path / "p.bmpx", strip())


def test_state_that_ran_away_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no node has a finite position"):
        save_picture(tmp_path / "p.png", strip(points=np.full((6, 3), np.nan)))


def test_picture_that_cannot_be_written_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(plotting.Path, "replace", full)
    with pytest.raises(InputError, match=r"p\.png: cannot be written: No space left"):
        save_picture(tmp_path / "p.png", strip(), dpi=50)
    assert list(tmp_path.iterdir()) == []
