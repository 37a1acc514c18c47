// Motion in the loop over the forces, gravity in the kernels, threads.
#include "force_scene.h"
#include "peridem/external.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real no_limit = std::numeric_limits<Real>::infinity();

// A kick and drift of all bodies, and what it leaves alone.
struct Motion {
  std::vector<std::uint8_t> locked;
  std::vector<std::uint8_t> locked_bodies;
  KickAndDrift step;

  explicit Motion(const Forces& forces, Real speed_limit = no_limit)
      : locked(forces.state.size(), 0) {
    for (const Particle& body : forces.bodies)
      if (body.constrained) std::fill(&locked[0] + body.start, &locked[0] + body.stop, 7);
    step.k = 2e-7;
    step.dt = 4e-7;
    step.speed_limit = speed_limit;
  }

  void lock(std::size_t node, int directions) {
    locked[node] = static_cast<std::uint8_t>(directions);
  }

  const KickAndDrift& of(const Forces& forces) {
    locked_bodies.clear();
    for (const Particle& body : forces.bodies)
      locked_bodies.push_back(std::any_of(&locked[0] + body.start, &locked[0] + body.stop,
                                          [](std::uint8_t bits) { return bits != 0; }));
    step.locked = &locked;
    step.locked_bodies = &locked_bodies;
    return step;
  }
};

// Four bodies that share a pattern, a constrained one and one of another zone, with three times as
// many nodes.
DEMModel scene(MaterialType type, int dimension) {
  ModelDeck deck = irregularBodies(type, dimension);
  deck.bodies = turnedBodies(dimension);
  deck.bodies.push_back(bodyAt(Vec3(0.1, 0, 0)));
  deck.bodies.back().constrained = true;
  deck.meshes.push_back(dimension == 2 ? quadGrid(14, 12, spacing) : tetraGrid(6, spacing));
  deck.zones.push_back(deck.zones[0]);
  deck.zones[1].mesh = 1;
  deck.zones[1].material.density = 1700;
  deck.contacts.assign(4, contact(spacing, 1));
  deck.bodies.push_back(bodyAt(Vec3(0, 0.1, 0), 1));
  DEMModel model(deck, 1);
  model.init();
  return model;
}

// The largest body in five pieces or so, the others whole.
BlockSizes someInPieces() {
  BlockSizes sizes;
  sizes.smallest_piece = sizes.largest_piece = 40;
  sizes.whole = 100;
  return sizes;
}

void giveVelocities(State& state, Real size, int dimension) {
  Random random(41);
  for (Vec3& v : state.v) v = size * random.vector(dimension);
}

void checkSameMotion(const Forces& a, const Forces& b) {
  checkSameBits(a, b);
  CHECK(a.state.v == b.state.v);
  CHECK(a.state.u == b.state.u);
  CHECK(a.state.x == b.state.x);
}

}  // namespace

TEST_CASE("fused motion: is motion, then forces, to the last bit") {
  const Vec3 gravity(1, -10, 0);
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types)
      for (const bool lock : {false, true}) {
        CAPTURE(dimension);
        CAPTURE(static_cast<int>(type));
        CAPTURE(lock);
        const DEMModel model = scene(type, dimension);
        Forces fused(model, someInPieces());
        Forces apart(model, someInPieces());
        Motion motion(fused);
        for (std::size_t i = 0; lock && i < motion.locked.size(); i += 7)
          if (motion.locked[i] == 0) motion.lock(i, 1 + static_cast<int>(i) % 7);
        for (Forces* forces : {&fused, &apart}) {
          giveVelocities(forces->state, 60, 3);  // in 2D the third component is not integrated
          for (Vec3& v : forces->state.v) v[2] *= dimension == 2 ? 10 : 1;
          forces->evaluate(1, gravity);
        }
        for (int n = 0; n < 12; ++n) {
          const Kick together = fused.force.moveAndCompute(motion.of(fused), fused.state,
                                                           fused.bonds, fused.bodies, gravity, 1);
          const Kick alone = motion.of(apart).move(
              apart.state, 0, static_cast<Index>(apart.state.size()), dimension);
          apart.force.compute(apart.state, apart.bonds, apart.bodies, gravity, 1);
          CHECK(together.fastest == alone.fastest);
          CHECK(together.within_limit);
        }
        fused.force.computeDamage(fused.state, 1);
        apart.force.computeDamage(apart.state, 1);
        checkSameMotion(fused, apart);
        CHECK(largestNorm(fused.state.u) > 0.1 * spacing);
        CHECK((brokenBonds(fused.bonds) > 0) == (type != MaterialType::pd_elastic_bond));
        const Particle& fixed = fused.bodies[4];
        REQUIRE(fixed.constrained);
        for (Index i = fixed.start; i < fixed.stop; ++i)
          CHECK(fused.state.u[static_cast<std::size_t>(i)] == Vec3::Zero());
      }
}

TEST_CASE("fused motion: finds a velocity beyond the limit or not a number wherever it is") {
  const DEMModel model = scene(MaterialType::pmb_bond, 2);
  Forces forces(model, someInPieces());
  Motion motion(forces, 100);
  std::size_t missed = 0;
  std::size_t imagined = 0;
  for (std::size_t i = 0; i < forces.state.size(); ++i) {
    if (motion.locked[i] != 0) continue;
    for (const Real v : {not_given, no_limit, 101.0, -101.0, 99.0}) {
      forces.state.v[i][static_cast<Eigen::Index>(i % 2)] = v;
      forces.state.f.assign(forces.state.size(), Vec3::Zero());
      const Kick kicked = forces.force.moveAndCompute(motion.of(forces), forces.state, forces.bonds,
                                                      forces.bodies, Vec3::Zero(), 1);
      (v == 99 ? imagined : missed) += kicked.within_limit == (v != 99);
      forces.state.u = forces.state.v = model.state().v;
    }
  }
  CHECK(missed == 0);
  CHECK(imagined == 0);
}

TEST_CASE("damage: is that of the current state, without a force evaluation in between") {
  for (const MaterialType type : all_types) {
    CAPTURE(static_cast<int>(type));
    const DEMModel model = scene(type, 2);
    Forces evaluated(model, someInPieces());
    Forces looked_at(model, someInPieces());
    for (const Real size : {0.01, 0.3}) {
      for (Forces* forces : {&evaluated, &looked_at})
        displaceBodies(forces->state, forces->bodies, size, 2, 59);
      evaluated.evaluate();
      looked_at.force.computeDamage(looked_at.state, 1);
      CHECK(looked_at.state.damage_z == evaluated.state.damage_z);
    }
  }
}

TEST_CASE("damage: a look at it before any evaluation leaves the dilatation alone") {
  // As after a restart, which sets theta from outside.
  const DEMModel model = scene(MaterialType::pd_state, 2);
  Forces forces(model, someInPieces());
  forces.state.theta.assign(forces.state.size(), 0.5);
  forces.force.computeDamage(forces.state, 1);
  CHECK(std::all_of(forces.state.theta.begin(), forces.state.theta.end(),
                    [](Real theta) { return theta == 0.5; }));
}

TEST_CASE("gravity: in the kernels is that of the external forces") {
  const Vec3 gravity(3, -9.81, 0);
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types) {
      const DEMModel model = scene(type, dimension);
      Forces inside(model, someInPieces());
      Forces added(model, someInPieces());
      for (Forces* forces : {&inside, &added})
        displaceBodies(forces->state, forces->bodies, 1e-6, dimension, 43);  // forces like gravity
      inside.evaluate(1, gravity);
      added.evaluate(1, Vec3::Zero());
      addExternalForces(added.state, gravity, {}, 0, 1);
      // The same three terms in another order.
      CHECK(relativeError(inside.state.f, added.state.f) < 3 * epsilon);
      CHECK(largestNorm(inside.state.f) > 1e4);
      const Particle& fixed = inside.bodies[4];
      for (Index i = fixed.start; i < fixed.stop; ++i)
        CHECK(inside.state.f[static_cast<std::size_t>(i)] == fixed.density * gravity);
    }
}

TEST_CASE("forces: an evaluation sets all components, what lay there before is gone") {
  // In 2D nothing acts out of the plane but gravity, if it points there.
  const Vec3 gravity(0, -9.81, 2);
  const DEMModel model = scene(all_types[0], 2);
  Forces forces(model, someInPieces());
  forces.state.f.assign(forces.state.size(), Vec3(7, 7, 7));
  forces.evaluate(1, gravity);
  for (const Particle& body : forces.bodies)
    for (Index i = body.start; i < body.stop; ++i)
      CHECK(forces.state.f[static_cast<std::size_t>(i)][2] == body.density * 2);
}

TEST_CASE("threads: any number gives the same bits, whole, shared and partitioned bodies") {
  // 72 x 72 nodes: more than one block and enough bonds for threads; small bodies, blocks of their
  // own, share a pattern.
  const Vec3 gravity(0, -10, 0);
  for (const MaterialType type : all_types) {
    ModelDeck deck = irregularBodies(type, 2);
    deck.bodies = turnedBodies(2);
    deck.meshes.push_back(quadGrid(72, 72, spacing));
    deck.zones.push_back(deck.zones[0]);
    deck.zones[1].mesh = 1;
    deck.bodies.push_back(bodyAt(Vec3(0, 1, 0), 1));
    deck.bodies.push_back(bodyAt(Vec3(0, 2, 0)));
    deck.bodies.back().constrained = true;
    deck.contacts.assign(4, contact(spacing, 1));
    DEMModel model(deck, 1);
    model.init();
    const auto moved = [&](int threads) {
      Forces forces(model);
      Motion motion(forces);
      giveVelocities(forces.state, 60, 2);
      forces.evaluate(threads, gravity);
      Kick kicked;
      for (int n = 0; n < 12; ++n)
        kicked.merge(forces.force.moveAndCompute(motion.of(forces), forces.state, forces.bonds,
                                                 forces.bodies, gravity, threads));
      forces.force.computeDamage(forces.state, threads);
      return std::pair(std::move(forces), kicked.fastest);
    };
    const auto one = moved(1);
    if (type != MaterialType::pd_elastic_bond) CHECK(brokenBonds(one.first.bonds) > 1000);
    for (const int threads : {2, 3, 4}) {
      const auto several = moved(threads);
      checkSameMotion(several.first, one.first);
      CHECK(several.second == one.second);
    }
  }
}
