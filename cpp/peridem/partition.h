// Cutting the work of the force loops into blocks of nodes.
#pragma once

#include <vector>

#include "bonds.h"
#include "particle.h"

namespace peridem {

// Part of one body that one thread treats at a time. Every node writes only its own values and
// sums in the order of its bonds, so that results do not depend on the partition.
struct NodeBlock {
  Index body;
  std::vector<Index> nodes;
};

// Splits the nodes of a body into `parts` compact pieces of nearly equal numbers of bonds with few
// bonds between them (METIS). Returns the piece of each node, local order.
std::vector<Index> partitionBody(const BondTable& bonds, const Particle& body, Index parts);

// Bodies of up to `block_nodes` nodes make one block each; larger ones are partitioned.
std::vector<NodeBlock> makeBlocks(const BondTable& bonds, const std::vector<Particle>& bodies,
                                  Index block_nodes);

}  // namespace peridem
