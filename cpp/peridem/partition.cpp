#include "partition.h"

#include <metis.h>

#include <numeric>
#include <string>

#include "errors.h"

namespace peridem {

namespace {

// Graph of the close neighbours only: a tenth of the bonds, and the same pieces.
struct Graph {
  std::vector<idx_t> offsets{0};
  std::vector<idx_t> neighbors;
  std::vector<idx_t> weights;  // work of a node: its number of bonds
};

Graph closeNeighbors(const BondTable& bonds, const Particle& body) {
  Graph graph;
  const Real reach = 2 * body.mesh_size;
  for (Index i = body.start; i < body.stop; ++i) {
    const auto begin = static_cast<std::size_t>(bonds.offsets[static_cast<std::size_t>(i)]);
    const auto end = static_cast<std::size_t>(bonds.offsets[static_cast<std::size_t>(i) + 1]);
    for (std::size_t k = begin; k < end; ++k)
      if (bonds.length[k] < reach)
        graph.neighbors.push_back(static_cast<idx_t>(bonds.neighbors[k] - body.start));
    graph.offsets.push_back(static_cast<idx_t>(graph.neighbors.size()));
    graph.weights.push_back(static_cast<idx_t>(end - begin) + 1);
  }
  return graph;
}

}  // namespace

std::vector<Index> partitionBody(const BondTable& bonds, const Particle& body, Index parts) {
  const auto n = static_cast<std::size_t>(body.nodes());
  std::vector<Index> piece(n, 0);
  if (parts <= 1) return piece;

  Graph graph = closeNeighbors(bonds, body);
  idx_t n_nodes = static_cast<idx_t>(n);
  idx_t n_constraints = 1;
  idx_t n_parts = static_cast<idx_t>(parts);
  idx_t edge_cut = 0;
  std::vector<idx_t> found(n, 0);
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_NUMBERING] = 0;
  const int status = METIS_PartGraphKway(
      &n_nodes, &n_constraints, graph.offsets.data(), graph.neighbors.data(), graph.weights.data(),
      nullptr, nullptr, &n_parts, nullptr, nullptr, options, &edge_cut, found.data());
  if (status != METIS_OK)
    throw NumericalError("METIS could not partition body " + std::to_string(body.id) + " (status " +
                         std::to_string(status) + ")");
  for (std::size_t i = 0; i < n; ++i) piece[i] = static_cast<Index>(found[i]);
  return piece;
}

std::vector<NodeBlock> makeBlocks(const BondTable& bonds, const std::vector<Particle>& bodies,
                                  Index block_nodes) {
  std::vector<NodeBlock> blocks;
  for (const Particle& body : bodies) {
    if (body.constrained) continue;  // no internal forces
    const Index parts = (body.nodes() + block_nodes - 1) / block_nodes;
    const auto piece = partitionBody(bonds, body, parts);
    const std::size_t first = blocks.size();
    for (Index p = 0; p < parts; ++p) blocks.push_back({body.id, {}});
    for (Index i = 0; i < body.nodes(); ++i)
      blocks[first + static_cast<std::size_t>(piece[static_cast<std::size_t>(i)])].nodes.push_back(
          body.start + i);
  }
  std::erase_if(blocks, [](const NodeBlock& block) { return block.nodes.empty(); });
  return blocks;
}

}  // namespace peridem
