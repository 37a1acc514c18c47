#include "many_bodies.h"
#include "peridem/partition.h"

using namespace peridem;
using namespace peridem::test;

namespace {

std::vector<Index> piecesOf(const ManyBodies& bodies, std::size_t body, Index parts) {
  return partitionBody(bodies.state, bodies.bonds, bodies.list[body], parts);
}

// Largest number of bonds of a piece by the mean.
Real imbalance(const ManyBodies& bodies, std::size_t body, const std::vector<Index>& piece,
               Index parts) {
  std::vector<Offset> work(static_cast<std::size_t>(parts), 0);
  Offset total = 0;
  for (std::size_t i = 0; i < piece.size(); ++i) {
    const auto node = static_cast<std::size_t>(bodies.list[body].start) + i;
    const Offset n = bodies.bonds.offsets[node + 1] - bodies.bonds.offsets[node];
    work[static_cast<std::size_t>(piece[i])] += n;
    total += n;
  }
  return static_cast<Real>(*std::max_element(work.begin(), work.end())) * static_cast<Real>(parts) /
         static_cast<Real>(total);
}

// Whether the values are exactly 0 to parts - 1, each at least once.
bool usesAll(std::vector<Index> piece, Index parts) {
  std::sort(piece.begin(), piece.end());
  piece.erase(std::unique(piece.begin(), piece.end()), piece.end());
  return static_cast<Index>(piece.size()) == parts && piece.front() == 0 &&
         piece.back() == parts - 1;
}

}  // namespace

TEST_CASE("partition: every node of a body is in one of the pieces") {
  const ManyBodies bodies({quadGrid(30, 30, 0.1).points});
  const auto piece = piecesOf(bodies, 0, 5);
  CHECK(piece.size() == 900);
  CHECK(usesAll(piece, 5));
}

TEST_CASE("partition: the pieces have nearly equal numbers of bonds") {
  const ManyBodies bodies({quadGrid(30, 30, 0.1).points});
  // METIS allows an imbalance of 3 % by default; the weight of a node is its bonds plus one, and
  // a piece is off by up to one node of about 24 in 4000.
  CHECK(imbalance(bodies, 0, piecesOf(bodies, 0, 5), 5) < 1.05);
}

TEST_CASE("partition: one piece is the whole body") {
  const ManyBodies bodies({quadGrid(5, 5, 0.1).points});
  CHECK(piecesOf(bodies, 0, 1) == std::vector<Index>(25, 0));
}

TEST_CASE("partition: the same body is cut the same way every time") {
  const ManyBodies bodies({quadGrid(30, 30, 0.1).points});
  CHECK(piecesOf(bodies, 0, 4) == piecesOf(bodies, 0, 4));
}

TEST_CASE("partition: a second body is cut in its own numbering, as if it were alone") {
  const ManyBodies both({quadGrid(6, 6, 0.1).points, quadGrid(20, 20, 0.1).points});
  const ManyBodies alone({quadGrid(20, 20, 0.1).points});
  CHECK(piecesOf(both, 1, 4) == piecesOf(alone, 0, 4));
}

TEST_CASE("partition: two nodes much closer than all others do not spoil the balance") {
  // The mesh size becomes 0.001: hardly any node has neighbours closer than twice that.
  std::vector<Vec3> points = quadGrid(20, 20, 0.1).points;
  points.push_back(points[0] + Vec3(0.001, 0, 0));
  ManyBodies bodies({points});
  bodies.list[0].mesh_size = 0.001;
  const auto piece = piecesOf(bodies, 0, 4);
  CHECK(usesAll(piece, 4));
  CHECK(imbalance(bodies, 0, piece, 4) < 1.1);
}
