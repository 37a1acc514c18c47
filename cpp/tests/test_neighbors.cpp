#include "peridem/neighbors.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// Every pair by the definition: dx^2 + dy^2 + dz^2 < radius^2, summed in this order.
std::vector<Index> bruteForce(std::span<const Vec3> points, std::size_t i, Real radius) {
  std::vector<Index> found;
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Real dx = points[j][0] - points[i][0];
    const Real dy = points[j][1] - points[i][1];
    const Real dz = points[j][2] - points[i][2];
    if (j != i && dx * dx + dy * dy + dz * dz < radius * radius)
      found.push_back(static_cast<Index>(j));
  }
  return found;
}

void checkAgainstBruteForce(const std::vector<Vec3>& points, Real radius) {
  const AdjacencyList list = neighborsWithin(points, radius, 2);
  REQUIRE(list.size() == points.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto links = list.links(static_cast<Index>(i));
    const std::vector<Index> row(links.begin(), links.end());
    wrong += row != bruteForce(points, i, radius);
  }
  CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("neighbours: agree with brute force on random points in 2D and 3D") {
  for (const int d : {2, 3}) {
    Random random(5);
    std::vector<Vec3> points(400);
    for (Vec3& x : points) x = random.vector(d);
    for (const Real radius : {0.05, 0.3, 1.0}) checkAgainstBruteForce(points, radius);
  }
}

TEST_CASE("neighbours: agree with brute force where lattice distances tie with the radius") {
  // Multiples of h = 0.1 are not exact numbers: the very edge is decided by round-off, and it must
  // be the round-off of the definition.
  const std::vector<Vec3> points = quadGrid(20, 20, 0.1).points;
  for (const Real radius : {0.1, 0.2, 0.1 * std::sqrt(2.0), 0.3, 3 * 0.1, 0.5})
    checkAgainstBruteForce(points, radius);
  const std::vector<Vec3> cube = tetraGrid(8, 0.1).points;
  for (const Real radius : {0.1, 0.1 * std::sqrt(3.0), 0.3}) checkAgainstBruteForce(cube, radius);
}

TEST_CASE("neighbours: a point at exactly the radius is none") {
  const std::vector<Vec3> points = {{0, 0, 0}, {0.5, 0, 0}, {0, -0.5, 0}};
  CHECK(neighborsWithin(points, 0.5, 1).links(0).empty());
  const Real above = std::nextafter(0.5, 1.0);
  CHECK(neighborsWithin(points, above, 1).links(0).size() == 2);
}

TEST_CASE("neighbours: in an exact lattice of radius 3 the ties at 3 are left out") {
  // Integer coordinates: 28 offsets have i^2 + j^2 <= 9 without the centre, 4 of them equal to 9.
  const std::vector<Vec3> points = quadGrid(9, 9, 1.0).points;
  CHECK(neighborsWithin(points, 3.0, 1).links(40).size() == 24);
  CHECK(neighborsWithin(points, 3.001, 1).links(40).size() == 28);
}

TEST_CASE("neighbours: i is a neighbour of j when j is one of i") {
  Random random(9);
  std::vector<Vec3> points(300);
  for (Vec3& x : points) x = random.vector(3);
  const AdjacencyList list = neighborsWithin(points, 0.4, 1);
  std::size_t missing = 0;
  for (Index i = 0; i < 300; ++i)
    for (const Index j : list.links(i)) {
      const auto back = list.links(j);
      missing += !std::binary_search(back.begin(), back.end(), i);
    }
  CHECK(missing == 0);
}

TEST_CASE("neighbours: the number of threads changes nothing") {
  // More than 1000 points, so that threads are used at all.
  const std::vector<Vec3> points = quadGrid(40, 40, 0.1).points;
  const AdjacencyList one = neighborsWithin(points, 0.3, 1);
  for (const int threads : {2, 4}) {
    const AdjacencyList many = neighborsWithin(points, 0.3, threads);
    CHECK(many.offsets == one.offsets);
    CHECK(many.indices == one.indices);
  }
}

TEST_CASE("neighbours: agree with brute force where points crowd, coincide or lie far away") {
  Random random(21);
  std::vector<Vec3> points;
  // Two crowds a million radii apart, far more cells than points; some points twice.
  for (int i = 0; i < 150; ++i) points.push_back(1e3 * Vec3(1, 2, 0) + 2e-3 * random.vector(3));
  for (int i = 0; i < 150; ++i) points.push_back(1e-3 * random.vector(2));
  for (int i = 0; i < 20; ++i) points.push_back(points[static_cast<std::size_t>(i)]);
  for (const Real radius : {1e-3, 1e-2, 1e4}) checkAgainstBruteForce(points, radius);
}

TEST_CASE("neighbours: agree with brute force on a lattice far from the origin") {
  // Places of cells carry the round-off of the coordinates, 1e8 times the size of the body.
  std::vector<Vec3> points = quadGrid(15, 15, 0.1).points;
  for (Vec3& x : points) x += Vec3(1.4e8, -1.4e8, 0);
  for (const Real radius : {0.1, 0.2, 0.3}) checkAgainstBruteForce(points, radius);
}

TEST_CASE("neighbours: sets one after the other are those of each set alone") {
  Random random(13);
  const std::vector<std::size_t> sizes = {7, 700, 1, 5000, 300};
  std::vector<std::vector<Vec3>> points;
  std::vector<PointSet> sets;
  Index first = 3;
  for (const std::size_t n : sizes) {
    points.emplace_back(n);
    for (Vec3& x : points.back()) x = random.vector(2);
  }
  for (const auto& own : points) {
    sets.push_back({own, 0.1 + 0.01 * static_cast<Real>(sets.size()), first});
    first += static_cast<Index>(own.size());
  }
  for (const int threads : {1, 3}) {
    std::vector<Offset> offsets = {0, 2};  // a row that is there already
    std::vector<Index> indices = {0, 1};
    appendNeighbors(sets, offsets, indices, threads);
    std::size_t row = 1;
    std::size_t wrong = indices[0] != 0 || indices[1] != 1;
    for (const PointSet& set : sets)
      for (std::size_t i = 0; i < set.points.size(); ++i, ++row) {
        std::vector<Index> found(indices.begin() + offsets[row],
                                 indices.begin() + offsets[row + 1]);
        for (Index& j : found) j -= set.first;
        wrong += found != bruteForce(set.points, i, set.radius);
      }
    CHECK(wrong == 0);
    CHECK(row + 1 == offsets.size());
    CHECK(static_cast<std::size_t>(offsets.back()) == indices.size());
  }
}

TEST_CASE("neighbours: of no points and of one point") {
  CHECK(neighborsWithin({}, 1.0, 1).size() == 0);
  const std::vector<Vec3> one = {{1, 2, 3}};
  const AdjacencyList list = neighborsWithin(one, 1.0, 1);
  CHECK(list.size() == 1);
  CHECK(list.links(0).empty());
}

TEST_CASE("point tree: the nearest other point is not the point itself") {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {1.25, 0, 0}};
  const PointTree tree(points);
  CHECK(tree.nearestOther(0) == 1);
  CHECK(tree.nearestOther(1) == 0.25);
  CHECK(tree.nearestOther(2) == 0.25);
  CHECK(tree.nearestOther(0, 1.5) == 1);
  CHECK(std::isinf(tree.nearestOther(0, 0.5)));
}
