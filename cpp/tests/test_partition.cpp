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

TEST_CASE("partition: the pieces of a flat body have equal numbers of nodes") {
  const ManyBodies bodies({quadGrid(30, 30, 0.1).points});
  for (const Index parts : {2, 5, 7, 16}) {
    std::vector<Index> count(static_cast<std::size_t>(parts), 0);
    for (const Index piece : piecesOf(bodies, 0, parts)) ++count[static_cast<std::size_t>(piece)];
    const auto [least, most] = std::minmax_element(count.begin(), count.end());
    // Every cut rounds down to a whole node; 16 pieces take four cuts one after the other.
    CHECK(*most - *least <= 4);
  }
}

TEST_CASE("partition: the pieces have nearly equal numbers of bonds") {
  const ManyBodies flat({quadGrid(120, 120, 0.1).points});
  // Equal numbers of nodes. The nodes at the sides lack less than a row's bonds, 480 of 14400,
  // which the piece in the middle has: 3.4 % above the mean.
  CHECK(imbalance(flat, 0, piecesOf(flat, 0, 9), 9) < 1.05);
  const ManyBodies solid({tetraGrid(12, 0.1).points});
  // METIS allows an imbalance of 3 % by default; the weight of a node is its bonds plus one.
  CHECK(imbalance(solid, 0, piecesOf(solid, 0, 5), 5) < 1.05);
}

TEST_CASE("partition: a square is cut into squares") {
  // Four pieces of 20 x 20 nodes: no piece is wider than half of the square and a node.
  const ManyBodies bodies({quadGrid(40, 40, 0.1).points});
  const auto piece = piecesOf(bodies, 0, 4);
  for (Index p = 0; p < 4; ++p) {
    Vec3 lower = Vec3::Constant(10);
    Vec3 upper = -lower;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      if (piece[i] != p) continue;
      lower = lower.cwiseMin(bodies.state.x_ref[i]);
      upper = upper.cwiseMax(bodies.state.x_ref[i]);
    }
    CHECK((upper - lower).maxCoeff() < 2.05);
  }
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
  // The same in a solid body, which METIS cuts.
  std::vector<Vec3> ball = tetraGrid(10, 0.1).points;
  ball.push_back(ball[0] + Vec3(0.001, 0, 0));
  ManyBodies solid({ball});
  solid.list[0].mesh_size = 0.001;
  const auto solid_piece = piecesOf(solid, 0, 4);
  CHECK(usesAll(solid_piece, 4));
  CHECK(imbalance(solid, 0, solid_piece, 4) < 1.1);
}
