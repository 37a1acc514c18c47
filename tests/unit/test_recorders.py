"""Recorders and what a run hands back: values derived by other ways, files, names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest
from modelling_parts import SIZE, Block, Disc, glass, two_discs


def test_momentum_position_and_velocity_of_free_flight() -> None:
    model = pd.DEMModel(gravity=(0, -10), dt=1e-6, threads=1)
    grain = model.add_particle(
        Disc(), material=glass(), mesh_size=SIZE, at=(0, 5e-3), velocity=(2, 1), spin=10.0
    )
    record = ["momentum", "kinetic_energy", pd.recorders.position(grain), pd.recorders.velocity(0)]
    with pytest.warns(pd.PeridemWarning, match="above the estimated stable one"):
        result = model.run(until=1e-4, record=record, record_every=10)
    s = model.state
    mass = float(s.density @ s.volume)
    start = (s.density * s.volume) @ s.x_ref / mass
    t = result.momentum.index.to_numpy()
    assert np.allclose(t, np.arange(11) * 1e-5, rtol=1e-12)
    # A free fall, exact in the velocities of velocity Verlet but for round-off of 100 steps.
    assert np.allclose(result.momentum["px"], 2 * mass, rtol=1e-12)
    assert np.allclose(result.momentum["py"], mass * (1 - 10 * t), rtol=1e-12)
    assert np.allclose(result.velocity_0[["x", "y"]].T, [2 + 0 * t, 1 - 10 * t], rtol=1e-12)
    place = result["position_disc"]
    assert np.allclose(place["x"], start[0] + 2 * t, rtol=0, atol=1e-15)
    assert np.allclose(place["y"], start[1] + t - 5 * t**2, rtol=0, atol=1e-15)
    # By Konig's theorem at the start; the angular momentum of the flight obeys dL/dt = x m g.
    inertia = (s.density * s.volume) @ ((s.x_ref - start) ** 2).sum(axis=1)
    energy = 0.5 * mass * 5 + 0.5 * inertia * 100
    assert result.kinetic_energy["kinetic_energy"].iloc[0] == pytest.approx(energy, rel=1e-12)
    angular = mass * (start[0] * 1 - start[1] * 2) + inertia * 10
    expected = angular - 10 * mass * (start[0] * t + t**2)
    assert np.allclose(result.momentum["Lz"], expected, rtol=1e-10)


def test_reaction_is_the_force_that_pushes_back() -> None:
    model = two_discs(velocity=(0, -5))
    lower, upper = model.body("lower"), model.body("upper")
    r = pd.recorders.reaction
    result = model.run(
        until=4e-5, record=[r(lower), r(upper, name="top"), r([lower, upper], name="both")]
    )
    a, b, both = (result[name].to_numpy() for name in ("reaction_lower", "top", "both"))
    assert a[:, 1].min() < -1.0  # the disc above has struck
    # Forces between nodes are opposite: F_ij V_i = -F_ji V_j; so are those of the damping.
    assert np.abs(a + b).max() < 1e-12 * np.abs(a).max()
    assert np.abs(both).max() < 1e-12 * np.abs(a).max()


def test_damage_and_contacts_count() -> None:
    model = two_discs(velocity=(0, -40))
    result = model.run(until=6e-5, record=["damage", "contacts"])
    bonds = model.bonds
    broken = int((bonds.intact == 0).sum()) // 2
    assert broken > 0
    assert result.damage["broken"].iloc[-1] == broken
    assert result.damage["fraction"].iloc[-1] == broken / (len(bonds.intact) // 2)
    assert result.damage["broken"].is_monotonic_increasing
    contacts = result.contacts
    assert contacts["bodies"].max() == 1
    pairs = model.touching_nodes()
    x = model.state.x
    distance = np.linalg.norm(x[:127, None] - x[None, 127:], axis=2)
    clearly = np.argwhere(distance < model.contact_radius(0, 1) * (1 - 2e-5))  # the test is fuzzy
    assert {(i, j + 127) for i, j in clearly} <= {(i, j) for i, j in pairs}
    assert contacts["nodes"].iloc[-1] == len(pairs)


def test_recorders_of_any_kind_give_tables() -> None:
    class Two:
        name = "two"
        columns = ("a", "b")
        every = 2e-6  # seconds

        def __call__(self, model: pd.DEMModel) -> tuple[float, float]:
            return model.time, 2 * model.time

    def fastest(model: pd.DEMModel) -> float:
        return float(np.abs(model.state.v).max())

    model = two_discs()
    result = model.run(
        until=1e-5,
        every=50,
        record=[Two(), fastest, lambda model: {"n": model.n}, lambda model: [1, 2]],
    )
    assert list(result.tables) == ["two", "fastest", "recorder_3", "recorder_4"]
    assert result.two.index.tolist() == pytest.approx([k * 2e-6 for k in range(6)])
    assert (result.two["b"] == 2 * result.two["a"]).all()
    assert result.fastest["fastest"].iloc[0] == 5.0
    assert result.recorder_3["n"].tolist() == [0, 50, 100]  # with the outputs
    assert list(result.recorder_4.columns) == ["0", "1"]
    series = result.series
    assert list(series.columns) == [
        "step", "two.a", "two.b", "fastest", "recorder_3.n", "recorder_4.0", "recorder_4.1",
    ]  # fmt: skip
    assert series["step"].tolist() == [0, 20, 40, 50, 60, 80, 100]
    assert series["fastest"].isna().sum() == 4
    named = two_discs().run(steps=1, record={"speed": fastest})
    assert list(named.tables) == ["speed"]


def test_names_can_be_registered() -> None:
    @pd.recorders.register("number_of_steps")
    def number_of_steps() -> Any:
        return lambda model: model.n

    try:
        result = two_discs().run(steps=2, every=1, record="number_of_steps")
    finally:
        pd.recorders._REGISTRY.pop("number_of_steps")
    assert result.series["recorder_1"].tolist() == [0, 1, 2]
    assert {"momentum", "damage", "contacts", "kinetic_energy"} <= set(pd.recorders.names())


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_series_are_written_to_the_last_bit(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / "results" / f"series.{suffix}"
    result = two_discs().run(until=1e-5, every=10, record=["momentum"], record_to=path)
    if suffix == "csv":
        found = pandas.read_csv(path, dtype=str).astype(float).set_index("time")
    else:
        found = pandas.read_parquet(path).set_index("time")
    assert list(found.columns) == list(result.series.columns)
    assert np.array_equal(found.to_numpy(), result.series.to_numpy())
    assert np.array_equal(found.index, result.series.index)


def test_series_stand_in_the_folder_of_the_output(tmp_path: Path) -> None:
    result = two_discs().run(output=tmp_path, until=5e-6, every=1e-6, record=["damage"])
    assert result.folder == tmp_path
    assert len(pandas.read_csv(tmp_path / "series.csv")) == 6
    assert len(list(tmp_path.glob("output_*.vtu"))) == 6
    assert not (tmp_path / "checkpoint_50.h5").exists()


def test_a_series_that_does_not_fit_is_not_gone_on_with(tmp_path: Path) -> None:
    model = two_discs()
    model.run(output=tmp_path, until=1e-6, checkpoint_every=5)
    (tmp_path / "series.csv").write_text("a,b\n1,2\n")
    with pytest.raises(pd.InputError, match=r"series.csv: cannot be gone on with.*remove or ren"):
        two_discs().run(output=tmp_path, until=2e-6, record=["damage"], resume=True)


def test_a_recorder_must_give_the_same_columns_every_time() -> None:
    with pytest.raises(pd.InputError, match=r"gives 2 numbers at step 1: must be 1 \(0\) every"):
        two_discs().run(steps=3, every=1, record=[lambda model: [0] * (model.n + 1)])


def test_results_say_what_they_have() -> None:
    result = two_discs().run(steps=5, record=["momentum"])
    assert "momentum" in dir(result)
    assert repr(result).startswith("<Result after step 5, t = 5e-07 s: 0 of 3696 bonds broken;")
    with pytest.raises(AttributeError, match="did you mean momentum"):
        _ = result.momentm
    with pytest.raises(KeyError, match="nothing of this name was recorded"):
        _ = result["energy"]


def test_reaction_of_a_wall_takes_up_the_momentum() -> None:
    model = pd.DEMModel(dt=1e-7, threads=1)
    block = Block((2e-3, 2e-3))
    grain = model.add_particle(block, material=glass(), mesh_size=2e-4, velocity=(0, -1))
    floor = model.add_wall(block, material=glass(), mesh_size=2e-4, at=(0, -2.19e-3))
    record = [pd.recorders.reaction(floor), pd.recorders.velocity(grain)]
    result = model.run(until=1e-4, record=record, record_every=1)
    push = result.reaction_wall["y"].to_numpy()
    speed = result.velocity_block["y"].to_numpy()
    mass = float((model.state.density * model.state.volume)[grain.nodes].sum())
    # velocity Verlet: v += dt (f_n + f_n+1) / 2 rho, so sums are exact but for round-off
    impulse = model.dt * (push[1:] + push[:-1]) / 2
    assert push.min() < 0
    np.testing.assert_allclose(-np.cumsum(impulse), mass * (speed[1:] + 1), rtol=0, atol=1e-12)
