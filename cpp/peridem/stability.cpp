#include "stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace peridem {

namespace {

// Row sums of |df/du| for unit displacements: every bond stretches by at most 2.
class StiffnessBound {
 public:
  StiffnessBound(const State& state, const BondTable& bonds,
                 const std::vector<BondConstants>& constants)
      : state_(state), bonds_(bonds), constants_(constants), sum_r_w_(state.size(), 0) {
    for (Index i = 0; i < static_cast<Index>(state.size()); ++i)
      for (std::size_t k = bonds.begin(i); k < bonds.end(i); ++k)
        sum_r_w_[static_cast<std::size_t>(i)] += constants[k].length * constants[k].weight;
  }

  Real at(Index i, const Lps& law) const {
    Real sum = 0;
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k) {
      const auto from = static_cast<std::size_t>(i);
      const auto to = static_cast<std::size_t>(bonds_.neighbors[k]);
      const auto [r, w] = constants_[k];
      const Real b_sum = law.b(state_.weighted_volume[from]) + law.b(state_.weighted_volume[to]);
      sum += 2 * w * (b_sum + r * (dilatation(law, from) + dilatation(law, to)));
    }
    return sum;
  }

  template <class BondLaw>
  Real at(Index i, const BondLaw& law) const {
    Real sum = 0;
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k) {
      const auto [r, w] = constants_[k];
      const Real small = 1e-8 * r;  // slope of the force at e = 0
      sum += 2 * w * law.force(r, small) / small;
    }
    return sum;
  }

 private:
  // |a| 3/m sum of r w: the pull of theta for unit stretches
  Real dilatation(const Lps& law, std::size_t i) const {
    const Real m = state_.weighted_volume[i];
    return std::abs(law.a(m)) * 3 / m * sum_r_w_[i];
  }

  const State& state_;
  const BondTable& bonds_;
  const std::vector<BondConstants>& constants_;
  std::vector<Real> sum_r_w_;
};

}  // namespace

namespace {

// Largest omega^2 of two nodes in contact: Kn V (1/rho + 1/rho').
Real contactStiffness(const Particle& body, const std::vector<Particle>& bodies,
                      const ContactForce& contact) {
  Real largest = 0;
  for (const Particle& other : bodies) {
    if (!mayTouch(body, other)) continue;
    const Real node_volume = other.volume / static_cast<Real>(other.nodes());
    largest = std::max(largest, contact.law(body, other).kn * node_volume *
                                    (1 / body.density + 1 / other.density));
  }
  return largest;
}

Real limit(Real omega_squared) {
  return omega_squared > 0 ? 2 / std::sqrt(omega_squared) : std::numeric_limits<Real>::infinity();
}

}  // namespace

StableTimeStep stableTimeStep(const State& state, const BondTable& bonds,
                              const std::vector<BondConstants>& constants,
                              const std::vector<Particle>& bodies, const ContactForce& contact) {
  const StiffnessBound stiffness(state, bonds, constants);
  Real of_bonds = 0;  // omega^2
  Real of_contact = 0;
  for (const Particle& body : bodies) {
    if (body.constrained) continue;
    of_contact = std::max(of_contact, contactStiffness(body, bodies, contact));
    for (Index i = body.start; i < body.stop; ++i) {
      const Real row = std::visit([&](const auto& law) { return stiffness.at(i, law); }, body.law);
      of_bonds = std::max(of_bonds, row / body.density);
    }
  }
  return {limit(of_bonds), limit(of_contact)};
}

}  // namespace peridem
