#include "stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace peridem {

namespace {

// Row sums of |df/du| of the nodes of a body for unit displacements: every bond stretches by at
// most 2.
class StiffnessBound {
 public:
  // What a node of a state-based body adds to the bonds it is in.
  struct NodeTerm {
    Real b = 0;
    Real pull = 0;  // |a| 3/m sum of r w: the pull of theta for unit stretches
  };

  StiffnessBound(const State& state, const BondTable& bonds, const Particle& body,
                 const Influence& influence)
      : state_(state), bonds_(bonds), body_(body), influence_(influence) {}

  NodeTerm termOf(Index i) const {
    const auto* law = std::get_if<Lps>(&body_.law);
    if (law == nullptr) return {};
    Real sum_r_w = 0;
    forEachBond(i, [&](Index, Real r, Real w) { sum_r_w += r * w; });
    const Real m = state_.weighted_volume[static_cast<std::size_t>(i)];
    return {law->b(m), std::abs(law->a(m)) * 3 / m * sum_r_w};
  }

  Real at(Index i, const std::vector<NodeTerm>& terms) const {
    return std::visit([&](const auto& law) { return at(i, law, terms); }, body_.law);
  }

 private:
  Real at(Index i, const Lps&, const std::vector<NodeTerm>& terms) const {
    const NodeTerm& own = terms[static_cast<std::size_t>(i)];
    Real sum = 0;
    forEachBond(i, [&](Index j, Real r, Real w) {
      const NodeTerm& other = terms[static_cast<std::size_t>(j)];
      sum += 2 * w * (own.b + other.b + r * (own.pull + other.pull));
    });
    return sum;
  }

  template <class BondLaw>
  Real at(Index i, const BondLaw& law, const std::vector<NodeTerm>&) const {
    Real sum = 0;
    forEachBond(i, [&](Index, Real r, Real w) {
      const Real s = 1e-8, e = s * r;  // slope of the force at e = 0; w lacks what weight(1) has
      sum += 2 * w * law.weight(1.0, 1 / r) * law.force(e, s) / e;
    });
    return sum;
  }

  template <class Visit>
  void forEachBond(Index i, Visit visit) const {
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k) {
      const Index j = bonds_.neighbors[k];
      const auto [r, w] = bondConstants(state_, body_, influence_, i, j);
      visit(j, r, w);
    }
  }

  const State& state_;
  const BondTable& bonds_;
  const Particle& body_;
  const Influence& influence_;
};

// Largest row sum by density over the nodes of all bodies that move: omega^2.
Real bondStiffness(const State& state, const BondTable& bonds,
                   const std::vector<Influence>& influences, const std::vector<Particle>& bodies,
                   int threads) {
  std::vector<std::size_t> sizes;
  for (const Particle& body : bodies)
    sizes.push_back(body.constrained ? 0 : static_cast<std::size_t>(body.nodes()));
  const std::vector<Chunk> chunks = chunksOf(sizes);
  std::vector<StiffnessBound::NodeTerm> terms(state.size());
  const auto boundOf = [&](std::size_t body) {
    return StiffnessBound(state, bonds, bodies[body], influences[body]);
  };
  Real largest = 0;
#pragma omp parallel num_threads(threads) if (chunks.size() > 1)
  {
#pragma omp for schedule(dynamic, 1)
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const Index start = bodies[chunks[c].set].start;
      const StiffnessBound bound = boundOf(chunks[c].set);
      for (std::size_t k = chunks[c].begin; k < chunks[c].end; ++k)
        terms[static_cast<std::size_t>(start) + k] = bound.termOf(start + static_cast<Index>(k));
    }
#pragma omp for schedule(dynamic, 1) reduction(max : largest)
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const Particle& body = bodies[chunks[c].set];
      const StiffnessBound bound = boundOf(chunks[c].set);
      for (std::size_t k = chunks[c].begin; k < chunks[c].end; ++k)
        largest =
            std::max(largest, bound.at(body.start + static_cast<Index>(k), terms) / body.density);
    }
  }
  return largest;
}

Real nodeVolume(const Particle& body) {
  return body.volume / static_cast<Real>(body.nodes());
}

// Whether bonds of the length r break before they are stretched to double their length.
bool breaks(const Lps& law, Real) {
  return law.s0 < 1;
}

bool breaks(const Pmb& law, Real) {
  return law.break_limit < 1;
}

bool breaks(const Rnp& law, Real r) {
  return law.break_factor * law.sc_times_sqrt_r < std::sqrt(r);
}

// Largest omega^2 of two nodes whose bond has broken: Kn V 2/rho.
Real selfContactStiffness(const std::vector<Particle>& bodies) {
  Real largest = 0;
  for (const Particle& body : bodies) {
    const auto may_break = [&](const auto& law) { return breaks(law, body.mesh_size); };
    if (body.constrained || !std::visit(may_break, body.law)) continue;
    largest = std::max(largest, body.self_contact_kn * nodeVolume(body) * 2 / body.density);
  }
  return largest;
}

// Largest omega^2 of two nodes in contact: Kn V (1/rho + 1/rho'). Law and density are those of the
// zones, so that of each zone the bodies with the largest nodes are enough: one of each kind for
// mayTouch(), and the second largest of its kind for the largest itself.
Real contactStiffness(const std::vector<Particle>& bodies, const ContactForce& contact) {
  using Kind = std::tuple<Index, bool, bool>;
  std::map<Kind, std::array<const Particle*, 2>> largest_of;
  for (const Particle& body : bodies) {
    auto& [first, second] = largest_of[{body.zone, body.is_wall, body.constrained}];
    if (first == nullptr || nodeVolume(body) > nodeVolume(*first)) {
      second = first;
      first = &body;
    } else if (second == nullptr || nodeVolume(body) > nodeVolume(*second)) {
      second = &body;
    }
  }
  Real largest = 0;
  for (const auto& [kind, own] : largest_of)
    for (const auto& [other_kind, others] : largest_of)
      for (const Particle* body : own)
        for (const Particle* other : others) {
          if (body == nullptr || other == nullptr || body->constrained) continue;
          if (!mayTouch(*body, *other)) continue;
          largest = std::max(largest, contact.law(*body, *other).kn * nodeVolume(*other) *
                                          (1 / body->density + 1 / other->density));
        }
  return largest;
}

Real limit(Real omega_squared) {
  return omega_squared > 0 ? 2 / std::sqrt(omega_squared) : std::numeric_limits<Real>::infinity();
}

}  // namespace

StableTimeStep stableTimeStep(const State& state, const BondTable& bonds,
                              const std::vector<Influence>& influences,
                              const std::vector<Particle>& bodies, const ContactForce& contact,
                              int threads) {
  return {limit(bondStiffness(state, bonds, influences, bodies, threads)),
          limit(contactStiffness(bodies, contact)), limit(selfContactStiffness(bodies))};
}

}  // namespace peridem
