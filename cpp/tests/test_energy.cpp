#include "peridem/energy.h"
#include "peridem/fragments.h"
#include "support.h"

namespace peridem::test {

namespace {

constexpr Real h = 0.1;
constexpr Real horizon = 0.25;

DEMModel square(MaterialType type, Real fracture_energy = 4e7 * horizon) {
  MaterialDeck m = material(type, horizon);
  m.fracture_energy = fracture_energy;
  return DEMModel(oneBody(triangleGrid(6, 5, h), m), 1);
}

Real strainEnergy(DEMModel& model) {
  const Energies found = model.energies();
  return found.bonds + found.self_contact;
}

// f of a node from central differences of the energy with its position.
Vec3 forceFromEnergy(DEMModel& model, std::size_t i) {
  constexpr Real step = 1e-6 * h;
  Vec3 force = Vec3::Zero();
  State& state = model.state();
  const Vec3 u = state.u[i];
  for (int d = 0; d < 2; ++d) {
    Real energy[2];
    for (int side = 0; side < 2; ++side) {
      setDisplacement(state, i, u + (side == 0 ? step : -step) * Vec3::Unit(d));
      energy[side] = strainEnergy(model);
    }
    force[d] = -(energy[0] - energy[1]) / (2 * step) / state.volume[i];
  }
  setDisplacement(state, i, u);
  return force;
}

}  // namespace

TEST_CASE("energy: forces of bonds and springs are the negative gradient of theirs") {
  for (const MaterialType type : {MaterialType::pd_state, MaterialType::pmb_bond,
                                  MaterialType::rnp_bond, MaterialType::pd_elastic_bond}) {
    CAPTURE(static_cast<int>(type));
    DEMModel model = square(type);
    model.start();
    displaceAtRandom(model.state(), 0.02 * h, 2, 3);
    // Some bonds are broken, and two of their ends pushed together.
    std::vector<std::uint8_t> intact = model.bonds().intact;
    for (const auto& [i, j] : {std::pair<Index, Index>{8, 9}, {8, 14}, {15, 21}}) {
      intact[model.bonds().find(i, j)] = 0;
      intact[model.bonds().find(j, i)] = 0;
    }
    model.setIntact(intact);
    setDisplacement(model.state(), 8, Vec3(0.2 * h, 0.01 * h, 0));
    model.computePeridynamicForces();
    REQUIRE(model.bonds().intact == intact);
    REQUIRE(model.energies().self_contact > 0);
    const std::vector<Vec3> f = model.state().f;
    // Rounding of the energies by 1e-16, over displacements of 1e-6: 1e-9, and the size of the
    // energies over that of their changes in a step.
    for (const std::size_t i : {8, 9, 14, 21})
      CHECK((forceFromEnergy(model, i) - f[i]).norm() < 1e-6 * largestNorm(f));
  }
}

TEST_CASE("energy: a uniformly dilated state-based body has K theta^2 / 2 in every node") {
  DEMModel model = square(MaterialType::pd_state);
  model.start();
  State& state = model.state();
  constexpr Real strain = 1e-4;
  Real volume = 0;
  for (std::size_t i = 0; i < state.size(); ++i) {
    setDisplacement(state, i, strain * state.x_ref[i]);
    volume += state.volume[i];
  }
  // e = strain r: theta = 3 strain and no deviator, near the border too.
  const Real theta = 3 * strain;
  CHECK(relativeError(strainEnergy(model), 0.5 * 2.16e7 * theta * theta * volume) < 1e-9);
}

TEST_CASE("energy: accounts close to round-off for a linear force and velocity Verlet") {
  // Free flight under gravity and a constant force: the potentials are linear.
  ModelDeck deck = oneBody(triangleGrid(6, 5, h), material(MaterialType::pd_state, horizon));
  deck.gravity = Vec3(0, -10, 0);
  deck.time_scheme = TimeScheme::velocity_verlet;
  DEMModel model(deck, 1);
  ForceSet push;
  for (Index i = 0; i < 30; ++i) push.nodes.push_back(i);
  push.amplitude.assign(30, 6000);
  push.directions = direction_x;
  push.time_function.parameters = {1};
  model.addForceSet(push);
  model.trackEnergy(true);
  model.integrate(100);
  const Energies now = model.energies();
  const EnergyFlows flows = model.energyTracker().flows();
  Real volume = 0;
  for (const Real v : model.state().volume) volume += v;
  const Real t = model.time();
  CHECK(relativeError(flows.work_forces, 6000 * volume * 0.5 * (6000.0 / 1200) * t * t) < 1e-11);
  CHECK(relativeError(now.gravity, -1200 * volume * 10 * 0.5 * 10 * t * t) < 1e-11);
  CHECK(std::abs(now.sum() - flows.start - flows.work_forces) < 1e-11 * flows.work_forces);
}

TEST_CASE("energy: what breaks is what the bonds held in the middle of the step") {
  // Pulled apart at a constant speed, the middle column between is cut off at some step.
  DEMModel model = square(MaterialType::pmb_bond, 40 * horizon);
  model.trackEnergy(true);
  model.start();
  State& state = model.state();
  for (std::size_t i = 0; i < state.size(); ++i) state.v[i] = Vec3(20 * state.x_ref[i][0], 0, 0);
  const Real start = model.energies().sum();
  for (int k = 0; k < 400; ++k) model.step();
  const auto& intact = model.bonds().intact;
  REQUIRE(std::count(intact.begin(), intact.end(), 0) > 0);
  const EnergyFlows flows = model.energyTracker().flows();
  CHECK(flows.fracture > 0);
  CHECK(flows.damping == 0);
  // The velocities were written after the accounts began.
  CHECK(relativeError(model.energies().sum() + flows.fracture - flows.created, start) < 1e-3);
}

TEST_CASE("fragments: connected components of intact bonds, by first nodes") {
  BondTable bonds;  // 0-1, 1-4, 2-3 broken, 3-5
  bonds.offsets = {0, 1, 3, 4, 6, 7, 8};
  bonds.neighbors = {1, 0, 4, 3, 2, 5, 1, 3};
  bonds.intact = {1, 1, 1, 0, 0, 1, 1, 1};
  CHECK(fragmentLabels(bonds, 6) == std::vector<Index>{0, 0, 1, 2, 0, 2});
  // Nodes without rows: bonds are not built yet.
  CHECK(fragmentLabels(BondTable(), 2) == std::vector<Index>{0, 1});
}

TEST_CASE("energy: sums over nodes do not depend on the number of threads") {
  // 3000 nodes are six chunks, the last of them short.
  const ModelDeck deck =
      oneBody(triangleGrid(60, 50, h), material(MaterialType::pd_state, horizon));
  const auto energies = [&](int threads) {
    DEMModel model(deck, threads);
    model.start();
    displaceAtRandom(model.state(), 0.02 * h, 2, 3);
    return model.energies();
  };
  const Energies one = energies(1);
  CHECK(one.bonds > 0);
  for (const int threads : {2, 3, 8}) CHECK(energies(threads).sum() == one.sum());
}

TEST_CASE("energy: accounts that do not fit the model are refused") {
  DEMModel model = square(MaterialType::pd_state);
  model.start();
  const std::string message = messageOf([&] { model.restoreEnergy({}, {}, {0}); });
  CHECK(contains(message, "0 forces for 30 nodes"));
  const std::vector<Vec3> none(30, Vec3::Zero());
  const EnergyTracker::Forces forces{{none, none}, none};
  CHECK(contains(messageOf([&] { model.restoreEnergy({}, forces, {}); }), "0 works for 1 bodies"));
}

}  // namespace peridem::test
