#include "peridynamic.h"

#include <algorithm>
#include <cmath>

namespace peridem {

namespace {

// Work below which waking threads costs more than it saves.
constexpr std::size_t bonds_worth_threads = 50000;

// y = (X_j - X_i) + (u_j - u_i): a rigid translation leaves it unchanged to the last digit.
template <int Dim>
struct Bond {
  Real xi[Dim], y[Dim];
  Real length;  // |y|

  Bond(const State& s, std::size_t i, std::size_t j) {
    Real squared = 0;
    for (int d = 0; d < Dim; ++d) {
      xi[d] = s.x_ref[j][d] - s.x_ref[i][d];
      y[d] = xi[d] + (s.u[j][d] - s.u[i][d]);
      squared += y[d] * y[d];
    }
    length = std::sqrt(squared);
  }
};

// Broken bonds resist being pushed together (Jha et al. 2021, section 3.3):
// f_i += min(0, Kn V_j (|y| - Rc) / |y|) y, with V_j whole.
template <int Dim>
void addSelfContact(const Bond<Dim>& bond, const Particle& body, Real volume, Real (&f)[Dim]) {
  const Real gap = bond.length - body.self_contact_radius;
  if (gap >= 0) return;
  const Real factor = body.self_contact_kn * volume * gap / bond.length;
  for (int d = 0; d < Dim; ++d) f[d] += factor * bond.y[d];
}

template <int Dim>
void store(Vec3& f, const Real (&sum)[Dim]) {
  for (int d = 0; d < Dim; ++d) f[d] = sum[d];
}

struct Row {
  std::size_t begin, end;
  Row(const BondTable& bonds, std::size_t i)
      : begin(static_cast<std::size_t>(bonds.offsets[i])),
        end(static_cast<std::size_t>(bonds.offsets[i + 1])) {}
};

// Break test |s| > s0, then
// (10) theta = 3/m sum over unbroken of r (|y| - r) J V_j   Jha et al. 2021
// (14) Z = max over all neighbours of |s| / s0
template <int Dim>
void dilatationAt(std::size_t i, const Lps& law, bool active, State& state, BondTable& bonds,
                  StateBasedFactors& factors) {
  Real sum = 0;
  Real largest = 0;
  const Row row(bonds, i);
  for (std::size_t k = row.begin; k < row.end; ++k) {
    const Bond<Dim> bond(state, i, static_cast<std::size_t>(bonds.neighbors[k]));
    const Real r = bonds.length[k];
    const Real e = bond.length - r;
    const Real s = e / r;
    largest = std::max(largest, std::abs(s));
    if (!active) continue;
    if (law.breaks(s)) bonds.intact[k] = 0;
    if (bonds.intact[k]) sum += r * e * bonds.weight[k];
  }
  const Real m = state.weighted_volume[i];
  state.theta[i] = m > 0 ? law.dilatation(m, sum) : 0;
  factors.theta_a[i] = state.theta[i] * factors.a[i];
  state.damage_z[i] = largest / law.s0;
}

// (9) f_i = sum of J V_j [ r (theta_i a_i + theta_j a_j) + e (b_i + b_j) ] y/|y|
template <int Dim>
void stateBasedForceAt(std::size_t i, const Particle& body, State& state, const BondTable& bonds,
                       const StateBasedFactors& factors) {
  Real f[Dim] = {};
  const Row row(bonds, i);
  for (std::size_t k = row.begin; k < row.end; ++k) {
    const auto j = static_cast<std::size_t>(bonds.neighbors[k]);
    const Bond<Dim> bond(state, i, j);
    if (!bonds.intact[k]) {
      addSelfContact(bond, body, state.volume[j], f);
      continue;
    }
    const Real r = bonds.length[k];
    const Real t =
        bonds.weight[k] * Lps::force(r, bond.length - r, factors.theta_a[i] + factors.theta_a[j],
                                     factors.b[i] + factors.b[j]);
    const Real t_by_length = t / bond.length;
    for (int d = 0; d < Dim; ++d) f[d] += t_by_length * bond.y[d];
  }
  store(state.f[i], f);
}

// f_i = sum of J V_j force(r, s) e. A bond exerts no force in the evaluation that breaks it; its
// self-contact starts in the next one.
template <int Dim, class BondLaw>
void bondBasedForceAt(std::size_t i, const BondLaw& law, const Particle& body, State& state,
                      BondTable& bonds) {
  Real f[Dim] = {};
  Real z = 0;
  const Row row(bonds, i);
  for (std::size_t k = row.begin; k < row.end; ++k) {
    const auto j = static_cast<std::size_t>(bonds.neighbors[k]);
    const Bond<Dim> bond(state, i, j);
    const Real r = bonds.length[k];
    Real du_dot_xi = 0;
    for (int d = 0; d < Dim; ++d) du_dot_xi += (state.u[j][d] - state.u[i][d]) * bond.xi[d];
    const Real s = BondLaw::stretch(r, bond.length, du_dot_xi);
    z = std::max(z, law.damage(r, s));
    if (!bonds.intact[k]) {
      addSelfContact(bond, body, state.volume[j], f);
    } else if (law.breaks(r, s)) {
      bonds.intact[k] = 0;
    } else {
      const Real t = bonds.weight[k] * law.force(r, s);
      constexpr bool deformed = BondLaw::along_deformed_bond;
      const Real t_by_length = t / (deformed ? bond.length : r);
      for (int d = 0; d < Dim; ++d) f[d] += t_by_length * (deformed ? bond.y[d] : bond.xi[d]);
    }
  }
  store(state.f[i], f);
  state.damage_z[i] = z;
}

enum class Stage { dilatation, force };

// One stage on one block; `active`: see the constructor. Bond-based bodies do everything in the
// force stage.
template <int Dim>
void runStage(Stage stage, const NodeBlock& block, const Particle& body, bool active, State& state,
              BondTable& bonds, StateBasedFactors& factors) {
  std::visit(
      [&](const auto& law) {
        for (const Index node : block.nodes) {
          const auto i = static_cast<std::size_t>(node);
          if constexpr (std::decay_t<decltype(law)>::state_based) {
            if (stage == Stage::dilatation)
              dilatationAt<Dim>(i, law, active, state, bonds, factors);
            else
              stateBasedForceAt<Dim>(i, body, state, bonds, factors);
          } else if (stage == Stage::force) {
            bondBasedForceAt<Dim>(i, law, body, state, bonds);
          }
        }
      },
      body.law);
}

}  // namespace

PeridynamicForce::PeridynamicForce(const State& state, const BondTable& bonds,
                                   const std::vector<Particle>& bodies, int dimension,
                                   Compatibility mode, Index block_nodes)
    : dimension_(dimension), factors_(state.size()) {
  // In the original the material of body 0 decides whether dilatation and the break test of
  // state-based bonds run at all, for all bodies.
  if (mode == Compatibility::original)
    state_based_stage_ = std::holds_alternative<Lps>(bodies.front().law);
  for (NodeBlock& block : makeBlocks(bonds, bodies, block_nodes)) {
    const auto& body = bodies[static_cast<std::size_t>(block.body)];
    const bool is_whole = static_cast<Index>(block.nodes.size()) == body.nodes();
    (is_whole ? whole_ : pieces_).push_back(std::move(block));
  }
  // Largest first, so that no thread ends with a long one.
  std::stable_sort(whole_.begin(), whole_.end(), [](const NodeBlock& p, const NodeBlock& q) {
    return p.nodes.size() > q.nodes.size();
  });
  for (const Particle& body : bodies) {
    const auto* law = std::get_if<Lps>(&body.law);
    if (law == nullptr) continue;
    for (auto i = static_cast<std::size_t>(body.start); i < static_cast<std::size_t>(body.stop);
         ++i) {
      const Real m = state.weighted_volume[i];
      if (!(m > 0)) continue;  // a node without neighbours
      factors_.a[i] = law->a(m);
      factors_.b[i] = law->b(m);
    }
  }
  parallel_ = bonds.size() > bonds_worth_threads;
}

template <int Dim>
void PeridynamicForce::computeInDimension(State& state, BondTable& bonds,
                                          const std::vector<Particle>& bodies, int threads) {
  const auto run = [&](Stage stage, const NodeBlock& block) {
    runStage<Dim>(stage, block, bodies[static_cast<std::size_t>(block.body)], state_based_stage_,
                  state, bonds, factors_);
  };
#pragma omp parallel num_threads(threads) if (parallel_)
  {
#pragma omp for schedule(dynamic, 1) nowait
    for (std::size_t k = 0; k < whole_.size(); ++k) {
      run(Stage::dilatation, whole_[k]);
      run(Stage::force, whole_[k]);
    }
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < pieces_.size(); ++k) run(Stage::dilatation, pieces_[k]);
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < pieces_.size(); ++k) run(Stage::force, pieces_[k]);
  }
}

void PeridynamicForce::compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
                               int threads) {
  if (dimension_ == 3)
    computeInDimension<3>(state, bonds, bodies, threads);
  else
    computeInDimension<2>(state, bonds, bodies, threads);
}

}  // namespace peridem
