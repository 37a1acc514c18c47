"""The csv of the tests, the stop criterion and the last state of a failed run."""

import math

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh, disc_mesh, pair_deck
from peridem import DEMModel, NumericalError, PeridemWarning
from peridem.output import read_pvd
from peridem.vtu import read_vtu

R = GRAIN_RADIUS
STEPS = 300


def impact(deck_folder, **changes):
    """Body 1 falls on body 0 at 2 m/s, from a gap of 1.05 Rc, with friction and damping."""
    rc = 0.95 * R / 6
    deck = deck_folder.grains(offset=(0.0, 2 * R + 1.05 * rc), steps=STEPS)
    deck_folder.mesh("disc_6_1", disc_mesh(R))
    deck_folder.mesh("disc_6_2", disc_mesh(R))
    deck_folder.places((0, 0, 0, 0, R, 0), (1, 0, 2 * R + 1.05 * rc, 0, R, 0))
    contact = {**deck["Contact"]["Zone_12"], "Damping_On": True, "Epsilon": 0.8}
    contact |= {"Friction_On": True, "Friction_Coeff": 0.3, "Beta_n_Factor": 100}
    deck["Contact"]["Zone_12"] = contact
    deck["Particle"]["Test_Name"] = "two_particle"
    deck["Force_BC"] = {"Gravity": [0, -10, 0]}
    velocity = {"Velocity_Vector": [0.1, -2, 0], "Particle_List": [1]}
    deck["IC"] = {"Constant_Velocity": velocity}
    deck["Output"] = {"Output_Interval": 50, "Test_Output_Interval": 20, "Tags": ["Velocity"]}
    return deck | changes


def read_csv(path):
    """Columns by name."""
    header, *lines = path.read_text().splitlines()
    values = np.array([[float(value) for value in line.split(",")] for line in lines])
    return dict(zip(header.split(","), values.T, strict=True))


def new_model(deck_folder, deck, **options):
    return DEMModel.from_deck(deck_folder.write(deck), threads=1, **options)


def test_two_particle_rows_are_those_of_the_model(deck_folder, tmp_path):
    model = new_model(deck_folder, impact(deck_folder))
    seen = []

    def look(model):
        below, above = model.particles
        nodes = slice(above.start, above.stop)
        force = (model.contact_forces()[nodes] * model.state.volume[nodes, None]).sum(axis=0)
        seen.append((model.n, model.time, *(above.center - below.center)[:2], *force[:2]))

    model.run(tmp_path / "out", callback=look, callback_every=20)
    n, t, dx, dy, fx, fy = np.array(seen).T
    rows = read_csv(tmp_path / "out" / "pp_two_particle.csv")
    assert list(rows) == [
        "step",
        "t [s]",
        "distance [m]",
        "penetration [m]",
        "max_distance [m]",
        "contact_force [N/m]",
    ]
    distance = np.hypot(dx, dy)
    np.testing.assert_array_equal(rows["step"], n)
    np.testing.assert_array_equal(rows["t [s]"], t)
    np.testing.assert_allclose(rows["distance [m]"], distance, rtol=1e-15)
    penetration = 0.95 * R / 6 - (distance - 2 * R)
    # differences of lengths of 2e-3; the smallest node distance of the mesh is R / 6 but for
    # the rounding of sines
    np.testing.assert_allclose(rows["penetration [m]"], penetration, rtol=0, atol=1e-15)
    force = (fx * dx + fy * dy) / distance
    # sums of 127 terms in another order
    np.testing.assert_allclose(rows["contact_force [N/m]"], force, rtol=1e-12, atol=1e-18)
    assert force.max() > 0


def test_max_distance_is_that_since_the_first_contact(deck_folder, tmp_path):
    model = new_model(deck_folder, impact(deck_folder))
    model.run(tmp_path / "out")
    rows = read_csv(tmp_path / "out" / "pp_two_particle.csv")
    touched = np.maximum.accumulate(rows["contact_force [N/m]"] != 0)
    farthest = rows["max_distance [m]"]
    assert not touched[0]
    assert np.isnan(farthest[~touched]).all()
    expected = np.maximum.accumulate(rows["distance [m]"][touched])
    np.testing.assert_array_equal(farthest[touched], expected)


def test_test_output_does_not_change_the_run(deck_folder, tmp_path):
    deck = impact(deck_folder)
    deck["Contact"]["Zone_12"]["Friction_Model"] = "history"
    deck["Output"]["Test_Output_Interval"] = 1
    watched = new_model(deck_folder, deck)
    watched.run(tmp_path / "out")
    plain = new_model(deck_folder, deck)
    plain.step(STEPS)
    for name in ("x", "v", "f"):
        np.testing.assert_array_equal(getattr(watched.state, name), getattr(plain.state, name))


def test_interval_is_that_of_the_outputs_unless_given(deck_folder, tmp_path):
    deck = impact(deck_folder)
    del deck["Output"]["Test_Output_Interval"]
    new_model(deck_folder, deck).run(tmp_path / "out", steps=110)
    rows = read_csv(tmp_path / "out" / "pp_two_particle.csv")
    assert rows["step"].tolist() == [0, 50, 100]


def test_tag_is_part_of_the_name_and_perform_out_does_not_matter(deck_folder, tmp_path):
    deck = impact(deck_folder)
    deck["Output"] |= {"Tag_PP": "a1", "Perform_Out": False}
    new_model(deck_folder, deck).run(tmp_path / "out", steps=1)
    written = {path.name for path in (tmp_path / "out").iterdir()}
    # and, as the run stops short, what is needed to go on with it
    assert written == {"pp_two_particle_a1.csv", "checkpoint_a1_1.h5"}


@pytest.mark.parametrize("at", [70, 80])
def test_second_part_of_a_run_goes_on_in_the_file(deck_folder, tmp_path, at):
    whole = new_model(deck_folder, impact(deck_folder))
    whole.run(tmp_path / "whole")
    parts = new_model(deck_folder, impact(deck_folder))
    parts.run(tmp_path / "parts", steps=at)
    parts.run(tmp_path / "parts")
    name = "pp_two_particle.csv"
    assert (tmp_path / "parts" / name).read_text() == (tmp_path / "whole" / name).read_text()


def test_lines_after_the_restart_and_torn_ones_are_replaced(deck_folder, tmp_path):
    # resumed from step 80 after a crash at step 130 that tore the line of step 120
    whole = new_model(deck_folder, impact(deck_folder))
    whole.run(tmp_path / "whole")
    model = new_model(deck_folder, impact(deck_folder))
    model.run(tmp_path / "out", steps=80)
    path = tmp_path / "out" / "pp_two_particle.csv"
    lines = (tmp_path / "whole" / path.name).read_text().splitlines()
    path.write_text("\n".join([*lines[:7], lines[7][:9]]))
    model.run(tmp_path / "out")
    assert path.read_text().splitlines() == lines


def test_resumed_run_goes_on_in_the_file(deck_folder, tmp_path):
    # killed after step 130, the line of 120 written; the last checkpoint is of step 100
    deck = impact(deck_folder)
    deck["Contact"]["Zone_12"]["Friction_Model"] = "history"
    new_model(deck_folder, deck).run(tmp_path / "whole")
    new_model(deck_folder, deck).run(tmp_path / "out", steps=130, checkpoint_every=50)
    (tmp_path / "out" / "checkpoint_130.h5").unlink()
    resumed = DEMModel.resume(tmp_path / "out", threads=1)
    assert resumed.n == 100
    resumed.run(tmp_path / "out")
    name = "pp_two_particle.csv"
    assert (tmp_path / "out" / name).read_text() == (tmp_path / "whole" / name).read_text()


def test_new_run_starts_a_new_file(deck_folder, tmp_path):
    new_model(deck_folder, impact(deck_folder)).run(tmp_path / "out", steps=20)
    with pytest.warns(PeridemWarning, match=r"checkpoint_20\.h5; renamed"):
        new_model(deck_folder, impact(deck_folder)).run(tmp_path / "out", steps=20)
    rows = read_csv(tmp_path / "out" / "pp_two_particle.csv")
    assert rows["step"].tolist() == [0, 20]


def press(deck_folder, compatibility):
    """A square plate moves down on a disc that stands on another; 2D, gravity."""
    side = 2.4e-3
    names = [
        deck_folder.mesh("disc", disc_mesh(R)),
        deck_folder.mesh("plate", box_mesh((side, side), (14, 14))),
    ]
    deck = pair_deck(names, {"Type": "circle", "Parameters": [R]}, walls=[2], steps=STEPS)
    deck["Model"]["Compatibility"] = compatibility
    deck["Particle"]["Zone_2"] = {"Type": "square", "Parameters": [side]}
    rc = 0.95 * R / 6
    deck_folder.places((0, 0, 0, 0, R, 0), (1, 0, R + side / 2 + 1.01 * rc, 0, side, 0))
    for zones in ("Zone_12", "Zone_11"):
        contact = deck["Contact"][zones]
        contact |= {"Damping_On": True, "Epsilon": 0.8, "Friction_On": True}
        contact |= {"Friction_Coeff": 0.3, "Beta_n_Factor": 10}
    deck["Particle"]["Test_Name"] = "compressive_test"
    test = {"Particle_Id": 1, "Particle_Force_Direction": 2}
    deck["Particle"]["Compressive_Test"] = test
    motion = {"Type": "linear", "Parameters": [-3.0]}
    deck["Displacement_BC"] = {
        "Sets": 1,
        "Set_1": {"Particle_List": [1], "Direction": [1, 2], "Time_Function": motion},
    }
    deck["Displacement_BC"]["Set_1"]["Spatial_Function"] = {"Type": "constant"}
    deck["Force_BC"] = {"Gravity": [0, -10, 0]}
    deck["Output"] = {"Output_Interval": 10}
    return deck


@pytest.mark.parametrize("compatibility", ["corrected", "original"])
def test_reaction_of_the_wall_is_the_momentum_it_gives(deck_folder, tmp_path, compatibility):
    deck = press(deck_folder, compatibility)
    deck["Particle"]["Zone_2"]["All_Dofs_Constrained"] = False
    model = new_model(deck_folder, deck)
    momenta = []

    def look(model):
        grain = model.particles[0]
        nodes = slice(grain.start, grain.stop)
        mass = model.state.density[nodes] * model.state.volume[nodes]
        weight = mass.sum() * -10.0
        force = model.state.volume[nodes] @ model.state.f[nodes, 1]
        momenta.append((force - weight, model.time))

    model.run(tmp_path / "out", callback=look, callback_every=10)
    rows = read_csv(tmp_path / "out" / "pp_compressive_test.csv")
    given, t = np.array(momenta).T
    reaction = rows["contact_force [N/m]"]
    assert reaction.max() > 1.0  # far above the weight, 0.04 N/m
    # the internal forces of the grain cancel to round-off of the largest of them
    np.testing.assert_allclose(reaction, -given, rtol=1e-8, atol=1e-8 * reaction.max())
    assert list(rows) == [
        "step",
        "t [s]",
        "wall_displacement [m]",
        "penetration [m]",
        "contact_force [N/m]",
        "gravity_force [N/m]",
        "total_force [N/m]",
    ]
    # the plate moves down, which is into the grain
    np.testing.assert_allclose(rows["wall_displacement [m]"], -3.0 * t, rtol=1e-12, atol=1e-18)
    np.testing.assert_array_equal(rows["penetration [m]"], -rows["wall_displacement [m]"])
    weight = 1200.0 * 2.4e-3**2 * -10.0  # density, area, gravity
    np.testing.assert_allclose(rows["gravity_force [N/m]"], weight, rtol=1e-12)
    total = rows["total_force [N/m]"]
    # the inner forces of the plate, which moves rigidly, vanish
    np.testing.assert_allclose(total, reaction + weight, rtol=1e-8, atol=1e-8 * reaction.max())


def test_penetration_is_negative_beyond_the_start(deck_folder, tmp_path):
    # the wall swings, y = -a sin(pi b t), b = 2 / T: down for half of T = 100 steps, then above
    deck = press(deck_folder, "corrected")
    motion = {"Type": "sin", "Parameters": [-1e-5, 2 / (100 * 1e-7)]}
    deck["Displacement_BC"]["Set_1"]["Time_Function"] = motion
    whole = new_model(deck_folder, deck)
    whole.run(tmp_path / "whole", steps=90)
    # the second part starts above and knows from the file that the first motion was down
    new_model(deck_folder, deck).run(tmp_path / "parts", steps=70, checkpoint_every=70)
    DEMModel.resume(tmp_path / "parts", threads=1).run(tmp_path / "parts", steps=20)
    name = "pp_compressive_test.csv"
    assert (tmp_path / "parts" / name).read_text() == (tmp_path / "whole" / name).read_text()
    rows = read_csv(tmp_path / "whole" / name)
    penetration = rows["penetration [m]"]
    # the centre is that of a node at 2 mm, whose place is rounded to 4e-19 m
    expected = 1e-5 * np.sin(2 * np.pi * rows["step"] / 100)
    np.testing.assert_allclose(penetration, expected, rtol=1e-9, atol=1e-17)
    np.testing.assert_array_equal(rows["wall_displacement [m]"], -penetration)
    assert penetration[-1] < 0


def flight(deck_folder, criteria, steps=STEPS):
    deck = impact(deck_folder)
    deck["IC"]["Constant_Velocity"]["Velocity_Vector"] = [0, 20.0, 0]
    del deck["Force_BC"]
    deck["Output"] = {"Output_Interval": 10, "Output_Criteria": criteria}
    return deck


def test_run_stops_when_the_centres_are_far_apart(deck_folder, tmp_path):
    # distance 2 R + 1.05 Rc + v t: it passes 2.4 mm at v t = 0.234 mm, after 116.9 steps
    deck = flight(deck_folder, {"Type": "max_particle_dist", "Parameters": [2.4e-3]})
    model = new_model(deck_folder, deck)
    model.run(tmp_path / "out")
    assert model.n == 120
    assert model.stop_reason.startswith("Output_Criteria: the centres of bodies 0 and 1 are 0.0024")
    assert model.summary()["stop_reason"] == model.stop_reason
    times = [time for time, _ in read_pvd(tmp_path / "out" / "output.pvd")]
    assert times[-1] == pytest.approx(120 * model.dt, rel=1e-12)


def test_run_stops_when_a_node_is_far_from_the_origin(deck_folder):
    # the top node starts at 3 R + 1.05 Rc = 3.16625 mm: 3.3 mm after 66.9 steps
    deck = flight(deck_folder, {"Type": "max_node_dist", "Parameters": [3.3e-3]})
    model = new_model(deck_folder, deck)
    model.run()
    assert model.n == 70
    assert "of body 1 is 0.00330" in model.stop_reason
    assert model.stop_reason.endswith("more than 0.0033 m from the origin")


def test_run_that_its_criterion_has_stopped_stays_stopped(deck_folder, tmp_path):
    # it stops at step 120, see above
    deck = flight(deck_folder, {"Type": "max_particle_dist", "Parameters": [2.4e-3]})
    model = new_model(deck_folder, deck)
    model.run(tmp_path / "out", checkpoint_every=50)
    series = (tmp_path / "out" / "output.pvd").read_bytes()
    resumed = DEMModel.resume(tmp_path / "out", threads=1)
    assert resumed.n == 120
    resumed.run(tmp_path / "out")
    assert (resumed.n, resumed.stop_reason) == (120, model.stop_reason)
    assert (tmp_path / "out" / "output.pvd").read_bytes() == series
    model.run()
    assert model.n == 120


def test_resumed_run_stops_where_the_whole_run_does(deck_folder, tmp_path):
    deck = flight(deck_folder, {"Type": "max_particle_dist", "Parameters": [2.4e-3]})
    # at step 118 the criterion holds already, but it is looked at with every output
    for at in (110, 118):
        out = tmp_path / str(at)
        new_model(deck_folder, deck).run(out, steps=at, checkpoint_every=500)
        resumed = DEMModel.resume(out, threads=1)
        resumed.run(out)
        assert resumed.n == 120


def test_new_interval_is_kept_when_the_criterion_no_longer_holds(deck_folder, tmp_path):
    # the centres are 2 R + 1.05 Rc - v t = 2.146 mm apart at step 10 and come nearer
    criteria = {"Type": "max_particle_dist", "Parameters": [2.14e-3], "New_Interval": 5}
    deck = flight(deck_folder, criteria)
    deck["IC"]["Constant_Velocity"]["Velocity_Vector"] = [0, -20.0, 0]
    new_model(deck_folder, deck).run(tmp_path / "whole", steps=40)
    new_model(deck_folder, deck).run(tmp_path / "parts", steps=22, checkpoint_every=500)
    resumed = DEMModel.resume(tmp_path / "parts", threads=1)
    resumed.run(tmp_path / "parts", steps=18)
    found, expected = (
        [round(time / resumed.dt) for time, _ in read_pvd(tmp_path / run / "output.pvd")]
        for run in ("parts", "whole")
    )
    below, above = resumed.particles
    assert np.linalg.norm(above.center - below.center) < 2.14e-3
    assert found == expected == [0, 10, 15, 20, 25, 30, 35, 40]
    # a Restart block with the same Output goes on likewise
    checkpoint = next((tmp_path / "parts").glob("checkpoint_22.h5"))
    deck["Restart"] = {"File": str(checkpoint), "Step": 22}
    model = new_model(deck_folder, deck)
    model.init()
    assert model.output_interval == 5


@pytest.mark.parametrize(("new", "after"), [(5, [145, 150]), (30, [150])])
def test_new_interval_takes_over_instead_of_a_stop(deck_folder, tmp_path, new, after):
    criteria = {"Type": "max_particle_dist", "Parameters": [2.4e-3], "New_Interval": new}
    model = new_model(deck_folder, flight(deck_folder, criteria))
    model.run(tmp_path / "out", steps=150)
    assert (model.n, model.stop_reason) == (150, None)
    series = read_pvd(tmp_path / "out" / "output.pvd")
    steps = [round(time / model.dt) for time, _ in series]
    assert steps[:13] == list(range(0, 130, 10))
    assert steps[-len(after) :] == after
    files = [path for _, path in series]
    assert len(set(files)) == len(files)  # no file is written over


def test_failed_run_leaves_its_last_state(deck_folder, tmp_path):
    deck = impact(deck_folder)
    deck["Output"]["Test_Output_Interval"] = 1
    model = new_model(deck_folder, deck)
    model.run(tmp_path / "out", steps=7)
    model.state.v[130] = math.nan
    with pytest.raises(NumericalError) as caught:
        model.run(tmp_path / "out")
    path = tmp_path / "out" / "output_last.vtu"
    assert str(caught.value).endswith(f"; the last state is in {path}")
    assert "body 1, node 3: " in str(caught.value)
    assert np.isnan(read_vtu(path)["arrays"]["Velocity"]).any(axis=1).nonzero()[0].tolist() == [130]
    assert path not in [file for _, file in read_pvd(tmp_path / "out" / "output.pvd")]


@pytest.mark.parametrize("name", ["x", "v", "f"])
def test_run_that_ends_in_nan_fails(deck_folder, tmp_path, name):
    # what the last evaluation of forces leaves is taken up by no step: here it is written there
    model = new_model(deck_folder, impact(deck_folder))
    model.run(tmp_path / "out", steps=7)
    getattr(model.state, name)[130, 1] = math.nan
    with pytest.raises(NumericalError) as caught:
        model.run(tmp_path / "out", steps=0)
    what = {"x": "position", "v": "velocity", "f": "force density"}[name]
    assert str(caught.value).startswith("step 7 (t = 7e-07 s): body 1, node 3: " + what + " = (")
    assert str(caught.value).endswith(f"; the last state is in {tmp_path}/out/output_last.vtu")
    with pytest.raises(NumericalError, match="body 1, node 3"):
        model.step(0)


def test_force_beyond_all_numbers_at_the_last_step_fails(deck_folder):
    # density times acceleration, 1200 * 1e306, overflows; no step follows that would notice
    deck = impact(deck_folder, Force_BC={"Gravity": [0, -1e306, 0]})
    with pytest.raises(NumericalError, match=r"step 0 \(t = 0 s\): body 0, node 0: force density"):
        new_model(deck_folder, deck).run(steps=0)


@pytest.mark.parametrize("rate", [-1e30, 1e308, 1.01 * 6e-4 / 1e-7])
def test_prescribed_motion_beyond_a_horizon_in_a_step_fails(deck_folder, tmp_path, rate):
    deck = press(deck_folder, "corrected")
    deck["Displacement_BC"]["Set_1"]["Time_Function"]["Parameters"] = [rate]
    model = new_model(deck_folder, deck)
    with pytest.raises(
        NumericalError, match=r"^step 1 \(t = 1e-07 s\): body 1, node 0: "
    ) as caught:
        model.run(tmp_path / "out", steps=1)
    assert str(caught.value).endswith("output_last.vtu")


def test_failed_run_without_folder_leaves_no_file(deck_folder):
    model = new_model(deck_folder, impact(deck_folder))
    model.start()
    model.state.v[130] = math.nan
    with pytest.raises(NumericalError, match="body 1, node 3") as caught:
        model.run()
    assert "last state" not in str(caught.value)
