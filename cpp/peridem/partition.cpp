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

Graph closeNeighbors(const State& state, const BondTable& bonds, const Particle& body) {
  Graph graph;
  const Real reach = 2 * body.mesh_size;
  for (Index i = body.start; i < body.stop; ++i) {
    const auto begin = static_cast<std::size_t>(bonds.offsets[static_cast<std::size_t>(i)]);
    const auto end = static_cast<std::size_t>(bonds.offsets[static_cast<std::size_t>(i) + 1]);
    for (std::size_t k = begin; k < end; ++k)
      if ((state.x_ref[static_cast<std::size_t>(bonds.neighbors[k])] -
           state.x_ref[static_cast<std::size_t>(i)])
              .norm() < reach)
        graph.neighbors.push_back(static_cast<idx_t>(bonds.neighbors[k] - body.start));
    graph.offsets.push_back(static_cast<idx_t>(graph.neighbors.size()));
    graph.weights.push_back(static_cast<idx_t>(end - begin) + 1);
  }
  return graph;
}

}  // namespace

std::vector<Index> partitionBody(const State& state, const BondTable& bonds, const Particle& body,
                                 Index parts) {
  const auto n = static_cast<std::size_t>(body.nodes());
  std::vector<Index> piece(n, 0);
  if (parts <= 1) return piece;

  Graph graph = closeNeighbors(state, bonds, body);
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

}  // namespace peridem
