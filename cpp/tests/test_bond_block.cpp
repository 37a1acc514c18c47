#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

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

// Two bodies, of which the second, turned by half a radian, is cut into patterns.
struct Patterns {
  ManyBodies bodies;
  std::vector<BondPattern> list;

  Patterns(const std::vector<Vec3>& points, Index parts)
      : bodies({quadGrid(3, 3, 0.1).points, points}) {
    Particle& body = bodies.list[1];
    body.law = Lps{5e7, 2e7, 0.01, 0.01, false};
    body.rotation = Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix();
    Random random(11);
    for (Real& volume : bodies.state.volume) volume *= 1 + 0.2 * random();
    list = makeBondPatterns(bodies.state, bodies.bonds, body, 2,
                            partitionBody(bodies.state, bodies.bonds, body, parts), parts);
  }
  const Particle& body() const { return bodies.list[1]; }
  std::size_t global(Index node) const { return static_cast<std::size_t>(body().start + node); }
  std::span<const Index> neighborsOf(Index node) const {  // global
    const BondTable& bonds = bodies.bonds;
    const std::size_t begin = bonds.begin(body().start + node);
    return std::span(bonds.neighbors).subspan(begin, bonds.end(body().start + node) - begin);
  }
};

// Calls visit(own place, place of the row, g) for every stored bond.
template <class Visit>
void forEachBond(const BondPattern& pattern, Visit visit) {
  for (const TileBonds& tile : pattern.tiles)
    for (std::size_t g = tile.begin; g < tile.end; ++g)
      for (std::size_t lane = 0; lane < lanes; ++lane)
        if ((pattern.groups[g].exists >> lane) & 1)
          visit(std::size_t{tile.tile} + lane, std::size_t{pattern.groups[g].row}, g);
}

enum class Rows { later, earlier };

// Rows of a tile with itself: nodes bonded to an earlier one, or to a later one, in the same tile.
std::size_t rowsWithin(const Patterns& p, const BondPattern& pattern, std::size_t tile, Rows kind) {
  const std::size_t begin = lanes * tile;
  const std::size_t end = std::min(begin + lanes, pattern.n_own);
  std::size_t rows = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const auto links = p.neighborsOf(pattern.nodes[k]);
    const auto from = static_cast<std::ptrdiff_t>(kind == Rows::later ? begin : k + 1);
    const auto to = static_cast<std::ptrdiff_t>(kind == Rows::later ? k : end);
    rows += std::any_of(pattern.nodes.begin() + from, pattern.nodes.begin() + to, [&](Index j) {
      return std::binary_search(links.begin(), links.end(), p.body().start + j);
    });
  }
  return rows;
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

TEST_CASE("bond patterns: every node is an own node of exactly one pattern") {
  for (const Index parts : {1, 4}) {
    const Patterns p(disturbedGrid(19, 17), parts);
    CHECK(p.list.size() == static_cast<std::size_t>(parts));
    std::vector<Index> nodes;
    for (const BondPattern& pattern : p.list) {
      CHECK(pattern.n_padded % lanes == 0);
      CHECK(pattern.n_padded < pattern.n_own + lanes);
      CHECK(pattern.n_all % lanes == 0);
      CHECK((parts == 1) == (pattern.n_halo == 0));
      nodes.insert(nodes.end(), pattern.nodes.begin(),
                   pattern.nodes.begin() + static_cast<std::ptrdiff_t>(pattern.n_own));
    }
    std::sort(nodes.begin(), nodes.end());
    std::vector<Index> expected(static_cast<std::size_t>(p.body().nodes()));
    std::iota(expected.begin(), expected.end(), 0);
    CHECK(nodes == expected);
  }
}

TEST_CASE("bond patterns: a bond is stored once inside a pattern and on either side between them") {
  for (const Index parts : {1, 4}) {
    const Patterns p(disturbedGrid(19, 17), parts);
    std::map<std::pair<Index, Index>, int> times;  // of the directed bond
    for (const BondPattern& pattern : p.list)
      forEachBond(pattern, [&](std::size_t own, std::size_t row, std::size_t) {
        const Index from = pattern.nodes[own];
        const Index to = pattern.nodes[row];
        ++times[{from, to}];
        if (row < pattern.n_padded) ++times[{to, from}];
      });
    std::size_t expected = 0;
    std::size_t wrong = 0;
    for (Index i = 0; i < p.body().nodes(); ++i)
      for (const Index j : p.neighborsOf(i)) {
        ++expected;
        wrong += times[{i, j - p.body().start}] != 1;
      }
    CHECK(wrong == 0);
    CHECK(times.size() == expected);
  }
}

TEST_CASE("bond patterns: groups follow each other tile by tile, those with the halo last") {
  for (const Index parts : {1, 4}) {
    const Patterns p(disturbedGrid(19, 17), parts);
    for (const BondPattern& pattern : p.list) {
      REQUIRE(pattern.tiles.size() == pattern.n_padded / lanes);
      std::size_t wrong = 0;
      std::size_t next = 0;
      for (std::size_t t = 0; t < pattern.tiles.size(); ++t) {
        const TileBonds& tile = pattern.tiles[t];
        wrong += tile.tile != lanes * t || tile.begin != next || tile.halo < tile.begin ||
                 tile.end < tile.halo;
        next = tile.end;
        for (std::size_t g = tile.begin; g < tile.end; ++g) {
          const bool row_in_halo = pattern.groups[g].row >= pattern.n_padded;
          wrong += row_in_halo != (g >= tile.halo) || pattern.groups[g].exists == 0;
        }
      }
      CHECK(wrong == 0);
      CHECK(next == pattern.groups.size());
    }
  }
}

TEST_CASE("bond patterns: a pair of tiles takes the fewer rows of the two ways to store it") {
  for (const Index parts : {1, 4}) {
    const Patterns p(disturbedGrid(19, 17), parts);
    for (const BondPattern& pattern : p.list) {
      using Tiles = std::pair<std::size_t, std::size_t>;
      std::map<Tiles, std::set<std::size_t>> rows;  // nodes of the first tile bonded to the second
      std::map<Index, std::size_t> place;
      for (std::size_t k = 0; k < pattern.nodes.size(); ++k)
        if (pattern.nodes[k] >= 0) place[pattern.nodes[k]] = k;
      for (std::size_t k = 0; k < pattern.n_own; ++k)
        for (const Index j : p.neighborsOf(pattern.nodes[k])) {
          const std::size_t other = place.at(j - p.body().start);
          rows[{other / lanes, k / lanes}].insert(other);
        }
      std::size_t fewest = 0;
      std::size_t at_earlier = 0;  // always with the nodes of the later tile as rows
      for (const auto& [tiles, nodes] : rows) {
        const auto [later, earlier] = tiles;
        if (earlier > later) continue;
        std::size_t here = nodes.size();
        std::size_t there = here;  // groups with the halo have no choice
        if (earlier == later) {
          here = rowsWithin(p, pattern, earlier, Rows::later);
          there = rowsWithin(p, pattern, earlier, Rows::earlier);
        } else if (later < pattern.n_padded / lanes) {
          there = rows.at({earlier, later}).size();
        }
        at_earlier += here;
        fewest += std::min(here, there);
      }
      CHECK(pattern.groups.size() == fewest);
      CHECK(fewest < at_earlier);
    }
  }
}

TEST_CASE("bond patterns: nodes lie and weigh as in the frame of the body") {
  const Patterns p(disturbedGrid(19, 17), 3);
  const State& state = p.bodies.state;
  const Vec3& center = state.x_ref[static_cast<std::size_t>(p.body().center_node)];
  const auto& law = std::get<Lps>(p.body().law);
  constexpr Real eps = 0.3;  // horizon
  Real worst = 0;
  std::size_t wrong = 0;
  for (const BondPattern& pattern : p.list)
    for (std::size_t k = 0; k < pattern.n_all; ++k) {
      const AlignedArray* const arrays[] = {&pattern.volume, &pattern.inverse_volume,
                                            &pattern.dilatation_factor, &pattern.a, &pattern.b};
      if (pattern.nodes[k] < 0) {
        for (const AlignedArray* array : arrays) wrong += (*array)[k] != 0;
        continue;
      }
      const std::size_t node = p.global(pattern.nodes[k]);
      const Vec3 x = state.x_ref[node] - center;
      // turned back by half a radian
      const Vec3 z(std::cos(0.5) * x[0] + std::sin(0.5) * x[1],
                   std::cos(0.5) * x[1] - std::sin(0.5) * x[0], 0);
      for (std::size_t d = 0; d < 3; ++d)
        worst =
            std::max(worst, std::abs(pattern.z_ref[d][k] - z[static_cast<Eigen::Index>(d)] / eps));
      const Real volume = state.volume[node] / (eps * eps);
      const Real m = state.weighted_volume[node] / std::pow(eps, 4);
      const Real b = 15 * law.shear_modulus / m;
      const Real expected[] = {volume, 1 / volume, 3 / m / volume, 3 * law.bulk_modulus / m - b / 3,
                               b};
      for (std::size_t c = 0; c < 5; ++c)
        wrong += relativeError((*arrays[c])[k], expected[c]) > 20 * epsilon;
    }
  CHECK(worst < 20 * epsilon);  // of coordinates up to 4
  CHECK(wrong == 0);
}

TEST_CASE("bond patterns: pieces find the nodes of their halo among the places of all pieces") {
  const Patterns p(disturbedGrid(19, 17), 4);
  std::vector<Index> node_at;  // of the places of all pieces
  for (const BondPattern& pattern : p.list) {
    CHECK(pattern.first_place == node_at.size());
    node_at.insert(node_at.end(), pattern.nodes.begin(),
                   pattern.nodes.begin() + static_cast<std::ptrdiff_t>(pattern.n_padded));
  }
  std::size_t wrong = 0;
  for (const BondPattern& pattern : p.list) {
    REQUIRE(pattern.halo_places.size() == pattern.n_halo);
    CHECK(pattern.n_halo > 0);
    for (std::size_t k = 0; k < pattern.n_halo; ++k)
      wrong += node_at[static_cast<std::size_t>(pattern.halo_places[k])] !=
               pattern.nodes[pattern.n_padded + k];
  }
  CHECK(wrong == 0);
}

TEST_CASE("aligned array: starts on 64 bytes and at zero") {
  for (const std::size_t n : {std::size_t{1}, std::size_t{8}, std::size_t{1001}}) {
    const AlignedArray array(n);
    CHECK(array.size() == n);
    CHECK(reinterpret_cast<std::uintptr_t>(array.data()) % 64 == 0);
    CHECK(std::all_of(array.data(), array.data() + n, [](double value) { return value == 0; }));
  }
}
