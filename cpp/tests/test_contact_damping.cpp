#include "contact_scene.h"

using namespace peridem;
using namespace peridem::test;

TEST_CASE("node damping: two approaching nodes by hand") {
  // m = 8 and 15, meq = 240/23, beta = sqrt(meq); w . e = -2: on 0 it is -2 beta / 2.
  ContactDeck c = damped(restitution, 10);
  c.node_damping = true;
  c.center_damping_criterion = DampingCriterion::nodes;
  Scene scene = twoNodes(c);
  scene.bodies[0].is_wall = true;  // so that there is no damping between centres
  scene.bodies[0].constrained = true;
  scene.bodies[1].bounding_radius = 1;
  scene.state.v[1] = Vec3(-2, 1, 0);
  ContactDeck without = c;
  without.node_damping = false;
  Scene reference = scene;
  reference.deck.contacts.assign(4, without);
  auto f = scene.forces();
  const auto rest = reference.forces();
  const Real beta = std::sqrt(240.0 / 23);
  CHECK(relativeError(f[0] - rest[0], Vec3(-2 * beta / 2, 0, 0)) < 50 * epsilon);
  CHECK(relativeError(f[1] - rest[1], Vec3(2 * beta / 3, 0, 0)) < 50 * epsilon);
  scene.state.v[1] = Vec3(2, 1, 0);  // going apart
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
}

namespace {

// Two bodies of two nodes each, of bounding radii 1 and 2 around their first nodes, which are
// 3.2 apart: closer than 1 + 2 + 1.01 * 0.5. No node is within Rc of another body's.
Scene twoBodies(const ContactDeck& c) {
  Scene scene(c);
  scene.add({Vec3(0, 0, 0), Vec3(0, -0.7, 0)}, 0.25, 4).bounding_radius = 1;
  scene.add({Vec3(3.2, 0, 0), Vec3(3.2, 0.7, 0)}, 0.5, 3).bounding_radius = 2;
  scene.state.v = {Vec3(2, 5, 0), Vec3(9, 9, 0), Vec3(-1, 5, 0), Vec3(9, 9, 0)};
  return scene;
}

}  // namespace

TEST_CASE("centre damping: two approaching bodies by hand") {
  // c = (v_q - v_p) . n = -3 between the first nodes; m = 4 / 2 and 3 * 1, meq = 12/5,
  // beta = sqrt(12/5); every node of p gets -3 beta / (1/2), of q 3 beta / 1.
  for (const int dimension : {2, 3}) {
    Scene scene = twoBodies(damped(restitution));
    scene.deck.dimension = dimension;
    const Vec3 on_p(-3 * std::sqrt(2.4) / 0.5, 0, 0);
    checkForces(scene.forces(), {on_p, on_p, -on_p / 2, -on_p / 2});
  }
}

TEST_CASE("centre damping: in the original by discs of the bounding radius") {
  // volumes pi and 4 pi: m = 4 pi and 12 pi, meq = 6 pi
  for (const int dimension : {2, 3}) {
    Scene scene = twoBodies(damped(restitution));
    scene.deck.dimension = dimension;
    scene.deck.compatibility = Compatibility::original;
    const Vec3 on_p(-3 * std::sqrt(6 * pi) / pi, 0, 0);
    checkForces(scene.forces(), {on_p, on_p, -on_p / 4, -on_p / 4});
  }
}

TEST_CASE("centre damping: none between bodies that part or that are farther apart") {
  Scene scene = twoBodies(damped(restitution));
  scene.state.v[0] = Vec3(-2, 0, 0);
  CHECK(largestNorm(scene.forces()) == 0);
  scene = twoBodies(damped(restitution));
  const Real limit = 3 + 1.01 * 0.5;
  scene.state.x[2][0] = limit * (1 - 0.9e-5);  // closer, but not fuzzily
  CHECK(largestNorm(scene.forces()) == 0);
  scene.state.x[2][0] = limit * (1 - 1.1e-5);
  CHECK(largestNorm(scene.forces()) > 0);
}

TEST_CASE("centre damping: none with damping off or with a restitution of one") {
  ContactDeck off = damped(restitution);
  off.damping_on = false;
  CHECK(largestNorm(twoBodies(off).forces()) == 0);
  CHECK(largestNorm(twoBodies(damped(1)).forces()) == 0);
}

TEST_CASE("centre damping: the factor Beta_n_Factor multiplies it") {
  ContactDeck c = damped(restitution);
  c.beta_n_factor = 3;
  const auto once = twoBodies(damped(restitution)).forces();
  const auto thrice = twoBodies(c).forces();
  for (std::size_t i = 0; i < once.size(); ++i)
    CHECK(relativeError(thrice[i], Vec3(3 * once[i])) < 20 * epsilon);
}

TEST_CASE("centre damping: by the criterion of nodes only while nodes touch") {
  ContactDeck c = damped(restitution);
  c.center_damping_criterion = DampingCriterion::nodes;
  Scene scene = twoBodies(c);
  CHECK(largestNorm(scene.forces()) == 0);
  const auto by_centers = twoBodies(damped(restitution)).forces();
  scene.state.x[3] = Vec3(0.3, 0, 0);  // within Rc of node 0; Kn is 0
  checkForces(scene.forces(), by_centers);
}

TEST_CASE("centre damping: acts on bodies that never move, too") {
  Scene scene = twoBodies(damped(restitution));
  const auto both_free = scene.forces();
  scene.bodies[0].constrained = scene.bodies[1].constrained = true;
  checkForces(scene.forces(), both_free);
}

namespace {

// A particle of two nodes over a wall of three, two of which are within Rc = 0.5 of the particle;
// node 2 of both its nodes. The centre is node 0.
Scene overWall() {
  Scene scene(damped(restitution));
  scene.add({Vec3(0, 0, 0), Vec3(0.2, 0, 0)}, 0.5, 4).bounding_radius = 1;
  scene.add({Vec3(0, -0.4, 0), Vec3(0.6, 0, 0), Vec3(2, 0, 0)}, 0.25, 7).is_wall = true;
  scene.bodies[1].constrained = true;
  scene.bodies[1].bounding_radius = 9;
  scene.state.v[0] = Vec3(3, -2, 0);
  scene.state.v[1] = Vec3(-9, 9, 0);
  scene.state.v[3] = Vec3(-1, 0, 0);
  return scene;
}

}  // namespace

TEST_CASE("wall damping: every wall node in reach once, by hand, and the reaction on it") {
  // vol = 1, meq = 4, beta = 2; node 2 (below): c = -2, node 3 (right): c = -4.
  const Real by_volume = 2;
  const Vec3 below(0, 2 * by_volume, 0);   // beta c n / vol with n = (0, -1, 0)
  const Vec3 right(-4 * by_volume, 0, 0);  // n = (1, 0, 0)
  // The particle's own volume is 1: the wall nodes of volume 1/4 take four times the density.
  checkForces(overWall().forces(),
              {below + right, below + right, -4 * below, -4 * right, Vec3(0, 0, 0)});
}

TEST_CASE("wall damping: the force of the particle and the reaction of the wall add up to zero") {
  const Scene scene = overWall();
  const auto f = scene.forces();
  Vec3 total = Vec3::Zero();
  for (std::size_t i = 0; i < f.size(); ++i) total += scene.state.volume[i] * f[i];
  CHECK(total.norm() < 20 * epsilon * largestNorm(f));
}

TEST_CASE("wall damping: none against a wall that recedes and none for a particle that is held") {
  Scene scene = overWall();
  scene.state.v[0] = Vec3(-3, 2, 0);
  CHECK(largestNorm(scene.forces()) == 0);
  scene = overWall();
  scene.bodies[0].constrained = true;
  scene.bodies[1].constrained = false;
  CHECK(largestNorm(scene.forces()) == 0);
}
