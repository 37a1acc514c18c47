// Force loops over the bond groups of a block; see bond_block.h. Compiled once per instruction set
// into the namespace PERIDEM_ISA.
#include "peridynamic_kernel.h"

#include "simd.h"

namespace peridem::PERIDEM_ISA {

namespace {

// z = (X - X_c) + (u - u_c): positions relative to the centre node of the body, so that a rigid
// translation leaves them unchanged to the last digit.
template <int Dim>
PERIDEM_INLINE void placeNodes(const BlockView& block, const NodeArrays& nodes,
                               const KernelScratch& work) {
  for (std::size_t k = 0; k < block.n_all; ++k) {
    const Index node = block.nodes[k];
    for (int d = 0; d < Dim; ++d) {
      const double u = node < 0 ? 0
                                : nodes.u[3 * static_cast<std::size_t>(node) + d] -
                                      nodes.u[3 * block.center + d];
      work.z[d][k] = block.z_ref[d][k] + u;
    }
  }
}

PERIDEM_INLINE void clear(double* values, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k) values[k] = 0;
}

PERIDEM_INLINE double* lengthsOf(const BlockView& block, std::size_t g) {
  return block.numbers + group_numbers * g;
}
PERIDEM_INLINE double* influencesOf(const BlockView& block, std::size_t g) {
  return lengthsOf(block, g) + lanes;
}

// The numbers stream through once per pass; asked for early enough, they are there in time.
PERIDEM_INLINE void prefetchNumbers(const BlockView& block, std::size_t g) {
  constexpr std::size_t groups_ahead = 14;
  const double* numbers = lengthsOf(block, g + groups_ahead);
  __builtin_prefetch(numbers);
  __builtin_prefetch(numbers + lanes);
}

// y = z_j - z_i of the eight bonds of a group.
template <int Dim>
struct Group {
  std::size_t tile;
  Lanes y[Dim];
  Lanes inverse_length;  // 1/|y|; 0 in lanes without bond
  Lanes deformed_length;

  PERIDEM_INLINE Group(const BlockView& block, const double* const z[3], std::size_t i,
                       std::size_t g)
      : tile(static_cast<std::size_t>(block.groups[g].tile)) {
    Lanes squared;
    for (int d = 0; d < Dim; ++d) {
      y[d] = load(z[d] + tile) - z[d][i];
      squared = multiplyAdd(y[d], y[d], squared);
    }
    inverse_length = keep(block.groups[g].exists, inverseSquareRoot(squared));
    deformed_length = squared * inverse_length;
  }
};

// Elongation e and direction of the force of a group's bonds, as the law wants them.
template <int Dim, class Law>
struct Stretch {
  Lanes e;
  Lanes direction[Dim];

  PERIDEM_INLINE Stretch(const BlockView& block, const Group<Dim>& group, std::size_t i, Lanes r) {
    if constexpr (Law::along_deformed_bond) {
      e = group.deformed_length - r;
      for (int d = 0; d < Dim; ++d) direction[d] = group.y[d] * group.inverse_length;
    } else {
      e = Lanes();
      for (int d = 0; d < Dim; ++d) {
        const Lanes xi = load(block.z_ref[d] + group.tile) - block.z_ref[d][i];
        e = multiplyAdd(group.y[d] - xi, xi, e);
        direction[d] = xi / r;
      }
      e = e / r;
    }
  }
};

// Out of the way of the loops: bonds break seldom.
[[gnu::noinline]] void markBroken(const BlockView& block, const BreakListener& listener,
                                  std::size_t i, std::size_t g, LaneBits broken) {
  BondGroup& group = block.groups[g];
  group.intact = static_cast<LaneBits>(group.intact & ~broken);
  const auto tile = static_cast<std::size_t>(group.tile);
  for (std::size_t lane = 0; lane < lanes; ++lane)
    if ((broken >> lane) & 1)
      listener.broken(listener.context, block.nodes[i], block.nodes[tile + lane],
                      tile < block.n_padded);
}

// Break test; returns the bits that are still intact.
template <class Law>
PERIDEM_INLINE LaneBits breakBonds(const Law& law, const BlockView& block,
                                   const BreakListener& listener, std::size_t i, std::size_t g,
                                   LaneBits intact, const Lanes& r, const Lanes& e) {
  const auto broken = static_cast<LaneBits>(greaterBits(law.excess(r, e), Lanes()) & intact);
  if (broken) [[unlikely]]
    markBroken(block, listener, i, g, broken);
  return static_cast<LaneBits>(intact & ~broken);
}

// Calls visit(i, g, in_block) for every group. One flat loop: rows are short, and a loop over each
// would be mispredicted at every end.
template <class Visit>
PERIDEM_INLINE void forEachGroup(const BlockView& block, Visit visit) {
  for (std::size_t g = 0; g < block.n_inside; ++g)
    visit(static_cast<std::size_t>(block.groups[g].row), g, true);
  for (std::size_t g = block.n_inside; g < block.n_groups; ++g)
    visit(static_cast<std::size_t>(block.groups[g].row), g, false);
}

// Row sums keep eight lanes for each node until all groups are done.
PERIDEM_INLINE void clearSums(const BlockView& block, double* row, double* column) {
  for (std::size_t k = 0; k < block.n_padded; ++k) store(row + lanes * k, Lanes());
  clear(column, block.n_padded);
}
PERIDEM_INLINE double sumAt(const double* row, const double* column, std::size_t k) {
  return sumOfLanes(load(row + lanes * k)) + column[k];
}

// Adds t V_j e to the row sums of node i and -t V_i e to the column sums of a group.
template <int Dim>
PERIDEM_INLINE void addPairForce(const BlockView& block, const KernelScratch& work, std::size_t i,
                                 std::size_t tile, bool in_block, const Lanes& t,
                                 const Lanes (&direction)[Dim]) {
  const Lanes on_i = t * load(block.volume + tile);
  const Lanes on_j = t * -block.volume[i];
  for (int d = 0; d < Dim; ++d) {
    double* row = work.row[d] + lanes * i;
    store(row, multiplyAdd(on_i, direction[d], load(row)));
    if (in_block) {
      double* column = work.column[d] + tile;
      store(column, multiplyAdd(on_j, direction[d], load(column)));
    }
  }
}

// Broken bonds resist being pushed together (Jha et al. 2021, section 3.3):
// f_i += min(0, Kn V_j (|y| - Rc)) y/|y|, with V_j whole. Returns t for addPairForce.
PERIDEM_INLINE Lanes selfContact(const BlockView& block, Lanes deformed_length, LaneBits broken) {
  const Lanes gap = deformed_length - block.self_contact_radius;
  const LaneBits close = static_cast<LaneBits>(greaterBits(Lanes{}, gap) & broken);
  return keep(close, block.self_contact_kn * gap);
}

template <int Dim>
PERIDEM_INLINE void storeForces(const BlockView& block, const NodeArrays& nodes,
                                const KernelScratch& work) {
  for (std::size_t k = 0; k < block.n_own; ++k)
    for (int d = 0; d < Dim; ++d)
      nodes.f[3 * static_cast<std::size_t>(block.nodes[k]) + d] =
          sumAt(work.row[d], work.column[d], k);
}

// Break test |s| > s0, then (10) theta_i = 3/m_i sum over unbroken of r e J V_j  Jha et al. 2021.
// With `keep_stretch` unit vectors and elongations stay in the scratch for the force pass.
template <int Dim, bool keep_stretch>
void dilatationPass(const Lps& law, const BlockView& shared, const NodeArrays& nodes,
                    const KernelScratch& scratch, const BreakListener& listener) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  clearSums(block, work.row[0], work.column[0]);
  forEachGroup(block, [&](std::size_t i, std::size_t g, bool in_block) PERIDEM_LAMBDA {
    prefetchNumbers(block, g);
    const Group<Dim> group(block, work.z, i, g);
    const Lanes r = load(lengthsOf(block, g));
    const Stretch<Dim, Lps> stretch(block, group, i, r);
    const LaneBits intact =
        breakBonds(law, shared, listener, i, g, block.groups[g].intact, r, stretch.e);
    const Lanes J = keep(intact, load(influencesOf(block, g)));
    const Lanes r_e_J = r * stretch.e * J;
    double* row = work.row[0] + lanes * i;
    store(row, multiplyAdd(r_e_J, load(block.volume + group.tile), load(row)));
    if (in_block) {
      double* column = work.column[0] + group.tile;
      store(column, multiplyAdd(r_e_J, broadcast(block.volume[i]), load(column)));
    }
    if constexpr (keep_stretch) {
      store(work.elongation + lanes * g, stretch.e);
      for (int d = 0; d < Dim; ++d) store(work.e[d] + lanes * g, stretch.direction[d]);
    }
  });
  for (std::size_t k = 0; k < block.n_own; ++k)
    nodes.theta[static_cast<std::size_t>(block.nodes[k])] =
        law.dilatation(block.weighted_volume[k], sumAt(work.row[0], work.column[0], k));
}

// (9) f_i = sum of J V_j [ r (theta_i a_i + theta_j a_j) + e (b_i + b_j) ] y/|y|  Jha et al. 2021
template <int Dim, bool stretch_kept>
void stateBasedForcePass(const BlockView& shared, const NodeArrays& nodes,
                         const KernelScratch& scratch) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  for (std::size_t k = 0; k < block.n_all; ++k)
    work.theta_a[k] =
        block.nodes[k] < 0 ? 0 : nodes.theta[static_cast<std::size_t>(block.nodes[k])] * block.a[k];
  for (int d = 0; d < Dim; ++d) clearSums(block, work.row[d], work.column[d]);
  forEachGroup(block, [&](std::size_t i, std::size_t g, bool in_block) PERIDEM_LAMBDA {
    const BondGroup bonds = block.groups[g];
    const auto tile = static_cast<std::size_t>(bonds.tile);
    const Lanes r = load(lengthsOf(block, g));
    Lanes e;
    Lanes direction[Dim];
    if constexpr (stretch_kept) {
      e = load(work.elongation + lanes * g);
      for (int d = 0; d < Dim; ++d) direction[d] = load(work.e[d] + lanes * g);
    } else {
      const Group<Dim> group(block, work.z, i, g);
      const Stretch<Dim, Lps> stretch(block, group, i, r);
      e = stretch.e;
      for (int d = 0; d < Dim; ++d) direction[d] = stretch.direction[d];
    }
    const Lanes J = keep(bonds.intact, load(influencesOf(block, g)));
    const Lanes theta_a = load(work.theta_a + tile) + work.theta_a[i];
    const Lanes b = load(block.b + tile) + block.b[i];
    Lanes t = J * Lps::force(r, e, theta_a, b);
    if (const auto broken = static_cast<LaneBits>(bonds.exists & ~bonds.intact); broken)
      t += selfContact(block, e + r, broken);
    addPairForce<Dim>(block, work, i, tile, in_block, t, direction);
  });
  storeForces<Dim>(block, nodes, work);
}

// f_i = sum of J V_j force(r, e) along the bond; the laws are Silling 2000 (PMBBond) and Lipton
// 2016, J. Elast. 124 (RNPBond). A bond exerts no force in the evaluation that breaks it; its
// self-contact starts in the next one.
template <int Dim, class Law>
void bondBasedForcePass(const Law& law, const BlockView& shared, const NodeArrays& nodes,
                        const KernelScratch& scratch, const BreakListener& listener) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  for (int d = 0; d < Dim; ++d) clearSums(block, work.row[d], work.column[d]);
  forEachGroup(block, [&](std::size_t i, std::size_t g, bool in_block) PERIDEM_LAMBDA {
    const Group<Dim> group(block, work.z, i, g);
    const Lanes r = load(lengthsOf(block, g));
    const Stretch<Dim, Law> stretch(block, group, i, r);
    const LaneBits intact_before = block.groups[g].intact;
    const auto broken_before = static_cast<LaneBits>(block.groups[g].exists & ~intact_before);
    const LaneBits intact = breakBonds(law, shared, listener, i, g, intact_before, r, stretch.e);
    const Lanes J = keep(intact, load(influencesOf(block, g)));
    addPairForce<Dim>(block, work, i, group.tile, in_block, J * law.force(r, stretch.e),
                      stretch.direction);
    if (broken_before) {
      const Lanes t = selfContact(block, group.deformed_length, broken_before);
      Lanes direction[Dim];
      for (int d = 0; d < Dim; ++d) direction[d] = group.y[d] * group.inverse_length;
      addPairForce<Dim>(block, work, i, group.tile, in_block, t, direction);
    }
  });
  storeForces<Dim>(block, nodes, work);
}

// (14) Z_i = max over all neighbours, broken ones included, of |s| / s0     Jha et al. 2021
template <int Dim, class Law>
void damagePass(const Law& law, const BlockView& shared, const NodeArrays& nodes,
                const KernelScratch& scratch) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  clearSums(block, work.row[0], work.column[0]);
  forEachGroup(block, [&](std::size_t i, std::size_t g, bool in_block) PERIDEM_LAMBDA {
    const Group<Dim> group(block, work.z, i, g);
    const Lanes r = load(lengthsOf(block, g));
    const Stretch<Dim, Law> stretch(block, group, i, r);
    const Lanes z = keep(block.groups[g].exists, law.damage(r, stretch.e));
    double* row = work.row[0] + lanes * i;
    store(row, larger(load(row), z));
    if (in_block) {
      double* column = work.column[0] + group.tile;
      store(column, larger(load(column), z));
    }
  });
  for (std::size_t k = 0; k < block.n_own; ++k)
    nodes.damage_z[static_cast<std::size_t>(block.nodes[k])] =
        larger(largestLane(load(work.row[0] + lanes * k)), work.column[0][k]);
}

// Reference lengths as the force loops compute them: an undeformed bond has elongation 0 exactly.
template <int Dim>
void lengthsPass(const BlockView& block) {
  forEachGroup(block, [&](std::size_t i, std::size_t g, bool) PERIDEM_LAMBDA {
    const Group<Dim> group(block, block.z_ref, i, g);
    const auto without_bond = static_cast<LaneBits>(~block.groups[g].exists);
    store(lengthsOf(block, g), group.deformed_length + keep(without_bond, broadcast(1.0)));
  });
}

template <int Dim>
void runStateBased(Stage stage, const Lps& law, bool active, const BlockView& block,
                   const NodeArrays& nodes, const KernelScratch& work,
                   const BreakListener& listener) {
  switch (stage) {
    case Stage::dilatation:
      if (active) dilatationPass<Dim, false>(law, block, nodes, work, listener);
      break;
    case Stage::force:
      stateBasedForcePass<Dim, false>(block, nodes, work);
      break;
    case Stage::whole:
      if (active) {
        dilatationPass<Dim, true>(law, block, nodes, work, listener);
        stateBasedForcePass<Dim, true>(block, nodes, work);
      } else {
        stateBasedForcePass<Dim, false>(block, nodes, work);
      }
      break;
    case Stage::damage:
      damagePass<Dim>(law, block, nodes, work);
      break;
    case Stage::lengths:
      break;
  }
}

template <int Dim, class Law>
void runBondBased(Stage stage, const Law& law, const BlockView& block, const NodeArrays& nodes,
                  const KernelScratch& work, const BreakListener& listener) {
  if (stage == Stage::force || stage == Stage::whole)
    bondBasedForcePass<Dim>(law, block, nodes, work, listener);
  else if (stage == Stage::damage)
    damagePass<Dim>(law, block, nodes, work);
}

template <int Dim>
void run(Stage stage, const LawView& law, const BlockView& block, const NodeArrays& nodes,
         const KernelScratch& work, const BreakListener& listener) {
  if (stage == Stage::lengths) return lengthsPass<Dim>(block);
  placeNodes<Dim>(block, nodes, work);
  if (law.lps != nullptr)
    runStateBased<Dim>(stage, *law.lps, law.state_based_stage, block, nodes, work, listener);
  else if (law.pmb != nullptr)
    runBondBased<Dim>(stage, *law.pmb, block, nodes, work, listener);
  else
    runBondBased<Dim>(stage, *law.rnp, block, nodes, work, listener);
}

}  // namespace

void runBlock(Stage stage, int dimension, const LawView& law, const BlockView& block,
              const NodeArrays& nodes, const KernelScratch& work, const BreakListener& listener) {
  if (dimension == 3)
    run<3>(stage, law, block, nodes, work, listener);
  else
    run<2>(stage, law, block, nodes, work, listener);
}

}  // namespace peridem::PERIDEM_ISA
