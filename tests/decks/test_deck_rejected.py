"""Decks that are refused: every message names line, key, value, rule and remedy."""

from __future__ import annotations

import pytest
from peridem.deck import read_deck
from peridem.errors import InputError

NAN = float("nan")

# Changed key, its value, and what the message must say after "input.yaml:<line>: <key> = <value>".
BAD_VALUES = [
    ("Model.Dimension", 1, "must be one of 2, 3"),
    ("Model.Final_Time", 0.0, "must be positive; give the end of the simulated time in s"),
    ("Model.Time_Steps", 0, "must be at least 1"),
    ("Model.Time_Steps", 1.5, "must be a whole number"),
    ("Model.Discretization_Type.Time", "central_diference", "did you mean central_difference?"),
    ("Model.Discretization_Type.Spatial", "weak_finite_element", "must be finite_difference"),
    ("Model.Compatibility", "orignal", "did you mean original?"),
    ("Material.Zone_1.Type", "PDstate", "did you mean PDState?"),
    ("Material.Zone_1.Horizon", -1.0, "must be positive; give the horizon in metres"),
    ("Material.Zone_1.K", NAN, "must be a finite number; give the bulk modulus in Pa"),
    ("Material.Zone_1.K", float("inf"), "must be a finite number"),
    ("Material.Zone_1.K", "soft", "must be a number; give the bulk modulus in Pa"),
    ("Material.Zone_1.K", True, "must be a number"),
    ("Material.Zone_1.Density", 0, "must be positive; give the density in kg/m^3"),
    ("Material.Zone_1.Density", -1200.0, "must be positive"),
    ("Material.Zone_1.Influence_Function.Type", 3, "must be one of 0, 1, 2"),
    ("Material.Zone_2.Copy_Material_Data", 2, "copies in a circle (Zone_2 -> Zone_2)"),
    ("Material.Zone_2.Copy_Material_Data", 5, "there is no Material.Zone_5"),
    ("Contact.Zone_11.Epsilon", 0, "must be positive"),
    ("Contact.Zone_11.Epsilon", 1.1, "must be at most 1"),
    ("Contact.Zone_11.Friction_Coeff", -0.1, "must be at least 0"),
    ("Contact.Zone_11.Kn", -1.0, "must be at least 0; give the normal stiffness in N/m^7, or "),
    ("Zone.Zones", 2001, "must be at most 2000; give the number of zones"),
    ("Contact.Zone_11.Contact_Radius", 1e-4, "is given besides Contact_Radius_Factor"),
    ("Contact.Zone_11.Center_Damping_Criterion", "center", "did you mean centers?"),
    ("Contact.Zone_11.Friction_Model", "histroy", "did you mean history?"),
    ("Contact.Zone_11.Tangential_Stiffness_Ratio", 0, "must be positive"),
    ("Contact.Zone_12.Copy_Contact_Data", [3, 4], "there is no Contact.Zone_34"),
    ("Contact.Zone_12.Copy_Contact_Data", [1], "must have at least 2 entries"),
    ("Neighbor.Search_Interval", 0, "must be at least 1"),
    ("Mesh.Zone_1.File", "none.msh", "no such file"),
    ("Particle_Generation.From_File", "none.csv", "no such file"),
    ("Particle_Generation.File_Data_Type", "loc", "must be one of loc_rad, loc_rad_orient"),
    ("Particle.Zone_1.Type", "cirle", "did you mean circle?"),
    ("Particle.Zone_1.Is_Wall", True, "contradicts Zone.Zone_1.Is_Wall"),
    ("Force_BC.Gravity", -10.0, "must be a list in brackets"),
    ("Displacement_BC.Set_1.Time_Function.Type", "linaer", "did you mean linear?"),
    ("Displacement_BC.Set_1.Wall_List", [0], "use Particle_List"),
    ("Displacement_BC.Set_1.Direction", [1, 1], "names a direction twice"),
    ("Output.Output_Interval", 0, "must be at least 1; give the number of steps between outputs"),
    ("Output.Perform_Out", "yes", "must be true or false"),
    ("Output.File_Format", "msh", "must be vtu"),
    ("Output.Tag_PP", "../x", "has characters that are not allowed"),
    ("Output.Path", "one.msh", "is a file; give the name of a folder"),
    ("Material.Zone_1.Densty", 1.0, "unknown key; did you mean Density?"),
    ("Material.Zone_1.Lambda", 1.0, "no law uses it"),
    ("Material.Zone_2.Density", 1.0, "has no effect beside Copy_Material_Data"),
    ("Contact.Zone_12.Kn", 1.0, "has no effect beside Copy_Contact_Data"),
    ("Model.Density", 1.0, "unknown key here; it belongs at Material.Zone_k.Density"),
]


@pytest.mark.parametrize(("path", "value", "rule"), BAD_VALUES)
def test_bad_value_is_refused_with_line_key_and_value(decks, refusal, path, value, rule):
    message = refusal({path: value})
    shown = "true" if value is True else value
    line = decks.line_of(*path.split("."))
    assert message.startswith(f"input.yaml:{line}: {path} = {shown}: "), message
    assert rule in message


# Removed key, the block whose line is named, and what the message must say.
MISSING = [
    ("Model", (), "Model: missing; give the block with dimension and time"),
    ("Model.Dimension", ("Model",), "Model.Dimension: missing; give the dimension, 2 or 3"),
    ("Model.Final_Time", ("Model",), "Model.Final_Time: missing"),
    ("Model.Discretization_Type", ("Model",), "Model.Discretization_Type: missing"),
    ("Material", (), "Material: missing; give the material of each zone"),
    ("Material.Zone_2", ("Material",), "Material.Zone_2: missing"),
    ("Material.Zone_1.Horizon", ("Material", "Zone_1"), "Material.Zone_1.Horizon: missing; give "),
    ("Material.Zone_1.Gc", ("Material", "Zone_1"), "Material.Zone_1.Gc: missing; give Gc"),
    ("Contact", (), "Contact: missing; give Zone_ij for each pair"),
    ("Contact.Zone_12", ("Contact",), "Contact.Zone_12: missing"),
    ("Contact.Zone_11.Epsilon", ("Contact", "Zone_11"), "Contact.Zone_11.Epsilon: missing"),
    (
        "Contact.Zone_11.Friction_Coeff",
        ("Contact", "Zone_11"),
        "Contact.Zone_11.Friction_Coeff: missing",
    ),
    ("Zone", (), "Zone: missing; give Zones"),
    ("Zone.Zones", ("Zone",), "Zone.Zones: missing; give the number of zones"),
    ("Particle", (), "Particle: missing"),
    ("Particle.Zone_2", ("Particle",), "Particle.Zone_2: missing; give the shape"),
    ("Particle.Zone_1.Parameters", ("Particle", "Zone_1"), "Particle.Zone_1.Parameters: missing"),
    ("Particle_Generation", (), "Particle_Generation: missing; give From_File"),
    ("Mesh", (), "Mesh: missing"),
    ("Mesh.Zone_2", ("Mesh",), "Mesh.Zone_2: missing"),
    ("Output", (), "Output: missing; give the block with Output_Interval"),
    ("Output.Output_Interval", ("Output",), "Output.Output_Interval: missing"),
    (
        "IC.Constant_Velocity.Particle_List",
        ("IC", "Constant_Velocity"),
        "IC.Constant_Velocity.Particle_List: missing",
    ),
    (
        "Displacement_BC.Set_1.Direction",
        ("Displacement_BC", "Set_1"),
        "Displacement_BC.Set_1.Direction: missing; give the list of directions",
    ),
    (
        "Displacement_BC.Set_1.Time_Function.Parameters",
        ("Displacement_BC", "Set_1", "Time_Function"),
        "Displacement_BC.Set_1.Time_Function.Parameters: constant needs 1 parameter, has 0",
    ),
]


@pytest.mark.parametrize(("path", "block", "text"), MISSING)
def test_missing_key_is_refused_at_the_block_it_belongs_to(decks, refusal, path, block, text):
    message = refusal({path: decks.REMOVE})
    place = f"input.yaml:{decks.line_of(*block)}" if block else "input.yaml"
    assert message.startswith(f"{place}: {text}"), message


def test_missing_neighbor_block_is_fine(decks, remove):
    # Results do not depend on it, so it may be left out.
    assert decks.two_grains(changes={"Neighbor": remove}).neighbor.search_interval == 1


def test_misspelt_obligatory_key_is_one_problem(refusal, remove):
    message = refusal({"Material.Zone_1.Density": remove, "Material.Zone_1.Densty": 1200.0})
    assert "Material.Zone_1.Densty = 1200.0: unknown key; did you mean Density?" in message


def test_unknown_block_is_refused_with_the_nearest(refusal):
    assert "Neighbour: unknown key; did you mean Neighbor?" in refusal({"Neighbour": {}})


def test_wall_block_of_older_versions_is_refused_with_a_reason(refusal):
    assert "give Zone.Zone_k.Is_Wall: true" in refusal({"Wall": {"Zone_3": {}}})


def test_all_problems_are_reported_at_once_in_the_order_of_the_file(decks):
    lines = decks.refusal(
        {
            "Model.Final_Time": -1.0,
            "Material.Zone_1.Density": 0.0,
            "Material.Zone_1.Horizon": "long",
            "Contact.Zone_11.Epsilon": 2.0,
            "Output.Tags": ["Displacement", "Stress"],
            "Nonsense": 1,
        }
    )
    assert len(lines) == 6
    numbers = [int(line.split(":")[1]) for line in lines]
    assert numbers == sorted(numbers)
    assert any("Output.Tags[1] = Stress: must be one of Displacement, " in line for line in lines)


def test_wrong_entry_of_a_vector_is_one_problem(refusal):
    message = refusal({"Force_BC.Gravity": [0.0, "down"]})
    assert "Force_BC.Gravity[1] = down: must be a number; give the acceleration" in message


def test_many_problems_are_cut_short(decks):
    changes = {"Zone.Zones": 12}  # 75 of 78 pairs of zones and 30 blocks are missing
    lines = decks.refusal(changes)
    assert len(lines) == 51
    assert lines[-1] == "input.yaml: and 55 more problems"


@pytest.mark.parametrize(
    ("given", "have"),
    [
        ({"K": 1e7, "G": 1e7, "E": 1e7}, "has E and K and G"),
        ({"K": 1e7}, "has K"),
        ({"K": 1e7, "Poisson_Ratio": 0.2}, "has K and Poisson_Ratio"),
        ({"K": 1e7, "nu": 0.2}, "has K and Poisson_Ratio"),
        ({}, "has none of them"),
    ],
)
def test_pdstate_wants_exactly_one_pair_of_elastic_constants(refusal, remove, given, have):
    changes = {"Material.Zone_1.K": remove, "Material.Zone_1.G": remove}
    changes |= {f"Material.Zone_1.{name}": value for name, value in given.items()}
    message = refusal(changes)
    assert f"exactly one pair of elastic constants, {have}; give (E, K), (E, G), " in message


@pytest.mark.parametrize(
    ("given", "rule"),
    # nu = (3K - E)/(6K) > -1 needs E < 9K; nu = E/(2G) - 1 < 1/2 needs E < 3G
    [({"E": 9.1e7, "K": 1e7}, "must be below 9 K"), ({"E": 3.1e7, "G": 1e7}, "must be below 3 G")],
)
def test_elastic_pair_without_positive_moduli_is_refused(refusal, remove, given, rule):
    changes = {"Material.Zone_1.K": remove, "Material.Zone_1.G": remove}
    changes |= {f"Material.Zone_1.{name}": value for name, value in given.items()}
    assert rule in refusal(changes)


@pytest.mark.parametrize("k", [1e300, 1e-300])
def test_elastic_pair_without_finite_moduli_is_refused(refusal, k):
    message = refusal({"Material.Zone_1.K": k})  # G = 1.296e7
    assert "Material.Zone_1.G = 12960000.0: does not fit K: no finite moduli follow" in message


def test_gc_and_kic_together_are_refused(refusal):
    assert "KIc = 1000.0: is given besides Gc" in refusal({"Material.Zone_1.KIc": 1e3})


@pytest.mark.parametrize("law", ["PMBBond", "RNPBond", "PDElasticBond"])
def test_bond_based_law_wants_e_or_k(refusal, remove, law):
    message = refusal({"Material.Zone_1.Type": law, "Material.Zone_1.K": remove})
    assert f"{law} needs Young's modulus E or the bulk modulus K" in message


def test_direct_constants_are_counted_and_positive(decks, refusal):
    changes = {"Material.Zone_1.Compute_From_Classical": False}
    assert "missing; give [K, G, s0] for PDState" in refusal(changes)
    changes["Material.Zone_1.Bond_Potential"] = {"Parameters": [1e7, 1e7]}
    assert "must be [K, G, s0] for PDState" in refusal(changes)
    changes["Material.Zone_1.Bond_Potential"] = {"Parameters": [1e7, 1e7, 0.0]}
    assert "Parameters[2] = 0.0: must be positive; give the constant s0" in refusal(changes)


def test_direct_constants_of_a_bond_law_want_k_for_contact(refusal, remove):
    changes = {
        "Material.Zone_1.Type": "PMBBond",
        "Material.Zone_1.K": remove,
        "Material.Zone_1.Compute_From_Classical": False,
        "Material.Zone_1.Bond_Potential": {"Parameters": [1e20, 0.01]},
    }
    assert "Material.Zone_1.K: missing; contact between bodies needs" in refusal(changes)


def test_v_max_without_kn_says_what_to_give(refusal, remove):
    message = refusal({"Contact.Zone_11.Kn": remove, "Contact.Zone_11.V_Max": 2.0})
    assert "Contact.Zone_11.V_Max = 2.0: " in message
    assert "give Kn in N/m^7, or remove V_Max for Kn = 18 kappa/(pi eps^5)" in message


def test_circle_of_contact_copies_is_reported_once(refusal):
    message = refusal({"Contact.Zone_11": {"Copy_Contact_Data": [2, 2]}})
    assert "copies in a circle (Zone_11 -> Zone_22 -> Zone_12 -> Zone_11)" in message


def test_contact_pair_written_backwards_is_refused(refusal):
    message = refusal({"Contact.Zone_21": {"Copy_Contact_Data": [1, 1]}})
    assert "pairs are written with the smaller zone first; write Zone_12" in message


@pytest.mark.parametrize("block", ["Zone", "Particle", "Mesh"])
def test_zone_beyond_the_number_of_zones_is_refused(decks, block):
    content = {
        "Zone": {"Is_Wall": False},
        "Particle": {"Type": "circle", "Parameters": [1e-3]},
        "Mesh": {"File": "one.msh"},
    }[block]
    (message,) = decks.refusal({f"{block}.Zone_3": content})
    assert f"{block}.Zone_3: no such zone: there is Zone_1 to Zone_2" in message


def test_shape_with_a_wrong_number_of_parameters_is_refused(decks, refusal):
    message = refusal({"Particle.Zone_1.Parameters": [1e-3, 0.0]})
    line = decks.line_of("Particle", "Zone_1", "Parameters")
    assert message.startswith(f"input.yaml:{line}: Particle.Zone_1: circle")


def test_region_of_older_versions_is_refused_with_its_new_form(decks):
    region = {"Rectangle": [0, 0, 0, 1, 1, 0]}
    lines = decks.refusal({"Displacement_BC.Set_1.Region": region})
    assert any("write it as Geometry: {Type: rectangle, Parameters: [...]}" in s for s in lines)


@pytest.mark.parametrize(
    ("kind", "function", "needed"),
    [
        ("Displacement_BC", "constant", 1),
        ("Displacement_BC", "linear", 1),
        ("Displacement_BC", "quadratic", 2),
        ("Displacement_BC", "sin", 2),
        ("Displacement_BC", "rotation", 4),
        ("Force_BC", "linear_step", 3),
        ("Force_BC", "linear_slow_fast", 4),
    ],
)
def test_time_function_wants_all_its_parameters(decks, refusal, kind, function, needed):
    load = {
        "Particle_List": [0],
        "Direction": [1],
        "Time_Function": {"Type": function, "Parameters": [1.0] * (needed - 1)},
    }
    changes = {f"{kind}.Sets": 1, f"{kind}.Set_1": load}
    path = f"{kind}.Set_1.Time_Function.Parameters"
    assert f"{path} = [{', '.join(['1.0'] * (needed - 1))}]: {function} needs" in refusal(changes)
    load["Time_Function"]["Parameters"] = [1.0] * needed
    decks.two_grains(changes=changes)


@pytest.mark.parametrize(
    ("kind", "function"), [("Displacement_BC", "linear_step"), ("Force_BC", "quadratic")]
)
def test_time_function_of_the_other_kind_of_load_is_refused(refusal, kind, function):
    load = {
        "Particle_List": [0],
        "Direction": [1],
        "Time_Function": {"Type": function, "Parameters": [1.0] * 4},
    }
    message = refusal({f"{kind}.Sets": 1, f"{kind}.Set_1": load})
    assert f"Time_Function.Type = {function}: must be one of constant, linear, " in message


def test_self_contact_belongs_to_pairs_of_one_zone(decks, refusal):
    contact = {"Friction_On": False, "Damping_On": False, "Self_Contact": True}
    message = refusal({"Contact.Zone_12": contact})
    line = decks.line_of("Contact", "Zone_12", "Self_Contact")
    assert message.startswith(f"input.yaml:{line}: Contact.Zone_12.Self_Contact = true: belongs to")


@pytest.mark.parametrize(
    ("axis", "rule"),
    [
        ([1.0, 0.0, 0.0], "must have the axis (0, 0, 1) in 2D"),
        ([0.0, 0.0, 0.0], "must have an axis [ax, ay, az] that is not zero"),
        ([1.0], "must be [T0, cx, cy, cz] for a rotation about z, or "),
        ([0.0, 0.0, 1.0, 1.0], "has 8 numbers"),
    ],
)
def test_axis_of_a_rotation_must_have_a_meaning(refusal, axis, rule):
    function = {"Type": "rotation", "Parameters": [1.0, 0.0, 0.0, 0.0, *axis]}
    message = refusal({"Displacement_BC.Set_1.Time_Function": function})
    assert "Displacement_BC.Set_1.Time_Function.Parameters = [1.0, 0.0, 0.0" in message
    assert rule in message


def test_displacement_set_without_time_function_is_refused(refusal, remove):
    held = {"Particle_List": [0], "Direction": [1]}
    message = refusal({"Displacement_BC.Set_1": held})
    assert "Displacement_BC.Set_1.Time_Function: missing; give Type and Parameters" in message


def test_hat_function_without_parameter_is_refused(refusal):
    changes = {"Displacement_BC.Set_1.Spatial_Function.Type": "hat_x"}
    assert "Spatial_Function.Parameters: hat_x needs 1 parameter, has 0" in refusal(changes)


@pytest.mark.parametrize(("direction", "rule"), [(0, "at least 1"), (3, "at most 2"), (4, "")])
def test_direction_beyond_the_dimension_is_refused(refusal, direction, rule):
    message = refusal({"Displacement_BC.Set_1.Direction": [1, direction]})
    assert f"Displacement_BC.Set_1.Direction[1] = {direction}: must be {rule}" in message


def test_number_of_sets_must_match_the_sets(decks, refusal):
    assert "Displacement_BC.Set_2: missing; Displacement_BC.Sets = 2" in refusal(
        {"Displacement_BC.Sets": 2}
    )
    assert "Displacement_BC.Set_1: is beyond Displacement_BC.Sets = 0" in refusal(
        {"Displacement_BC.Sets": 0}
    )


def test_restart_file_must_exist(decks, refusal):
    message = refusal({"Restart": {"File": "gone.vtu", "Step": 10}})
    line = decks.line_of("Restart", "File")
    assert message.startswith(f"input.yaml:{line}: Restart.File = gone.vtu: no such file")


def test_compressive_test_wants_its_body(refusal):
    message = refusal({"Particle.Test_Name": "compressive_test"})
    assert "Particle.Compressive_Test: missing; compressive_test needs it" in message


def test_compressive_test_of_older_versions_is_refused_with_the_new_names(decks):
    lines = decks.refusal({"Particle.Compressive_Test": {"Wall_Id": 1, "Wall_Force_Direction": 2}})
    assert any("use Particle_Id" in line for line in lines)
    assert any("use Particle_Force_Direction" in line for line in lines)


def test_mesh_wants_file_or_creation_and_not_both(decks, refusal):
    assert "Mesh.Zone_1.File: missing; give the mesh file" in refusal({"Mesh.Zone_1": {}})
    changes = {"Mesh.Zone_1.CreateMesh": {"Flag": True}, "Mesh.Zone_1.Mesh_Size": 1e-4}
    assert "File = one.msh: is given besides CreateMesh.Flag: true" in refusal(changes)


def test_created_mesh_wants_size_and_rectangle(refusal):
    mesh = {"CreateMesh": {"Flag": True, "Info": "uniform"}}
    assert "Mesh_Size: missing; CreateMesh needs it" in refusal({"Mesh.Zone_1": mesh})
    mesh["Mesh_Size"] = 1e-4
    assert "meshes rectangles only, the shape is circle" in refusal({"Mesh.Zone_1": mesh})


def test_created_mesh_without_any_shape_is_refused(decks):
    mesh = {"CreateMesh": {"Flag": True}, "Mesh_Size": 1e-4}
    (message,) = decks.refusal({"Mesh.Zone_1": mesh}, single=True)
    assert "CreateMesh.Geometry: missing; give the rectangle" in message


def test_single_particle_with_two_zones_is_refused(decks):
    (message,) = decks.refusal({"Zone": {"Zones": 2}}, single=True)
    assert "Zone.Zones = 2: must be 1 for Single_Particle" in message


# Text of the file, and what the message must say.
BROKEN_FILES = [
    ("", "input.yaml: the deck is empty"),
    ("# nothing\n", "input.yaml: the deck is empty"),
    ("- a\n- b\n", "input.yaml:1: the deck must be a mapping of blocks"),
    ("Model: {a: [1, 2\nZone: 3\n", "not valid YAML"),
    ("Model:\n  Dimension: 2\n Time: 3\n", "input.yaml:3: not valid YAML"),
    ("Model:\n\tDimension: 2\n", "input.yaml:2: not valid YAML"),
    ("Model: *missing\n", "input.yaml:1: not valid YAML"),
    ("a: &a [*a]\n", "nested or repeated beyond any deck"),
    ("Model:\n  Dimension: 2\n---\nModel: 3\n", "not valid YAML"),
    ("a: " + "[" * 3000, "input.yaml"),
]


@pytest.mark.parametrize(("text", "message"), BROKEN_FILES)
def test_broken_file_is_refused(decks, text, message):
    with pytest.raises(InputError, match=r"input\.yaml") as caught:
        read_deck(decks.write_text(text))
    assert message in str(caught.value)


def test_key_given_twice_is_refused_with_both_lines(decks):
    path = decks.write({})
    text = path.read_text(encoding="utf-8")
    decks.write_text(text.replace("    G: ", "    K: 1.0\n    G: "))
    with pytest.raises(InputError) as caught:
        read_deck(path)
    message = str(caught.value)
    assert "Material.Zone_1.K" in message
    assert "given twice, in lines" in message


def test_missing_deck_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.yaml: the deck does not exist"):
        read_deck(tmp_path / "none.yaml")


def test_folder_as_deck_is_refused(tmp_path):
    with pytest.raises(InputError, match="the deck is not a file; give the YAML file itself"):
        read_deck(tmp_path)


def test_binary_file_as_deck_is_refused(tmp_path):
    path = tmp_path / "input.yaml"
    path.write_bytes(b"Model:\n  x: \xff\xfe\n")
    with pytest.raises(InputError, match=r"input\.yaml:2: the deck is not UTF-8 text"):
        read_deck(path)
