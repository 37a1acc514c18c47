#include "fragments.h"

#include <numeric>

namespace peridem {

namespace {

// Disjoint sets; the smallest member stands for a set, so that the order of joining has no effect.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) {
    std::iota(parent_.begin(), parent_.end(), Index{0});
  }
  Index find(Index i) {
    while (parent(i) != i) i = parent(i) = parent(parent(i));
    return i;
  }
  void join(Index i, Index j) {
    i = find(i);
    j = find(j);
    parent(std::max(i, j)) = std::min(i, j);
  }

 private:
  Index& parent(Index i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<Index> parent_;
};

}  // namespace

std::vector<Index> fragmentLabels(const BondTable& bonds, std::size_t n_nodes) {
  const auto n_rows = static_cast<Index>(bonds.offsets.size() - 1);
  DisjointSets sets(n_nodes);
  for (Index i = 0; i < n_rows; ++i)
    for (std::size_t k = bonds.begin(i); k < bonds.end(i); ++k)
      if (bonds.intact[k] && bonds.neighbors[k] > i) sets.join(i, bonds.neighbors[k]);
  std::vector<Index> labels(n_nodes);
  Index count = 0;
  for (Index i = 0; i < static_cast<Index>(n_nodes); ++i) {
    const Index first = sets.find(i);  // at most i, so that it has its label
    labels[static_cast<std::size_t>(i)] =
        first == i ? count++ : labels[static_cast<std::size_t>(first)];
  }
  return labels;
}

}  // namespace peridem
