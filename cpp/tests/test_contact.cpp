#include "contact_scene.h"
#include "peridem/errors.h"

using namespace peridem;
using namespace peridem::test;

namespace {

ContactDeck frictional(Real mu) {
  ContactDeck c = contact(0.5, 10);
  c.friction_on = true;
  c.friction_coeff = mu;
  return c;
}

}  // namespace

TEST_CASE("contact: normal force of two nodes by hand") {
  const Vec3 e(0.6, 0.8, 0);
  checkForces(twoNodes(contact(0.5, 10), e).forces(), {-3 * e, 2 * e});
}

TEST_CASE("contact: nodes at the contact radius do not touch, by the fuzzy comparison") {
  Scene scene = twoNodes();
  for (const auto& [distance, touches] :
       {std::pair(0.5, false), {0.5 * (1 - 0.9e-5), false}, {0.5 * (1 - 1.1e-5), true}}) {
    scene.state.x[1] = Vec3(distance, 0, 0);
    CHECK((largestNorm(scene.forces()) > 0) == touches);
  }
}

TEST_CASE("contact: friction opposes the slip, the original's pushes along it") {
  // v_1 - v_0 = (5, 2, 0): slip along +y; |mu F| = 0.9 on 0 and 0.6 on 1, whatever the speed.
  Scene scene = twoNodes(frictional(0.3));
  scene.state.v = {Vec3(-1, 0, 0), Vec3(4, 2, 0)};
  checkForces(scene.forces(), {Vec3(-3, 0.9, 0), Vec3(2, -0.6, 0)});
  scene.deck.compatibility = Compatibility::original;
  checkForces(scene.forces(), {Vec3(-3, -0.9, 0), Vec3(2, 0.6, 0)});
}

TEST_CASE("contact: no friction without slip or when it is off") {
  Scene scene = twoNodes(frictional(0.3));
  scene.state.v[1] = Vec3(7, 0, 0);
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
  ContactDeck off = frictional(0.3);
  off.friction_on = false;
  scene = twoNodes(off);
  scene.state.v[1] = Vec3(0, 7, 0);
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
}

TEST_CASE("contact: friction takes energy, the original's gives it") {
  for (const auto mode : {Compatibility::corrected, Compatibility::original}) {
    Scene scene = twoNodes(frictional(0.3));
    scene.deck.compatibility = mode;
    scene.state.v = {Vec3(0, -1, 0.5), Vec3(0, 2, 1)};
    const auto f = scene.forces();
    const Real power = 2 * f[0].dot(scene.state.v[0]) + 3 * f[1].dot(scene.state.v[1]);
    // mu |F V| |slip| = 0.3 * 6 * |(3, 0.5)|
    const Real expected = 1.8 * std::hypot(3.0, 0.5);
    CHECK(relativeError(power, mode == Compatibility::original ? expected : -expected) <
          50 * epsilon);
  }
}

TEST_CASE("friction with history: a spring grows with the slip up to the Coulomb limit") {
  // kt = 0.5 Kn = 5: slip 0.1 stretches the spring to 0.01 per 0.1 s: force 5 * 3 * 0.01 = 0.15
  // on node 0 and 0.1 on node 1; the limit is 0.3 * 3 = 0.9.
  ContactDeck c = frictional(0.3);
  c.friction_model = FrictionModel::history;
  c.tangential_stiffness_ratio = 0.5;
  Scene scene = twoNodes(c);
  scene.state.v[1] = Vec3(0, 0.1, 0);
  ContactForce force(scene.deck, scene.bodies);
  checkForces(scene.forces(force, 0), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
  checkForces(scene.forces(force, 0.1), {Vec3(-3, 0.15, 0), Vec3(2, -0.1, 0)});
  checkForces(scene.forces(force, 0), {Vec3(-3, 0.15, 0), Vec3(2, -0.1, 0)});
  checkForces(scene.forces(force, 0.2), {Vec3(-3, 0.45, 0), Vec3(2, -0.3, 0)});
  checkForces(scene.forces(force, 5), {Vec3(-3, 0.9, 0), Vec3(2, -0.6, 0)});
  // At the limit the spring is cut back, so that it gives way at once when the slip turns round.
  scene.state.v[1] = Vec3(0, -0.1, 0);
  checkForces(scene.forces(force, 0.1), {Vec3(-3, 0.75, 0), Vec3(2, -0.5, 0)});
  scene.state.x[1] = Vec3(0.6, 0, 0);  // apart: the spring is gone
  CHECK(largestNorm(scene.forces(force, 0.1)) == 0);
  scene.state.x[1] = Vec3(0.4, 0, 0);
  checkForces(scene.forces(force, 0), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
}

TEST_CASE("friction with history: springs outlive a new search and a saved state") {
  ContactDeck c = frictional(0.3);
  c.friction_model = FrictionModel::history;
  Scene scene = twoNodes(c);
  scene.state.v[1] = Vec3(0, 0.1, 0);
  ContactForce force(scene.deck, scene.bodies);
  const auto before = scene.forces(force, 0.1);
  CHECK(before[0][1] > 0);
  for (Vec3& x : scene.state.x) x += Vec3(2, 0, 0);  // both move on: a new search
  const Offset rebuilds = force.search().rebuilds();
  checkForces(scene.forces(force, 0), before);
  CHECK(force.search().rebuilds() == rebuilds + 1);

  const auto saved = force.slips();
  REQUIRE(saved.size() == 2);
  CHECK(saved[0].i == 0);
  CHECK(saved[0].j == 1);
  CHECK(relativeError(saved[0].elongation, Vec3(0, 0.01, 0)) < 10 * epsilon);
  ContactForce restored(scene.deck, scene.bodies);
  restored.updateSearch(scene.state, scene.bonds, scene.bodies, 1);
  restored.setSlips(saved);
  CHECK(scene.forces(restored, 0) == scene.forces(force, 0));
}

TEST_CASE("walls: a held wall carries the reaction in both modes") {
  for (const auto mode : {Compatibility::corrected, Compatibility::original}) {
    Scene scene = twoNodes();
    scene.deck.compatibility = mode;
    scene.bodies[1].is_wall = true;
    SUBCASE("held as a whole") {
      scene.bodies[1].constrained = true;
    }
    SUBCASE("held by displacement sets in x and y") {
      scene.state.fixity[1] = 3;
    }
    const auto f = scene.forces();
    checkForces(f, {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
    CHECK(std::abs(2 * f[0][0] + 3 * f[1][0]) < 50 * epsilon);
  }
}

TEST_CASE("walls: the original gives no contact force to a wall that may move") {
  Scene scene = twoNodes();
  scene.bodies[1].is_wall = true;
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
  scene.deck.compatibility = Compatibility::original;
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(0, 0, 0)});
  scene.state.fixity[1] = 1;  // only x is held
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(0, 0, 0)});
}

TEST_CASE("walls: the original gives no contact force to a particle that never moves") {
  Scene scene = twoNodes();
  scene.bodies[1].constrained = true;
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(2, 0, 0)});
  scene.deck.compatibility = Compatibility::original;
  checkForces(scene.forces(), {Vec3(-3, 0, 0), Vec3(0, 0, 0)});
}

TEST_CASE("contact constants: radius and stiffness from the deck or from the paper") {
  ContactDeck c = contact(0.3, 7);
  c.kn_factor = 2;
  Scene scene(c);
  scene.add({Vec3(0, 0, 0)});
  scene.add({Vec3(9, 0, 0)});
  scene.bodies[0].mesh_size = 0.5;
  scene.bodies[0].bulk_modulus = 3;
  scene.bodies[1].horizon = 2;
  const auto law = [&](const ContactDeck& deck) {
    scene.deck.contacts.assign(4, deck);
    return ContactForce(scene.deck, scene.bodies).law(scene.bodies[0], scene.bodies[1]);
  };
  CHECK(law(c).radius == 0.3);
  CHECK(law(c).kn == 14);
  CHECK(law(c).kappa == 1.5);  // 2 * 3 * 1 / 4
  c.contact_radius = not_given;
  c.contact_radius_factor = 0.8;
  CHECK(law(c).radius == 0.4);  // of the smallest mesh size
  c.contact_radius_factor = not_given;
  CHECK(law(c).radius == 0.95 * 0.5);
  c.kn = not_given;
  CHECK(relativeError(law(c).kn, 2 * 18 * 1.5 / (pi * 32)) < 10 * epsilon);
}

TEST_CASE("contact constants: missing for a pair of zones is refused") {
  Scene scene = twoNodes();
  scene.deck.contacts.resize(3);
  CHECK_THROWS_AS(ContactForce(scene.deck, scene.bodies), InputError);
}

TEST_CASE("self-contact of a body: nodes never bonded push each other when the deck says so") {
  for (const bool on : {false, true}) {
    ContactDeck c = contact(0.5, 10);
    c.self_contact = on;
    Scene scene(c, 1);
    scene.add({Vec3(0, 0, 0), Vec3(0.4, 0, 0)}, 3);
    const Real expected = on ? -3 : 0;
    checkForces(scene.forces(), {Vec3(expected, 0, 0), Vec3(-expected, 0, 0)});
  }
}

TEST_CASE("contact: 1 and 2 and 4 threads give the same bits") {
  // Three intermingled clouds, the third a wall: thousands of nodes in contact, all forces on.
  ContactDeck c = frictional(0.3);
  c.contact_radius = 0.1;
  c.damping_on = c.node_damping = true;
  c.epsilon = 0.8;
  Scene scene(c, 3);
  Random random(53);
  for (int body = 0; body < 3; ++body) {
    std::vector<Vec3> nodes(900);
    for (Vec3& x : nodes) x = random.vector(2);
    scene.add(nodes, 1e-3).bounding_radius = 1.5;
  }
  scene.bodies[2].is_wall = true;
  for (Vec3& v : scene.state.v) v = random.vector(2);
  const auto one = scene.forces(1);
  CHECK(largestNorm(one) > 0);
  CHECK(scene.forces(2) == one);
  CHECK(scene.forces(4) == one);
}
