"""The balance of all energies, works and dissipations of a run.

Residuals are those of the integrator, second order in dt: these runs take a fifth of the stable
time step of a full contact, a tenth where bonds break.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import peridem as pd
import pytest
from modelling_parts import ARRAYS, SIZE, Block, Disc, glass
from reference import ReferenceModel

TOUGH = glass(fracture_energy=1e9)
BRITTLE = glass(bond_breaking="tension")


def impact(
    material: Any = TOUGH,
    velocity: Sequence[float] = (0, -5),
    dt: float | None = 5e-8,
    **options: Any,
) -> pd.DEMModel:
    """A disc that strikes another one off its centre."""
    contact = options.pop("contact", {})
    model = pd.DEMModel(gravity=(0, -10), dt=dt, **{"threads": 1, **options})
    for at, motion in (((0, 0), (0, 0)), ((3e-4, 2.15e-3), velocity)):
        model.add_particle(
            Disc(), material=material, mesh_size=SIZE, angle=0.3, at=at, velocity=motion
        )
    if contact:
        model.set_contact(**contact)
    return model


def pushed(velocity: Sequence[float], **contact: Any) -> pd.DEMModel:
    """A disc at rest that a moving wall strikes."""
    model = pd.DEMModel(gravity=(0, -10), dt=5e-8, threads=1)
    model.add_particle(Disc(), material=TOUGH, mesh_size=SIZE, name="disc")
    wall = model.add_wall(
        Block((4e-3, 5e-4)), material=TOUGH, mesh_size=SIZE, at=(0, -1.4e-3), fixed=False
    )
    model.prescribe(wall, velocity=velocity)
    if contact:
        model.set_contact(**contact)
    return model


def balance(model: pd.DEMModel, until: float = 1e-4) -> Any:
    """Energies by the input; the largest residual must be below 1e-3."""
    energy = model.run(until=until, record=["energy"], record_every=50).energy
    assert (energy["residual"] / energy["input"]).abs().max() < 1e-3
    return energy / energy["input"].iloc[-1]


SCHEMES = ["velocity_verlet", "central_difference"]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_balance_of_an_undamped_impact_closes(scheme: str) -> None:
    parts = balance(impact(scheme=scheme))
    assert parts["bond"].max() > 0.1  # the discs are squeezed
    assert parts["contact"].max() > 1e-3
    assert (parts[["damping", "friction", "fracture", "created"]] == 0).all(axis=None)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_balance_of_a_damped_impact_closes(scheme: str) -> None:
    contact = {"damping_ratio": 0.8, "damping_factor": 100}
    parts = balance(impact(scheme=scheme, contact=contact))
    assert 0.1 < parts["damping"].iloc[-1] < 0.9
    assert (parts["damping"].diff().dropna() >= 0).all()  # dampers only take


@pytest.mark.parametrize("friction_model", ["slip", "history"])
def test_balance_of_a_sliding_impact_closes(friction_model: str) -> None:
    contact = {"friction": 0.5, "friction_model": friction_model}
    parts = balance(impact(velocity=(3, -5), contact=contact))
    assert parts["friction"].iloc[-1] > 0.05


@pytest.mark.parametrize("scheme", SCHEMES)
def test_balance_of_a_fracturing_impact_closes(scheme: str) -> None:
    model = impact(BRITTLE, velocity=(0, -30), dt=2.5e-8, scheme=scheme)
    parts = balance(model)
    assert model.bonds.intact.mean() < 0.95
    assert parts["fracture"].iloc[-1] > 0.05
    assert (parts["fracture"].diff().dropna() >= 0).all()


def test_balance_of_a_crushed_grain_with_springs_of_broken_bonds_closes() -> None:
    parts = balance(impact(glass(), velocity=(0, -30), dt=2.5e-8))
    assert parts["self_contact"].max() > 1e-3
    assert parts["fracture"].iloc[-1] > 0.2


@pytest.mark.parametrize("law", [pd.PMBBond, pd.RNPBond])
def test_balance_of_bond_based_grains_closes(law: Any) -> None:
    material = law(density=1200, young_modulus=3e7, fracture_energy=20, horizon=6e-4)
    parts = balance(impact(material, velocity=(0, -5), dt=1.25e-8), until=5e-5)
    assert parts["fracture"].iloc[-1] > 0.02


def test_balance_with_a_moving_wall_closes() -> None:
    energy = pushed((0, 5)).run(until=1e-4, record=["energy"], record_every=50).energy
    assert (energy["residual"] / energy["input"]).abs().max() < 1e-3
    # What does not give way strikes the disc at 5 m/s: it leaves at 10 m/s but for its vibration,
    # and the force on the wall has done the work (momentum of the disc) times 5 m/s.
    mass = 1200 * np.pi * 1e-6
    assert energy["work_prescribed"].iloc[-1] == pytest.approx(mass * 10 * 5, rel=0.05)
    parts = balance(pushed((0, 5), friction=0.5, damping_ratio=0.8, damping_factor=100))
    assert parts["damping"].iloc[-1] > 0.01


def squeezed() -> pd.DEMModel:
    """A disc between two walls that close in at different speeds."""
    model = pd.DEMModel(dt=5e-8, threads=1)
    model.add_particle(Disc(), material=TOUGH, mesh_size=SIZE)
    for name, y, speed in (("below", -1.4e-3, 3.0), ("above", 1.4e-3, -5.0)):
        plate = Block((4e-3, 5e-4))
        wall = model.add_wall(
            plate, material=TOUGH, mesh_size=SIZE, at=(0, y), fixed=False, name=name
        )
        model.prescribe(wall, velocity=(0, speed))
    model.set_contact(friction=0.3, damping_ratio=0.8, damping_factor=100)
    return model


def test_work_of_walls_is_that_of_the_forces_that_hold_their_speed() -> None:
    def forces(model: pd.DEMModel) -> dict[str, float]:
        """Force on each wall, with the velocities that the dampers had in the step."""
        f = model.state.volume * model.state.f[:, 1]
        return {name: float(f[model.nodes_of(name)].sum()) for name in ("below", "above")}

    record = ["energy", forces, *(pd.recorders.work(name) for name in ("below", "above"))]
    model = squeezed()
    result = model.run(until=6e-5, record=record, record_every=1)
    works = pd.diagnostics.prescribed_work(model)
    for body, name, speed in ((1, "below", 3.0), (2, "above", -5.0)):
        # Nothing is accelerated: what holds the speed is the opposite of the force of contact,
        # and the sum of 1/2 (F_n + F_n+1) dx is the trapezoid rule.
        force = -result["forces"][name].to_numpy()
        expected = speed * model.dt * (force[1:] + force[:-1]).sum() / 2
        assert expected > 0
        assert works[body] == pytest.approx(expected, rel=1e-9)
        work = result[f"work_{name}"]["work"]
        assert work.iloc[-1] == works[body]
        assert pd.diagnostics.prescribed_work(model, name).tolist() == [works[body]]
    assert works[0] == 0
    assert works.sum() == pytest.approx(result.energy["work_prescribed"].iloc[-1], rel=1e-12)


def test_works_of_walls_go_on_from_a_checkpoint_bit_for_bit(tmp_path: Path) -> None:
    def table(model: pd.DEMModel, **options: Any) -> Any:
        record = [pd.recorders.work("below"), pd.recorders.work("above")]
        result = model.run(record=record, record_every=40, **options)
        return np.column_stack([result.work_below, result.work_above])

    whole = table(squeezed(), until=4e-5)
    table(squeezed(), steps=400, output=tmp_path, every=400, checkpoint_every=400)
    again = table(squeezed(), until=4e-5, output=tmp_path, every=400, resume=True)
    assert np.array_equal(again, whole)
    assert (whole[-1] > whole[10]).all()  # the walls press before and after


def test_work_of_walls_needs_accounts() -> None:
    with pytest.raises(pd.InputError, match=r"track_energy = False.*record 'energy'"):
        pd.diagnostics.prescribed_work(squeezed())


def test_balance_with_forces_and_a_sliding_wall_closes() -> None:
    model = pushed((3, 0), friction=0.5)
    model.apply_force("disc", density=lambda t: (0, -1e8 * np.sin(1e5 * t)))
    parts = balance(model, until=6e-5)
    assert parts["work_forces"].abs().max() > 0.01
    assert parts["friction"].iloc[-1] > 1e-3


def test_balance_of_a_fracturing_impact_in_3d_closes() -> None:
    model = pd.DEMModel(dimension=3, gravity=(0, 0, -10), dt=1e-7, threads=1)
    model.add_particle(Block((1e-3,) * 3), material=BRITTLE, mesh_size=2e-4, velocity=(10, 0, -20))
    model.add_wall(Block((1.4e-3, 1.4e-3, 4e-4)), material=TOUGH, mesh_size=2e-4, at=(0, 0, -9e-4))
    model.set_contact(friction=0.8, damping_ratio=0.9, damping_factor=0.05, stiffness_factor=100)
    parts = balance(model, until=4e-5)
    assert parts["friction"].iloc[-1] > 0.01
    assert parts["damping"].iloc[-1] > 0.01
    assert parts["fracture"].iloc[-1] > 0.01


def test_residual_is_second_order_in_the_time_step() -> None:
    # No contact and no fracture: a grain that vibrates, whose forces are smooth.
    def worst(dt: float) -> float:
        model = pd.DEMModel(dt=dt, threads=1)
        model.add_particle(Disc(), material=TOUGH, mesh_size=SIZE)
        model.init()
        model.state.v[:, :2] = 20 * model.state.x_ref[:, :2] / 1e-3 * [1, -1]
        energy = model.run(until=4e-5, record=["energy"], record_every=4e-6).energy
        assert energy["bond"].max() > 0.3 * energy["input"].iloc[0]
        return float((energy["residual"] / energy["input"]).abs().max())

    coarse, fine = worst(4e-7), worst(1e-7)  # half of the stable step, and an eighth
    assert coarse / fine == pytest.approx(16, rel=0.3)


def test_energies_are_those_of_the_reference_kernels(deck_folder: Any) -> None:
    deck = deck_folder.grains(offset=(3e-4, 2.1e-3), dt=5e-8)
    velocity = {"Velocity_Vector": [0, -30.0, 0], "Particle_List": [1]}
    deck["IC"] = {"Constant_Velocity": velocity}
    model = deck_folder.model(deck)
    model.step(400)
    reference = ReferenceModel(model)
    kinetic, strain, contact = reference.energy()
    found = pd.diagnostics.energies(model)
    assert model.bonds.intact.mean() < 0.99
    # Round-off of some 1e4 terms; the reference counts springs of broken bonds as strain.
    assert found["bond"] + found["self_contact"] == pytest.approx(strain, rel=1e-10)
    assert found["contact"] == pytest.approx(contact, rel=1e-10)
    assert found["kinetic"] == pytest.approx(kinetic, rel=1e-2)  # at half steps, and not


def test_tracking_changes_no_bit_and_threads_change_none_of_it() -> None:
    def run(threads: int, record: Sequence[str]) -> tuple[pd.DEMModel, Any]:
        contact = {"friction": 0.3, "damping_ratio": 0.8, "friction_model": "history"}
        model = impact(BRITTLE, (2, -30), 5e-8, threads=threads, contact=contact)
        return model, model.run(until=4e-5, record=record)

    (plain, _), (one, first), (three, second) = run(1, []), run(1, ["energy"]), run(3, ["energy"])
    for name in ARRAYS:
        assert np.array_equal(getattr(plain.state, name), getattr(one.state, name))
        assert np.array_equal(getattr(one.state, name), getattr(three.state, name))
    assert first.energy.equals(second.energy)
    assert first.energy["fracture"].iloc[-1] > 0


def test_energy_goes_on_from_a_checkpoint_bit_for_bit(tmp_path: Path) -> None:
    def model() -> pd.DEMModel:
        contact = {"friction": 0.3, "damping_ratio": 0.8, "friction_model": "history"}
        return impact(BRITTLE, (2, -30), 5e-8, contact=contact)

    options: dict[str, Any] = {"record": ["energy"], "record_every": 40}
    whole = model().run(until=4e-5, **options).energy
    first = model()
    first.run(steps=400, output=tmp_path, every=400, checkpoint_every=400, **options)
    again = model().run(until=4e-5, output=tmp_path, every=400, resume=True, **options)
    assert np.array_equal(again.energy.to_numpy(), whole.to_numpy())


def test_open_balance_is_told_in_the_summary() -> None:
    # Bonds that break when squeezed, and the default time step: stiff springs gain energy.
    model = pd.DEMModel(threads=1)
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE, velocity=(0, -35))
    model.add_wall(Block((4e-3, 5e-4)), material=TOUGH, mesh_size=SIZE, at=(0, -1.4e-3))
    with pytest.warns(pd.PeridemWarning, match="balance is open"):
        result = model.run(until=1e-4, record=["energy"])
    (text,) = result.summary["warnings"]
    assert "balance is open" in text
    assert "use a smaller dt" in text
    assert model.warnings == [text]
    assert impact().run(until=2e-5, record=["energy"]).summary["warnings"] == []


def test_default_time_step_bears_springs_of_broken_bonds_under_soft_contact() -> None:
    # Contact of a tenth of the stiffness bears 1.6 times the step, with which the springs between
    # the ends of broken bonds blow the run up: 320 times the input, as measured.
    model = impact(BRITTLE, velocity=(0, -30), dt=None, contact={"stiffness_factor": 0.1})
    energy = model.run(until=1e-4, record=["energy"]).energy
    limits = model.stable_time_step()
    assert limits.self_contact < 0.5 * min(limits.bonds, limits.contact)
    assert model.bonds.intact.mean() < 0.95
    assert (energy["residual"] / energy["input"]).abs().max() < 0.02  # 0.005


def test_created_energy_and_inverted_friction_are_told() -> None:
    quiet = {"input": 2.0, "residual": 1e-3, "created": 0.0, "friction": 0.1, "damping": 0.0}
    assert pd.diagnostics.energy_warnings(quiet) == []
    loud = {**quiet, "created": 0.1, "friction": -0.5, "residual": float("nan")}
    open_, created, friction = pd.diagnostics.energy_warnings(loud)
    assert "open by nan %" in open_
    assert "0.1 J, 5 %" in created
    assert "friction has given 0.5 J, 25 %" in friction


def test_springs_of_bonds_that_break_when_squeezed_are_told_as_created() -> None:
    # A bond that is squeezed to half of its length before it breaks leaves a stressed spring.
    material = glass(fracture_energy=4e3)
    model = impact(material, velocity=(0, -150), dt=5e-9)
    with pytest.warns(pd.PeridemWarning, match="bonds that broke when squeezed"):
        parts = balance(model, until=1.5e-5)
    assert parts["created"].iloc[-1] > 1e-3


def test_track_energy_without_record_and_what_is_told_without_it() -> None:
    model = impact()
    assert not model.track_energy
    assert "residual" not in pd.diagnostics.energies(model)
    model.track_energy = True  # accounts begin now
    model.step(200)
    found = pd.diagnostics.energies(model)
    assert abs(found["residual"]) < 1e-3 * found["input"]
    model.track_energy = False
    assert "residual" not in pd.diagnostics.energies(model)


def test_balance_sees_energy_that_nothing_accounts_for() -> None:
    # The residual is no identity: velocities that somebody else changes stay in it.
    model = impact()
    model.track_energy = True
    model.step(200)
    before = pd.diagnostics.energies(model)
    model.state.v[...] *= 0.9
    model.step(400)
    after = pd.diagnostics.energies(model)
    lost = (1 - 0.9**2) * before["kinetic"]
    assert lost > 0.1 * before["input"]
    # The forces of the moment, dt f . v / 2, keep it from being the square.
    assert after["residual"] == pytest.approx(-lost, rel=0.01)
