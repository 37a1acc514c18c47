#include "neighbors.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

namespace peridem {

namespace {

// dx^2 + dy^2 + dz^2 in this order of operations: pairs at the very edge of a horizon are decided
// by its round-off.
Real squaredDistance(const Vec3& a, const Vec3& b) {
  const Real dx = a[0] - b[0];
  const Real dy = a[1] - b[1];
  const Real dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

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

// Result sets for nanoflann (the same interface in its versions 1.4 and 1.5).
struct IndicesWithin {
  using DistanceType = Real;
  using IndexType = Index;
  Real limit;
  std::vector<Index>& found;

  std::size_t size() const { return found.size(); }
  bool empty() const { return found.empty(); }
  bool full() const { return true; }
  bool addPoint(Real, Index i) {
    found.push_back(i);
    return true;
  }
  Real worstDist() const { return limit; }
  void sort() {}
};

struct NearestOther {
  using DistanceType = Real;
  using IndexType = Index;
  Index self;
  Real best = std::numeric_limits<Real>::infinity();

  std::size_t size() const { return std::isfinite(best) ? 1 : 0; }
  bool empty() const { return size() == 0; }
  bool full() const { return true; }
  bool addPoint(Real squared, Index i) {
    if (i != self) best = std::min(best, squared);
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

void PointTree::withinRadius(const Vec3& center, Real radius, std::vector<Index>& found) const {
  const Real squared = radius * radius;
  found.clear();
  // The tree prunes with bounds that carry round-off: ask for a little more, then decide exactly.
  IndicesWithin result{squared * (1 + 1e-9), found};
  tree_->index.findNeighbors(result, center.data(), SearchParameters());
  std::erase_if(found, [&](Index j) {
    return !(squaredDistance(tree_->cloud.points[static_cast<std::size_t>(j)], center) < squared);
  });
  std::sort(found.begin(), found.end());
}

Real PointTree::nearestOther(Index i) const {
  NearestOther result{i};
  tree_->index.findNeighbors(result, tree_->cloud.points[static_cast<std::size_t>(i)].data(),
                             SearchParameters());
  return std::sqrt(result.best);
}

AdjacencyList neighborsWithin(std::span<const Vec3> points, Real radius, int threads) {
  AdjacencyList list;
  const std::size_t n = points.size();
  if (n == 0) return list;
  const PointTree tree(points);
  std::vector<std::vector<Index>> rows(n);
#pragma omp parallel num_threads(threads) if (n > 1000)
  {
    std::vector<Index> found;
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < n; ++i) {
      tree.withinRadius(points[i], radius, found);
      std::erase(found, static_cast<Index>(i));
      rows[i] = found;
    }
  }
  list.offsets.resize(n + 1);
  for (std::size_t i = 0; i < n; ++i)
    list.offsets[i + 1] = list.offsets[i] + static_cast<Offset>(rows[i].size());
  list.indices.reserve(static_cast<std::size_t>(list.offsets[n]));
  for (auto& row : rows) {
    list.indices.insert(list.indices.end(), row.begin(), row.end());
    std::vector<Index>().swap(row);
  }
  return list;
}

}  // namespace peridem
