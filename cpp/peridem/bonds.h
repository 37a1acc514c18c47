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
  std::vector<Real> length;          // r = |X_j - X_i|
  std::vector<Real> weight;          // w = J(r / eps) V_j, with the partial-volume correction
  std::vector<std::uint8_t> intact;  // 1: unbroken

  std::size_t size() const { return neighbors.size(); }

  // Whether nodes i and j are bonded in the reference configuration, broken since or not.
  bool everBonded(Index i, Index j) const {
    const auto row = static_cast<std::size_t>(i);
    return std::binary_search(neighbors.begin() + offsets[row],
                              neighbors.begin() + offsets[row + 1], j);
  }
};

// V_j *= (eps + h/2 - r) / h   where r > eps - h/2: the part of V_j inside the horizon.
Real partialVolume(Real r, Real horizon, Real mesh_size);

// Appends the bonds of one body to the table and fills its weighted volumes m.
void appendBonds(BondTable& bonds, State& state, const Particle& body, const Influence& influence,
                 int threads);

}  // namespace peridem
