"""Decks that are read: what the reader makes of them."""

from __future__ import annotations

import hashlib
import time

import pytest
from peridem.deck import read_deck

PLAIN_CONTACT = {"Damping_On": False, "Friction_On": False}


def test_two_grain_deck_keeps_its_values(decks):
    deck = decks.two_grains()
    assert deck.model.dimension == 2
    assert deck.model.discretization_type.time == "central_difference"
    assert deck.model.dt == pytest.approx(1e-7, rel=1e-15)  # Final_Time / Time_Steps
    assert deck.gravity == (0.0, -10.0, 0.0)
    assert deck.initial_velocity.velocity_vector == (0.0, -1.0, 0.0)
    assert deck.initial_velocity.particle_list == (1,)
    assert [particle.type for particle in deck.particles] == ["circle", "circle"]
    assert deck.test_name == "two_particle"
    assert deck.notes == ()


def test_defaults_are_those_of_the_original_or_the_correction(decks):
    deck = decks.one_grain()
    assert deck.model.compatibility == "corrected"
    assert deck.model.seed == 1
    assert deck.neighbor.search_interval == 1
    assert deck.materials[0].bond_breaking == "both"
    assert deck.materials[0].bond_potential.irreversible_bond_fracture is True
    assert deck.output.compress_type == "zlib"
    assert deck.output.perform_fe_out is True
    assert deck.restart is None


def test_contact_defaults_follow_the_original(decks):
    changes = {"Contact.Zone_11": {"Epsilon": 0.9, "Friction_Coeff": 0.1}}
    contact = decks.two_grains(changes=changes).contacts[0, 0]
    assert contact.damping_on is True
    assert contact.friction_on is True
    assert (contact.kn_factor, contact.beta_n_factor) == (1.0, 1.0)
    assert (contact.kn, contact.contact_radius, contact.contact_radius_factor) == (None,) * 3
    assert contact.center_damping_criterion == "centers"
    assert contact.node_damping is False


def test_paths_are_taken_from_the_folder_of_the_deck(decks, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path.parent)
    deck = decks.two_grains()
    assert deck.path == tmp_path / "input.yaml"
    assert [mesh.file for mesh in deck.meshes] == [tmp_path / "one.msh", tmp_path / "two.msh"]
    assert deck.particle_generation.file == tmp_path / "places.csv"
    assert deck.output.path == tmp_path / "out"


def test_single_particle_deck_needs_only_mesh_material_and_output(decks):
    deck = decks.one_grain()
    assert deck.single_particle
    assert deck.n_zones == 1
    assert deck.particles == (None,)
    assert deck.contacts == {}
    assert deck.particle_generation is None


def test_single_particle_initial_velocity_acts_on_body_0(decks):
    deck = decks.one_grain(changes={"IC.Constant_Velocity.Velocity_Vector": [1.0, 2.0]})
    assert deck.initial_velocity.particle_list == (0,)
    assert deck.initial_velocity.velocity_vector == (1.0, 2.0, 0.0)


def test_material_copies_are_followed_over_several_zones(decks):
    changes = {
        "Zone.Zones": 3,
        "Particle.Zone_3": {"Type": "circle", "Parameters": [1e-3]},
        "Mesh.Zone_3": {"File": "one.msh"},
        "Material.Zone_3": {"Copy_Material_Data": 2},
        "Contact.Zone_13": {"Copy_Contact_Data": [1, 1]},
        "Contact.Zone_23": {"Copy_Contact_Data": [2, 1]},
        "Contact.Zone_33": {"Copy_Contact_Data": [2, 3]},
    }
    deck = decks.two_grains(changes=changes)
    assert deck.materials[2] is deck.materials[0]
    assert len({id(contact) for contact in deck.contacts.values()}) == 1
    assert sorted(deck.contacts) == [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]


def _many_zones(n, walls=()):
    """Changes for n zones where Zone_ij has Friction_Coeff i + j/100."""
    changes = {"Zone": {"Zones": n}, "Displacement_BC.Sets": 1, "Contact": {}}
    for k in range(1, n + 1):
        changes["Zone"][f"Zone_{k}"] = {"Is_Wall": k in walls}
        changes[f"Particle.Zone_{k}"] = {"Type": "circle", "Parameters": [1e-3]}
        changes[f"Mesh.Zone_{k}"] = {"File": "one.msh"}
        if k > 1:
            changes[f"Material.Zone_{k}"] = {"Copy_Material_Data": 1}
        for j in range(k, n + 1):
            changes["Contact"][f"Zone_{k}{j}"] = {
                "Damping_On": False,
                "Friction_Coeff": k + j / 100,
                "Kn": 1e20,
            }
    return changes


def test_contact_pair_names_are_read_with_the_smaller_zone_first(decks):
    deck = decks.two_grains(changes=_many_zones(11))
    # Zone_110 is (1, 10) and Zone_111 is (1, 11), not (11, 1); counted from 0 here.
    assert deck.contacts[0, 9].friction_coeff == 1.10
    assert deck.contacts[0, 10].friction_coeff == 1.11
    assert deck.contacts[10, 10].friction_coeff == 11.11
    assert len(deck.contacts) == 11 * 12 // 2


def test_numbers_of_a_pair_may_be_written_apart(decks, remove):
    law = {"Damping_On": False, "Friction_Coeff": 0.7, "Kn": 1e20}
    changes = {"Contact.Zone_12": remove, "Contact.Zone_1_2": law}
    assert decks.two_grains(changes=changes).contacts[0, 1].friction_coeff == 0.7


def test_pairs_beyond_110_zones_are_written_apart(decks, remove):
    changes = _many_zones(112)
    laws = {"Zone_1_1": 0.1, "Zone_1_111": 0.2, "Zone_11_11": 0.3}
    changes["Contact"] = {
        name: {"Damping_On": False, "Friction_Coeff": friction, "Kn": 1e20}
        for name, friction in laws.items()
    }
    changes["Contact"]["Default_Pair"] = [1, 1]
    changes["Contact"]["Zone_2_112"] = {"Copy_Contact_Data": [1, 111]}
    contacts = decks.two_grains(changes=changes).contacts
    assert len(contacts) == 112 * 113 // 2
    expected = {(0, 0): 0.1, (0, 110): 0.2, (10, 10): 0.3, (1, 111): 0.2, (0, 1): 0.1, (5, 5): 0.1}
    assert {pair: contacts[pair].friction_coeff for pair in expected} == expected


def test_self_contact_of_the_default_pair_is_that_of_bodies_with_themselves(decks, remove):
    law = {"Damping_On": False, "Friction_On": False, "Kn": 1e20, "Self_Contact": True}
    contact = {"Zone_11": law, "Default_Pair": [1, 1]}
    contacts = decks.two_grains(changes={"Contact": contact}).contacts
    found = {pair: contact.self_contact for pair, contact in contacts.items()}
    assert found == {(0, 0): True, (0, 1): False, (1, 1): True}


def test_deck_of_ten_zones_reads_quickly(decks):
    path = decks.write(_many_zones(10))
    start = time.perf_counter()
    read_deck(path)
    assert time.perf_counter() - start < 0.3  # measured 0.05 s


def test_walls_need_no_contact_among_themselves(decks, remove):
    changes = {
        "Zone.Zone_1.Is_Wall": True,
        "Zone.Zone_2.Is_Wall": True,
        "Contact.Zone_11": remove,
        "Contact.Zone_12": remove,
        "Contact.Zone_22": remove,
    }
    assert decks.two_grains(changes=changes).contacts == {}


@pytest.mark.parametrize("block", ["Zone", "Particle"])
def test_wall_flag_may_stand_in_either_block(decks, remove, block):
    changes = {"Zone.Zone_1": remove, f"{block}.Zone_1.Is_Wall": True}
    if block == "Zone":
        changes = {"Zone.Zone_1": {"Is_Wall": True}}
    deck = decks.two_grains(changes=changes)
    assert [zone.is_wall for zone in deck.zones] == [True, False]


def test_flags_may_be_written_as_0_and_1(decks):
    deck = decks.two_grains(changes={"Output.Perform_Out": 0, "Output.Perform_FE_Out": 1})
    assert (deck.output.perform_out, deck.output.perform_fe_out) == (False, True)


@pytest.mark.parametrize(("value", "text"), [(0, "0"), ("run_a", "run_a")])
def test_tag_pp_may_be_a_number_or_a_word(decks, value, text):
    assert decks.two_grains(changes={"Output.Tag_PP": value}).output.tag_pp == text


def test_numbers_follow_yaml_1_2(decks):
    path = decks.write({})
    text = path.read_text(encoding="utf-8")
    decks.write_text(
        text.replace("Search_Factor: 10.0", "Search_Factor: 1e+01")
        .replace("Time_Steps: 1000", "Time_Steps: 1e3")
        .replace("Density: 1200.0", "Density: 1.200000E+03")
    )
    deck = read_deck(path)
    assert deck.neighbor.search_factor == 10.0
    assert deck.model.time_steps == 1000
    assert deck.materials[0].density == 1200.0


def test_empty_block_counts_as_not_given(decks):
    path = decks.write({})
    decks.write_text(path.read_text(encoding="utf-8") + "Restart:\n")
    assert read_deck(path).restart is None


def test_zero_displacement_set_needs_no_time_function(decks):
    held = {"Particle_List": [0], "Direction": [1, 2], "Zero_Displacement": True}
    load = decks.two_grains(changes={"Displacement_BC.Set_1": held}).displacement_sets[0]
    assert load.zero_displacement is True
    assert (load.time_function.type, load.time_function.parameters) == ("constant", (0.0,))
    assert load.spatial_function.type == "constant"


def test_rotation_needs_no_direction(decks):
    turning = {
        "Particle_List": [0],
        "Time_Function": {"Type": "rotation", "Parameters": [-125.0, -3e-3, 3e-3, 0.0]},
        "Spatial_Function": {"Type": "rotation"},
    }
    load = decks.two_grains(changes={"Displacement_BC.Set_1": turning}).displacement_sets[0]
    assert load.direction == (1, 2)
    assert load.time_function.rotation_axis is None  # z


def test_rotation_about_an_axis_takes_all_directions(decks):
    parameters = [-125.0, -3e-3, 3e-3, 0.0, 1.0, 1.0, 0.0]
    turning = {
        "Particle_List": [0],
        "Time_Function": {"Type": "rotation", "Parameters": parameters},
    }
    changes = {
        "Model.Dimension": 3,
        "Particle.Zone_1.Type": "sphere",
        "Particle.Zone_2.Type": "sphere",
        "Displacement_BC.Set_1": turning,
    }
    load = decks.two_grains(changes=changes).displacement_sets[0]
    assert load.direction == (1, 2, 3)
    assert load.time_function.rotation_axis == (1.0, 1.0, 0.0)


def test_force_set_keeps_region_lists_and_functions(decks):
    force = {
        "Region": {"Geometry": {"Type": "rectangle", "Parameters": [0, 0, 0, 1, 1, 0]}},
        "Particle_Exclude_List": [1],
        "Direction": [2],
        "Time_Function": {"Type": "linear_slow_fast", "Parameters": [4.0, 1e-4, 1e9, 2e9]},
        "Spatial_Function": {"Type": "hat_x", "Parameters": [2.0]},
    }
    deck = decks.two_grains(changes={"Force_BC.Sets": 1, "Force_BC.Set_1": force})
    (load,) = deck.force_sets
    assert load.region.geometry.parameters == (0.0, 0.0, 0.0, 1.0, 1.0, 0.0)
    assert load.particle_list is None
    assert load.particle_exclude_list == (1,)
    assert load.direction == (2,)
    assert load.time_function.parameters == (4.0, 1e-4, 1e9, 2e9)
    assert (load.spatial_function.type, load.spatial_function.parameters) == ("hat_x", (2.0,))


def test_options_of_the_contact_model_are_read(decks):
    changes = {
        "Model.Compatibility": "original",
        "Material.Zone_1.Bond_Breaking": "tension",
        "Contact.Zone_11.Center_Damping_Criterion": "nodes",
        "Contact.Zone_11.Node_Damping": True,
    }
    deck = decks.two_grains(changes=changes)
    assert deck.model.compatibility == "original"
    assert deck.materials[0].bond_breaking == "tension"
    assert deck.contacts[0, 0].center_damping_criterion == "nodes"
    assert deck.contacts[0, 0].node_damping is True


def test_friction_with_history_and_self_contact_are_read(decks):
    changes = {
        "Contact.Zone_11.Friction_Model": "history",
        "Contact.Zone_11.Tangential_Stiffness_Ratio": 0.5,
        "Contact.Zone_11.Self_Contact": True,
    }
    contacts = decks.two_grains(changes=changes).contacts
    assert contacts[0, 0].friction_model == "history"
    assert contacts[0, 0].tangential_stiffness_ratio == 0.5
    assert contacts[0, 0].self_contact is True
    plain = decks.two_grains().contacts[0, 0]
    assert (plain.friction_model, plain.self_contact) == ("slip", False)
    assert plain.tangential_stiffness_ratio is None  # 2/7, the core's


def test_friction_settings_without_effect_are_noted(decks):
    deck = decks.two_grains(changes={"Contact.Zone_11.Tangential_Stiffness_Ratio": 0.5})
    (note,) = deck.notes
    assert note.endswith("has no effect without Friction_Model: history")
    changes = {"Contact.Zone_11.Friction_Model": "history", "Contact.Zone_11.Friction_On": False}
    (note,) = decks.two_grains(changes=changes).notes
    assert note.endswith("has no effect with Friction_On: false")


@pytest.mark.parametrize("name", ["Kn", "Kn_Factor"])
def test_contact_without_force_is_noted_once_for_all_copies(decks, name):
    (note,) = decks.two_grains(changes={f"Contact.Zone_11.{name}": 0.0}).notes
    line = decks.line_of("Contact", "Zone_11", name)
    expected = f"input.yaml:{line}: Contact.Zone_11.{name} = 0.0: means no contact force"
    assert note.startswith(expected)


def test_contact_without_force_between_walls_is_silent(decks):
    changes = {"Zone.Zone_1.Is_Wall": True, "Zone.Zone_2.Is_Wall": True, "Contact.Zone_11.Kn": 0.0}
    assert decks.two_grains(changes=changes).notes == ()


def test_built_in_mesh_takes_the_shape_of_the_particle(decks, remove):
    changes = {
        "Mesh.Zone_1": {"CreateMesh": {"Flag": True, "Info": "uniform"}, "Mesh_Size": 5e-4},
        "Particle.Zone_1": {"Type": "rectangle", "Parameters": [0, 0, 0, 0.01, 0.01, 0]},
    }
    deck = decks.one_grain(changes=changes)
    assert deck.meshes[0].creates
    assert deck.meshes[0].file is None
    assert deck.meshes[0].mesh_size == 5e-4


def test_restart_test_and_stop_criterion_are_read(decks, tmp_path):
    (tmp_path / "state.vtu").touch()
    changes = {
        "Restart": {"File": "state.vtu", "Step": 500, "Change_Reference_Free_Dofs": True},
        "Particle.Test_Name": "compressive_test",
        "Particle.Compressive_Test": {"Particle_Id": 1, "Particle_Force_Direction": 2},
        "Output.Output_Criteria": {
            "Type": "max_node_dist",
            "Parameters": [1.37],
            "New_Interval": 5,
        },
    }
    deck = decks.two_grains(changes=changes)
    assert deck.restart.file == tmp_path / "state.vtu"
    assert deck.restart.step == 500
    assert deck.compressive_test.particle_id == 1
    assert deck.output.output_criteria.parameters == (1.37,)
    assert deck.output.output_criteria.new_interval == 5


def test_empty_tags_of_the_original_are_noted(decks):
    changes = {"Output.Tags": ["Damage", "Contact_Nodes", "Damage"]}
    deck = decks.two_grains(changes=changes)
    assert deck.output.tags == ("Damage", "Contact_Nodes")
    (note,) = deck.notes
    assert note.startswith(f"{deck.where('Output.Tags[1]')}: Output.Tags[1] = Contact_Nodes: ")
    assert "ignored" in note


def test_keys_without_effect_are_noted(decks):
    changes = {
        "Model.Horizon": 1e-3,
        "Contact.Zone_11.V_Max": 1.0,
        "Displacement_BC.Set_1.Time_Function.Parameters": [0.0, 1.0],
    }
    notes = "\n".join(decks.two_grains(changes=changes).notes)
    assert "Model.Horizon = 0.001: has no effect" in notes
    assert "Contact.Zone_11.V_Max = 1.0: has no effect beside Kn" in notes
    assert "only the first 1 are used by constant" in notes


def test_set_without_region_and_list_is_noted(decks, remove):
    deck = decks.two_grains(changes={"Displacement_BC.Set_1.Particle_List": remove})
    assert any("Displacement_BC.Set_1: selects no node" in note for note in deck.notes)


def test_blocks_without_effect_are_accepted(decks):
    changes = {"Policy": {"Enable_PostProcessing": True}, "HPX": {"Partitions": 1}}
    decks.two_grains(changes=changes)


def test_where_names_the_line_of_keys_items_and_missing_keys(decks):
    deck = decks.two_grains()
    line = decks.line_of("Material", "Zone_1", "Horizon")
    assert deck.where("Material.Zone_1.Horizon") == f"input.yaml:{line}"
    # Zone_2 is a copy: the nearest block that is in the file is named.
    line = decks.line_of("Material", "Zone_2")
    assert deck.where("Material.Zone_2.Horizon") == f"input.yaml:{line}"
    assert deck.where("Restart.File") == "input.yaml"
    first = decks.line_of("Output", "Tags") + 1
    assert deck.where("Output.Tags[0]") == f"input.yaml:{first}"


def test_error_after_reading_names_line_key_and_value(decks):
    deck = decks.two_grains()
    error = deck.error("Material.Zone_1.Horizon", "is below the mesh size; enlarge it")
    line = decks.line_of("Material", "Zone_1", "Horizon")
    expected = f"input.yaml:{line}: Material.Zone_1.Horizon = 0.0006: is below the mesh size; "
    assert str(error) == expected + "enlarge it"


def test_hash_is_that_of_the_file(decks):
    deck = decks.two_grains()
    assert deck.sha256 == hashlib.sha256(deck.path.read_bytes()).hexdigest()
