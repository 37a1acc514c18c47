// Conservation laws of whole runs.
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real h = 1e-3;

Real kineticEnergy(const State& state) {
  Real energy = 0;
  for (std::size_t i = 0; i < state.size(); ++i)
    energy += state.density[i] * state.volume[i] * state.v[i].squaredNorm() / 2;
  return energy;
}

// Energy whose derivative is the state-based force (without broken bonds):
// sum of V_i [ (K - 5G/3) theta_i^2 / 2 + 15 G / (2 m_i) sum of J V_j e^2 ]
class ElasticEnergy {
 public:
  explicit ElasticEnergy(const DEMModel& model)
      : model_(model), constants_(model.bondConstants()) {}

  Real operator()() const {
    Real energy = 0;
    for (const Particle& body : model_.particles())
      for (Index i = body.start; i < body.stop; ++i) {
        const auto& law = std::get<Lps>(body.law);
        const auto node = static_cast<std::size_t>(i);
        const Real theta = model_.state().theta[node];
        const Real dilatational =
            (law.bulk_modulus - 5 * law.shear_modulus / 3) * theta * theta / 2;
        energy += model_.state().volume[node] *
                  (dilatational + law.b(model_.state().weighted_volume[node]) * squares(i) / 2);
      }
    return energy;
  }

 private:
  Real squares(Index i) const {  // sum of J V_j e^2
    const State& state = model_.state();
    const BondTable& bonds = model_.bonds();
    Real sum = 0;
    for (std::size_t k = bonds.begin(i); k < bonds.end(i); ++k) {
      const auto [r, weight] = constants_[k];
      const Real e = (state.x[static_cast<std::size_t>(bonds.neighbors[k])] -
                      state.x[static_cast<std::size_t>(i)])
                         .norm() -
                     r;
      sum += weight * e * e;
    }
    return sum;
  }

  const DEMModel& model_;
  std::vector<BondConstants> constants_;
};

Vec3 momentum(const State& state) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < state.size(); ++i)
    sum += state.density[i] * state.volume[i] * state.v[i];
  return sum;
}

Vec3 angularMomentum(const State& state) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < state.size(); ++i)
    sum += state.density[i] * state.volume[i] * state.x[i].cross(state.v[i]);
  return sum;
}

// Two squares, the first on its way to the second, off centre.
ModelDeck collision(MaterialType type) {
  ModelDeck deck = oneZone(quadGrid(6, 6, h), material(type, 3.1 * h));
  deck.bodies = {bodyAt(Vec3(0, -5 * h, 0)), bodyAt(Vec3(6 * h, -3.3 * h, 0))};
  deck.bodies[1].angle = 0.3;
  deck.contacts = {contact(0.95 * h, 1e17)};
  deck.final_time = 3e-4;
  deck.time_steps = 1500;
  return deck;
}

}  // namespace

TEST_CASE("energy: stays within 1e-3 over ten thousand Verlet steps of an elastic oscillation") {
  ModelDeck deck = oneBody(quadGrid(5, 5, h), material(MaterialType::pd_state, 3.1 * h));
  deck.time_scheme = TimeScheme::velocity_verlet;
  DEMModel probe(deck, 1);
  probe.init();
  deck.time_steps = 10000;
  // A twentieth of the stable step, omega dt = 0.1: the energy of Verlet wavers by (omega dt)^2 / 4
  // = 2.5e-3 in the fastest mode and by less in the slow ones that are excited most.
  deck.final_time = 1e4 * 0.05 * probe.stableTimeStep().bonds;
  DEMModel model(deck, 1);
  model.init();
  for (std::size_t i = 0; i < model.state().size(); ++i) {
    const Vec3& x = model.state().x_ref[i];
    setDisplacement(model.state(), i, Vec3(1e-3 * x[0], -5e-4 * x[1], 0));
  }
  model.start();
  const ElasticEnergy elasticEnergy(model);
  const Real at_start = elasticEnergy();
  Real worst = 0;
  Real largest_kinetic = 0;
  model.run([&] {
    if (model.n() % 10 == 0) {
      const Real kinetic = kineticEnergy(model.state());
      largest_kinetic = std::max(largest_kinetic, kinetic);
      worst = std::max(worst, std::abs(kinetic + elasticEnergy() - at_start));
    }
    return false;
  });
  CHECK(worst < 1e-3 * at_start);
  CHECK(largest_kinetic > 0.5 * at_start);  // it does oscillate
}

TEST_CASE("momentum: of a colliding pair stays to 1e-10, linear and angular") {
  for (const auto type : {MaterialType::pd_state, MaterialType::pmb_bond})
    for (const auto scheme : {TimeScheme::central_difference, TimeScheme::velocity_verlet}) {
      ModelDeck deck = collision(type);
      deck.time_scheme = scheme;
      DEMModel model(deck, 1);
      model.addInitialVelocity({{0}, Vec3(10, 0, 0)});
      model.start();
      const Vec3 p = momentum(model.state());
      const Vec3 l = angularMomentum(model.state());
      REQUIRE(l.norm() > 4 * h * p.norm());  // the first moves at a distance of 5 h
      Real worst_p = 0;
      Real worst_l = 0;
      model.run([&] {
        worst_p = std::max(worst_p, relativeError(momentum(model.state()), p));
        worst_l = std::max(worst_l, relativeError(angularMomentum(model.state()), l));
        return false;
      });
      CHECK(worst_p < 1e-10);
      CHECK(worst_l < 1e-10);
      CHECK(model.state().v.back().norm() > 0.1);  // they did collide
    }
}

TEST_CASE("momentum: friction changes neither the sum of a sliding pair nor adds energy") {
  for (const auto model_of_friction : {FrictionModel::slip, FrictionModel::history}) {
    ModelDeck deck = collision(MaterialType::pd_state);
    deck.contacts[0].friction_on = true;
    deck.contacts[0].friction_coeff = 0.5;
    deck.contacts[0].friction_model = model_of_friction;
    DEMModel model(deck, 1);
    model.addInitialVelocity({{0}, Vec3(10, 0, 0)});
    model.start();
    const Vec3 p = momentum(model.state());
    const Real energy = kineticEnergy(model.state());
    model.run();
    CHECK(relativeError(momentum(model.state()), p) < 1e-10);
    CHECK(kineticEnergy(model.state()) + ElasticEnergy(model)() < energy);
  }
}
