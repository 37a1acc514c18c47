// The bonds of one node with a tile of eight: their vectors, lengths, weights and stretches, in
// lanes. For the force kernels alone, like simd.h.
#pragma once

#include "block_view.h"
#include "fuzzy.h"
#include "simd.h"

namespace peridem::PERIDEM_ISA {

// y_j of the eight nodes of a tile; their bonds with one node have y_j - y_i.
template <int Dim>
struct TilePositions {
  Lanes z[Dim];

  PERIDEM_INLINE TilePositions(const double* const (&places)[3], std::size_t tile) {
    for (int d = 0; d < Dim; ++d) z[d] = load(places[d] + tile);
  }
};

// The bonds of node i with a tile, from i to the tile.
template <int Dim>
struct Deformed {
  Lanes y[Dim];
  Lanes squared;         // |y|^2
  Lanes inverse_length;  // 1/|y|
  Lanes length;          // |y|

  PERIDEM_INLINE Deformed(const TilePositions<Dim>& tile, const double* const (&places)[3],
                          std::size_t i) {
    for (int d = 0; d < Dim; ++d) {
      y[d] = tile.z[d] - places[d][i];
      squared = d == 0 ? y[d] * y[d] : multiplyAdd(y[d], y[d], squared);
    }
    inverse_length = inverseSquareRoot(squared);
    length = squared * inverse_length;
  }
};

// Which numbers of its bonds a block has in a table; it computes the others.
enum class Table { all, weights, none };

// What a tile needs to compute lengths, or lengths and weights, of its bonds.
template <int Dim, Table table>
struct TileReference {
  PERIDEM_INLINE TileReference(const BlockView&, std::size_t) {}
};
template <int Dim>
struct TileReference<Dim, Table::weights> {
  TilePositions<Dim> positions;

  PERIDEM_INLINE TileReference(const BlockView& block, std::size_t tile)
      : positions({block.z_ref[0], block.z_ref[1], block.z_ref[2]}, tile) {}
};
template <int Dim>
struct TileReference<Dim, Table::none> {
  TilePositions<Dim> positions;
  Lanes volume;

  PERIDEM_INLINE TileReference(const BlockView& block, std::size_t tile)
      : positions({block.z_ref[0], block.z_ref[1], block.z_ref[2]}, tile),
        volume(load(block.volume + tile)) {}
};

// J times the partial-volume factor 1 or (eps + h/2 - r) / h; lengths in units of eps.
PERIDEM_INLINE Lanes partialVolume(const BondReference& reference, const Lanes& J, const Lanes& r) {
  const LaneBits beyond = greaterBits(r, broadcast(reference.partial_from));
  const Lanes lost = multiplySubtract(broadcast(reference.inverse_mesh_size), r,
                                      broadcast(reference.partial_offset));
  return J + keepProduct(beyond, J, lost);
}

// J(a) = a0 + a1 a
struct LinearInfluence {
  PERIDEM_INLINE static Lanes at(const InfluenceNumbers& numbers, const Lanes& a) {
    return multiplyAdd(a, broadcast(numbers.a1), broadcast(numbers.a0));
  }
};
// J(a) = a0 exp(-a^2 / beta)
struct GaussianInfluence {
  PERIDEM_INLINE static Lanes at(const InfluenceNumbers& numbers, const Lanes& a) {
    return numbers.a0 * exponential(a * a * (-1 / numbers.beta));
  }
};

// Lengths r (1/r for laws along the reference bond) and weights of the bonds of a group.
template <class Law>
struct ReferenceBond {
  Lanes number;
  Lanes weight;

  template <int Dim>
  PERIDEM_INLINE ReferenceBond(const BlockView& block, const TileReference<Dim, Table::all>&,
                               std::size_t, std::size_t g) {
    const double* numbers = block.numbers + 2 * lanes * g;
    number = load(numbers);
    weight = load(numbers + lanes);
    constexpr int ahead = 14 * 2 * lanes;  // asked for early enough, they are there in time
    __builtin_prefetch(numbers + ahead);
    __builtin_prefetch(numbers + ahead + lanes);
  }

  template <int Dim>
  PERIDEM_INLINE ReferenceBond(const BlockView& block,
                               const TileReference<Dim, Table::weights>& tile, std::size_t i,
                               std::size_t g) {
    const double* const places[3] = {block.z_ref[0], block.z_ref[1], block.z_ref[2]};
    const Deformed<Dim> bond(tile.positions, places, i);
    number = Law::along_deformed_bond ? bond.length : bond.inverse_length;
    const double* weights = block.numbers + lanes * g;
    weight = load(weights);
    __builtin_prefetch(weights + 28 * lanes);
  }

  template <int Dim, class Influence = LinearInfluence>
  PERIDEM_INLINE ReferenceBond(const BlockView& block, const TileReference<Dim, Table::none>& tile,
                               std::size_t i, std::size_t, Influence = {}) {
    const double* const places[3] = {block.z_ref[0], block.z_ref[1], block.z_ref[2]};
    const Deformed<Dim> bond(tile.positions, places, i);
    number = Law::along_deformed_bond ? bond.length : bond.inverse_length;
    const Lanes J =
        partialVolume(block.reference, Influence::at(block.influence, bond.length), bond.length);
    weight = Law::weight(J, bond.inverse_length) * (tile.volume * block.volume[i]);
  }
};

// Elongation e of the bonds of node i with a tile, what the law calls their stretch, and the
// direction of their forces, times `inverse` a unit vector. Along the deformed bond: number = r,
// stretch = e. Along the reference bond: number = 1/r, stretch = s. (Results by reference: GCC
// keeps them in registers, but not the members of a class.)
template <int Dim, class Law>
PERIDEM_INLINE void stretchOf(const BlockView& block, const Deformed<Dim>& bond,
                              const Lanes& number, std::size_t i, std::size_t tile,
                              Lanes& elongation, Lanes& stretch, Lanes (&direction)[Dim],
                              Lanes& inverse) {
  if constexpr (Law::along_deformed_bond) {
    elongation = bond.length - number;
    stretch = elongation;
    for (int d = 0; d < Dim; ++d) direction[d] = bond.y[d];
    inverse = bond.inverse_length;
  } else {
    Lanes eta_xi;  // (u_j - u_i) . xi
    for (int d = 0; d < Dim; ++d) {
      direction[d] = load(block.z_ref[d] + tile) - block.z_ref[d][i];
      eta_xi = multiplyAdd(bond.y[d] - direction[d], direction[d], eta_xi);
    }
    elongation = eta_xi * number;
    stretch = elongation * number;
    inverse = number;
  }
}

}  // namespace peridem::PERIDEM_ISA
