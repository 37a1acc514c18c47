// Patterns of bonds that bodies share, and their tables.
#include "force_scene.h"
#include "instruction_sets.h"

using namespace peridem;
using namespace peridem::test;

namespace {

DEMModel modelOf(const ModelDeck& deck) {
  DEMModel model(deck, 1);
  model.init();
  return model;
}

BlockSizes withTables(Lengths lengths) {
  BlockSizes sizes;
  sizes.lengths = lengths;
  return sizes;
}

// Two bodies of the zone, the second turned and scaled.
struct Pair {
  State state;
  BondTable bonds;
  std::vector<Particle> bodies;

  Pair() {
    ModelDeck deck = irregularBodies(MaterialType::pd_state, 2);
    deck.bodies = turnedBodies(2);
    deck.bodies.erase(deck.bodies.begin() + 1, deck.bodies.begin() + 3);
    const DEMModel model = modelOf(deck);
    state = model.state();
    bonds = model.bonds();
    bodies = model.particles();
  }
  bool same() const { return sameInFrame(state, bonds, bodies[0], bodies[1], 2); }
};

std::size_t bytesOf(const ModelDeck& deck) {
  return Forces(modelOf(deck), withTables(Lengths::of_all)).force.bytes();
}

}  // namespace

TEST_CASE("patterns: forces with and without a table of lengths are the same bits") {
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    for (const int dimension : {2, 3})
      for (const MaterialType type : all_types)
        for (const bool pieces : {false, true}) {
          CAPTURE(instruction_set);
          CAPTURE(dimension);
          CAPTURE(static_cast<int>(type));
          CAPTURE(pieces);
          ModelDeck deck = irregularBodies(type, dimension);
          deck.bodies = {turnedBodies(dimension)[3]};
          const DEMModel model = modelOf(deck);
          const auto sizes = pieces ? smallPieces : withTables;
          Forces kept(model, sizes(Lengths::of_all));
          Forces computed(model, sizes(Lengths::of_shared_patterns));
          // 8 numbers of a group fewer, out of 16 and what a place takes.
          REQUIRE(kept.force.bytes() > 1.4 * static_cast<double>(computed.force.bytes()));
          for (const Real size : {0.0, 0.02, 0.07, 0.3}) {
            for (Forces* forces : {&kept, &computed}) {
              displaceBodies(forces->state, forces->bodies, size, dimension, 29);
              forces->evaluate();
            }
            checkSameBits(kept, computed);
            CHECK((largestNorm(kept.state.f) > 0) == (size > 0));
          }
          CHECK((brokenBonds(kept.bonds) > 0) == (type != MaterialType::pd_elastic_bond));
        }
  }
}

TEST_CASE("patterns: lengths of single bodies are kept where computing them takes longer") {
  ModelDeck deck = irregularBodies(MaterialType::pd_state, 2);
  deck.bodies = {bodyAt(Vec3::Zero())};
  const DEMModel model = modelOf(deck);
  const auto bytes = [&](Lengths lengths) {
    return Forces(model, withTables(lengths)).force.bytes();
  };
  CHECK(bytes(Lengths::automatic) == bytes(Lengths::of_all));  // a small one, in the cache
  CHECK(bytes(Lengths::of_shared_patterns) < bytes(Lengths::of_all));
  constexpr std::size_t in_cache = 16 << 20, small_to_memory = 64 << 20;  // [bytes]
  for (const char* instruction_set : {"avx512", "avx2", "baseline"}) {
    CHECK(lengthsPay(instruction_set, in_cache));
    CHECK(lengthsPay(instruction_set, small_to_memory) ==
          (instruction_set != std::string("avx512")));
    CHECK_FALSE(lengthsPay(instruction_set, std::size_t{1} << 60));
  }
}

TEST_CASE("patterns: bodies that share one have the forces that each has alone") {
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types)
      for (const InfluenceType influence : {InfluenceType::linear, InfluenceType::gaussian}) {
        CAPTURE(dimension);
        CAPTURE(static_cast<int>(type));
        CAPTURE(static_cast<int>(influence));
        ModelDeck deck = irregularBodies(type, dimension);
        deck.zones[0].material.influence = {influence, {}};
        deck.bodies = turnedBodies(dimension);
        Forces together(modelOf(deck));
        for (const Particle& body : together.bodies)
          REQUIRE(sameInFrame(together.state, together.bonds, together.bodies[0], body, dimension));
        std::vector<Forces> alone;
        for (const BodyDeck& body : turnedBodies(dimension)) {
          deck.bodies = {body};
          alone.emplace_back(modelOf(deck), withTables(Lengths::of_shared_patterns));
        }
        for (const Real size : {0.02, 0.07, 0.3}) {
          displaceBodies(together.state, together.bodies, size, dimension, 31);
          together.evaluate();
          for (std::size_t k = 0; k < alone.size(); ++k) {
            const auto begin = static_cast<std::ptrdiff_t>(together.bodies[k].start);
            const auto end = static_cast<std::ptrdiff_t>(together.bodies[k].stop);
            const auto part = [&](const auto& of_all) {
              return std::vector(of_all.begin() + begin, of_all.begin() + end);
            };
            State& state = alone[k].state;
            state.u = part(together.state.u);
            alone[k].evaluate();
            // Coordinates of up to 80 h are the same in both frames up to 20 epsilon in units of
            // the horizon, which is 50 epsilon of the length of a bond; stretches are 1e-2.
            CHECK(relativeError(part(together.state.f), state.f) < 1e4 * epsilon);
            Real wrong_theta = 0;
            Real wrong_z = 0;
            for (std::size_t i = 0; i < state.size(); ++i) {
              const auto j = static_cast<std::size_t>(begin) + i;
              wrong_theta =
                  std::max(wrong_theta, std::abs(state.theta[i] - together.state.theta[j]));
              wrong_z =
                  std::max(wrong_z, relativeError(state.damage_z[i], together.state.damage_z[j]));
            }
            CHECK(wrong_theta < 1e3 * epsilon);
            CHECK(wrong_z < 1e4 * epsilon);
          }
        }
        std::size_t broken = 0;
        for (const Forces& forces : alone) broken += brokenBonds(forces.bonds);
        CHECK(brokenBonds(together.bonds) == broken);
        CHECK((broken > 0) == (type != MaterialType::pd_elastic_bond));
      }
}

TEST_CASE("patterns: more bodies that share one take their flags alone") {
  ModelDeck deck = irregularBodies(MaterialType::pd_state, 2);
  std::vector<std::size_t> bytes;
  for (const BodyDeck& body : turnedBodies(2)) {
    deck.bodies.push_back(body);
    bytes.push_back(bytesOf(deck));
  }
  const std::size_t flags = bytes[1] - bytes[0];  // one for each group of up to eight bonds
  CHECK(flags >= modelOf(deck).bonds().size() / 4 / 2 / 8);
  CHECK(100 * flags < bytes[0]);  // the table has 128 bytes where there is one flag
  CHECK(bytes[2] - bytes[1] == flags);
  CHECK(bytes[3] - bytes[2] == flags);
}

TEST_CASE("patterns: bodies of zones of their own or in pieces do not share") {
  ModelDeck deck = irregularBodies(MaterialType::pd_state, 2);
  deck.bodies = {bodyAt(Vec3::Zero())};
  const std::size_t one = bytesOf(deck);
  deck.zones.push_back(deck.zones[0]);
  deck.contacts.assign(4, contact(spacing, 1));
  deck.bodies.push_back(bodyAt(Vec3(1, 0, 0), 1));
  CHECK(bytesOf(deck) == 2 * one);
  deck.bodies[1].zone = 0;
  CHECK(bytesOf(deck) < 1.1 * static_cast<Real>(one));
  deck.bodies.pop_back();
  const std::size_t pieces = Forces(modelOf(deck), smallPieces(Lengths::of_all)).force.bytes();
  deck.bodies.push_back(bodyAt(Vec3(1, 0, 0)));
  CHECK(Forces(modelOf(deck), smallPieces(Lengths::of_all)).force.bytes() == 2 * pieces);
}

TEST_CASE("patterns: bodies are the same in their frames when turned, moved and scaled") {
  CHECK(Pair().same());
}

TEST_CASE("patterns: bodies that differ in a node, a volume, the horizon or a bond are not same") {
  const auto differ = [](auto&& change) {
    Pair pair;
    change(pair, static_cast<std::size_t>(pair.bodies[1].start) + 5);
    return !pair.same();
  };
  CHECK(differ([](Pair& p, std::size_t i) { p.state.x_ref[i][1] += 1e-6 * spacing; }));
  CHECK(differ([](Pair& p, std::size_t i) { p.state.volume[i] *= 1 + 1e-6; }));
  CHECK(differ([](Pair& p, std::size_t) { p.bodies[1].horizon *= 1 + 1e-6; }));
  CHECK(differ([](Pair& p, std::size_t) { p.bodies[1].mesh_size *= 1 + 1e-6; }));
  CHECK(differ([](Pair& p, std::size_t) { p.bodies[1].zone = 1; }));
  CHECK(differ([](Pair& p, std::size_t) { ++p.bodies[1].center_node; }));
  CHECK(differ([](Pair& p, std::size_t) { p.bodies[1].rotation = p.bodies[0].rotation; }));
  CHECK(differ([](Pair& p, std::size_t) {  // one node fewer
    p.bodies[1].stop -= 1;
  }));
  CHECK(differ([](Pair& p, std::size_t i) {  // a bond with another node
    Index& j = p.bonds.neighbors[p.bonds.end(static_cast<Index>(i)) - 1];
    j += j + 1 < p.bodies[1].stop ? 1 : -1;
  }));
  CHECK(differ([](Pair& p, std::size_t i) { --p.bonds.offsets[i + 1]; }));  // one bond fewer
}

TEST_CASE("patterns: undeformed bodies, turned, scaled and moved, have no force at all") {
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    for (const int dimension : {2, 3})
      for (const MaterialType type : all_types)
        for (const InfluenceType influence : {InfluenceType::linear, InfluenceType::gaussian}) {
          CAPTURE(instruction_set);
          CAPTURE(dimension);
          CAPTURE(static_cast<int>(type));
          ModelDeck deck = irregularBodies(type, dimension);
          deck.zones[0].material.influence = {influence, {}};
          deck.bodies = turnedBodies(dimension);
          const DEMModel model = modelOf(deck);
          for (const BlockSizes& sizes : {BlockSizes(), withTables(Lengths::of_shared_patterns),
                                          smallPieces(Lengths::of_shared_patterns)}) {
            Forces forces(model, sizes);
            for (const Real way : {0.0, 0.3, -71.7}) {
              for (std::size_t i = 0; i < forces.state.size(); ++i)
                setDisplacement(forces.state, i, Vec3(way, 2 * way, dimension == 3 ? -way : 0));
              forces.state.f.assign(forces.state.size(), Vec3::Zero());
              forces.evaluate();
              CHECK(largestNorm(forces.state.f) == 0);
              const auto& [theta, z] = std::tie(forces.state.theta, forces.state.damage_z);
              CHECK(std::all_of(theta.begin(), theta.end(), [](Real t) { return t == 0; }));
              CHECK(std::all_of(z.begin(), z.end(), [](Real value) { return value == 0; }));
            }
          }
        }
  }
}
