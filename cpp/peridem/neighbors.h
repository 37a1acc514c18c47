// Neighbour search on a fixed set of points (nanoflann kd-tree), and compressed adjacency lists.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "types.h"

namespace peridem {

// Compressed rows: links(i) are the neighbours of i, ascending.
struct AdjacencyList {
  std::vector<Offset> offsets{0};
  std::vector<Index> indices;

  std::size_t size() const { return offsets.size() - 1; }
  std::span<const Index> links(Index i) const {
    const auto row = static_cast<std::size_t>(i);
    return std::span(indices).subspan(static_cast<std::size_t>(offsets[row]),
                                      static_cast<std::size_t>(offsets[row + 1] - offsets[row]));
  }
};

// kd-tree over points that must outlive it and stay where they are.
class PointTree {
 public:
  explicit PointTree(std::span<const Vec3> points);
  ~PointTree();
  PointTree(const PointTree&) = delete;
  PointTree& operator=(const PointTree&) = delete;

  // Indices of the points with dx^2 + dy^2 + dz^2 < radius^2, ascending, into `found`.
  void withinRadius(const Vec3& center, Real radius, std::vector<Index>& found) const;

  // Distance from point i to the nearest other point.
  Real nearestOther(Index i) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

// Neighbours of every point: j != i with |X_j - X_i| < radius.
AdjacencyList neighborsWithin(std::span<const Vec3> points, Real radius, int threads);

}  // namespace peridem
