#include "peridem/contact.h"
#include "peridem/errors.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// Bodies put together node by node: only what contact reads. Every body is a zone of its own.
struct Scene {
  ModelDeck deck;
  std::vector<Particle> bodies;
  State state;
  BondTable bonds;

  explicit Scene(const ContactDeck& c, std::size_t n_bodies = 2) {
    deck.zones.resize(n_bodies);
    deck.contacts.assign(n_bodies * n_bodies, c);
  }

  Particle& add(const std::vector<Vec3>& nodes, Real volume = 1, Real density = 1) {
    Particle body;
    body.id = body.zone = static_cast<Index>(bodies.size());
    body.start = body.center_node = static_cast<Index>(state.size());
    body.stop = body.start + static_cast<Index>(nodes.size());
    body.density = density;
    body.volume = volume * static_cast<Real>(nodes.size());
    body.mesh_size = body.horizon = body.bulk_modulus = 1;
    State grown(state.size() + nodes.size());
    const auto copy = [](const auto& from, auto& to) {
      std::copy(from.begin(), from.end(), to.begin());
    };
    copy(state.x, grown.x);
    copy(state.v, grown.v);
    copy(state.volume, grown.volume);
    copy(state.density, grown.density);
    copy(state.particle_id, grown.particle_id);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const std::size_t i = state.size() + k;
      grown.x[i] = nodes[k];
      grown.volume[i] = volume;
      grown.density[i] = density;
      grown.particle_id[i] = body.id;
    }
    state = grown;
    bonds.offsets.assign(state.size() + 1, 0);
    bodies.push_back(body);
    return bodies.back();
  }

  std::vector<Vec3> forces(int threads = 1) const {
    ContactForce force(deck, bodies);
    return forces(force, 0, threads);
  }
  std::vector<Vec3> forces(ContactForce& force, Real slip_time, int threads = 1) const {
    std::vector<Vec3> f(state.size(), Vec3::Zero());
    force.updateSearch(state, bonds, bodies, threads);
    force.compute(state, bodies, slip_time, f, threads);
    return f;
  }
};

// Nodes 0 and 1 of volumes 2 and 3 on the x axis at a distance of 0.4; Rc 0.5, Kn 10: F on 0 is
// 10 (0.4 - 0.5) 3 = -3, on 1 it is -2 towards 0.
Scene twoNodes(ContactDeck c = contact(0.5, 10), const Vec3& e = Vec3(1, 0, 0)) {
  Scene scene(c);
  scene.add({Vec3::Zero()}, 2, 4);
  scene.add({0.4 * e}, 3, 5);
  return scene;
}

ContactDeck frictional(Real mu) {
  ContactDeck c = contact(0.5, 10);
  c.friction_on = true;
  c.friction_coeff = mu;
  return c;
}

ContactDeck damped(Real epsilon_n, Real kn = 0) {
  ContactDeck c = contact(0.5, kn);
  c.damping_on = true;
  c.epsilon = epsilon_n;
  return c;
}

// betan of a restitution exp(-pi) is sqrt 2; with K = 1, Rc = 0.5: beta = sqrt(meq).
const Real restitution = std::exp(-pi);

void checkForces(const std::vector<Vec3>& f, const std::vector<Vec3>& expected) {
  // Some ten operations on numbers of size one.
  CHECK(relativeError(f, expected) < 50 * epsilon);
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
  // c = (v_q - v_p) . n = -3 between the first nodes; m = 4 pi and 12 pi, meq = 6 pi,
  // beta = sqrt(6 pi); every node of p gets -3 beta / pi, of q 3 beta / (4 pi).
  const Scene scene = twoBodies(damped(restitution));
  const Vec3 on_p(-3 * std::sqrt(6 * pi) / pi, 0, 0);
  checkForces(scene.forces(), {on_p, on_p, -on_p / 4, -on_p / 4});
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

TEST_CASE("centre damping: in 3D the bodies' volumes, in the original discs") {
  // m_p = 4 * 0.5, m_q = 3 * 1: meq = 12/5
  Scene scene = twoBodies(damped(restitution));
  scene.deck.dimension = 3;
  const Real beta = std::sqrt(2.4);
  const Vec3 on_p(-3 * beta / 0.5, 0, 0);
  const Vec3 on_q(3 * beta / 1, 0, 0);
  checkForces(scene.forces(), {on_p, on_p, on_q, on_q});
  scene.deck.compatibility = Compatibility::original;
  const Vec3 disc(-3 * std::sqrt(6 * pi) / pi, 0, 0);
  checkForces(scene.forces(), {disc, disc, -disc / 4, -disc / 4});
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
  // vol = pi, meq = 4 pi, beta = 2 sqrt(pi); node 2 (below): c = -2, node 3 (right): c = -4.
  const Real by_volume = 2 * std::sqrt(pi) / pi;
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
