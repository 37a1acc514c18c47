"""What is checked before the first step: overlap, time step, ids, container."""

import re

import numpy as np
import peridem as pd
import pytest
from helpers import GRAIN_RADIUS, disc_mesh, single_deck
from modelling_parts import mesh_of
from peridem import DEMModel, packing
from peridem.checks import check_model
from peridem.errors import InputError
from peridem.overlaps import find_overlaps

R = GRAIN_RADIUS
SPACING = R / 6  # of the rings of a disc, the smallest distance of its nodes without jiggle


def grains(deck_folder, offset, **changes):
    """Two equal discs without jiggle, not turned; their nearest nodes are offset - 2 R apart."""
    deck = deck_folder.grains()
    deck_folder.mesh("disc_6_1", disc_mesh(R))
    deck_folder.mesh("disc_6_2", disc_mesh(R))
    deck_folder.places((0, 0, 0, 0, R, 0), (1, *offset, 0, R, 0))
    return deck_folder.write({**deck, **changes})


def initialised(path, **options):
    model = DEMModel.from_deck(path, threads=1, **options)
    model.init()
    return model


@pytest.mark.parametrize(("fraction", "overlap"), [(0.501, False), (0.499, True)])
def test_nodes_overlap_below_half_the_contact_radius(deck_folder, fraction, overlap):
    # Rc = 0.95 h (helpers.CONTACT); both discs have a node on the x axis
    path = grains(deck_folder, (2 * R + fraction * 0.95 * SPACING, 0))
    model = initialised(path, allow_overlap=True)
    found = find_overlaps(model)
    assert len(found) == overlap
    if overlap:
        # nodes 91 = 1 + 3 5 6 and 91 + 18 of the outer ring lie at angles 0 and pi
        assert (found[0].bodies, found[0].nodes) == ((0, 1), (91, 109))
        assert found[0].distance == pytest.approx(fraction * 0.95 * SPACING, rel=1e-9)
        assert not found[0].inside


def test_node_inside_an_element_is_an_overlap(deck_folder):
    # Nodes of one disc in the middles of the elements of the other, farther than Rc/2 from
    # every node when the contact radius is small.
    path = grains(deck_folder, (1.5 * R, 0.4 * SPACING))
    text = path.read_text().replace('"Contact_Radius_Factor": 0.95', '"Contact_Radius_Factor": 0.1')
    path.write_text(text)
    with pytest.raises(InputError, match="inside an element"):
        initialised(path)


def test_refused_overlap_names_bodies_distance_and_remedy(deck_folder):
    path = grains(deck_folder, (2 * R + 0.25 * SPACING, 0))
    with pytest.raises(InputError) as caught:
        initialised(path)
    text = str(caught.value)
    places = deck_folder.folder / "places.csv"
    assert text.startswith(f"{places}:2: bodies 0 and 1 (from {places}:3) overlap at the start: ")
    assert "distance = 4.17e-05 m between their nodes 91 and 109" in text  # R / 24
    assert "must be at least 0.5 of the contact radius 0.000158 m" in text  # 0.95 R / 6
    assert "--allow-overlap" in text


@pytest.mark.parametrize(("fraction", "warns"), [(0.501, True), (0.985, True), (0.995, False)])
def test_bodies_that_start_in_contact_are_warned_of(deck_folder, fraction, warns):
    # From 0.99 of the contact radius Rc = 0.95 h on, what the springs hold does not matter.
    radius = 0.95 * SPACING
    path = grains(deck_folder, (2 * R + fraction * radius, 0))
    found = [text for text in initialised(path).warnings if "start in contact" in text]
    places = deck_folder.folder / "places.csv"
    expected = (
        f"{places}:2: bodies 0 and 1 (from {places}:3) start in contact: "
        f"distance = {fraction * radius:.3g} m between their nodes 91 and 109: is below the "
        f"contact radius {radius:.3g} m, so that they push each other apart at once; move them "
        f"{(1 - fraction) * radius:.2g} m apart (a packing: gap = {radius:.3g} or more), or give a "
        "smaller contact radius"
    )
    assert found == ([expected] if warns else [])


def test_bodies_that_do_not_repel_may_start_within_the_contact_radius(deck_folder):
    deck = deck_folder.grains()
    for contact in deck["Contact"].values():
        contact["Kn_Factor"] = 0
    offset = (2 * R + 0.9 * 0.95 * SPACING, 0)
    model = initialised(grains(deck_folder, offset, Contact=deck["Contact"]))
    assert model.contact_stiffness(0, 1) == 0
    assert model.warnings == []


def test_many_bodies_that_start_in_contact_are_counted_nearest_first():
    mesh = mesh_of(disc_mesh(R))
    model = pd.DEMModel(threads=1)
    glass = pd.PDState(
        density=1200, young_modulus=3e7, poisson_ratio=0.2, fracture_energy=50, horizon=R / 2
    )
    radius = 0.95 * SPACING
    gaps = [0.9, 0.6, 0.8, 0.7, 0.95]  # from each disc to the next one
    for k in range(6):
        x = 2 * R * k + radius * sum(gaps[:k])
        model.add_particle(mesh=mesh, at=(x, 0), material=glass, name=f"disc-{k}")
    model.init()
    found = [text for text in model.warnings if "in contact" in text]
    assert [re.findall("disc-.", text.partition(" start")[0]) for text in found[:3]] == [
        ["disc-1", "disc-2"],
        ["disc-3", "disc-4"],
        ["disc-2", "disc-3"],
    ]
    assert found[3:] == ["and 2 more pairs of bodies start in contact"]


@pytest.mark.parametrize("place", [packing.hexagonal, packing.grid])
def test_gap_that_the_refusal_of_a_packing_names_is_enough(place):
    glass = pd.PDState(
        density=1200, young_modulus=3e7, poisson_ratio=0.2, fracture_energy=50, horizon=0.9e-3
    )
    disc = pd.Circle(radius=1e-3)

    def model(gap):
        made = pd.DEMModel(threads=1)
        grains = place(disc, cells=(3, 3), gap=gap)
        made.add_particles(grains, material=glass, mesh_size=0.3e-3)
        return made

    with pytest.raises(InputError, match="overlap at the start") as caught:
        model(0.0).init()
    (gap,) = set(re.findall(r"\(a packing: gap = (\S+) or more\)", str(caught.value)))
    apart = model(float(gap))
    apart.init()
    assert apart.warnings == []


def test_init_refuses_again_after_a_refusal(deck_folder):
    model = DEMModel.from_deck(grains(deck_folder, (R, 0)), threads=1)
    for _ in range(2):
        with pytest.raises(InputError, match="overlap"):
            model.init()


def test_allowed_overlap_runs(deck_folder):
    model = initialised(grains(deck_folder, (2 * R + 0.25 * SPACING, 0)), allow_overlap=True)
    model.step(1)
    # the discs push each other apart
    assert model.state.v[model.particles[1].start :, 0].max() > 0


@pytest.mark.parametrize("flag", ["Is_Wall", "All_Dofs_Constrained"])
def test_walls_and_bodies_that_never_move_may_overlap(deck_folder, flag):
    deck = deck_folder.grains(offset=(R, 0))
    for zone in ("Zone_1", "Zone_2"):
        deck["Particle"][zone] = {**deck["Particle"][zone], flag: True}
        deck["Zone"][zone] = {}
    path = deck_folder.write(deck)
    assert find_overlaps(initialised(path)) == []


def test_a_body_in_the_hole_of_another_does_not_overlap(deck_folder):
    # a ring: the disc without the elements within 0.7 R
    mesh = disc_mesh(R, 12)
    far = np.linalg.norm(mesh.points[mesh.cells].mean(axis=1), axis=1) > 0.7 * R
    used, cells = np.unique(mesh.cells[far], return_inverse=True)
    ring = type(mesh)(mesh.points[used], cells.reshape(-1, 3))
    deck = deck_folder.grains()
    deck_folder.mesh("disc_6_1", ring)
    deck_folder.mesh("disc_6_2", disc_mesh(R))
    deck_folder.places((0, 0, 0, 0, R, 0), (1, 0, 0, 0, 0.4 * R, 0))
    deck["Material"]["Zone_2"] = {**deck["Material"]["Zone_2"], "Horizon": 3e-4}
    assert find_overlaps(initialised(deck_folder.write(deck))) == []


def with_time_step(deck_folder, dt, kn_factor=0.01):
    """Two grains; with a hundredth of the stiffness, contact is stable at steps of the bonds."""
    deck = deck_folder.grains(dt=dt)
    for contact in deck["Contact"].values():
        contact["Kn_Factor"] = kn_factor
    return deck_folder.write(deck)


def test_time_step_above_the_bonds_limit_is_a_warning_and_strictly_an_error(deck_folder):
    limit = initialised(with_time_step(deck_folder, 1e-7)).stable_time_step().bonds
    path = with_time_step(deck_folder, 1.01 * limit)
    (warning,) = initialised(path).warnings
    line = next(
        n for n, text in enumerate(path.read_text().splitlines(), 1) if "Time_Steps" in text
    )
    assert warning.startswith(f"{path.name}:{line}: Model.Time_Steps = 1000: the time step ")
    assert warning.endswith("use at least 1010")  # 1000 steps, 1.01 times too long
    with pytest.raises(InputError, match="is above the estimated stable one"):
        initialised(path, strict=True)


def test_time_step_below_the_bonds_limit_is_silent(deck_folder):
    limit = initialised(with_time_step(deck_folder, 1e-7)).stable_time_step().bonds
    assert initialised(with_time_step(deck_folder, 0.99 * limit), strict=True).warnings == []


def test_time_step_above_that_of_springs_of_broken_bonds_is_a_note(deck_folder):
    limit = initialised(with_time_step(deck_folder, 1e-7)).stable_time_step()
    assert limit.self_contact < 0.5 * min(limit.bonds, limit.contact)  # contact is soft here
    path = with_time_step(deck_folder, 1.02 * limit.self_contact)
    model = initialised(path, strict=True)
    (note,) = model.notes
    assert model.warnings == []
    assert "stable one of the springs between the ends of broken bonds" in note
    assert "if bonds break and their ends are pressed together" in note
    assert initialised(with_time_step(deck_folder, 0.99 * limit.self_contact)).notes == []


def test_time_step_a_little_above_the_contact_limit_is_a_note(deck_folder):
    limit = initialised(with_time_step(deck_folder, 1e-7, 1.0)).stable_time_step()
    assert limit.contact < 0.5 * limit.bonds  # the stiffness of the paper: contact decides
    for factor in (1.01, 1.49):
        path = with_time_step(deck_folder, factor * limit.contact, 1.0)
        model = initialised(path, strict=True)
        assert model.warnings == []
        (note,) = model.notes
        assert "is above the estimated stable one of two nodes in full contact" in note
        assert "if bodies rebound too fast" in note
    model = initialised(with_time_step(deck_folder, 0.99 * limit.contact, 1.0))
    assert (model.warnings, model.notes) == ([], [])


def test_time_step_far_above_the_contact_limit_is_a_warning_and_strictly_an_error(deck_folder):
    limit = initialised(with_time_step(deck_folder, 1e-7, 1.0)).stable_time_step().contact
    path = with_time_step(deck_folder, 1.51 * limit, 1.0)
    model = initialised(path)
    (warning,) = model.warnings
    assert model.notes == []
    assert "is above the estimated stable one of two nodes in full contact" in warning
    assert warning.endswith("use at least 1510, or a smaller Kn")  # 1000 steps, 1.51 times too long
    with pytest.raises(InputError, match="two nodes in full contact"):
        initialised(path, strict=True)


def lone_nodes(deck_folder, lone, **particle):
    """A row of 4 nodes 1 apart (times 0.1 mm) and `lone` ones, 5 apart; horizon 2."""
    h = 1e-4
    x = [*range(4), *(3 + 5 * (k + 1) for k in range(lone))]
    # two rows, so that the body has an area
    points = [(k * h, y * h, 0.0) for k in x for y in (0, 4)]
    name = deck_folder.nodes("row", points, [h * h] * len(points))
    deck = single_deck(name, {"Type": "rectangle", "Parameters": [0.01, 0.01], **particle})
    deck["Material"]["Zone_1"] = {**deck["Material"]["Zone_1"], "Horizon": 2 * h}
    return deck_folder.write(deck)


def test_nodes_without_neighbours_are_a_warning(deck_folder):
    path = lone_nodes(deck_folder, 2)
    line = next(n for n, text in enumerate(path.read_text().splitlines(), 1) if "Horizon" in text)
    (warning,) = initialised(path).warnings
    assert warning.startswith(
        f"{path.name}:{line}: Material.Zone_1.Horizon: 4 nodes of the zone have no neighbour "
        "within the horizon 0.0002 m"
    )
    assert "h = 0.0001 m" in warning


def test_body_with_most_nodes_without_neighbours_is_refused(deck_folder):
    assert len(initialised(lone_nodes(deck_folder, 4)).warnings) == 1  # half of them: 8 of 16
    path = lone_nodes(deck_folder, 5)
    with pytest.raises(InputError, match="Horizon: 10 of the 18 nodes of body 0 have no neighb"):
        initialised(path)


def test_nodes_of_a_body_that_never_moves_need_no_neighbours(deck_folder):
    assert initialised(lone_nodes(deck_folder, 5, All_Dofs_Constrained=True)).warnings == []


def test_checks_of_the_model_are_reported_together(deck_folder):
    path = grains(deck_folder, (2 * R + 0.25 * SPACING, 0))
    text = path.read_text().replace('"Time_Steps": 1000', '"Time_Steps": 1')
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        initialised(path, strict=True)
    assert "overlap at the start" in str(caught.value)
    assert "is above the estimated stable one, " in str(caught.value)


def test_body_of_a_compressive_test_must_exist(deck_folder):
    deck = deck_folder.grains()
    deck["Particle"]["Test_Name"] = "compressive_test"
    test = {"Particle_Id": 2, "Particle_Force_Direction": 2}
    deck["Particle"]["Compressive_Test"] = test
    with pytest.raises(
        InputError, match="Particle_Id = 2: no such body: the deck has bodies 0 to 1"
    ):
        initialised(deck_folder.write(deck))


def test_particle_outside_the_container_is_a_warning(deck_folder):
    deck = deck_folder.grains()
    deck["Container"] = {"Geometry": {"Type": "circle", "Parameters": [1.5 * R, 0, 0, 0]}}
    (warning,) = initialised(deck_folder.write(deck)).warnings
    assert "Container.Geometry: the centre of body 1 is outside" in warning


def test_hollow_container_is_taken_as_its_box(deck_folder):
    deck = deck_folder.grains()
    deck["Container"] = {
        "Geometry": {
            "Type": "complex",
            "Vec_Type": ["circle", "circle"],
            "Vec_Flag": ["plus", "minus"],
            "Parameters": [5 * R, 0, 0, 0, 4 * R, 0, 0, 0],
        }
    }
    assert initialised(deck_folder.write(deck)).warnings == []


def test_check_model_returns_what_init_keeps(deck_folder):
    deck = deck_folder.grains()
    deck["Container"] = {"Geometry": {"Type": "circle", "Parameters": [1.5 * R, 0, 0, 0]}}
    model = initialised(deck_folder.write(deck))
    assert check_model(model) == model.warnings


def test_horizon_wider_than_a_body_is_a_warning(deck_folder):
    # 0.6 m for 0.6 mm: a wrong unit.
    model = deck_folder.model(deck_folder.grains(), {"Material.Zone_2.Horizon": 0.6})
    (warning,) = [text for text in model.warnings if "wider" in text]
    assert "Material.Zone_2.Horizon: the horizon 0.6 m is wider than body 1" in warning
    assert "of radius 0.001 m" in warning
    assert "check the unit" in warning
