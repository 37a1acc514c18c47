// Force loops over the bond groups of a block; see bond_block.h. Compiled once per instruction set
// into the namespace PERIDEM_ISA.
#include "peridynamic_kernel.h"

#include "bond_lanes.h"

namespace peridem::PERIDEM_ISA {

namespace {

// Nodes of a large body lie anywhere in the arrays of the model; asked for early enough, they are
// there in time.
enum class Access { read = 0, write = 1 };
template <Access access>
PERIDEM_INLINE void prefetchNode(const BlockView& block, const double* vectors, std::size_t k) {
  constexpr std::size_t nodes_ahead = 32;
  if (k + nodes_ahead >= block.n_own) return;
  const auto node = block.start + static_cast<std::size_t>(block.nodes[k + nodes_ahead]);
  __builtin_prefetch(vectors + 3 * node, static_cast<int>(access));
}

// One line for every group: a body has more groups than its arrays have lines.
PERIDEM_INLINE void prefetchNextBody(const BlockView& block, std::size_t g) {
  const std::size_t line = g / 4;
  if (line < block.next_lines) __builtin_prefetch(block.next[g % 4] + lanes * line, 1);
}

// y = z_ref + Q^T (u - u_c) / eps of the own nodes: a rigid translation leaves it unchanged to the
// last digit.
template <int Dim>
void placeNodes(const BlockView& shared, const NodeArrays& nodes, double* const (&z)[3]) {
  const BlockView block = shared;  // copies that can stay in registers
  double u_c[Dim];
  for (int d = 0; d < Dim; ++d) u_c[d] = nodes.u[3 * block.center + static_cast<std::size_t>(d)];
  const double* all_u = nodes.u + 3 * block.start;
  for (std::size_t k = 0; k < block.n_own; ++k) {
    prefetchNode<Access::read>(block, nodes.u, k);
    const double* u = all_u + 3 * static_cast<std::size_t>(block.nodes[k]);
    double motion[Dim];
    for (int d = 0; d < Dim; ++d) motion[d] = u[d] - u_c[d];
    for (int d = 0; d < Dim; ++d) {
      double y = block.z_ref[d][k];
      for (int e = 0; e < Dim; ++e) y += block.into_frame[d][e] * motion[e];
      z[d][k] = y;
    }
  }
  for (std::size_t k = block.n_own; k < block.n_padded; ++k)
    for (int d = 0; d < Dim; ++d) z[d][k] = 0;
}

// The own places of an array over all pieces, then those of the halo.
void fetch(const BlockView& block, const double* of_pieces, double* places) {
  const double* own = of_pieces + block.pieces.first;
  for (std::size_t k = 0; k < block.n_padded; ++k) places[k] = own[k];
  for (std::size_t k = 0; k < block.n_halo; ++k)
    places[block.n_padded + k] = of_pieces[block.halo_places[k]];
}

template <int Dim>
void fetchPositions(const BlockView& block, const NodeArrays& nodes, const KernelScratch& work) {
  if (block.pieces.theta == nullptr) return placeNodes<Dim>(block, nodes, work.z);
  for (int d = 0; d < Dim; ++d) fetch(block, block.pieces.z[d], work.z[d]);
}

// Out of the way of the loops: bonds break seldom.
[[gnu::noinline]] void markBroken(const BlockView& block, const BreakListener& listener,
                                  std::size_t i, std::size_t tile, std::size_t g, LaneBits broken,
                                  bool both) {
  block.intact[g] = static_cast<LaneBits>(block.intact[g] & ~broken);
  const auto node = [&](std::size_t place) {
    return static_cast<Index>(block.start) + block.nodes[place];
  };
  for (std::size_t lane = 0; lane < lanes; ++lane)
    if ((broken >> lane) & 1) listener.broken(listener.context, node(tile + lane), node(i), both);
}

// Whether the row of a group is an own node, which takes its share of the force.
struct RowIsOwn {
  static constexpr bool value = true;
};
struct RowIsHalo {
  static constexpr bool value = false;
};

// For every tile of own nodes: tile = begin(place), visit(tile, i, g, row) for each of its groups,
// end(tile). Sums of a tile stay in registers meanwhile; those of the rows are in memory, eight
// lanes each, until all groups are done.
template <class Begin, class Visit, class End>
PERIDEM_INLINE void forEachGroup(const BlockView& block, Begin begin, Visit visit, End end) {
  for (std::size_t t = 0; t < block.n_tiles; ++t) {
    const TileBonds bonds = block.tiles[t];
    auto tile = begin(std::size_t{bonds.tile});
    for (std::size_t g = bonds.begin; g < bonds.halo; ++g)
      visit(tile, std::size_t{block.groups[g].row}, g, RowIsOwn{});
    for (std::size_t g = bonds.halo; g < bonds.end; ++g)
      visit(tile, std::size_t{block.groups[g].row}, g, RowIsHalo{});
    end(tile);
  }
}

// Sums of rows and columns of eight places; the rows are zero afterwards.
PERIDEM_INLINE Lanes takeSums(double* row, const double* column, std::size_t place) {
  double* rows = row + lanes * place;
  const Lanes sums = sumsOfRows(rows) + load(column + place);
  for (int k = 0; k < lanes; ++k) store(rows + lanes * k, Lanes());
  return sums;
}

// f = out_of_frame (sum of the forces) / V + gravity
template <int Dim>
void storeForces(const BlockView& shared, const NodeArrays& nodes, const KernelScratch& scratch) {
  const BlockView block = shared;  // copies that can stay in registers
  const KernelScratch work = scratch;
  double* all_f = nodes.f + 3 * block.start;
  for (std::size_t k = 0; k < block.n_padded; k += lanes) {
    const Lanes inverse_volume = load(block.inverse_volume + k);
    for (int d = 0; d < Dim; ++d)
      store(work.column[d] + k, takeSums(work.row[d], work.column[d], k) * inverse_volume);
  }
  for (std::size_t k = 0; k < block.n_own; ++k) {
    prefetchNode<Access::write>(block, nodes.f, k);
    double* f = all_f + 3 * static_cast<std::size_t>(block.nodes[k]);
    for (int d = 0; d < Dim; ++d) {
      double sum = block.body_force[d];
      for (int e = 0; e < Dim; ++e) sum += block.out_of_frame[d][e] * work.column[e][k];
      f[d] = sum;
    }
    for (int d = Dim; d < 3; ++d) f[d] = block.body_force[d];
  }
}

// Broken bonds resist being pushed together (Jha et al. 2021, section 3.3):
// f_i += min(0, Kn V_j (|y| - Rc)) y/|y|, with V_j whole. `groups` are those with a close broken
// bond. Seldom many.
template <int Dim>
[[gnu::noinline]] void addSelfContact(const BlockView& block, const KernelScratch& work,
                                      std::size_t count) {
  const double* const places[3] = {work.z[0], work.z[1], work.z[2]};
  for (std::size_t c = 0; c < count; ++c) {
    const std::size_t i = work.close[c].row;
    const std::size_t tile = work.close[c].tile;
    const Deformed<Dim> bonds(TilePositions<Dim>(places, tile), places, i);
    const Lanes gap = bonds.length - block.self_contact_radius;
    const Lanes pressed = block.self_contact_kn * block.volume[i] * gap;
    const Lanes t =
        keepProduct(work.close[c].close, pressed * load(block.volume + tile), bonds.inverse_length);
    for (int d = 0; d < Dim; ++d) {
      double* column = work.column[d] + tile;
      store(column, load(column) - t * bonds.y[d]);
      double* row = work.row[d] + lanes * i;
      if (work.close[c].row_is_own) store(row, multiplyAdd(t, bonds.y[d], load(row)));
    }
  }
}

// Lanes with a broken bond that is shorter than Rc.
PERIDEM_INLINE LaneBits closeBroken(const BlockView& block, const Lanes& squared, std::size_t g,
                                    LaneBits intact) {
  const Real Rc = block.self_contact_radius;
  return static_cast<LaneBits>(greaterBits(broadcast(Rc * Rc), squared) & block.groups[g].exists &
                               ~intact);
}

PERIDEM_INLINE void noteClose(const KernelScratch& work, std::size_t& count, std::size_t i,
                              std::size_t tile, LaneBits close, bool row_is_own) {
  work.close[count++] = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(tile), close,
                         row_is_own};
}

// A tile in a pass that sums one number per node.
template <int Dim, Table table>
struct ScalarTile {
  std::size_t place;
  TilePositions<Dim> positions;
  TileReference<Dim, table> reference;
  Lanes sum;
};

// A tile in a pass that sums forces.
template <int Dim, Table table>
struct ForceTile {
  std::size_t place;
  TilePositions<Dim> positions;
  TileReference<Dim, table> reference;
  Lanes theta_a, b;
  Lanes sum[Dim];

  // t / |y| times y to the row, the opposite to the tile
  PERIDEM_INLINE void add(const KernelScratch& work, std::size_t i, bool row_is_own, const Lanes& t,
                          const Lanes (&y)[Dim]) {
    for (int d = 0; d < Dim; ++d) {
      sum[d] = multiplySubtract(t, y[d], sum[d]);
      double* row = work.row[d] + lanes * i;
      if (row_is_own) store(row, multiplyAdd(t, y[d], load(row)));
    }
  }
};

void storeDilatations(const BlockView& block, const NodeArrays& nodes, const double* theta) {
  for (std::size_t k = 0; k < block.n_own; ++k)
    nodes.theta[block.start + static_cast<std::size_t>(block.nodes[k])] = theta[k];
}

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
  using Tile = TileReference<Dim, Table::computed>;
  forEachGroup(
      block, [&](std::size_t tile) PERIDEM_LAMBDA { return Tile(block, tile); },
      [&](const Tile& tile, std::size_t i, std::size_t g, auto) PERIDEM_LAMBDA {
        const ReferenceBond<Law> bond(block, tile, i, g, Influence());
        const LaneBits exists = block.groups[g].exists;
        const auto without_bond = static_cast<LaneBits>(~exists);
        double* numbers = block.numbers + group_numbers * g;
        store(numbers, keep(exists, bond.number) + keep(without_bond, broadcast(1.0)));
        store(numbers + lanes, keep(exists, bond.weight));
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
  const auto runWith = block.numbers != nullptr
                           ? (dimension == 3 ? run<3, Table::kept> : run<2, Table::kept>)
                           : (dimension == 3 ? run<3, Table::computed> : run<2, Table::computed>);
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
