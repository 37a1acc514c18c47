#include <algorithm>
#include <map>
#include <numeric>

#include "many_bodies.h"
#include "peridem/bond_block.h"
#include "peridem/partition.h"

using namespace peridem;
using namespace peridem::test;

namespace {

std::vector<Vec3> disturbedGrid(Index nx, Index ny) {
  std::vector<Vec3> points = quadGrid(nx, ny, 0.1).points;
  Random random(7);
  for (Vec3& x : points) x += 0.01 * random.vector(2);
  return points;
}

struct Blocks {
  ManyBodies bodies;
  std::vector<BondBlock> blocks;

  Blocks(const std::vector<Vec3>& points, Index parts)
      : bodies({quadGrid(3, 3, 0.1).points, points}) {
    const Particle& body = bodies.list[1];
    blocks = makeBondBlocks(bodies.state, bodies.bonds, body, bodies.influence,
                            partitionBody(bodies.state, bodies.bonds, body, parts), parts);
  }
  const Particle& body() const { return bodies.list[1]; }
};

// Calls visit(i, place, r, influence) for every stored bond, i and place being places in the block.
template <class Visit>
void forEachBond(const BondBlock& block, Visit visit) {
  for (std::size_t g = 0; g < block.n_groups; ++g) {
    const Real* numbers = &block.numbers[g * group_numbers];
    for (std::size_t lane = 0; lane < lanes; ++lane)
      if ((block.groups[g].exists >> lane) & 1)
        visit(static_cast<std::size_t>(block.groups[g].row),
              static_cast<std::size_t>(block.groups[g].tile) + lane, numbers[lane],
              numbers[lanes + lane]);
  }
}

}  // namespace

TEST_CASE("bisection order: is a permutation") {
  for (const Index n : {0, 1, 7, 8, 9, 100, 257}) {
    Random random(3);
    std::vector<Vec3> points(static_cast<std::size_t>(n));
    for (Vec3& x : points) x = random.vector(3);
    std::vector<Index> order = bisectionOrder(points);
    std::sort(order.begin(), order.end());
    std::vector<Index> expected(points.size());
    std::iota(expected.begin(), expected.end(), 0);
    CHECK(order == expected);
  }
}

TEST_CASE("bisection order: runs of eight are close in space") {
  // On a 16 x 16 lattice of spacing 1 every run of eight is a 2 x 4 cell: diagonal sqrt(10).
  const std::vector<Vec3> points = quadGrid(16, 16, 1.0).points;
  const std::vector<Index> order = bisectionOrder(points);
  Real widest = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    widest = std::max(widest, (points[static_cast<std::size_t>(order[k])] -
                               points[static_cast<std::size_t>(order[k - k % 8])])
                                  .norm());
  CHECK(widest < 3.2);
}

TEST_CASE("bond blocks: every node is an own node of exactly one block") {
  for (const Index parts : {1, 4}) {
    const Blocks b(disturbedGrid(19, 17), parts);
    CHECK(b.blocks.size() == static_cast<std::size_t>(parts));
    std::vector<Index> nodes;
    for (const BondBlock& block : b.blocks) {
      CHECK(block.body == 1);
      CHECK(block.whole_body == (parts == 1));
      CHECK(block.n_padded % lanes == 0);
      CHECK(block.n_all % lanes == 0);
      CHECK((parts == 1) == (block.n_all == block.n_padded));
      nodes.insert(nodes.end(), block.nodes.begin(),
                   block.nodes.begin() + static_cast<std::ptrdiff_t>(block.n_own));
    }
    std::sort(nodes.begin(), nodes.end());
    std::vector<Index> expected(static_cast<std::size_t>(b.body().nodes()));
    std::iota(expected.begin(), expected.end(), b.body().start);
    CHECK(nodes == expected);
  }
}

TEST_CASE("bond blocks: a bond is stored once inside a block and on either side between blocks") {
  for (const Index parts : {1, 4}) {
    const Blocks b(disturbedGrid(19, 17), parts);
    std::map<std::pair<Index, Index>, int> times;  // of the directed bond
    for (const BondBlock& block : b.blocks)
      forEachBond(block, [&](std::size_t i, std::size_t place, Real, Real) {
        const Index from = block.nodes[i];
        const Index to = block.nodes[place];
        ++times[{from, to}];
        if (place < block.n_padded) ++times[{to, from}];
      });
    std::size_t expected = 0;
    std::size_t wrong = 0;
    for (Index i = b.body().start; i < b.body().stop; ++i)
      for (std::size_t k = b.bodies.bonds.begin(i); k < b.bodies.bonds.end(i); ++k) {
        ++expected;
        wrong += times[{i, b.bodies.bonds.neighbors[k]}] != 1;
      }
    CHECK(wrong == 0);
    CHECK(times.size() == expected);
  }
}

TEST_CASE("bond blocks: carry length, influence, volume and position of their bonds and nodes") {
  const Blocks b(disturbedGrid(19, 17), 3);
  const State& state = b.bodies.state;
  const Vec3& center = state.x_ref[static_cast<std::size_t>(b.body().center_node)];
  std::size_t wrong = 0;
  for (const BondBlock& block : b.blocks) {
    for (std::size_t k = 0; k < block.n_all; ++k) {
      if (block.nodes[k] < 0) {
        wrong += block.volume[k] != 0;
        continue;
      }
      const auto node = static_cast<std::size_t>(block.nodes[k]);
      wrong += block.volume[k] != state.volume[node];
      for (std::size_t d = 0; d < 3; ++d) {
        const auto component = static_cast<Eigen::Index>(d);
        wrong += block.z_ref[d][k] != state.x_ref[node][component] - center[component];
      }
    }
    forEachBond(block, [&](std::size_t i, std::size_t place, Real r, Real influence) {
      const Index j = block.nodes[place];
      const auto c = bondConstants(state, b.body(), b.bodies.influence, block.nodes[i], j);
      const Real weight = influence * state.volume[static_cast<std::size_t>(j)];
      wrong += r != c.length;
      wrong += relativeError(weight, c.weight) > 4 * epsilon;
    });
    for (const BondGroup& group : block.groups) wrong += group.intact != group.exists;
  }
  CHECK(wrong == 0);
}

TEST_CASE("bond blocks: lanes without a bond have length one and no influence") {
  const Blocks b(disturbedGrid(6, 5), 1);
  std::size_t wrong = 0;
  for (const BondBlock& block : b.blocks)
    for (std::size_t g = 0; g < block.n_groups; ++g)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        if (!((block.groups[g].exists >> lane) & 1))
          wrong += block.numbers[g * group_numbers + lane] != 1 ||
                   block.numbers[g * group_numbers + lanes + lane] != 0;
  CHECK(wrong == 0);
}

TEST_CASE("bond blocks: groups with the halo come last, rows ascend in either part") {
  const Blocks b(disturbedGrid(19, 17), 4);
  for (const BondBlock& block : b.blocks) {
    std::size_t wrong = block.n_inside == block.n_groups;  // four pieces: each has a halo
    for (std::size_t g = 0; g < block.n_groups; ++g) {
      const bool halo = block.groups[g].tile >= static_cast<Index>(block.n_padded);
      wrong += halo != (g >= block.n_inside);
      if (g > 0 && g != block.n_inside) wrong += block.groups[g].row < block.groups[g - 1].row;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("bond groups: packing keeps the groups of every block, one block after the other") {
  Blocks b(disturbedGrid(19, 17), 4);
  std::vector<BondBlock*> order;
  std::vector<BondGroup> groups;
  std::vector<Real> numbers;
  for (BondBlock& block : b.blocks) {
    order.push_back(&block);
    groups.insert(groups.end(), block.groups.begin(), block.groups.end());
    numbers.insert(numbers.end(), block.numbers.begin(), block.numbers.end());
  }
  BondGroups packed;
  packed.pack(order);
  REQUIRE(packed.groups.size() == groups.size());
  CHECK(std::equal(groups.begin(), groups.end(), packed.groups.begin(),
                   [](const BondGroup& p, const BondGroup& q) {
                     return p.row == q.row && p.tile == q.tile && p.exists == q.exists;
                   }));
  CHECK(std::equal(numbers.begin(), numbers.end(), packed.numbers.data()));
  std::size_t first = 0;
  for (const BondBlock& block : b.blocks) {
    CHECK(block.first_group == first);
    first += block.n_groups;
  }
}

TEST_CASE("aligned array: starts on 64 bytes and at zero") {
  for (const std::size_t n : {std::size_t{1}, std::size_t{8}, std::size_t{1001}}) {
    const AlignedArray array(n);
    CHECK(array.size() == n);
    CHECK(reinterpret_cast<std::uintptr_t>(array.data()) % 64 == 0);
    CHECK(std::all_of(array.data(), array.data() + n, [](double value) { return value == 0; }));
  }
}
