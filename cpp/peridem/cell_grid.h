// Nodes sorted into cubic cells, to find those near a node of the same set.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "types.h"

namespace peridem {

class CellGrid {
 public:
  // `nodes`: which of the positions to sort; neighbours are sought up to `radius`.
  CellGrid(const std::vector<Vec3>& positions, const std::vector<Index>& nodes, Real radius)
      : positions_(positions) {
    if (nodes.empty()) return;
    Vec3 upper = positions[static_cast<std::size_t>(nodes.front())];
    lower_ = upper;
    for (const Index i : nodes) {
      lower_ = lower_.cwiseMin(positions[static_cast<std::size_t>(i)]);
      upper = upper.cwiseMax(positions[static_cast<std::size_t>(i)]);
    }
    chooseCells(upper - lower_, nodes.size(), radius);
    sort(nodes);
  }

  // Calls visit(j) for every node in the cells around that of node i: all within the radius are
  // among them, i itself too.
  template <class Visit>
  void forEachNear(Index i, Visit visit) const {
    const auto center = cellOf(positions_[static_cast<std::size_t>(i)]);
    std::array<Offset, 3> first{};
    std::array<Offset, 3> last{};
    for (std::size_t d = 0; d < 3; ++d) {
      first[d] = std::max<Offset>(center[d] - 1, 0);
      last[d] = std::min<Offset>(center[d] + 1, cells_[d] - 1);
    }
    for (Offset z = first[2]; z <= last[2]; ++z)
      for (Offset y = first[1]; y <= last[1]; ++y) {
        // The cells of a line along x follow each other.
        const auto begin = start_[index(first[0], y, z)];
        const auto end = start_[index(last[0], y, z) + 1];
        for (auto k = begin; k < end; ++k) visit(sorted_[static_cast<std::size_t>(k)]);
      }
  }

 private:
  static constexpr Real cells_per_node = 4;

  // Cells as wide as the radius; wider where the nodes are so far apart that there would be many
  // more cells than nodes.
  void chooseCells(const Vec3& extent, std::size_t n, Real radius) {
    width_ = radius;
    for (;; width_ *= 2) {
      Real total = 1;
      for (std::size_t d = 0; d < 3; ++d) {
        const Real count = std::floor(extent[static_cast<Eigen::Index>(d)] / width_) + 1;
        total *= count;
        cells_[d] = count < 1e9 ? static_cast<Offset>(count) : Offset{1};
      }
      if (!(total > cells_per_node * static_cast<Real>(n) + 1000)) return;
    }
  }

  std::array<Offset, 3> cellOf(const Vec3& x) const {
    std::array<Offset, 3> cell{};
    for (std::size_t d = 0; d < 3; ++d) {
      const auto axis = static_cast<Eigen::Index>(d);
      const Real place = (x[axis] - lower_[axis]) / width_;  // NaN goes to the first cell
      if (place > 0)
        cell[d] = place < static_cast<Real>(cells_[d]) ? static_cast<Offset>(place) : cells_[d] - 1;
    }
    return cell;
  }

  std::size_t index(Offset x, Offset y, Offset z) const {
    return static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x);
  }

  // Counting sort: the nodes of a cell keep their order.
  void sort(const std::vector<Index>& nodes) {
    const auto cell = [&](Index i) {
      const auto c = cellOf(positions_[static_cast<std::size_t>(i)]);
      return index(c[0], c[1], c[2]);
    };
    start_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
    for (const Index i : nodes) ++start_[cell(i) + 1];
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    std::vector<Offset> next(start_.begin(), start_.end() - 1);
    sorted_.resize(nodes.size());
    for (const Index i : nodes) sorted_[static_cast<std::size_t>(next[cell(i)]++)] = i;
  }

  const std::vector<Vec3>& positions_;
  Vec3 lower_ = Vec3::Zero();
  Real width_ = 1;
  std::array<Offset, 3> cells_{1, 1, 1};
  std::vector<Offset> start_;
  std::vector<Index> sorted_;
};

}  // namespace peridem
