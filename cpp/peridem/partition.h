// Cutting a large body into pieces for the force loops.
#pragma once

#include <vector>

#include "bonds.h"
#include "particle.h"

namespace peridem {

// Splits the nodes of a body into `parts` compact pieces of nearly equal numbers of bonds with few
// bonds between them (METIS). Returns the piece of each node, local order.
std::vector<Index> partitionBody(const State& state, const BondTable& bonds, const Particle& body,
                                 Index parts);

}  // namespace peridem
