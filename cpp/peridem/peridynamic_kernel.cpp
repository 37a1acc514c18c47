// Force loops over the bond groups of a block; see bond_block.h. Compiled once per instruction set
// into the namespace PERIDEM_ISA.
#include "peridynamic_kernel.h"

#include "bond_passes.h"

namespace peridem::PERIDEM_ISA {

namespace {

enum class Keep { nothing, bonds };

// Break test |s| > s0, then (10) theta_i = 3/m_i sum over unbroken of r e J V_j  Jha et al. 2021.
// With Keep::bonds what the force pass needs of them stays in the scratch. Returns the number of
// groups with close broken bonds.
template <int Dim, Table table, Keep keep_bonds>
std::size_t dilatationPass(const Lps& law, const BlockView& shared, const NodeArrays& nodes,
                           const KernelScratch& scratch, const BreakListener& listener) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  const double* const places[3] = {work.z[0], work.z[1], work.z[2]};
  std::size_t n_close = 0;
  forEachGroup(
      block,
      [&](std::size_t tile) PERIDEM_LAMBDA {
        return ScalarTile<Dim, table>{tile, {places, tile}, {block, tile}, {}};
      },
      [&](ScalarTile<Dim, table>& tile, std::size_t i, std::size_t g, auto row) PERIDEM_LAMBDA {
        prefetchNextBody(block, g);
        const Deformed<Dim> bond(tile.positions, places, i);
        const auto [r, J] = ReferenceBond<Lps>(block, tile.reference, i, g);
        const Lanes e = bond.length - r;
        const LaneBits intact_before = block.intact[g];
        const auto broken =
            static_cast<LaneBits>(greaterBits(law.excess(r, e), Lanes()) & intact_before);
        const auto intact = static_cast<LaneBits>(intact_before & ~broken);
        const Lanes J_r = J * r;
        const Lanes J_r_e = keepProduct(intact, J_r, e);
        tile.sum += J_r_e;
        if constexpr (row.value) {
          double* sums = work.row[0] + lanes * i;
          store(sums, load(sums) + J_r_e);
        }
        if constexpr (keep_bonds == Keep::bonds) {
          store(work.J_r_by_length + lanes * g, keepProduct(intact, J_r, bond.inverse_length));
          store(work.J_e_by_length + lanes * g, keepProduct(intact, J * e, bond.inverse_length));
          if (const LaneBits close = closeBroken(block, bond.squared, g, intact); close)
              [[unlikely]]
            noteClose(work, n_close, i, tile.place, close, row.value);
        }
        if (broken) [[unlikely]]
          markBroken(shared, listener, i, tile.place, g, broken, row.value);
      },
      [&](const ScalarTile<Dim, table>& tile)
          PERIDEM_LAMBDA { store(work.column[0] + tile.place, tile.sum); });
  double* sums = block.pieces.theta == nullptr ? work.sum : block.pieces.theta + block.pieces.first;
  for (std::size_t k = 0; k < block.n_padded; k += lanes) {
    const Lanes theta =
        takeSums(work.row[0], work.column[0], k) * load(block.dilatation_factor + k);
    store(sums + k, theta);
    store(work.theta_a + k, theta * load(block.a + k));
  }
  if (block.pieces.theta == nullptr) storeDilatations(block, nodes, work.sum);
  return n_close;
}

// theta a of all places, where theta was computed before.
void fetchDilatations(const BlockView& block, const NodeArrays& nodes, const KernelScratch& work) {
  if (block.pieces.theta == nullptr)
    for (std::size_t k = 0; k < block.n_own; ++k)
      work.sum[k] = nodes.theta[block.start + static_cast<std::size_t>(block.nodes[k])];
  else
    fetch(block, block.pieces.theta, work.sum);
  const std::size_t n = block.n_padded + block.n_halo;
  for (std::size_t k = 0; k < n; ++k) work.theta_a[k] = work.sum[k] * block.a[k];
}

// (9) f_i = sum of J V_j [ r (theta_i a_i + theta_j a_j) + e (b_i + b_j) ] y/|y|  Jha et al. 2021
// With Keep::bonds the dilatation pass has kept J r/|y| and J e/|y|, and found `n_close`.
template <int Dim, Table table, Keep kept>
void stateBasedForcePass(const BlockView& shared, const NodeArrays& nodes,
                         const KernelScratch& scratch, std::size_t n_close) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  const double* const places[3] = {work.z[0], work.z[1], work.z[2]};
  forEachGroup(
      block,
      [&](std::size_t tile) PERIDEM_LAMBDA {
        return ForceTile<Dim, table>{
            tile, {places, tile}, {block, tile}, load(work.theta_a + tile), load(block.b + tile),
            {}};
      },
      [&](ForceTile<Dim, table>& tile, std::size_t i, std::size_t g, auto row) PERIDEM_LAMBDA {
        Lanes y[Dim];
        Lanes J_r, J_e;  // over |y|
        if constexpr (kept == Keep::bonds) {
          J_r = load(work.J_r_by_length + lanes * g);
          J_e = load(work.J_e_by_length + lanes * g);
          for (int d = 0; d < Dim; ++d) y[d] = tile.positions.z[d] - places[d][i];
        } else {
          const Deformed<Dim> bond(tile.positions, places, i);
          const LaneBits intact = block.intact[g];
          const auto [r, J] = ReferenceBond<Lps>(block, tile.reference, i, g);
          const Lanes J_by_length = keepProduct(intact, J, bond.inverse_length);
          J_r = keepProduct(intact, J_by_length, r);
          J_e = keepProduct(intact, J_by_length, bond.length - r);
          for (int d = 0; d < Dim; ++d) y[d] = bond.y[d];
          if (const LaneBits close = closeBroken(block, bond.squared, g, intact); close)
              [[unlikely]]
            noteClose(work, n_close, i, tile.place, close, row.value);
        }
        const Lanes t = Lps::force(J_r, J_e, tile.theta_a + work.theta_a[i], tile.b + block.b[i]);
        tile.add(work, i, row.value, t, y);
      },
      [&](const ForceTile<Dim, table>& tile) PERIDEM_LAMBDA {
        for (int d = 0; d < Dim; ++d) store(work.column[d] + tile.place, tile.sum[d]);
      });
  if (n_close > 0) addSelfContact<Dim>(shared, scratch, n_close);
  storeForces<Dim>(block, nodes, work);
}

// f_i = sum of w force along the bond; the laws are Silling 2000 (PMBBond) and Lipton 2016, J.
// Elast. 124 (RNPBond). A bond exerts no force in the evaluation that breaks it; its self-contact
// starts in the next one.
template <int Dim, Table table, class Law>
void bondBasedForcePass(const Law& law, const BlockView& shared, const NodeArrays& nodes,
                        const KernelScratch& scratch, const BreakListener& listener) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  const double* const places[3] = {work.z[0], work.z[1], work.z[2]};
  std::size_t n_close = 0;
  forEachGroup(
      block,
      [&](std::size_t tile) PERIDEM_LAMBDA {
        return ForceTile<Dim, table>{tile, {places, tile}, {block, tile}, {}, {}, {}};
      },
      [&](ForceTile<Dim, table>& tile, std::size_t i, std::size_t g, auto row) PERIDEM_LAMBDA {
        prefetchNextBody(block, g);
        const Deformed<Dim> deformed(tile.positions, places, i);
        const ReferenceBond<Law> reference(block, tile.reference, i, g);
        Lanes elongation, stretch, inverse, direction[Dim];
        stretchOf<Dim, Law>(block, deformed, reference.number, i, tile.place, elongation, stretch,
                            direction, inverse);
        const LaneBits intact_before = block.intact[g];
        const LaneBits close = closeBroken(block, deformed.squared, g, intact_before);
        const auto broken = static_cast<LaneBits>(
            greaterBits(law.excess(reference.number, stretch), Lanes()) & intact_before);
        const auto intact = static_cast<LaneBits>(intact_before & ~broken);
        const Lanes t = reference.weight * law.force(elongation, stretch);
        tile.add(work, i, row.value, keepProduct(intact, t, inverse), direction);
        if (broken) [[unlikely]]
          markBroken(shared, listener, i, tile.place, g, broken, row.value);
        if (close) [[unlikely]]
          noteClose(work, n_close, i, tile.place, close, row.value);
      },
      [&](const ForceTile<Dim, table>& tile) PERIDEM_LAMBDA {
        for (int d = 0; d < Dim; ++d) store(work.column[d] + tile.place, tile.sum[d]);
      });
  if (n_close > 0) addSelfContact<Dim>(shared, scratch, n_close);
  storeForces<Dim>(block, nodes, work);
}

// (14) Z_i = max over all neighbours, broken ones included, of |s| / s0     Jha et al. 2021
template <int Dim, Table table, class Law>
void damagePass(const Law& law, const BlockView& shared, const NodeArrays& nodes,
                const KernelScratch& scratch) {
  const BlockView block = shared;  // copies whose pointers can stay in registers
  const KernelScratch work = scratch;
  const double* const places[3] = {work.z[0], work.z[1], work.z[2]};
  forEachGroup(
      block,
      [&](std::size_t tile) PERIDEM_LAMBDA {
        return ScalarTile<Dim, table>{tile, {places, tile}, {block, tile}, {}};
      },
      [&](ScalarTile<Dim, table>& tile, std::size_t i, std::size_t g, auto row) PERIDEM_LAMBDA {
        const Deformed<Dim> deformed(tile.positions, places, i);
        const ReferenceBond<Law> reference(block, tile.reference, i, g);
        Lanes elongation, stretch, inverse, direction[Dim];
        stretchOf<Dim, Law>(block, deformed, reference.number, i, tile.place, elongation, stretch,
                            direction, inverse);
        const Lanes z = keep(block.groups[g].exists, law.damage(reference.number, stretch));
        tile.sum = larger(tile.sum, z);
        if constexpr (row.value) {
          double* largest = work.row[0] + lanes * i;
          store(largest, larger(load(largest), z));
        }
      },
      [&](const ScalarTile<Dim, table>& tile)
          PERIDEM_LAMBDA { store(work.column[0] + tile.place, tile.sum); });
  for (std::size_t k = 0; k < block.n_own; ++k) {
    double* largest = work.row[0] + lanes * k;
    nodes.damage_z[block.start + static_cast<std::size_t>(block.nodes[k])] =
        larger(largestLane(load(largest)), work.column[0][k]);
    store(largest, Lanes());
  }
}

// Lengths and weights as the force loops compute them without a table: an undeformed bond has
// elongation 0 exactly.
template <int Dim, class Law, class Influence>
void fillTable(const BlockView& block) {
  using Tile = TileReference<Dim, Table::none>;
  forEachGroup(
      block, [&](std::size_t tile) PERIDEM_LAMBDA { return Tile(block, tile); },
      [&](const Tile& tile, std::size_t i, std::size_t g, auto) PERIDEM_LAMBDA {
        const ReferenceBond<Law> bond(block, tile, i, g, Influence());
        const LaneBits exists = block.groups[g].exists;
        const auto without_bond = static_cast<LaneBits>(~exists);
        double* numbers = block.numbers + numbersOf(block.table) * g;
        if (block.table == TableOf::lengths_and_weights) {
          store(numbers, keep(exists, bond.number) + keep(without_bond, broadcast(1.0)));
          numbers += lanes;
        }
        store(numbers, keep(exists, bond.weight));
      },
      [](const Tile&) PERIDEM_LAMBDA {});
}

template <int Dim, Table table>
void runStateBased(Stage stage, const Lps& law, bool active, const BlockView& block,
                   const NodeArrays& nodes, const KernelScratch& work,
                   const BreakListener& listener) {
  if (stage == Stage::dilatation) {
    if (active) dilatationPass<Dim, table, Keep::nothing>(law, block, nodes, work, listener);
  } else if (stage == Stage::whole && active) {
    const std::size_t n_close =
        dilatationPass<Dim, table, Keep::bonds>(law, block, nodes, work, listener);
    stateBasedForcePass<Dim, table, Keep::bonds>(block, nodes, work, n_close);
  } else {
    fetchDilatations(block, nodes, work);
    stateBasedForcePass<Dim, table, Keep::nothing>(block, nodes, work, 0);
  }
}

template <int Dim, Table table, class Law>
void runLaw(Stage stage, const Law& law, bool active, const BlockView& block,
            const NodeArrays& nodes, const KernelScratch& work, const BreakListener& listener) {
  if (stage == Stage::table)
    return block.influence.beta > 0 ? fillTable<Dim, Law, GaussianInfluence>(block)
                                    : fillTable<Dim, Law, LinearInfluence>(block);
  if (stage == Stage::place) {
    const std::size_t first = block.pieces.first;
    double* const z[3] = {block.pieces.z[0] + first, block.pieces.z[1] + first,
                          block.pieces.z[2] + first};
    return placeNodes<Dim>(block, nodes, z);
  }
  fetchPositions<Dim>(block, nodes, work);
  if (stage == Stage::damage) {
    damagePass<Dim, table>(law, block, nodes, work);
    if (Law::state_based && block.pieces.theta != nullptr && block.write_theta)
      storeDilatations(block, nodes, block.pieces.theta + block.pieces.first);
  } else if constexpr (Law::state_based)
    runStateBased<Dim, table>(stage, law, active, block, nodes, work, listener);
  else if (stage != Stage::dilatation)
    bondBasedForcePass<Dim, table>(law, block, nodes, work, listener);
}

template <int Dim, Table table>
void run(Stage stage, const LawView& law, const BlockView& block, const NodeArrays& nodes,
         const KernelScratch& work, const BreakListener& listener) {
  const bool active = law.state_based_stage;
  if (law.lps != nullptr)
    runLaw<Dim, table>(stage, *law.lps, active, block, nodes, work, listener);
  else if (law.pmb != nullptr)
    runLaw<Dim, table>(stage, *law.pmb, active, block, nodes, work, listener);
  else
    runLaw<Dim, table>(stage, *law.rnp, active, block, nodes, work, listener);
}

}  // namespace

void runBlock(Stage stage, int dimension, const LawView& law, const BlockView& block,
              const NodeArrays& nodes, const KernelScratch& work, const BreakListener& listener) {
  const auto runWith = block.table == TableOf::weights
                           ? (dimension == 3 ? run<3, Table::weights> : run<2, Table::weights>)
                           : (dimension == 3 ? run<3, Table::all> : run<2, Table::all>);
  runWith(stage, law, block, nodes, work, listener);
}

// Eight nodes at a time: three times eight components, of which those of directions that do not
// move stay as they are.
NodeSpeed moveNodes(const NodeMotion& motion, const MovingArrays& shared) {
  const MovingArrays nodes = shared;
  LaneBits moves[3] = {};
  for (int k = 0; k < 3 * lanes; ++k)
    if (k % 3 < motion.dimension)
      moves[k / lanes] = static_cast<LaneBits>(moves[k / lanes] | 1u << (k % lanes));
  const Lanes k_by_rho = broadcast(motion.k_by_rho);
  const Lanes dt = broadcast(motion.dt);
  const Lanes limit = broadcast(motion.speed_limit);
  Lanes fastest;
  unsigned within = all_lanes;
  std::size_t i = 3 * motion.begin;
  const std::size_t end = 3 * motion.end;
  for (; i + 3 * lanes <= end; i += 3 * lanes)
    for (int part = 0; part < 3; ++part) {
      const std::size_t at = i + static_cast<std::size_t>(lanes * part);
      const Lanes kick = keepProduct(moves[part], k_by_rho, loadUnaligned(nodes.f + at));
      const Lanes v = loadUnaligned(nodes.v + at) + kick;
      const Lanes speed = keep(moves[part], magnitude(v));
      within &= greaterBits(limit, speed);
      fastest = larger(fastest, speed);
      const Lanes way = keepProduct(moves[part], dt, v);
      storeUnaligned(nodes.v + at, v);
      storeUnaligned(nodes.u + at, loadUnaligned(nodes.u + at) + way);
      storeUnaligned(nodes.x + at, loadUnaligned(nodes.x + at) + way);
    }
  NodeSpeed speed{within == all_lanes, largestLane(fastest)};
  for (; i < end; ++i) {
    if (static_cast<int>(i % 3) >= motion.dimension) continue;
    const double v = nodes.v[i] + motion.k_by_rho * nodes.f[i];
    speed.within_limit &= magnitude(v) < motion.speed_limit;
    speed.fastest = larger(speed.fastest, magnitude(v));
    nodes.v[i] = v;
    nodes.u[i] += motion.dt * v;
    nodes.x[i] += motion.dt * v;
  }
  return speed;
}

}  // namespace peridem::PERIDEM_ISA
