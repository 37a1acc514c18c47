#include "peridem/cell_grid.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// Nodes within the radius of i that are not visited, and nodes visited more than once.
std::pair<std::size_t, std::size_t> mistakes(const std::vector<Vec3>& x,
                                             const std::vector<Index>& nodes, Real radius) {
  const CellGrid grid(x, nodes, radius);
  std::size_t missed = 0;
  std::size_t repeated = 0;
  for (const Index i : nodes) {
    std::vector<int> visits(x.size(), 0);
    grid.forEachNear(i, [&](Index j) { ++visits[static_cast<std::size_t>(j)]; });
    for (const Index j : nodes) {
      const auto k = static_cast<std::size_t>(j);
      missed += (x[k] - x[static_cast<std::size_t>(i)]).norm() <= radius && visits[k] == 0;
      repeated += visits[k] > 1;
    }
  }
  return {missed, repeated};
}

std::vector<Vec3> cloud(std::size_t n, int dimension) {
  Random random(67);
  std::vector<Vec3> x(n);
  for (Vec3& point : x) point = random.vector(dimension);
  return x;
}

std::vector<Index> everySecond(const std::vector<Vec3>& x) {
  std::vector<Index> nodes;
  for (Index i = 0; i < static_cast<Index>(x.size()); i += 2) nodes.push_back(i);
  return nodes;
}

}  // namespace

TEST_CASE("cell grid: visits every node within the radius, and once") {
  for (const int dimension : {1, 2, 3})
    for (const Real radius : {0.01, 0.1, 0.5, 5.0}) {
      const auto x = cloud(300, dimension);
      const auto [missed, repeated] = mistakes(x, everySecond(x), radius);
      CHECK(missed == 0);
      CHECK(repeated == 0);
    }
}

TEST_CASE("cell grid: nodes on the borders of cells and at the very radius") {
  // A lattice as wide as the cells: every node lies on a border, neighbours at the radius.
  const auto x = quadGrid(12, 12, 0.25).points;
  const auto [missed, repeated] = mistakes(x, everySecond(x), 0.25);
  CHECK(missed == 0);
  CHECK(repeated == 0);
}

TEST_CASE("cell grid: a node far away from all others costs no memory") {
  auto x = cloud(300, 3);
  x[4] = Vec3(1e7, -1e8, 1e6);  // 1e24 cells of the radius
  const auto [missed, repeated] = mistakes(x, everySecond(x), 0.1);
  CHECK(missed == 0);
  CHECK(repeated == 0);
}

TEST_CASE("cell grid: a node that is nowhere harms none of the others") {
  auto x = cloud(300, 2);
  x[4][1] = not_given;
  std::vector<Index> nodes = everySecond(x);
  const CellGrid grid(x, nodes, 0.1);
  std::erase(nodes, 4);
  std::size_t missed = 0;
  for (const Index i : nodes) {
    std::vector<char> visited(x.size(), 0);
    grid.forEachNear(i, [&](Index j) { visited[static_cast<std::size_t>(j)] = 1; });
    for (const Index j : nodes)
      missed += (x[static_cast<std::size_t>(j)] - x[static_cast<std::size_t>(i)]).norm() <= 0.1 &&
                !visited[static_cast<std::size_t>(j)];
  }
  CHECK(missed == 0);
}

TEST_CASE("cell grid: of no nodes") {
  const std::vector<Vec3> x(3, Vec3::Zero());
  CHECK_NOTHROW(CellGrid(x, {}, 0.1));
}
