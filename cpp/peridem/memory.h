// Bytes that the arrays of a model take for each node, bond and group of bonds. Both
// DEMModel::memoryBytes() and the prediction that `peridem check` makes before bonds are built
// (python/peridem/memory.py) use them: a change of State, BondTable, BondPattern or
// PeridynamicForce belongs here too.
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
  // BondPattern: z_ref, V, 1/V, the factor of theta, a, b and the node of each place. Blocks pad
  // their nodes to whole tiles and hold a copy of those of other blocks that they are bonded to,
  // with where those are in the arrays that pieces of a body exchange: z and theta of all places.
  std::size_t place = 8 * sizeof(double) + sizeof(Index);
  std::size_t halo = sizeof(Index);
  std::size_t exchange = 4 * sizeof(double);
  std::size_t tile_bonds = sizeof(TileBonds);  // of a tile
  // The bonds of one node with one tile: of a pattern, in its table (see Lengths), of every block.
  std::size_t group = sizeof(BondGroup);
  std::size_t weights = numbersOf(TableOf::weights) * sizeof(double);
  std::size_t lengths = numbersOf(TableOf::lengths_and_weights) * sizeof(double) - weights;
  std::size_t flags = sizeof(LaneBits);
  std::size_t tile = static_cast<std::size_t>(lanes);  // nodes of a tile
};

}  // namespace peridem
