"""Pictures of a state: what is drawn, where, in which colour."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from peridem.errors import InputError
from peridem.output import OutputWriter
from peridem.plot import Snapshot, render
from peridem.plot.edges import boundary_edges
from peridem.plot.fields import FIELDS, colour_scale, find_field, value_range
from peridem.plot.mosaic import Mosaic

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


def mosaic(figure: Any) -> Mosaic:
    """The coloured triangles of a picture."""
    return [one for one in figure.axes[0].collections if isinstance(one, Mosaic)][-1]


def texts(figure: Any) -> str:
    figure.canvas.draw()
    axes, bar = figure.axes[0], figure.axes[-1]
    labels = [label.get_text() for label in bar.get_yticklabels()]
    parts = [axes.get_title(loc="left"), axes.get_xlabel(), axes.get_ylabel(), bar.get_ylabel()]
    return " | ".join([*parts, *labels])


def pixels(figure: Any) -> Any:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=figure.dpi)
    stream.seek(0)
    return imread(stream)[..., :3]


def at(figure: Any, x: float, y: float) -> Any:
    """Colour of the pixel at a place in data coordinates."""
    image = pixels(figure)
    column, row = figure.axes[0].transData.transform((x, y))
    return image[len(image) - 1 - int(row), int(column)]


def test_damage_turns_from_blue_to_red_where_bonds_break() -> None:
    colours, norm = colour_scale(FIELDS["Damage_Z"], (0.0, 2.0), None)
    # red minus blue of the colour: negative for the blues, positive for the reds
    tint = [colours(norm(z))[0] - colours(norm(z))[2] for z in (0.99, 1.01, 2.0)]
    assert tint[0] < 0 < tint[1]
    assert colours(norm(50.0)) == colours(1.0)  # the scale is capped
    assert "1  bond\nbroken" in texts(render(strip()))


@pytest.mark.parametrize("name", ["Damage_Z", "Damage", "Velocity"])
def test_colours_keep_their_order_in_grey(name: str) -> None:
    field = FIELDS[name]
    colours, _ = colour_scale(field, value_range(field, np.array([0.0, 1.0])), None)
    rgb = np.asarray(colours(np.linspace(0, 1, 257)))[:, :3]
    # relative luminance (Rec. 709) of the linear colours
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    grey = linear @ np.array([0.2126, 0.7152, 0.0722])
    steps = np.diff(grey)
    assert (steps <= 1e-3).all() or (steps >= -1e-3).all()
    assert abs(grey[-1] - grey[0]) > 0.5


def test_broken_grain_is_coloured_pixel_by_pixel() -> None:
    z = np.array([0.0, 2.0, 2.0, 0.0, 2.0, 2.0])  # the right square is broken
    figure = render(strip(fields={"Damage_Z": z}))
    sound = at(figure, 0.2, 0.7)  # in triangle 0, 4, 3 with mean 2/3
    broken = at(figure, 1.7, 0.4)  # in triangle 1, 2, 5 with mean 2
    colours, norm = colour_scale(FIELDS["Damage_Z"], (0.0, 2.0), None)
    np.testing.assert_allclose(sound, colours(norm(2 / 3))[:3], atol=1.5 / 255)  # 8-bit colours
    np.testing.assert_allclose(broken, colours(norm(2.0))[:3], atol=1.5 / 255)
    np.testing.assert_allclose(at(figure, 1.0, 1.06), 1.0)  # above the bodies: the page


def test_small_bodies_have_ticks_in_mm_and_a_title_with_the_time() -> None:
    figure = render(strip(), title="Strip")
    text = texts(figure)
    assert text.startswith("Strip   t = 125 µs")
    assert "x [mm]" in text and "y [mm]" in text
    assert figure.axes[0].get_aspect() == 1.0
    # 2 mm long with a margin of 4 % of the length on both sides
    np.testing.assert_allclose(figure.axes[0].get_xlim(), (-0.08, 2.08), rtol=1e-12)


def test_large_bodies_have_ticks_in_m() -> None:
    assert "x [m]" in texts(render(strip(points=1e3 * STRIP)))


def test_vectors_are_drawn_by_their_length_or_a_component_with_unit() -> None:
    figure = render(strip(), "velocity")
    np.testing.assert_allclose(mosaic(figure).get_array(), 5.0, rtol=1e-15)  # 3, 4, 5
    assert "Speed [m/s]" in texts(figure)
    np.testing.assert_allclose(mosaic(render(strip(), "Velocity_y")).get_array(), 4.0, rtol=1e-15)


def test_unit_has_a_prefix_that_suits_the_numbers() -> None:
    stress = np.zeros((4, 6))
    stress[:, 0] = (1e6, 2e6, 3e6, 4e6)  # uniaxial: von Mises' is the stress itself
    text = texts(render(strip(element_fields={"Stress": stress}), "stress"))
    assert "Von Mises stress [MPa]" in text
    assert "| 4" in text


def test_stress_measures_are_those_of_mechanics() -> None:
    s = np.array([[3.0, -1.0, 2.0, 4.0, 0.0, 0.0]])  # in the xy-plane, and 2 along z

    def measure(name: str) -> float:
        return float(find_field(name, ["Stress"]).of(s)[0])

    # Mohr's circle: centre 1, radius sqrt(2^2 + 4^2)
    assert measure("stress_max") == pytest.approx(1 + 20**0.5, rel=1e-14)
    assert measure("stress_min") == pytest.approx(1 - 20**0.5, rel=1e-14)
    assert measure("stress_mean") == pytest.approx(4 / 3, rel=1e-14)
    a, b, c = 1 + 20**0.5, 1 - 20**0.5, 2.0
    mises = (0.5 * ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2)) ** 0.5
    assert measure("stress") == pytest.approx(mises, rel=1e-14)
    assert measure("stress_xy") == 4.0


def test_cells_have_the_mean_of_their_nodes() -> None:
    z = np.array([0.0, 0.3, 0.6, 0.9, 1.2, 1.5])
    figure = render(strip(fields={"Damage_Z": z}))
    want = [z[nodes].sum() / 3 for nodes in TRIANGLES]
    np.testing.assert_allclose(mosaic(figure).get_array(), want, rtol=1e-15)


def test_quads_are_drawn_as_two_triangles_of_one_colour() -> None:
    quads = [("quad", np.array([[0, 1, 4, 3], [1, 2, 5, 4]]))]
    figure = render(strip(cells=quads, fields={"Damage_Z": np.array([0.0, 1, 2, 0, 1, 2])}))
    np.testing.assert_allclose(mosaic(figure).get_array(), [0.5, 0.5, 1.5, 1.5], rtol=1e-15)
    # areas of the triangles in mm^2: together the two squares
    a, b, c = np.moveaxis(mosaic(figure).triangles, 1, 0)
    u, v = b - a, c - a
    area = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    assert area.sum() == pytest.approx(2.0, rel=1e-12)


def test_cells_torn_by_a_crack_are_left_out() -> None:
    # Pull the right edge off: both triangles of the right square become twice as long.
    moved = np.zeros((6, 3))
    moved[[2, 5], 0] = 1e-3
    fields = {"Damage_Z": np.zeros(6), "Displacement": moved}
    figure = render(strip(points=STRIP + moved, fields=fields))
    assert len(mosaic(figure).triangles) == 2
    without = {"Damage_Z": np.zeros(6)}  # nothing to compare with: all are drawn
    assert len(mosaic(render(strip(points=STRIP + moved, fields=without))).triangles) == 4


def test_rotated_cells_are_whole() -> None:
    turned = STRIP @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    fields = {"Damage_Z": np.zeros(6), "Displacement": turned - STRIP}
    assert len(mosaic(render(strip(points=turned, fields=fields))).triangles) == 4


def test_scale_exaggerates_the_displacement_and_zero_undoes_it() -> None:
    moved = np.zeros((6, 3))
    moved[:, 0] = 1e-4 * np.array([0, 1, 2, 0, 1, 2])  # stretched by a tenth
    source = strip(points=STRIP + moved, fields={"Damage_Z": np.zeros(6), "Displacement": moved})
    # corners in mm: 2 mm and scale times 0.2 mm
    for scale, right in ((0, 2.0), (1, 2.2), (3, 2.6)):
        corners = mosaic(render(source, scale=scale)).triangles
        assert corners[..., 0].max() == pytest.approx(right, rel=1e-12)
    with pytest.raises(InputError, match="scale = 3: needs the array Displacement"):
        render(strip(fields={"Damage_Z": np.zeros(6)}), scale=3)


@pytest.mark.parametrize(
    ("walls", "grey"), [("filled", True), ("outline", False), ("hidden", False)]
)
def test_walls_are_grey_and_do_not_stretch_the_scale(walls: str, grey: bool) -> None:
    wall = np.array([True, True, False, True, True, False])
    speed = np.array([100.0, 100.0, 1.0, 100.0, 100.0, 2.0])[:, None] * np.array([1.0, 0, 0])
    triangles = np.array([[0, 1, 4], [0, 4, 3], [2, 5, 5]])
    source = strip(wall=wall, fields={"Velocity": speed}, cells=[("triangle", triangles)])
    figure = render(source, "Velocity", walls=walls)
    # the only grain's element has the mean 5/3, in the middle of the scale; no wall's 100 is there
    assert mosaic(figure).get_clim() == pytest.approx((5 / 6, 5 / 2), rel=1e-12)
    if walls != "hidden":
        inside = at(figure, 0.3, 0.6)
        np.testing.assert_allclose(inside, 0.74 if grey else 1.0, atol=1.5 / 255)


def test_coloured_walls_take_part_in_the_scale() -> None:
    wall = np.array([True, True, False, True, True, False])
    speed = np.array([100.0, 100.0, 1.0, 100.0, 100.0, 2.0])[:, None] * np.array([1.0, 0, 0])
    figure = render(strip(wall=wall, fields={"Velocity": speed}), "velocity", walls="coloured")
    assert mosaic(figure).get_clim()[1] == pytest.approx(100.0, rel=1e-12)


def test_walls_alone_can_be_drawn() -> None:
    for style in ("cells", "nodes"):
        figure = render(strip(wall=np.ones(6, dtype=bool)), "Velocity", style=style)
        assert "Speed [m/s]" in texts(figure)


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
    fields = {"Damage_Z": np.arange(6.0), "Nodal_Volume": volume}
    figure = render(strip(fields=fields), style="nodes")
    sizes = figure.axes[0].collections[-1].get_sizes()  # by damage, so in the order of the nodes
    np.testing.assert_allclose(sizes / sizes[0], volume / volume[0], rtol=1e-12)


def test_a_fragment_far_away_does_not_shrink_the_bodies() -> None:
    rng = np.random.default_rng(1)
    points = np.column_stack([1e-3 * rng.random((500, 2)), np.zeros(500)])
    points[0] = [1.0, 0.0, 0.0]
    figure = render(Snapshot(points, {"Damage_Z": np.zeros(500)}))
    left, right = figure.axes[0].get_xlim()  # in mm; at most a quarter of the bodies' size further
    assert -0.3 < left < 0.0
    assert 1.0 < right < 1.4


def test_an_outlier_does_not_use_up_the_scale() -> None:
    values = np.append(np.linspace(1.0, 2.0, 2000), 500.0)
    low, high = value_range(FIELDS["Velocity"], values) or (0.0, 0.0)
    assert low == 1.0
    assert 1.99 < high < 2.01


def test_diverging_fields_are_symmetric_about_zero() -> None:
    assert value_range(FIELDS["Theta"], np.array([-1.0, 3.0])) == (-3.0, 3.0)


def test_fragments_have_one_colour_each_whatever_array_they_come_in() -> None:
    labels = np.array([0, 1, 1, 0, 1, 1])
    named = render(strip(fields={"Fragment_ID": labels}), "fragment")
    colours = mosaic(named).get_facecolor()  # an element has the label of its first node
    assert (colours[0] == colours[1]).all() and (colours[2] == colours[3]).all()
    assert not np.allclose(colours[0], colours[2])
    given = render(strip(), labels, label="Piece", unit="-")
    np.testing.assert_allclose(mosaic(given).get_array(), labels[TRIANGLES].mean(axis=1))
    assert "Piece [-]" in texts(given)
    doubled = render(strip(), lambda state: 2.0 * state.fields["Velocity"][:, 1])
    np.testing.assert_allclose(mosaic(doubled).get_array(), 8.0, rtol=1e-15)


def test_zoom_magnifies_about_the_middle_or_shows_a_box() -> None:
    limits = render(strip(), zoom=2.0).axes[0].get_xlim()
    np.testing.assert_allclose(limits, (1 - 0.54, 1 + 0.54), rtol=1e-12)  # half of 2.16 mm
    limits = render(strip(), zoom=(0.5e-3, 0, 1e-3, 1e-3)).axes[0].get_xlim()
    np.testing.assert_allclose(limits, (0.5, 1.0), rtol=1e-12)


def test_size_and_background_are_those_asked_for(tmp_path: Path) -> None:
    image = imread(render(strip(), path=tmp_path / "p.png", size=(700, 500), background="#101820"))
    assert image.shape[:2] == (500, 700)
    np.testing.assert_allclose(image[2, 2, :3], to_rgb("#101820"), atol=1.5 / 255)


def test_boundary_edges_are_those_of_one_element() -> None:
    edges = {tuple(edge) for edge in boundary_edges([TRIANGLES], 6).tolist()}
    assert edges == {(0, 1), (1, 2), (2, 5), (4, 5), (3, 4), (0, 3)}


def test_file_and_model_give_the_same_picture(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    z, v = rng.random(6), rng.normal(size=(6, 3))
    state = SimpleNamespace(
        x=STRIP, u=np.zeros((6, 3)), v=v, f=v, damage_z=z, theta=z, volume=z,
        particle_id=np.zeros(6, int), zone_id=np.zeros(6, int), fixity=np.zeros(6, np.uint8),
    )  # fmt: skip
    body = SimpleNamespace(start=0, stop=6, type="particle", constrained=False)
    model = SimpleNamespace(
        state=state, bonds=None, cells=[("triangle", TRIANGLES)], particles=[body], time=2e-3,
        dimension=2, broken_fraction=lambda: np.zeros(6),
    )  # fmt: skip
    arrays = {"Damage_Z": z, "Velocity": v, "Displacement": state.u}
    path = OutputWriter(tmp_path, tags=[], interval=1, cells=model.cells).write(
        0, 0, model.time, arrays, points=STRIP
    )
    pictures = [
        imread(render(source, path=tmp_path / f"{k}.png"))
        for k, source in enumerate((path, str(path), model))
    ]
    assert pictures[0].std() > 0.05  # not an empty page
    np.testing.assert_array_equal(pictures[0], pictures[1])
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_points_without_elements_are_drawn_as_nodes(tmp_path: Path) -> None:
    source = strip(cells=[("vertex", np.arange(6)[:, None])])
    assert imread(render(source, path=tmp_path / "p.png")).std() > 0.02


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"field": "Stress"}, "run with the tag Strain_Stress to have it; there are Damage_Z"),
        ({"field": "velocty"}, "is not in the data; did you mean velocity"),
        ({"field": np.zeros(5)}, r"array of shape \(5,\): must be \(6,\) or \(6, 3\)"),
        ({"style": "voxels"}, "style = 'voxels': must be one of cells, nodes"),
        ({"walls": "filed"}, "did you mean filled"),
        ({"limits": (2, 1)}, "the lower end must be below the upper one; swap them"),
        ({"limits": 3}, "limits = 3: must be two numbers"),
        ({"colours": "viridi"}, "colours = viridi: no such colour map; did you mean viridis"),
        ({"size": (10, 10)}, "must be whole numbers of pixels from 100"),
        ({"zoom": 0}, "zoom = 0: must be positive"),
        ({"zoom": (1, 1, 2, 2)}, "shows nothing: the bodies are within"),
        ({"background": "blurple"}, "background = blurple: is no colour"),
        ({"scale": -1}, "scale = -1: must be at least 0"),
        ({"at": 3}, "at = 3: is for the outputs of a run"),
        ({"colour": "viridis"}, "colour: unknown argument; did you mean colours"),
        ({"engine": "pyvista"}, "draws states in 3D only"),
        ({"chains": 3}, "chains = 3: must be a table"),
    ],
)
def test_what_cannot_be_drawn_is_an_input_error(
    tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        render(strip(), path=tmp_path / "p.png", **options)
    assert list(tmp_path.iterdir()) == []


def test_unknown_picture_format_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"p\.bmpx: ending \.bmpx is no picture format"):
        render(strip(), path=tmp_path / "p.bmpx")


def test_state_that_ran_away_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no node has a finite position"):
        render(strip(points=np.full((6, 3), np.nan)), path=tmp_path / "p.png")


def test_picture_that_cannot_be_written_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match=r"p\.png: cannot be written: No space left"):
        render(strip(), path=tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []
