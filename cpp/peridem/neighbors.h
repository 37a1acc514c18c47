// Neighbour search on fixed sets of points: a cell grid for all points within one radius, a kd-tree
// (nanoflann) for the nearest point however far it is; compressed adjacency lists.
#pragma once

#include <limits>
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

  // Distance from point i to the nearest other point; infinite when none is closer than `below`.
  Real nearestOther(Index i, Real below = std::numeric_limits<Real>::infinity()) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

// A set of points whose neighbours are sought within its own radius only. Its points are numbered
// from `first` on.
struct PointSet {
  std::span<const Vec3> points;
  Real radius = 0;
  Index first = 0;
};

// Runs of points that are worth a turn of a thread: [begin, end) of set number `set`.
struct Chunk {
  std::size_t set;
  std::size_t begin;
  std::size_t end;
};
std::vector<Chunk> chunksOf(std::span<const std::size_t> sizes);

// Appends one row for every point of the sets, one set after the other: the points j != i of the
// set with dx^2 + dy^2 + dz^2 < radius^2, ascending. `offsets` ends with the size of `indices`.
void appendNeighbors(std::span<const PointSet> sets, std::vector<Offset>& offsets,
                     std::vector<Index>& indices, int threads);

// The same for one set, numbered from 0.
AdjacencyList neighborsWithin(std::span<const Vec3> points, Real radius, int threads);

}  // namespace peridem
