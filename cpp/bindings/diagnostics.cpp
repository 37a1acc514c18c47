#include "bindings.h"
#include "peridem/errors.h"
#include "peridem/fragments.h"

namespace peridem::bindings {

namespace {

py::dict energies(DEMModel& model) {
  Energies found;
  {
    const py::gil_scoped_release release;
    found = model.energies();
  }
  py::dict result;
  result["kinetic"] = found.kinetic;
  result["bond"] = found.bonds;
  result["self_contact"] = found.self_contact;
  result["contact"] = found.contact;
  result["tangential"] = found.tangential;
  result["gravity"] = found.gravity;
  return result;
}

// The numbers of EnergyFlows by name, for reading and writing alike.
template <class Flows, class Visit>
void forEachFlow(Flows& flows, Visit visit) {
  visit("work_prescribed", flows.work_prescribed);
  visit("work_forces", flows.work_forces);
  visit("damping", flows.damping);
  visit("friction", flows.friction);
  visit("fracture", flows.fracture);
  visit("created", flows.created);
  visit("start", flows.start);
  visit("tangential_start", flows.tangential_start);
}

py::dict energyFlows(const DEMModel& model) {
  py::dict result;
  const EnergyFlows flows = model.energyTracker().flows();
  forEachFlow(flows, [&](const char* name, const Real& value) { result[name] = value; });
  return result;
}

py::array_t<Real> pointsArray(const std::vector<Vec3>& points) {
  py::array_t<Real> array({points.size(), std::size_t{3}});
  if (!points.empty()) std::copy_n(points.front().data(), 3 * points.size(), array.mutable_data());
  return array;
}

// Forces of friction, dampers and force sets that the work of the next step needs.
py::tuple energyForces(const DEMModel& model) {
  const auto& forces = model.energyTracker().forces();
  return py::make_tuple(pointsArray(forces.contact.friction), pointsArray(forces.contact.damping),
                        pointsArray(forces.sets));
}

// Work of prescribed motion on each body.
py::array_t<Real> prescribedWorks(const DEMModel& model) {
  const auto& works = model.energyTracker().prescribedWorks();
  return py::array_t<Real>(static_cast<py::ssize_t>(works.size()), works.data());
}

void restoreEnergy(DEMModel& model, const py::dict& values, const PointArray& friction,
                   const PointArray& damping, const PointArray& sets,
                   const std::vector<Real>& prescribed_works) {
  EnergyFlows flows;
  forEachFlow(flows, [&](const char* name, Real& value) { value = values[name].cast<Real>(); });
  model.restoreEnergy(
      flows,
      {{toPoints(friction, "friction"), toPoints(damping, "damping")}, toPoints(sets, "sets")},
      prescribed_works);
}

py::array_t<Real> bondVirials(DEMModel& model) {
  std::vector<Eigen::Matrix3d> virials;
  {
    const py::gil_scoped_release release;
    virials = model.bondVirials();
  }
  py::array_t<Real> array({virials.size(), std::size_t{3}, std::size_t{3}});
  auto values = array.mutable_unchecked<3>();
  for (std::size_t i = 0; i < virials.size(); ++i)
    for (int d = 0; d < 3; ++d)
      for (int e = 0; e < 3; ++e) values(static_cast<py::ssize_t>(i), d, e) = virials[i](d, e);
  return array;
}

py::array_t<Index> fragmentLabels(const DEMModel& model) {
  const auto labels = peridem::fragmentLabels(model.bonds(), model.state().size());
  return py::array_t<Index>(static_cast<py::ssize_t>(labels.size()), labels.data());
}

// Pairs of nodes (k, 2) and normal, friction and damping force on the first (k, 3, 3) [N].
py::tuple nodeContacts(DEMModel& model) {
  const auto contacts = model.nodeContacts();
  py::array_t<Index> nodes({contacts.size(), std::size_t{2}});
  py::array_t<Real> forces({contacts.size(), std::size_t{3}, std::size_t{3}});
  auto node = nodes.mutable_unchecked<2>();
  auto force = forces.mutable_unchecked<3>();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const auto row = static_cast<py::ssize_t>(k);
    node(row, 0) = contacts[k].i;
    node(row, 1) = contacts[k].j;
    for (int d = 0; d < 3; ++d) {
      force(row, 0, d) = contacts[k].normal[d];
      force(row, 1, d) = contacts[k].friction[d];
      force(row, 2, d) = contacts[k].damping[d];
    }
  }
  return py::make_tuple(nodes, forces);
}

// Pairs of bodies (k, 2) and force of their dampers on either (k, 2, 3) [N].
py::tuple bodyDampings(DEMModel& model) {
  const auto dampings = model.bodyDampings();
  py::array_t<Index> bodies({dampings.size(), std::size_t{2}});
  py::array_t<Real> forces({dampings.size(), std::size_t{2}, std::size_t{3}});
  auto body = bodies.mutable_unchecked<2>();
  auto force = forces.mutable_unchecked<3>();
  for (std::size_t k = 0; k < dampings.size(); ++k) {
    const auto row = static_cast<py::ssize_t>(k);
    body(row, 0) = dampings[k].p;
    body(row, 1) = dampings[k].q;
    for (int d = 0; d < 3; ++d) {
      force(row, 0, d) = dampings[k].on_p[d];
      force(row, 1, d) = dampings[k].on_q[d];
    }
  }
  return py::make_tuple(bodies, forces);
}

}  // namespace

void bindDiagnostics(py::class_<DEMModel>& model) {
  model.def_property("track_energy", &DEMModel::tracksEnergy, &DEMModel::trackEnergy)
      .def("energies", &energies)
      .def("energy_flows", &energyFlows)
      .def("energy_forces", &energyForces)
      .def("restore_energy", &restoreEnergy, py::arg("flows"), py::arg("friction"),
           py::arg("damping"), py::arg("sets"), py::arg("prescribed_works"))
      .def("prescribed_works", &prescribedWorks)
      .def("bond_virials", &bondVirials)
      .def("fragment_labels", &fragmentLabels)
      .def("node_contacts", &nodeContacts)
      .def("body_dampings", &bodyDampings);
}

}  // namespace peridem::bindings
