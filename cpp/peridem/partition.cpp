#include "partition.h"

#include <metis.h>

#include <algorithm>
#include <span>
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

namespace {

struct Node {
  Vec3 x;
  Index local;
};

// Pieces [first, first + parts) for the nodes: cut across the longest side of their box, until
// there is one piece for each part.
void bisect(std::span<Node> nodes, Index first, Index parts, std::vector<Index>& piece) {
  if (parts == 1) {
    for (const Node& node : nodes) piece[static_cast<std::size_t>(node.local)] = first;
    return;
  }
  Vec3 lower = nodes.front().x;
  Vec3 upper = lower;
  for (const Node& node : nodes) {
    lower = lower.cwiseMin(node.x);
    upper = upper.cwiseMax(node.x);
  }
  Eigen::Index axis = 0;
  (upper - lower).maxCoeff(&axis);
  const Index left = parts / 2;
  const std::size_t cut =
      nodes.size() * static_cast<std::size_t>(left) / static_cast<std::size_t>(parts);
  std::nth_element(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(cut), nodes.end(),
                   [axis](const Node& p, const Node& q) {
                     return p.x[axis] != q.x[axis] ? p.x[axis] < q.x[axis] : p.local < q.local;
                   });
  bisect(nodes.first(cut), first, left, piece);
  bisect(nodes.subspan(cut), first + left, parts - left, piece);
}

std::span<const Vec3> pointsOf(const State& state, const Particle& body) {
  return {state.x_ref.data() + body.start, static_cast<std::size_t>(body.nodes())};
}

// Thinner than its horizon in one direction, as every body in 2D.
bool isFlat(std::span<const Vec3> points, Real horizon) {
  Vec3 lower = points.front();
  Vec3 upper = lower;
  for (const Vec3& x : points) {
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
  }
  return (upper - lower).minCoeff() < horizon;
}

std::vector<Index> partitionByBisection(std::span<const Vec3> points, Index parts) {
  std::vector<Node> nodes;
  nodes.reserve(points.size());
  for (const Vec3& x : points) nodes.push_back({x, static_cast<Index>(nodes.size())});
  std::vector<Index> piece(points.size(), 0);
  bisect(nodes, 0, parts, piece);
  return piece;
}

std::vector<Index> partitionByMetis(const State& state, const BondTable& bonds,
                                    const Particle& body, Index parts) {
  const auto n = static_cast<std::size_t>(body.nodes());
  std::vector<Index> piece(n, 0);
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

}  // namespace

std::vector<Index> partitionBody(const State& state, const BondTable& bonds, const Particle& body,
                                 Index parts) {
  const std::span<const Vec3> points = pointsOf(state, body);
  if (parts <= 1) return std::vector<Index>(points.size(), 0);
  if (isFlat(points, body.horizon)) return partitionByBisection(points, parts);
  return partitionByMetis(state, bonds, body, parts);
}

}  // namespace peridem
