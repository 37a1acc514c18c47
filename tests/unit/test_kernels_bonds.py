"""Nodal volumes, mesh size, neighbours, bonds and weighted volumes against the reference."""

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh, disc_mesh, relative_error, single_deck
from reference import ReferenceModel
from reference.bonds import nodal_volumes

INFLUENCES = [
    {"Type": 0},
    {"Type": 0, "Parameters": [2.5]},
    {"Type": 1},
    {"Type": 1, "Parameters": [3.0, -1.0]},
    {"Type": 2},
    {"Type": 2, "Parameters": [2.0, 0.5]},
]


@pytest.fixture(params=[2, 3], ids=["2D", "3D"])
def pair(request, deck_folder):
    """The deck of two bodies."""
    return deck_folder.grains() if request.param == 2 else deck_folder.cubes()


def assert_same_bonds(model):
    reference = ReferenceModel(model)
    bonds, bodies = model.bonds, reference.bodies
    i = np.concatenate([body.start + body.solid.bonds.i for body in bodies])
    j = np.concatenate([body.start + body.solid.bonds.j for body in bodies])
    count = np.bincount(i, minlength=model.n_nodes)
    assert np.array_equal(np.diff(bonds.offsets), count)
    assert np.array_equal(bonds.indices, j)
    assert bonds.intact.all()
    # Both compute the same few operations: differences are of single roundings.
    r = np.concatenate([body.solid.bonds.r for body in bodies])
    w = np.concatenate([body.solid.bonds.w for body in bodies])
    m = np.concatenate([body.solid.bonds.m for body in bodies])
    np.testing.assert_allclose(bonds.length, r, rtol=1e-15)
    np.testing.assert_allclose(bonds.weight, w, rtol=1e-13)
    np.testing.assert_allclose(model.state.weighted_volume, m, rtol=1e-13)


@pytest.mark.parametrize("influence", INFLUENCES, ids=str)
def test_bonds_match_the_reference(pair, deck_folder, influence):
    model = deck_folder.model(pair, {"Material.Zone_1.Influence_Function": influence})
    assert_same_bonds(model)


def test_influence_of_the_first_zone_is_used_for_all_in_original_mode_only(pair, deck_folder):
    change = {"Material.Zone_2.Influence_Function": {"Type": 0}}
    corrected = deck_folder.model(pair, change)
    original = deck_folder.model(pair, change, compatibility="original")
    assert_same_bonds(corrected)
    assert_same_bonds(original)
    second = slice(corrected.bonds.offsets[corrected.particles[1].start], None)
    a = corrected.bonds.length[second] / corrected.particles[1].horizon
    ratio = 4 * (1 - a) if corrected.dimension == 2 else 5 * (1 - a)  # 12 (1-a)/3, 20 (1-a)/4
    weights = corrected.bonds.weight[second] * ratio
    # 1 - a loses digits near the horizon
    np.testing.assert_allclose(original.bonds.weight[second], weights, rtol=1e-12)


def test_bonds_by_horizon_mesh_ratio_match_the_reference(pair, deck_folder):
    model = deck_folder.model(pair, {"Material.Zone_2.Horizon_Mesh_Ratio": 3.2})
    body = model.particles[1]
    assert body.horizon == 3.2 * body.mesh_size
    assert_same_bonds(model)


def test_neighbors_lie_strictly_inside_the_horizon(deck_folder):
    # A grid of spacing 1/64 (exact in binary) and horizon 2/64: nodes at distance 1 and sqrt(2)
    # spacings are neighbours, those at exactly 2 are not; 8 for an inner node, 3 at a corner.
    side, h = 0.25, 1 / 64
    shape = {"Type": "rectangle", "Parameters": [0, 0, 0, side, side, 0]}
    deck = single_deck("", shape)
    deck["Mesh"]["Zone_1"] = {"Mesh_Size": h, "CreateMesh": {"Flag": True, "Geometry": shape}}
    model = deck_folder.model(deck, {"Material.Zone_1.Horizon": 2 * h})
    count = np.diff(model.bonds.offsets).reshape(17, 17)
    assert (count[1:-1, 1:-1] == 8).all()
    assert count[0, 0] == 3
    # V = h^2 inside; J = 12 (1 - r/eps). r = h: whole volume; r = sqrt(2) h < eps - h/2 too.
    m = sum(4 * r**2 * 12 * (1 - r / 2) for r in (1, np.sqrt(2))) * h**4
    inner = model.state.weighted_volume.reshape(17, 17)[2:-2, 2:-2]
    np.testing.assert_allclose(inner, m, rtol=1e-14)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nodal_volumes_match_the_reference_and_fill_the_body(deck_folder, dimension):
    if dimension == 2:
        mesh = disc_mesh(GRAIN_RADIUS, jiggle=0.2)
        shape = {"Type": "circle", "Parameters": [GRAIN_RADIUS]}
        whole = 18 * np.sin(np.pi / 18) * GRAIN_RADIUS**2  # the outline is a regular 36-gon
    else:
        mesh = box_mesh((1e-3, 2e-3, 1e-3), (4, 8, 4), jiggle=0.2)
        shape = {"Type": "cuboid", "Parameters": [1e-3, 2e-3, 1e-3]}
        whole = 2e-9
    name = deck_folder.mesh("body", mesh)
    model = deck_folder.model(single_deck(name, shape, Dimension=dimension))
    assert relative_error(model.state.volume, nodal_volumes(mesh.points, mesh.cells)) < 1e-14
    assert model.state.volume.sum() == pytest.approx(whole, rel=1e-13)


def test_scaled_and_turned_bodies_keep_the_shape_of_their_mesh(deck_folder):
    # X = site + s R(theta) X_mesh, V = s^d V_mesh with s = r / Parameters[0]
    deck = deck_folder.grains()
    deck_folder.places((0, 1e-3, 2e-3, 0, 0.5e-3, 0.7), (1, 0, 9e-3, 0, 3e-3, 0.0))
    model = deck_folder.model(deck)
    mesh = disc_mesh(GRAIN_RADIUS, jiggle=0.15, seed=1)
    c, s = 0.5 * np.cos(0.7), 0.5 * np.sin(0.7)
    turned = mesh.points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 0.5]]).T + [1e-3, 2e-3, 0]
    first = slice(0, len(mesh.points))
    np.testing.assert_allclose(model.state.x_ref[first], turned, rtol=1e-14, atol=1e-18)
    volumes = nodal_volumes(mesh.points, mesh.cells)
    np.testing.assert_allclose(model.state.volume[first], volumes / 4, rtol=1e-13)
    assert [body.bounding_radius for body in model.particles] == [0.5e-3, 3e-3]


@pytest.mark.parametrize("mode", ["corrected", "original"])
def test_mesh_size_and_center_node_match_the_reference(pair, deck_folder, mode):
    model = deck_folder.model(pair, compatibility=mode)
    for body, expected in zip(model.particles, ReferenceModel(model).bodies, strict=True):
        assert body.mesh_size == pytest.approx(expected.h, rel=1e-14)
        assert np.array_equal(body.center, model.state.x[expected.center])


def test_mesh_size_in_original_mode_is_the_running_fuzzy_minimum(deck_folder):
    # Distances in node order: 1, then 1 - 4e-6 (within 1e-5: ignored), then 1 - 12e-6 (taken).
    x = [0.0, 1.0, 2 - 4e-6, 3 - 16e-6]

    def size(mode, n):
        name = deck_folder.nodes("row", [(a, 0.0, 0.0) for a in x[:n]], [1.0] * n)
        deck = single_deck(name, {"Type": "circle", "Parameters": [4.0]})
        model = deck_folder.model(deck, {"Material.Zone_1.Horizon": 2.5}, compatibility=mode)
        return model.particles[0].mesh_size

    assert size("original", 3) == 1.0
    assert size("corrected", 3) == pytest.approx(1 - 4e-6, rel=1e-14)
    assert size("original", 4) == size("corrected", 4) == pytest.approx(1 - 12e-6, rel=1e-14)
