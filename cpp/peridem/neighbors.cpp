#include "neighbors.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>

namespace peridem {

namespace {

struct PointCloud {
  std::span<const Vec3> points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  Real kdtree_get_pt(std::size_t i, std::size_t d) const {
    return points[i][static_cast<Eigen::Index>(d)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

// Result set for nanoflann (the same interface in its versions 1.4 and 1.5).
struct NearestOther {
  using DistanceType = Real;
  using IndexType = Index;
  Index self;
  Real best;
  bool found = false;

  std::size_t size() const { return found ? 1 : 0; }
  bool empty() const { return size() == 0; }
  bool full() const { return true; }
  bool addPoint(Real squared, Index i) {
    if (i != self && squared < best) {
      best = squared;
      found = true;
    }
    return true;
  }
  Real worstDist() const { return best; }
  void sort() {}
};

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Real, PointCloud, Real, Index>,
                                        PointCloud, 3, Index>;

#if NANOFLANN_VERSION >= 0x150
using SearchParameters = nanoflann::SearchParameters;
#else
using SearchParameters = nanoflann::SearchParams;
#endif

}  // namespace

struct PointTree::Tree {
  PointCloud cloud;
  KdTree index;

  explicit Tree(std::span<const Vec3> points)
      : cloud{points}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
    index.buildIndex();
  }
};

PointTree::PointTree(std::span<const Vec3> points) : tree_(std::make_unique<Tree>(points)) {}
PointTree::~PointTree() = default;

Real PointTree::nearestOther(Index i, Real below) const {
  NearestOther result{i, below * below};
  tree_->index.findNeighbors(result, tree_->cloud.points[static_cast<std::size_t>(i)].data(),
                             SearchParameters());
  return result.found ? std::sqrt(result.best) : std::numeric_limits<Real>::infinity();
}

namespace {

// Points sorted into cells as wide as the radius. Their coordinates are kept in the order of the
// cells: a row of cells is one run of memory.
class PointGrid {
 public:
  PointGrid(std::span<const Vec3> points, Real radius) : squared_radius_(radius * radius) {
    const std::size_t n = points.size();
    if (n == 0) return;
    lower_ = points[0];
    Vec3 upper = points[0];
    for (const Vec3& x : points) {
      lower_ = lower_.cwiseMin(x);
      upper = upper.cwiseMax(x);
    }
    // A little wider than the radius: the places of two neighbours carry round-off.
    chooseCells(upper - lower_, n, radius * (1 + 1e-6));
    sort(points);
  }

  // Point at a place in the order of the cells.
  Index point(std::size_t place) const { return order_[place]; }

  std::size_t countNeighbors(std::size_t place) const {
    Offset count = 0;
    forEachRun(place, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) count += isNear(place, k) ? 1 : 0;
    });
    return static_cast<std::size_t>(count - 1);  // the point itself
  }

  // Ascending, `first` added to each; `found` has room for one more than countNeighbors().
  void findNeighbors(std::size_t place, Index first, Index* found) const {
    std::size_t n = 0;
    forEachRun(place, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        found[n] = first + order_[k];
        n += isNear(place, k) && k != place ? 1 : 0;
      }
    });
    std::sort(found, found + n);
  }

 private:
  static constexpr Real cells_per_point = 4;

  // dx^2 + dy^2 + dz^2 in this order of operations: pairs at the very edge of a horizon are decided
  // by its round-off.
  bool isNear(std::size_t i, std::size_t j) const {
    const Real dx = x_[0][j] - x_[0][i];
    const Real dy = x_[1][j] - x_[1][i];
    const Real dz = x_[2][j] - x_[2][i];
    return dx * dx + dy * dy + dz * dz < squared_radius_;
  }

  // Wider cells where the points are so far apart that there would be many more cells than points.
  void chooseCells(const Vec3& extent, std::size_t n, Real width) {
    for (width_ = width;; width_ *= 2) {
      Real total = 1;
      for (int d = 0; d < 3; ++d) {
        const Real count = std::floor(extent[d] / width_) + 1;
        total *= count;
        cells_[static_cast<std::size_t>(d)] = count < 1e9 ? static_cast<Offset>(count) : 1;
      }
      if (!(total > cells_per_point * static_cast<Real>(n) + 1000)) return;
    }
  }

  std::array<Offset, 3> cellOf(Real x, Real y, Real z) const {
    const std::array<Real, 3> at = {x, y, z};
    std::array<Offset, 3> cell{};
    for (std::size_t d = 0; d < 3; ++d) {
      const Real place = (at[d] - lower_[static_cast<Eigen::Index>(d)]) / width_;
      cell[d] = std::min(static_cast<Offset>(place), cells_[d] - 1);
    }
    return cell;
  }

  std::size_t number(Offset x, Offset y, Offset z) const {
    return static_cast<std::size_t>((z * cells_[1] + y) * cells_[0] + x);
  }

  // Counting sort: the points of a cell keep their order.
  void sort(std::span<const Vec3> points) {
    const std::size_t n = points.size();
    start_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
    std::vector<std::size_t> cell(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto c = cellOf(points[i][0], points[i][1], points[i][2]);
      cell[i] = number(c[0], c[1], c[2]);
      ++start_[cell[i] + 1];
    }
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    order_.resize(n);
    for (auto& component : x_) component.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t place = next[cell[i]]++;
      order_[place] = static_cast<Index>(i);
      for (std::size_t d = 0; d < 3; ++d) x_[d][place] = points[i][static_cast<Eigen::Index>(d)];
    }
  }

  // Calls visit(begin, end) for the runs of places around a place: all neighbours are in them.
  template <class Visit>
  void forEachRun(std::size_t place, Visit visit) const {
    const auto center = cellOf(x_[0][place], x_[1][place], x_[2][place]);
    std::array<Offset, 3> first{};
    std::array<Offset, 3> last{};
    for (std::size_t d = 0; d < 3; ++d) {
      first[d] = std::max<Offset>(center[d] - 1, 0);
      last[d] = std::min<Offset>(center[d] + 1, cells_[d] - 1);
    }
    for (Offset z = first[2]; z <= last[2]; ++z)
      for (Offset y = first[1]; y <= last[1]; ++y)
        visit(start_[number(first[0], y, z)], start_[number(last[0], y, z) + 1]);
  }

  Real squared_radius_ = 0;
  Vec3 lower_ = Vec3::Zero();
  Real width_ = 1;
  std::array<Offset, 3> cells_{1, 1, 1};
  std::vector<std::size_t> start_;  // first place of each cell
  std::vector<Index> order_;        // point at each place
  std::array<std::vector<Real>, 3> x_;
};

}  // namespace

std::vector<Chunk> chunksOf(std::span<const std::size_t> sizes) {
  constexpr std::size_t most = 4096;
  std::vector<Chunk> chunks;
  for (std::size_t set = 0; set < sizes.size(); ++set)
    for (std::size_t begin = 0; begin < sizes[set]; begin += most)
      chunks.push_back({set, begin, std::min(begin + most, sizes[set])});
  return chunks;
}

void appendNeighbors(std::span<const PointSet> sets, std::vector<Offset>& offsets,
                     std::vector<Index>& indices, int threads) {
  std::vector<PointGrid> grids;
  std::vector<std::size_t> sizes;
  std::vector<std::size_t> first_row;
  std::size_t rows = offsets.size() - 1;
  grids.reserve(sets.size());
  for (const PointSet& set : sets) {
    grids.emplace_back(set.points, set.radius);
    sizes.push_back(set.points.size());
    first_row.push_back(rows);
    rows += set.points.size();
  }
  const std::vector<Chunk> chunks = chunksOf(sizes);
  const std::size_t old_rows = offsets.size() - 1;
  const auto rowOf = [&](const Chunk& chunk, std::size_t place) {
    return first_row[chunk.set] + static_cast<std::size_t>(grids[chunk.set].point(place));
  };

  // First how many there are, then which: nothing is allocated by the threads.
  offsets.resize(rows + 1);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) if (rows - old_rows > 1000)
  for (std::size_t c = 0; c < chunks.size(); ++c)
    for (std::size_t place = chunks[c].begin; place < chunks[c].end; ++place)
      offsets[rowOf(chunks[c], place) + 1] =
          static_cast<Offset>(grids[chunks[c].set].countNeighbors(place));
  Offset longest = 0;
  for (std::size_t i = old_rows; i < rows; ++i) {
    longest = std::max(longest, offsets[i + 1]);
    offsets[i + 1] += offsets[i];
  }
  indices.resize(static_cast<std::size_t>(offsets[rows]));
  std::vector<std::vector<Index>> found(static_cast<std::size_t>(threads),
                                        std::vector<Index>(static_cast<std::size_t>(longest) + 1));
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) if (rows - old_rows > 1000)
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    Index* const row = found[static_cast<std::size_t>(omp_get_thread_num())].data();
    for (std::size_t place = chunks[c].begin; place < chunks[c].end; ++place) {
      grids[chunks[c].set].findNeighbors(place, sets[chunks[c].set].first, row);
      const std::size_t i = rowOf(chunks[c], place);
      std::copy_n(row, offsets[i + 1] - offsets[i], indices.begin() + offsets[i]);
    }
  }
}

AdjacencyList neighborsWithin(std::span<const Vec3> points, Real radius, int threads) {
  AdjacencyList list;
  const PointSet set{points, radius, 0};
  appendNeighbors({&set, 1}, list.offsets, list.indices, threads);
  return list;
}

}  // namespace peridem
