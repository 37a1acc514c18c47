// What the passes of the force kernels are made of: nodes to places and back, the walk over the
// groups of a block, sums of tiles and rows, self-contact. For the force kernels alone, like
// simd.h.
#pragma once

#include "bond_lanes.h"
#include "kernel_arrays.h"

namespace peridem::PERIDEM_ISA {

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
inline void fetch(const BlockView& block, const double* of_pieces, double* places) {
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
[[gnu::noinline]] inline void markBroken(const BlockView& block, const BreakListener& listener,
                                         std::size_t i, std::size_t tile, std::size_t g,
                                         LaneBits broken, bool both) {
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

inline void storeDilatations(const BlockView& block, const NodeArrays& nodes, const double* theta) {
  for (std::size_t k = 0; k < block.n_own; ++k)
    nodes.theta[block.start + static_cast<std::size_t>(block.nodes[k])] = theta[k];
}

}  // namespace peridem::PERIDEM_ISA
