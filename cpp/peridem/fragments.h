// The pieces of broken bodies: nodes that intact bonds hold together.
#pragma once

#include <vector>

#include "bonds.h"

namespace peridem {

// Fragment of each node: the connected components of the intact bonds, counted from 0 in the order
// of their first nodes. A node without intact bonds is a fragment of its own.
std::vector<Index> fragmentLabels(const BondTable& bonds, std::size_t n_nodes);

}  // namespace peridem
