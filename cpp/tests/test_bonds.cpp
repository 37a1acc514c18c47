#include "peridem/bonds.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

struct Bonded {
  Particle body;
  State state;
  BondTable bonds;

  Bonded(const std::vector<Vec3>& points, Real horizon, Real h, const Influence& influence)
      : state(points.size()) {
    body.stop = static_cast<Index>(points.size());
    body.horizon = horizon;
    body.mesh_size = h;
    state.x_ref = points;
    for (std::size_t i = 0; i < points.size(); ++i) state.volume[i] = 1 + static_cast<Real>(i);
    appendBonds(bonds, state, body, influence, 1);
    for (Index i = 0; i < body.stop; ++i)
      for (std::size_t k = bonds.begin(i); k < bonds.end(i); ++k) {
        const BondConstants c = bondConstants(state, body, influence, i, bonds.neighbors[k]);
        length.push_back(c.length);
        weight.push_back(c.weight);
      }
  }

  std::vector<Real> length, weight;  // of every bond of the table
};

Influence constantInfluence() {
  return Influence({InfluenceType::constant, {2.0}}, 2);
}

}  // namespace

TEST_CASE("partial volume: whole inside, half at the horizon, linear between") {
  // Horizon 3, h 1: the correction starts at 2.5 and is (3.5 - r) / 1.
  CHECK(partialVolume(1, 3, 1) == 1);
  CHECK(partialVolume(2.5, 3, 1) == 1);
  CHECK(partialVolume(2.75, 3, 1) == 0.75);
  CHECK(partialVolume(3, 3, 1) == 0.5);
  CHECK(partialVolume(3.5, 3, 1) == 0);
}

TEST_CASE("partial volume: its threshold is fuzzy") {
  // 2.5 (1 + 0.8e-5) is not yet fuzzily greater than 2.5 and keeps the whole volume.
  CHECK(partialVolume(2.5 * (1 + 0.8e-5), 3, 1) == 1);
  CHECK(partialVolume(2.5 * (1 + 1.2e-5), 3, 1) < 1);
}

TEST_CASE("bonds: length and weight and weighted volume of a line of nodes by hand") {
  // Nodes at 0, 1, 2.75; horizon 3, h 1, J = 2, V = 1, 2, 3.
  const Bonded b({{0, 0, 0}, {1, 0, 0}, {2.75, 0, 0}}, 3, 1, constantInfluence());
  CHECK(b.bonds.offsets == std::vector<Offset>{0, 2, 4, 6});
  CHECK(b.bonds.neighbors == std::vector<Index>{1, 2, 0, 2, 0, 1});
  CHECK(b.length == std::vector<Real>{1, 2.75, 1, 1.75, 2.75, 1.75});
  // J V_j, with three quarters of the volume at 2.75
  CHECK(b.weight == std::vector<Real>{4, 4.5, 2, 6, 1.5, 4});
  CHECK(b.bonds.intact == std::vector<std::uint8_t>(6, 1));
  const Real q = 2.75 * 2.75;  // m = sum of r^2 J V_j
  CHECK(b.state.weighted_volume ==
        std::vector<Real>{4 + 4.5 * q, 2 + 6 * 1.75 * 1.75, 1.5 * q + 4 * 1.75 * 1.75});
}

TEST_CASE("bonds: J is taken at the length by the horizon") {
  const Influence linear({InfluenceType::linear, {4, -4}}, 2);
  // r = 1, horizon 4: J = 4 - 4/4 = 3; V_j = 2 and 1.
  const Bonded b({{0, 0, 0}, {1, 0, 0}}, 4, 1, linear);
  CHECK(b.weight == std::vector<Real>{6, 3});
}

TEST_CASE("bonds: both directions have the same length to the last digit") {
  Random random(21);
  std::vector<Vec3> points(80);
  for (Vec3& x : points) x = random.vector(3);
  const Bonded b(points, 0.7, 0.1, constantInfluence());
  std::size_t different = 0;
  for (Index i = 0; i < b.body.stop; ++i)
    for (std::size_t k = b.bonds.begin(i); k < b.bonds.end(i); ++k) {
      const std::size_t opposite = b.bonds.find(b.bonds.neighbors[k], i);
      REQUIRE(opposite < b.bonds.size());
      different += b.length[opposite] != b.length[k];
    }
  CHECK(different == 0);
}

TEST_CASE("bonds: a second body follows in the table with global node numbers") {
  Bonded b({{0, 0, 0}, {1, 0, 0}}, 2, 1, constantInfluence());
  Particle second = b.body;
  second.start = 2;
  second.stop = 5;
  State state(5);
  state.x_ref = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {9, 0, 0}};
  state.volume.assign(5, 1);
  BondTable bonds;
  appendBonds(bonds, state, b.body, constantInfluence(), 1);
  appendBonds(bonds, state, second, constantInfluence(), 1);
  CHECK(bonds.offsets == std::vector<Offset>{0, 1, 2, 3, 4, 4});
  CHECK(bonds.neighbors == std::vector<Index>{1, 0, 3, 2});
  CHECK(state.weighted_volume[4] == 0);  // a node without neighbours
}

TEST_CASE("bonds: are found by their nodes") {
  const Bonded b({{0, 0, 0}, {1, 0, 0}, {2.5, 0, 0}}, 2, 1, constantInfluence());
  CHECK(b.bonds.neighbors == std::vector<Index>{1, 0, 2, 1});
  CHECK(b.bonds.find(0, 1) == 0);
  CHECK(b.bonds.find(1, 2) == 2);
  CHECK(b.bonds.find(0, 2) == b.bonds.size());
  CHECK(b.bonds.everBonded(2, 1));
  CHECK_FALSE(b.bonds.everBonded(2, 0));
}

TEST_CASE("bonds: of many bodies at once are those of one after the other, on any threads") {
  const std::vector<std::vector<Vec3>> points = {quadGrid(5, 4, 1.0).points,
                                                 quadGrid(80, 80, 0.5).points,
                                                 {{0, 0, 0}},
                                                 quadGrid(9, 9, 0.1).points};
  std::vector<Particle> bodies;
  std::vector<Influence> influences;
  State one_by_one(20 + 6400 + 1 + 81);
  for (const auto& own : points) {
    Particle body;
    body.start = bodies.empty() ? 0 : bodies.back().stop;
    body.stop = body.start + static_cast<Index>(own.size());
    body.mesh_size = own.size() > 1 ? own[1][0] - own[0][0] : 1;
    body.horizon = 3.1 * body.mesh_size;
    std::copy(own.begin(), own.end(), one_by_one.x_ref.begin() + body.start);
    bodies.push_back(body);
    influences.emplace_back(InfluenceDeck{InfluenceType::linear, {}}, 2 + (body.start > 0));
  }
  for (std::size_t i = 0; i < one_by_one.size(); ++i)
    one_by_one.volume[i] = 1 + static_cast<Real>(i % 7);
  State at_once = one_by_one;
  BondTable expected;
  for (std::size_t k = 0; k < bodies.size(); ++k)
    appendBonds(expected, one_by_one, bodies[k], influences[k], 1);
  for (const int threads : {1, 3}) {
    BondTable bonds;
    appendBonds(bonds, at_once, bodies, influences, threads);
    CHECK(bonds.offsets == expected.offsets);
    CHECK(bonds.neighbors == expected.neighbors);
    CHECK(bonds.intact == expected.intact);
    CHECK(at_once.weighted_volume == one_by_one.weighted_volume);
  }
}
