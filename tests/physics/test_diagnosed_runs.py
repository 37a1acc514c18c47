"""Momenta, fragments, contact networks and stresses against what they must be."""

from __future__ import annotations

from typing import Any

import numpy as np
import peridem as pd
import pytest
from modelling_parts import SIZE, Block, Disc, glass, two_discs
from peridem import diagnostics

TOUGH = glass(fracture_energy=1e9)


def test_momenta_of_a_spinning_disc_and_their_sum() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    for x, spin in ((-2e-3, 30.0), (2e-3, 0.0)):
        model.add_particle(
            Disc(), material=TOUGH, mesh_size=SIZE, at=(x, 1e-3), velocity=(1, 2), spin=spin
        )
    model.start()
    found = diagnostics.momenta(model)
    s: Any = model.state
    mass = s.volume * s.density
    one = slice(0, model.particle(0).stop)
    about = s.x[one] - found.loc[0, ["x", "y", "z"]].to_numpy(float)
    inertia = float(mass[one] @ (about**2).sum(axis=1))
    assert found["mass"].sum() == pytest.approx(mass.sum(), rel=1e-14)
    assert found.loc[0, "Sz"] == pytest.approx(30 * inertia, rel=1e-12)
    assert abs(found.loc[1, "Sz"]) < 1e-12 * found.loc[0, "Sz"]
    # L = S + x_c p, and the sums are those of the recorder
    body = found.loc[0]
    lever = body["x"] * body["py"] - body["y"] * body["px"]
    assert body["Lz"] == pytest.approx(body["Sz"] + lever, rel=1e-12)
    total = pd.recorders.momentum()(model)
    for name in ("px", "py", "Lz"):
        assert found[name].sum() == pytest.approx(total[name], rel=1e-12)


def cut(model: pd.DEMModel, x_cuts: list[float]) -> np.ndarray[Any, Any]:
    """Break the bonds across some lines x = const; return the strip of each node."""
    model.init()
    strip = np.searchsorted(x_cuts, model.state.x_ref[:, 0])
    i = np.repeat(np.arange(model.n_nodes), np.diff(model.bonds.offsets))
    model.set_intact(strip[i] == strip[model.bonds.indices])
    return strip


def test_fragments_of_a_body_cut_in_known_pieces_have_their_masses() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    bar = model.add_particle(Block((2e-3, 5e-4)), material=TOUGH, mesh_size=1e-4, velocity=(1, 2))
    model.add_wall(Block((2e-3, 5e-4)), material=TOUGH, mesh_size=1e-4, at=(0, -2e-3))
    strip = cut(model, [-5e-4 + 1e-9, 3e-4 + 1e-9])[bar.nodes]
    model.start()
    found = diagnostics.fragments(model)
    mass = (model.state.volume * model.state.density)[bar.nodes]
    # A wall is not looked at; numbers follow the first nodes, which are those of the left strip.
    assert np.array_equal(found.labels[bar.nodes], strip)
    assert (found.labels[model.particle(1).start :] == -1).all()
    assert np.array_equal(found.nodes, np.bincount(strip))
    np.testing.assert_allclose(found.masses, np.bincount(strip, mass), rtol=1e-14)
    np.testing.assert_allclose(found.velocities, [[1, 2, 0]] * 3, rtol=1e-12)
    x = np.bincount(strip, mass * model.state.x[bar.nodes, 0]) / found.masses
    np.testing.assert_allclose(found.centers[:, 0], x, rtol=1e-12)
    # The grading curve has all mass below the largest diameter, a known part below the second.
    curve = found.size_distribution()
    order = np.argsort(found.diameters)
    expected = np.cumsum(found.masses[order]) / found.masses.sum()
    np.testing.assert_allclose(curve["passing"], expected, rtol=1e-12)
    assert curve["count"].tolist() == [1, 2, 3]
    assert found.size_distribution([found.diameters.max() / 10])["passing"].tolist() == [0.0]
    assert found.per_body().loc[0, "fragments"] == 3
    large = diagnostics.fragments(model, bar, min_nodes=int(np.sort(found.nodes)[1]))
    assert len(large) == 2
    row = pd.recorders.fragments()(model)
    assert row["count"] == 3
    assert row["largest"] == pytest.approx(found.masses.max(), rel=1e-14)


def test_grading_of_fragments_is_recorded_over_time() -> None:
    # Three strips of a bar, of which the left one is cut in two on the way.
    model = pd.DEMModel(threads=1, dt=1e-7)
    bar = model.add_particle(Block((2e-3, 5e-4)), material=TOUGH, mesh_size=1e-4)
    cut(model, [-5e-4 + 1e-9, 3e-4 + 1e-9])
    strips = diagnostics.fragments(model)
    left, middle, right = strips.masses
    assert left < right < middle
    sizes = np.sort(strips.diameters)
    sieves = (sizes[0] * 0.5, sizes[0] * 0.999, *(sizes[1:] * 1.001))

    def halve(model: pd.DEMModel) -> None:
        if model.n == 10:
            cut(model, [-7e-4 + 1e-9, -5e-4 + 1e-9, 3e-4 + 1e-9])

    record = [pd.recorders.fragments(bar, sieves=sieves, name="pieces")]
    table = model.run(
        steps=20, record=record, record_every=5, callback=halve, callback_every=5
    ).pieces
    passing = table[[f"passing_{size:g}" for size in sieves]].to_numpy()
    assert table["count"].tolist() == [3, 3, 3, 4, 4]
    # Before the cut no piece is below the left strip; after it both of its halves are.
    whole = left + middle + right
    before = np.array([0, 0, left + right, whole]) / whole
    after = np.array([0, left, left + right, whole]) / whole
    np.testing.assert_allclose(passing, [before] * 3 + [after] * 2, rtol=1e-12)


def test_fragments_follow_a_body_whose_bonds_all_break() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    model.add_particle(Disc(), material=TOUGH, mesh_size=SIZE)
    assert len(diagnostics.fragments(model)) == 1
    model.set_intact(np.zeros(len(model.bonds)))
    found = diagnostics.fragments(model)
    assert len(found) == model.n_nodes
    assert np.array_equal(found.masses, model.state.volume * model.state.density)


def test_network_adds_up_to_the_forces_of_contact() -> None:
    model = two_discs(velocity=(1, -5))
    model.add_wall(Block((4e-3, 5e-4)), material=TOUGH, mesh_size=SIZE, at=(0, -1.36e-3))
    model.set_contact(friction=0.4, damping_ratio=0.8, node_damping=True)
    model.step(1)
    network = diagnostics.contact_network(model)
    for _ in range(60):
        model.step(10)
        network = diagnostics.contact_network(model)
        if len(network) >= 2 and (network.damping != 0).any() and (network.friction != 0).any():
            break
    assert len(network) == 2
    force = model.state.volume[:, None] * model.contact_forces()
    expected = [force[body.start : body.stop].sum(axis=0) for body in model.particles]
    found = network.forces_on_bodies()
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    # The middle disc touches the other one and the wall.
    assert sorted(network.coordination().tolist()) == [1, 1, 2]
    assert len(network.nodes) == network.contacts.sum()
    assert network.to_frame()["contacts"].sum() == len(network.nodes_to_frame())
    row = pd.recorders.coordination()(model)
    assert row["mean"] == 1.5  # of the discs, the wall does not count
    assert row["rattlers"] == 0.5


def test_chains_join_bodies_by_strong_contacts() -> None:
    m, n = 5, 6
    zero = np.zeros((m, 3))
    network = diagnostics.ContactNetwork(
        nodes=np.zeros((0, 2), int),
        normal=zero,
        friction=zero,
        node_damping=zero,
        points=zero,
        bodies=np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5]]),
        contacts=np.array([2, 1, 1, 3, 1]),
        force=zero,
        damping=zero,
        reaction=zero,
        normal_force=np.array([5.0, 6.0, 0.5, 4.0, 0.5]),  # mean 3.2
        places=zero,
        centers=np.zeros((n, 3)),
        is_wall=np.zeros(n, bool),
    )
    # 0-1-2 is a chain; 3-4 is strong, but two bodies are none.
    assert network.chains().tolist() == [0, 0, -1, -1, -1]
    assert network.chains(min_bodies=2).tolist() == [0, 0, -1, 1, -1]
    with pytest.raises(pd.InputError, match=r"factor = 0: must be positive"):
        network.chains(0)


def relax(model: pd.DEMModel, steps: int) -> None:
    """Take energy out until the model rests."""

    def calm(model: pd.DEMModel) -> None:
        model.state.v[...] *= 0.93

    model.run(steps=steps, callback=calm, callback_every=5)


@pytest.mark.parametrize("law", ["state", "bond"])
def test_stress_in_a_stretched_bar_is_force_by_section(law: str) -> None:
    bond = pd.PMBBond(density=1200, young_modulus=3e7, fracture_energy=1e9, horizon=6e-4)
    material = TOUGH if law == "state" else bond
    length, height, pull = 3e-3, 1e-3, 10.0  # a strain of 3e-4: the shape stays
    model = pd.DEMModel(threads=1, dt=1e-7 if law == "state" else 2e-8)
    bar = model.add_particle(Block((length, height)), material=material, mesh_size=2e-4)
    model.init()
    x, volume = model.state.x_ref[:, 0], model.state.volume
    ends = [np.abs(x - end) < 1e-9 for end in (-length / 2, length / 2)]
    model = pd.DEMModel(threads=1, dt=model.dt)
    bar = model.add_particle(Block((length, height)), material=material, mesh_size=2e-4)
    density = np.zeros((len(x), 2))
    for nodes, sign in zip(ends, (-1, 1), strict=True):
        density[nodes, 0] = sign * pull / (nodes.sum() * volume[nodes])  # alike on all: no couple
    model.apply_force(bar, density=lambda t: density)
    relax(model, 4000)
    # The mean over the bar is exact at rest: V sigma = sum of F x = pull length (Bagi 1996).
    mean = diagnostics.body_stress(model)[0]
    expected = pull * length / (length * height)
    assert mean[0, 0] == pytest.approx(expected, rel=1e-3)
    assert abs(mean[1, 1]) < 1e-3 * expected
    assert abs(mean[0, 1]) < 1e-3 * expected
    # In the middle third, away from the ends: force by section. Which nodes are in the box is
    # a matter of 5 % of its nodes (5 columns of 6, moved by 15 % of their distance).
    box = ((-5e-4, -height), (5e-4, height))
    area = float(volume[(x >= -5e-4) & (x < 5e-4)].sum())
    middle = diagnostics.bulk_stress(model, box, volume=area)
    assert middle[0, 0] == pytest.approx(expected, rel=0.05)
    row = pd.recorders.stress(box, volume=area)(model)
    assert row["xx"] == pytest.approx(middle[0, 0], rel=1e-12)
    assert row["pressure"] == pytest.approx(-(middle[0, 0] + middle[1, 1]) / 2, rel=1e-12)


@pytest.mark.filterwarnings("ignore:.*start in contact:peridem.PeridemWarning")  # on purpose
def test_stress_of_two_discs_pressed_together() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    gap = 0.9 * 0.95 * SIZE
    push = 1e5
    for x, sign in ((-1e-3 - gap / 2, 1), (1e-3 + gap / 2, -1)):
        disc = model.add_particle(Disc(jiggle=0), material=TOUGH, mesh_size=SIZE, at=(x, 0))
        model.apply_force(disc, density=(sign * push, 0))
    relax(model, 10000)
    network = diagnostics.contact_network(model)
    total = push * model.particle(0).volume
    np.testing.assert_allclose(network.force, [[-total, 0, 0]], rtol=1e-3, atol=1e-3 * total)
    # The contact force P at a distance R of the centre and a uniform force on the disc against it:
    # V sigma = -P R, and P = push V. Nodes of the outline are at R but for some flattening.
    for body in range(2):
        inside, outside = (
            diagnostics.body_stress(model)[body],
            diagnostics.contact_stress(model)[body],
        )
        assert outside[0, 0] == pytest.approx(-push * 1e-3, rel=0.02)
        # The virial has besides half of the contact's: P (gap between nodes) / 2.
        nodes = network.nodes
        spans = np.abs(np.diff(model.state.x[nodes, 0], axis=1)[:, 0])
        half = 0.5 * (np.abs(network.normal[:, 0]) @ spans) / model.particle(body).volume
        assert inside[0, 0] == pytest.approx(outside[0, 0] - half, rel=2e-3)
        assert abs(inside[1, 1] - outside[1, 1]) < 2e-3 * push * 1e-3


def test_stress_of_a_block_between_plates_is_their_force_by_the_section() -> None:
    # Uniaxial compression without friction: force P on either plate, sigma_yy = -P / width in the
    # block and none across, however the force is spread over the nodes in contact. The plates'
    # nodes are so close that the plates are smooth, but for 1 % of the force.
    side, gap, thick = 2e-3, 1e-4, 1e-4
    model = pd.DEMModel(threads=1, dt=1e-7)
    block = model.add_particle(Block((side, side)), material=TOUGH, mesh_size=2e-4)
    plate, place = Block((3e-3, thick)), side / 2 + gap + thick / 2
    options: dict[str, Any] = {"material": TOUGH, "mesh_size": 4e-5}
    model.add_wall(plate, at=(0, -place), name="below", **options)
    model.add_wall(plate, at=(0, place), name="above", fixed=False, **options)
    model.set_contact(radius=gap)
    model.prescribe("above", displacement=lambda t: (0, -4e-5 * min(1.0, t / 2e-4)))
    relax(model, 12000)
    volume = model.state.volume
    force = volume[:, None] * model.contact_forces()
    below, above = (force[model.nodes_of(name)].sum(axis=0) for name in ("below", "above"))
    load = float(above[1])
    assert load > 0
    np.testing.assert_allclose(below, [0, -load, 0], atol=0.02 * load)
    assert below[1] == pytest.approx(-load, rel=1e-3)
    width = volume[block.nodes].sum() / np.ptp(model.state.x[block.nodes, 1])  # as squeezed
    expected = -load / width
    assert abs(expected) > 1e-3 * 2.16e7  # of K
    outside, inside = diagnostics.contact_stress(model)[0], diagnostics.body_stress(model)[0]
    # To the outline's nodes, which the plates do not press all alike: they are 1 % of the height
    # from their mean. The virial has half of the gaps besides, 2 x 0.1 mm / 2 of 2 mm.
    assert outside[1, 1] == pytest.approx(expected, rel=0.01)
    assert inside[1, 1] == pytest.approx(expected * (1 + gap / side), rel=0.02)
    for stress in (outside, inside):
        assert abs(stress[0, 0]) < 0.02 * abs(expected)
        assert abs(stress[0, 1]) < 0.02 * abs(expected)
    np.testing.assert_allclose(diagnostics.bulk_stress(model), inside, rtol=1e-12, atol=1e-9)
    # In the middle half of the height, where no contact is: force by section at every height.
    box = ((-side, -side / 4), (side, side / 4))
    chosen = np.abs(model.state.x[block.nodes, 1]) < side / 4
    area = float(volume[block.nodes][chosen].sum())
    middle = diagnostics.bulk_stress(model, box, volume=area)
    assert middle[1, 1] == pytest.approx(expected, rel=0.02)


def approaching(*, wall: bool, damping_ratio: float = 0.5) -> pd.DEMModel:
    """A disc that has come within reach of another one, or of a wall, at 1 m/s."""
    model = pd.DEMModel(threads=1, dt=1e-7)
    reach = (0.4 if wall else 0.7) * SIZE
    disc = Disc(jiggle=0)
    model.add_particle(disc, material=TOUGH, mesh_size=SIZE, velocity=(0.3, 1), at=(0, 0))
    if wall:
        at = (0, 1e-3 + reach + 2.5e-4)
        model.add_wall(Block((4e-3, 5e-4)), material=TOUGH, mesh_size=SIZE, at=at)
    else:
        towards = np.array([np.cos(np.radians(80)), np.sin(np.radians(80))])  # of nodes
        at = tuple((2e-3 + reach) * towards)
        model.add_particle(disc, material=TOUGH, mesh_size=SIZE, at=at)
    model.set_contact(
        friction=0.4, damping_ratio=damping_ratio, damping_factor=100, node_damping=True
    )
    model.start()
    return model


def test_bulk_stress_is_the_virial_of_all_forces_dampers_too() -> None:
    # Without anything outside V sigma = sum over pairs of F_ij x (x_j - x_i) = -sum of F_i x x_i.
    model = approaching(wall=False)
    network = diagnostics.contact_network(model)
    # Weaker than the springs, but over 2 mm instead of 0.1 mm: a tenth of the stress.
    assert np.linalg.norm(network.damping) > 1e-3 * np.linalg.norm(network.force) > 0
    s: Any = model.state
    expected = -np.einsum("n,ni,nj->ij", s.volume, s.f, s.x) / s.volume.sum()
    found = diagnostics.bulk_stress(model)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    # Half of the damper's part is in either body: the sum over two boxes is that of all.
    middle = float(model.state.x[:, 1].mean())
    boxes = [((-1, -1), (1, middle)), ((-1, middle), (1, 1))]
    halves = [diagnostics.bulk_stress(model, box, volume=1) for box in boxes]
    np.testing.assert_allclose(sum(halves) / s.volume.sum(), found, rtol=1e-12)
    for half in halves:
        assert half[1, 1] == pytest.approx(0.5 * found[1, 1] * s.volume.sum(), rel=0.05)


def test_dampers_of_a_wall_press_on_the_bulk_but_not_inside_the_body() -> None:
    damped = approaching(wall=True)
    free = approaching(wall=True, damping_ratio=1)
    network = diagnostics.contact_network(damped)
    push = float(network.damping[0, 1])  # on the disc, away from the wall above
    assert push < 0
    # From the place of contact, half a gap from the outline, to the centre: -F (R + gap/2).
    change = diagnostics.bulk_stress(damped) - diagnostics.bulk_stress(free)
    node_part = diagnostics.body_stress(damped) - diagnostics.body_stress(free)
    lever = 1e-3 + 0.2 * SIZE
    expected = push * lever / damped.particle(0).volume
    assert change[1, 1] - node_part[0, 1, 1] == pytest.approx(expected, rel=0.02)
    # On the disc's own nodes it acts alike, with no moment about the centre.
    of_disc = diagnostics.contact_stress(damped)[0] - diagnostics.contact_stress(free)[0]
    nodes = network.nodes
    arm = damped.state.x[nodes[:, 0]] - network.centers[0]
    by_nodes = np.einsum("ki,kj->ij", network.node_damping, arm) / damped.particle(0).volume
    np.testing.assert_allclose(of_disc, by_nodes, atol=1e-9 * abs(expected))


def test_virial_of_bonds_is_that_of_their_forces() -> None:
    # sum over pairs of F_ij (x_j - x_i) = -sum of F_i x_i, broken and squeezed bonds included.
    model = pd.DEMModel(threads=1, dt=1e-7)
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE, angle=0.4)
    model.init()
    random = np.random.default_rng(3)
    u = np.zeros((model.n_nodes, 3))
    u[:, :2] = 0.3 * SIZE * random.uniform(-1, 1, (model.n_nodes, 2))
    model.state.u[...], model.state.x[...] = u, model.state.x_ref + u
    model.compute_forces()
    s: Any = model.state
    assert 0.01 < model.bonds.intact.mean() < 0.99
    expected = -np.einsum("n,ni,nj->ij", s.volume, s.f, s.x)
    found = np.einsum("n,nij->ij", s.volume, diagnostics.node_stress(model))
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_pressure_of_a_gas_of_grains_is_kinetic() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    for x, v in ((-4e-3, 3.0), (4e-3, -3.0)):
        model.add_particle(Disc(), material=TOUGH, mesh_size=SIZE, at=(x, 0), velocity=(v, 0))
    model.start()
    area = 1e-4
    found = diagnostics.bulk_stress(model, volume=area, kinetic=True)
    mass = float(model.state.volume @ model.state.density)
    assert found[0, 0] == pytest.approx(-mass * 9 / area, rel=1e-12)


def test_wrong_regions_are_refused() -> None:
    model = two_discs()
    with pytest.raises(pd.InputError, match="region"):
        diagnostics.bulk_stress(model, ((0, 0), (0, 1)))
    with pytest.raises(pd.InputError, match=r"volume = -1\.0: must be positive"):
        diagnostics.bulk_stress(model, volume=-1)
    with pytest.raises(pd.InputError, match="min_nodes = 0"):
        diagnostics.fragments(model, min_nodes=0)


def test_recorders_of_diagnostics_have_names() -> None:
    names = ["energy", "fragments", "coordination", "network", "stress"]
    assert set(names) <= set(pd.recorders.names())
    result = two_discs().run(until=2e-5, record=names)
    assert result.network["pairs"].max() == 1
    assert result.coordination["mean"].max() == 1
    assert result.fragments["count"].iloc[0] == 2
    assert list(result.stress.columns) == ["xx", "yy", "xy", "pressure"]
