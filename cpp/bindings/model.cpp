#include "peridem/model.h"

#include "bindings.h"
#include "peridem/errors.h"
#include "peridem/instruction_set.h"
#include "peridem/memory.h"

namespace peridem::bindings {

namespace {

using Clock = std::chrono::steady_clock;

// Steps until `n` are taken or `seconds` have passed, at least one; the caller regains control in
// between, so that signals and progress are served.
Offset advance(DEMModel& model, Offset n, double seconds) {
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  return model.integrate(n, [&] { return Clock::now() > deadline; });
}

template <class T>
auto stateView(std::vector<T> State::* member, Access access) {
  return [member, access](const py::object& self) {
    return view(self.cast<State&>().*member, self, access);
  };
}

void bindState(py::module_& m) {
  py::class_<State>(m, "State", "Arrays over all nodes, without copies.")
      .def_property_readonly("x_ref", stateView(&State::x_ref, Access::read_only))
      .def_property_readonly("x", stateView(&State::x, Access::writable))
      .def_property_readonly("u", stateView(&State::u, Access::writable))
      .def_property_readonly("v", stateView(&State::v, Access::writable))
      .def_property_readonly("f", stateView(&State::f, Access::writable))
      .def_property_readonly("volume", stateView(&State::volume, Access::read_only))
      .def_property_readonly("density", stateView(&State::density, Access::read_only))
      .def_property_readonly("theta", stateView(&State::theta, Access::writable))
      .def_property_readonly("weighted_volume",
                             stateView(&State::weighted_volume, Access::read_only))
      .def_property_readonly("damage_z", stateView(&State::damage_z, Access::writable))
      .def_property_readonly("particle_id", stateView(&State::particle_id, Access::read_only))
      .def_property_readonly("zone_id", stateView(&State::zone_id, Access::read_only))
      .def_property_readonly("fixity", stateView(&State::fixity, Access::read_only))
      .def_property_readonly("force_fixity", stateView(&State::force_fixity, Access::read_only))
      .def("__len__", &State::size);
}

void bindParticle(py::module_& m) {
  py::class_<Particle>(m, "Particle", "A body: particle or wall.")
      .def_readonly("id", &Particle::id)
      .def_readonly("zone", &Particle::zone)
      .def_readonly("is_wall", &Particle::is_wall)
      .def_readonly("constrained", &Particle::constrained)
      .def_readonly("start", &Particle::start)
      .def_readonly("stop", &Particle::stop)
      .def_readonly("center_node", &Particle::center_node)
      .def_readonly("bounding_radius", &Particle::bounding_radius)
      .def_readonly("mesh_size", &Particle::mesh_size)
      .def_readonly("horizon", &Particle::horizon)
      .def_readonly("volume", &Particle::volume)
      .def_readonly("density", &Particle::density)
      .def_readonly("bulk_modulus", &Particle::bulk_modulus)
      .def_readonly("self_contact_radius", &Particle::self_contact_radius)
      .def_readonly("self_contact_kn", &Particle::self_contact_kn);

  py::class_<BondTable>(m, "BondTable", "Compressed bond lists, without copies.")
      .def_property_readonly("offsets",
                             [](const py::object& self) {
                               return view(self.cast<BondTable&>().offsets, self,
                                           Access::read_only);
                             })
      .def_property_readonly("indices",
                             [](const py::object& self) {
                               return view(self.cast<BondTable&>().neighbors, self,
                                           Access::read_only);
                             })
      .def_property_readonly("intact", [](const py::object& self) {
        return view(self.cast<BondTable&>().intact, self, Access::read_only);
      });
}

py::dict timings(const DEMModel& model) {
  const Timings& t = model.timings();
  py::dict result;
  result["setup"] = t.setup;
  result["peridynamic"] = t.peridynamic;
  result["contact_search"] = t.contact_search;
  result["contact"] = t.contact;
  result["external"] = t.external;
  result["integration"] = t.integration;
  return result;
}

py::dict memoryCosts() {
  const MemoryCosts costs;
  py::dict result;
  result["node"] = costs.node;
  result["bond"] = costs.bond;
  result["place"] = costs.place;
  result["halo"] = costs.halo;
  result["exchange"] = costs.exchange;
  result["tile_bonds"] = costs.tile_bonds;
  result["group"] = costs.group;
  result["weights"] = costs.weights;
  result["lengths"] = costs.lengths;
  result["flags"] = costs.flags;
  result["tile"] = costs.tile;
  result["whole"] = BlockSizes{}.whole;
  return result;
}

py::dict contactLaw(const DEMModel& model, Index body_i, Index body_j) {
  const auto& bodies = model.particles();
  const ContactLaw& law = model.contact().law(bodies.at(static_cast<std::size_t>(body_i)),
                                              bodies.at(static_cast<std::size_t>(body_j)));
  py::dict result;
  result["radius"] = law.radius;
  result["kn"] = law.kn;
  result["friction"] = law.friction;
  result["damping_factor"] = law.damping_factor;
  result["kappa"] = law.kappa;
  return result;
}

void setIntact(DEMModel& model, const py::array_t<std::uint8_t, py::array::c_style>& intact) {
  model.setIntact({intact.data(), static_cast<std::size_t>(intact.size())});
}

// Length r and weight w of every bond, shape (n_bonds, 2).
py::array_t<Real> bondConstants(const DEMModel& model) {
  const auto constants = model.bondConstants();
  static_assert(sizeof(BondConstants) == 2 * sizeof(Real));
  py::array_t<Real> array({constants.size(), std::size_t{2}});
  if (!constants.empty())
    std::copy_n(&constants.front().length, 2 * constants.size(), array.mutable_data());
  return array;
}

py::array_t<Real> contactForces(DEMModel& model) {
  std::vector<Vec3> f;
  {
    const py::gil_scoped_release release;
    f = model.contactForces();
  }
  py::array_t<Real> array({f.size(), std::size_t{3}});
  if (!f.empty()) std::copy_n(f.front().data(), 3 * f.size(), array.mutable_data());
  return array;
}

// Pairs of nodes in contact, shape (k, 2).
py::array_t<Index> touchingNodes(DEMModel& model) {
  std::vector<std::pair<Index, Index>> pairs;
  {
    const py::gil_scoped_release release;
    pairs = model.touchingNodes();
  }
  py::array_t<Index> array({pairs.size(), std::size_t{2}});
  auto node = array.mutable_unchecked<2>();
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    node(static_cast<py::ssize_t>(k), 0) = pairs[k].first;
    node(static_cast<py::ssize_t>(k), 1) = pairs[k].second;
  }
  return array;
}

// Stretched springs of the friction with history: node pairs (k, 2) and elongations (k, 3).
py::tuple slips(const DEMModel& model) {
  const std::vector<SlipRecord> records = model.contact().slips();
  py::array_t<Index> nodes({records.size(), std::size_t{2}});
  py::array_t<Real> elongations({records.size(), std::size_t{3}});
  auto node = nodes.mutable_unchecked<2>();
  auto elongation = elongations.mutable_unchecked<2>();
  for (std::size_t k = 0; k < records.size(); ++k) {
    const auto row = static_cast<py::ssize_t>(k);
    node(row, 0) = records[k].i;
    node(row, 1) = records[k].j;
    for (int d = 0; d < 3; ++d) elongation(row, d) = records[k].elongation[d];
  }
  return py::make_tuple(nodes, elongations);
}

void restore(DEMModel& model, Offset n, Real time, const py::array_t<Index>& nodes,
             const PointArray& elongations) {
  const std::vector<Vec3> values = toPoints(elongations, "elongations");
  const auto node = nodes.unchecked<2>();
  if (nodes.shape(0) != elongations.shape(0) || nodes.shape(1) != 2)
    throw InputError("nodes: expected one pair per elongation");
  std::vector<SlipRecord> records(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    records[k] = {node(static_cast<py::ssize_t>(k), 0), node(static_cast<py::ssize_t>(k), 1),
                  values[k]};
  model.restore(n, time, records);
}

}  // namespace

void bindModel(py::module_& m) {
  bindState(m);
  bindParticle(m);
  m.def("memory_costs", &memoryCosts);
  m.def("lengths_pay",
        [](double bytes) { return lengthsPay(instructionSet(), static_cast<std::size_t>(bytes)); });
  m.def("nodes_of_piece", [](Index nodes) { return BlockSizes{}.nodesOfPiece(nodes); });
  using Release = py::call_guard<py::gil_scoped_release>;
  py::class_<DEMModel> bound(m, "DEMModel");
  bindDiagnostics(bound);
  bound.def(py::init<ModelDeck, int>(), py::arg("deck"), py::arg("threads"), Release())
      .def("add_displacement_set", &DEMModel::addDisplacementSet)
      .def("add_force_set", &DEMModel::addForceSet)
      .def("add_initial_velocity", &DEMModel::addInitialVelocity)
      .def("init", &DEMModel::init, Release())
      .def("set_duration", &DEMModel::setDuration, py::arg("final_time"), py::arg("time_steps"))
      .def("start", &DEMModel::start, Release())
      .def("advance", &advance, py::arg("n"), py::arg("seconds"), Release())
      .def(
          "compute_forces",
          [](DEMModel& model) {
            model.computeForces();
            model.computeDamage();
          },
          Release())
      .def("compute_peridynamic_forces", &DEMModel::computePeridynamicForces, Release())
      .def(
          "compute_contact_forces", [](DEMModel& model) { model.computeContactForces(); },
          Release())
      .def("contact_forces", &contactForces)
      .def("touching_nodes", &touchingNodes)
      .def("slips", &slips)
      .def("compute_damage", &DEMModel::computeDamage, Release())
      .def("set_intact", &setIntact, py::arg("intact"))
      .def("bond_constants", &bondConstants)
      .def_property_readonly("instruction_set", &DEMModel::instructionSet)
      .def("restore", &restore, py::arg("n"), py::arg("time"), py::arg("nodes"),
           py::arg("elongations"))
      .def("compute_external_forces", &DEMModel::computeExternalForces, Release())
      .def(
          "compute_external_displacement_bc",
          [](DEMModel& model) { model.computeExternalDisplacementBC(); }, Release())
      .def("stable_time_step",
           [](const DEMModel& model) {
             const auto limit = model.stableTimeStep();
             return std::make_tuple(limit.bonds, limit.contact, limit.self_contact);
           })
      .def("timings", &timings)
      .def("contact_law", &contactLaw, py::arg("body_i"), py::arg("body_j"))
      .def("contact_candidates",
           [](const DEMModel& model) {
             return model.contact().search().candidates().indices.size();
           })
      .def("contact_rebuilds",
           [](const DEMModel& model) { return model.contact().search().rebuilds(); })
      .def_property_readonly("memory_bytes", &DEMModel::memoryBytes)
      .def_property_readonly("state", py::overload_cast<>(&DEMModel::state),
                             py::return_value_policy::reference_internal)
      .def_property_readonly("bonds", py::overload_cast<>(&DEMModel::bonds),
                             py::return_value_policy::reference_internal)
      .def_property_readonly("particles", &DEMModel::particles,
                             py::return_value_policy::reference_internal)
      .def_property_readonly("time", &DEMModel::time)
      .def_property_readonly("dt", &DEMModel::timeStep)
      .def_property_readonly("n", &DEMModel::n)
      .def_property_readonly("threads", &DEMModel::threads)
      .def_property_readonly("started", &DEMModel::started);
}

}  // namespace peridem::bindings
