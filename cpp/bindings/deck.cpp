// The structs of cpp/peridem/deck.h, field by field.
#include "peridem/deck.h"

#include <pybind11/native_enum.h>

#include <algorithm>
#include <array>

#include "bindings.h"
#include "peridem/errors.h"

namespace peridem::bindings {

namespace {

using std::uint8_t;
using Array3 = std::array<Real, 3>;
using IndexArray = py::array_t<Index, py::array::c_style | py::array::forcecast>;

Vec3 toVec3(const Array3& a) {
  return Vec3(a[0], a[1], a[2]);
}
Array3 toArray(const Vec3& v) {
  return {v[0], v[1], v[2]};
}

// A Vec3 member as a tuple of three numbers.
template <class Struct>
void defVec3(py::class_<Struct>& type, const char* name, Vec3 Struct::* member) {
  type.def_property(
      name, [member](const Struct& s) { return toArray(s.*member); },
      [member](Struct& s, const Array3& value) { s.*member = toVec3(value); });
}

void bindEnums(py::module_& m) {
  py::native_enum<Compatibility>(m, "Compatibility", "enum.Enum")
      .value("corrected", Compatibility::corrected)
      .value("original", Compatibility::original)
      .finalize();
  py::native_enum<TimeScheme>(m, "TimeScheme", "enum.Enum")
      .value("central_difference", TimeScheme::central_difference)
      .value("velocity_verlet", TimeScheme::velocity_verlet)
      .finalize();
  py::native_enum<MaterialType>(m, "MaterialType", "enum.Enum")
      .value("pd_state", MaterialType::pd_state)
      .value("pmb_bond", MaterialType::pmb_bond)
      .value("rnp_bond", MaterialType::rnp_bond)
      .value("pd_elastic_bond", MaterialType::pd_elastic_bond)
      .finalize();
  py::native_enum<BondBreaking>(m, "BondBreaking", "enum.Enum")
      .value("both", BondBreaking::both)
      .value("tension", BondBreaking::tension)
      .finalize();
  py::native_enum<InfluenceType>(m, "InfluenceType", "enum.Enum")
      .value("constant", InfluenceType::constant)
      .value("linear", InfluenceType::linear)
      .value("gaussian", InfluenceType::gaussian)
      .finalize();
  py::native_enum<CellType>(m, "CellType", "enum.Enum")
      .value("none", CellType::none)
      .value("line", CellType::line)
      .value("triangle", CellType::triangle)
      .value("quad", CellType::quad)
      .value("tetra", CellType::tetra)
      .finalize();
  py::native_enum<DampingCriterion>(m, "DampingCriterion", "enum.Enum")
      .value("centers", DampingCriterion::centers)
      .value("nodes", DampingCriterion::nodes)
      .finalize();
  py::native_enum<FrictionModel>(m, "FrictionModel", "enum.Enum")
      .value("slip", FrictionModel::slip)
      .value("history", FrictionModel::history)
      .finalize();
  py::native_enum<TimeFunctionType>(m, "TimeFunctionType", "enum.Enum")
      .value("constant", TimeFunctionType::constant)
      .value("linear", TimeFunctionType::linear)
      .value("quadratic", TimeFunctionType::quadratic)
      .value("sin", TimeFunctionType::sin)
      .value("rotation", TimeFunctionType::rotation)
      .value("linear_step", TimeFunctionType::linear_step)
      .value("linear_slow_fast", TimeFunctionType::linear_slow_fast)
      .finalize();
}

void bindMesh(py::module_& m) {
  py::class_<Mesh>(m, "Mesh").def(py::init([](const PointArray& points, CellType cell_type,
                                              const IndexArray& cells, std::vector<Real> volumes) {
                                    Mesh mesh;
                                    mesh.points = toPoints(points, "points");
                                    mesh.cell_type = cell_type;
                                    mesh.cells.assign(cells.data(), cells.data() + cells.size());
                                    mesh.volumes = std::move(volumes);
                                    return mesh;
                                  }),
                                  py::arg("points"), py::arg("cell_type"), py::arg("cells"),
                                  py::arg("volumes") = std::vector<Real>());
}

void bindZone(py::module_& m) {
  py::class_<InfluenceDeck>(m, "InfluenceDeck")
      .def(py::init<>())
      .def_readwrite("type", &InfluenceDeck::type)
      .def_readwrite("parameters", &InfluenceDeck::parameters);

  py::class_<MaterialDeck>(m, "MaterialDeck")
      .def(py::init<>())
      .def_readwrite("type", &MaterialDeck::type)
      .def_readwrite("density", &MaterialDeck::density)
      .def_readwrite("horizon", &MaterialDeck::horizon)
      .def_readwrite("horizon_mesh_ratio", &MaterialDeck::horizon_mesh_ratio)
      .def_readwrite("youngs_modulus", &MaterialDeck::youngs_modulus)
      .def_readwrite("bulk_modulus", &MaterialDeck::bulk_modulus)
      .def_readwrite("shear_modulus", &MaterialDeck::shear_modulus)
      .def_readwrite("poisson_ratio", &MaterialDeck::poisson_ratio)
      .def_readwrite("fracture_energy", &MaterialDeck::fracture_energy)
      .def_readwrite("critical_stress_factor", &MaterialDeck::critical_stress_factor)
      .def_readwrite("law_parameters", &MaterialDeck::law_parameters)
      .def_readwrite("bond_breaking", &MaterialDeck::bond_breaking)
      .def_readwrite("irreversible_fracture", &MaterialDeck::irreversible_fracture)
      .def_readwrite("check_sc_factor", &MaterialDeck::check_sc_factor)
      .def_readwrite("influence", &MaterialDeck::influence);

  py::class_<ZoneDeck> zone(m, "ZoneDeck");
  zone.def(py::init<>())
      .def_readwrite("name", &ZoneDeck::name)
      .def_readwrite("is_wall", &ZoneDeck::is_wall)
      .def_readwrite("all_dofs_constrained", &ZoneDeck::all_dofs_constrained)
      .def_readwrite("mesh", &ZoneDeck::mesh)
      .def_readwrite("bounding_radius", &ZoneDeck::bounding_radius)
      .def_readwrite("material", &ZoneDeck::material);
  defVec3(zone, "center", &ZoneDeck::center);

  py::class_<BodyDeck> body(m, "BodyDeck");
  body.def(py::init<>())
      .def_readwrite("zone", &BodyDeck::zone)
      .def_readwrite("angle", &BodyDeck::angle)
      .def_readwrite("scale", &BodyDeck::scale)
      .def_readwrite("constrained", &BodyDeck::constrained);
  defVec3(body, "site", &BodyDeck::site);
  defVec3(body, "axis", &BodyDeck::axis);

  py::class_<ContactDeck>(m, "ContactDeck")
      .def(py::init<>())
      .def_readwrite("contact_radius", &ContactDeck::contact_radius)
      .def_readwrite("contact_radius_factor", &ContactDeck::contact_radius_factor)
      .def_readwrite("kn", &ContactDeck::kn)
      .def_readwrite("kn_factor", &ContactDeck::kn_factor)
      .def_readwrite("damping_on", &ContactDeck::damping_on)
      .def_readwrite("epsilon", &ContactDeck::epsilon)
      .def_readwrite("beta_n_factor", &ContactDeck::beta_n_factor)
      .def_readwrite("friction_on", &ContactDeck::friction_on)
      .def_readwrite("friction_coeff", &ContactDeck::friction_coeff)
      .def_readwrite("center_damping_criterion", &ContactDeck::center_damping_criterion)
      .def_readwrite("node_damping", &ContactDeck::node_damping)
      .def_readwrite("friction_model", &ContactDeck::friction_model)
      .def_readwrite("tangential_stiffness_ratio", &ContactDeck::tangential_stiffness_ratio)
      .def_readwrite("self_contact", &ContactDeck::self_contact);
}

// A Python function of time that returns an array of shape (n_nodes, 3). What it raises goes
// through the core unchanged.
NodeFunction nodeFunction(const py::function& function) {
  NodeFunction result;
  result.evaluate = [function](Real t, std::span<Vec3> values) {
    const py::gil_scoped_acquire acquire;
    const std::vector<Vec3> points = toPoints(function(t).cast<PointArray>(), "load");
    if (points.size() != values.size()) throw InputError("load: one value per node is needed");
    std::copy(points.begin(), points.end(), values.begin());
  };
  return result;
}

template <class Struct>
void defFunction(py::class_<Struct>& type, const char* name, NodeFunction Struct::* member) {
  type.def(name, [member](Struct& s, const py::function& f) { s.*member = nodeFunction(f); });
}

void bindLoads(py::module_& m) {
  py::class_<TimeFunction>(m, "TimeFunction")
      .def(py::init([](TimeFunctionType type, std::vector<Real> parameters) {
             return TimeFunction{type, std::move(parameters)};
           }),
           py::arg("type"), py::arg("parameters"))
      .def_readwrite("type", &TimeFunction::type)
      .def_readwrite("parameters", &TimeFunction::parameters);

  py::class_<DisplacementSet> displacement(m, "DisplacementSet");
  displacement.def(py::init<>())
      .def_readwrite("nodes", &DisplacementSet::nodes)
      .def_readwrite("amplitude", &DisplacementSet::amplitude)
      .def_readwrite("directions", &DisplacementSet::directions)
      .def_readwrite("time_function", &DisplacementSet::time_function)
      .def_readwrite("zero_displacement", &DisplacementSet::zero_displacement);
  defVec3(displacement, "rotation_axis", &DisplacementSet::rotation_axis);
  defFunction(displacement, "set_displacement", &DisplacementSet::displacement);
  defFunction(displacement, "set_velocity", &DisplacementSet::velocity);

  py::class_<ForceSet> force(m, "ForceSet");
  force.def(py::init<>())
      .def_readwrite("nodes", &ForceSet::nodes)
      .def_readwrite("amplitude", &ForceSet::amplitude)
      .def_readwrite("directions", &ForceSet::directions)
      .def_readwrite("time_function", &ForceSet::time_function);
  defFunction(force, "set_density", &ForceSet::density);

  py::class_<InitialVelocity> initial(m, "InitialVelocity");
  initial.def(py::init<>()).def_readwrite("bodies", &InitialVelocity::bodies);
  defVec3(initial, "velocity", &InitialVelocity::velocity);
  defVec3(initial, "spin", &InitialVelocity::spin);
}

}  // namespace

void bindDeck(py::module_& m) {
  bindEnums(m);
  bindMesh(m);
  bindZone(m);
  bindLoads(m);
  py::class_<ModelDeck> deck(m, "ModelDeck");
  deck.def(py::init<>())
      .def_readwrite("dimension", &ModelDeck::dimension)
      .def_readwrite("final_time", &ModelDeck::final_time)
      .def_readwrite("time_steps", &ModelDeck::time_steps)
      .def_readwrite("time_scheme", &ModelDeck::time_scheme)
      .def_readwrite("compatibility", &ModelDeck::compatibility)
      .def_readwrite("meshes", &ModelDeck::meshes)
      .def_readwrite("zones", &ModelDeck::zones)
      .def_readwrite("bodies", &ModelDeck::bodies)
      .def_readwrite("contacts", &ModelDeck::contacts);
  defVec3(deck, "gravity", &ModelDeck::gravity);
}

}  // namespace peridem::bindings
