// Bonds of all bodies: compressed rows over the nodes, both directions of a bond stored.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "influence.h"
#include "neighbors.h"
#include "particle.h"
#include "state.h"

namespace peridem {

struct BondTable {
  std::vector<Offset> offsets{0};    // bonds of node i: [offsets[i], offsets[i+1])
  std::vector<Index> neighbors;      // node j of the bond (i, j), ascending in a row
  std::vector<std::uint8_t> intact;  // 1: unbroken

  std::size_t size() const { return neighbors.size(); }

  std::size_t begin(Index i) const {
    return static_cast<std::size_t>(offsets[static_cast<std::size_t>(i)]);
  }
  std::size_t end(Index i) const {
    return static_cast<std::size_t>(offsets[static_cast<std::size_t>(i) + 1]);
  }

  // Position of the bond (i, j) in the table; size() when there is none.
  std::size_t find(Index i, Index j) const {
    const auto row = static_cast<std::size_t>(i);
    const auto begin = neighbors.begin() + offsets[row];
    const auto end = neighbors.begin() + offsets[row + 1];
    const auto found = std::lower_bound(begin, end, j);
    return found != end && *found == j ? static_cast<std::size_t>(found - neighbors.begin())
                                       : size();
  }

  // Whether nodes i and j are bonded in the reference configuration, broken since or not.
  bool everBonded(Index i, Index j) const { return find(i, j) < size(); }
};

// V_j *= (eps + h/2 - r) / h   where r > eps - h/2: the part of V_j inside the horizon.
Real partialVolume(Real r, Real horizon, Real mesh_size);

// r = |X_j - X_i| of a bond, and w = J(r / eps) V_j with the partial-volume correction.
struct BondConstants {
  Real length;
  Real weight;
};
BondConstants bondConstants(const State& state, const Particle& body, const Influence& influence,
                            Index i, Index j);

// Appends the bonds of bodies whose nodes follow each other to the table, and fills their weighted
// volumes m. `influences[k]`: influence function of bodies[k].
void appendBonds(BondTable& bonds, State& state, std::span<const Particle> bodies,
                 std::span<const Influence> influences, int threads);

// The same for one body.
void appendBonds(BondTable& bonds, State& state, const Particle& body, const Influence& influence,
                 int threads);

}  // namespace peridem
