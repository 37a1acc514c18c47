#include <numeric>

#include "peridem/errors.h"
#include "peridem/partition.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

struct Bodies {
  std::vector<Particle> list;
  State state;
  BondTable bonds;

  explicit Bodies(const std::vector<std::vector<Vec3>>& points) {
    std::size_t n = 0;
    for (const auto& of_body : points) n += of_body.size();
    state = State(n);
    for (const auto& of_body : points) {
      Particle body;
      body.id = static_cast<Index>(list.size());
      body.start = list.empty() ? 0 : list.back().stop;
      body.stop = body.start + static_cast<Index>(of_body.size());
      body.mesh_size = 0.1;
      body.horizon = 0.3;
      std::copy(of_body.begin(), of_body.end(), state.x_ref.begin() + body.start);
      list.push_back(body);
    }
    state.volume.assign(n, 0.01);
    for (const Particle& body : list)
      appendBonds(bonds, state, body, Influence({InfluenceType::constant, {}}, 2), 1);
  }
};

// Bonds of every piece by the mean over the pieces.
Real imbalance(const BondTable& bonds, const std::vector<NodeBlock>& blocks) {
  Offset total = 0;
  Offset largest = 0;
  for (const NodeBlock& block : blocks) {
    Offset work = 0;
    for (const Index i : block.nodes)
      work += bonds.offsets[static_cast<std::size_t>(i) + 1] -
              bonds.offsets[static_cast<std::size_t>(i)];
    total += work;
    largest = std::max(largest, work);
  }
  return static_cast<Real>(largest) * static_cast<Real>(blocks.size()) / static_cast<Real>(total);
}

void checkCoversOnce(const std::vector<NodeBlock>& blocks, const Particle& body) {
  std::vector<Index> nodes;
  for (const NodeBlock& block : blocks)
    if (block.body == body.id) nodes.insert(nodes.end(), block.nodes.begin(), block.nodes.end());
  std::sort(nodes.begin(), nodes.end());
  std::vector<Index> expected(static_cast<std::size_t>(body.nodes()));
  std::iota(expected.begin(), expected.end(), body.start);
  CHECK(nodes == expected);
}

}  // namespace

TEST_CASE("partition: every node of a large body is in exactly one block") {
  const Bodies bodies({quadGrid(30, 30, 0.1).points});
  const auto blocks = makeBlocks(bodies.bonds, bodies.list, 200);
  CHECK(blocks.size() == 5);  // 900 nodes in pieces of up to about 200
  checkCoversOnce(blocks, bodies.list[0]);
}

TEST_CASE("partition: the pieces have nearly equal numbers of bonds") {
  const Bodies bodies({quadGrid(30, 30, 0.1).points});
  // METIS allows an imbalance of 3 % by default; the weight of a node is its bonds plus one, and
  // a piece is off by up to one node of about 24 in 4000.
  CHECK(imbalance(bodies.bonds, makeBlocks(bodies.bonds, bodies.list, 200)) < 1.05);
}

TEST_CASE("partition: nodes of a block ascend, so that sums keep their order") {
  const Bodies bodies({quadGrid(30, 30, 0.1).points});
  for (const NodeBlock& block : makeBlocks(bodies.bonds, bodies.list, 200))
    CHECK(std::is_sorted(block.nodes.begin(), block.nodes.end()));
}

TEST_CASE("partition: small bodies are one block each and bodies that never move have none") {
  Bodies bodies(
      {quadGrid(5, 5, 0.1).points, quadGrid(4, 4, 0.1).points, quadGrid(3, 3, 0.1).points});
  bodies.list[1].constrained = true;
  const auto blocks = makeBlocks(bodies.bonds, bodies.list, 25);
  REQUIRE(blocks.size() == 2);
  CHECK(blocks[0].body == 0);
  CHECK(blocks[1].body == 2);
  checkCoversOnce(blocks, bodies.list[0]);
  checkCoversOnce(blocks, bodies.list[2]);
}

TEST_CASE("partition: the same body is cut the same way every time") {
  const Bodies bodies({quadGrid(30, 30, 0.1).points});
  CHECK(partitionBody(bodies.bonds, bodies.list[0], 4) ==
        partitionBody(bodies.bonds, bodies.list[0], 4));
}

TEST_CASE("partition: a second body is cut in its own numbering") {
  const Bodies bodies({quadGrid(6, 6, 0.1).points, quadGrid(20, 20, 0.1).points});
  const auto blocks = makeBlocks(bodies.bonds, bodies.list, 100);
  CHECK(blocks.size() == 5);
  checkCoversOnce(blocks, bodies.list[1]);
}

TEST_CASE("partition: two nodes much closer than all others do not spoil the balance") {
  // The mesh size becomes 0.001: hardly any node has neighbours closer than twice that.
  std::vector<Vec3> points = quadGrid(20, 20, 0.1).points;
  points.push_back(points[0] + Vec3(0.001, 0, 0));
  Bodies bodies({points});
  bodies.list[0].mesh_size = 0.001;
  const auto blocks = makeBlocks(bodies.bonds, bodies.list, 100);
  checkCoversOnce(blocks, bodies.list[0]);
  CHECK(imbalance(bodies.bonds, blocks) < 1.1);
}
