// Bytes that the arrays of a model take for each node, bond and group of bonds. Both
// DEMModel::memoryBytes() and the prediction that `peridem check` makes before bonds are built
// (python/peridem/memory.py) use them: a change of State, BondTable or BondBlock belongs here too.
#pragma once

#include <cstddef>

#include "bond_block.h"
#include "bonds.h"
#include "peridynamic.h"
#include "state.h"

namespace peridem {

struct MemoryCosts {
  // State: X x u v f; V rho theta m Z; body and zone; two fixities and the locked directions.
  // Besides, the row of the bond table and the position of the last contact search.
  std::size_t node =
      5 * sizeof(Vec3) + 5 * sizeof(Real) + 2 * sizeof(Index) + 3 + sizeof(Offset) + sizeof(Vec3);
  // BondTable: neighbour and flag of a directed bond.
  std::size_t bond = sizeof(Index) + sizeof(std::uint8_t);
  // BondBlock: z_ref, V, m, a, b and the node of each place of a block; blocks pad their nodes to
  // whole tiles and hold a copy of those of other blocks that they are bonded to.
  std::size_t place = 7 * sizeof(double) + sizeof(Index);
  // BondGroups: the bonds of one node with one tile.
  std::size_t group = sizeof(BondGroup) + group_numbers * sizeof(double);
  std::size_t tile = static_cast<std::size_t>(lanes);  // nodes of a tile
  // Largest body that is one block, and nodes of the blocks of larger ones.
  std::size_t whole = static_cast<std::size_t>(BlockSizes{}.whole);
  std::size_t piece = static_cast<std::size_t>(BlockSizes{}.piece);
};

}  // namespace peridem
