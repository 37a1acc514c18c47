// Bodies in contact, put together node by node.
#pragma once

#include "peridem/contact.h"
#include "support.h"

namespace peridem::test {

// Only what contact reads. Every body is a zone of its own.
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
    copy(state.zone_id, grown.zone_id);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const std::size_t i = state.size() + k;
      grown.x[i] = nodes[k];
      grown.volume[i] = volume;
      grown.density[i] = density;
      grown.particle_id[i] = body.id;
      grown.zone_id[i] = body.zone;
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
inline Scene twoNodes(const ContactDeck& c = contact(0.5, 10), const Vec3& e = Vec3(1, 0, 0)) {
  Scene scene(c);
  scene.add({Vec3::Zero()}, 2, 4);
  scene.add({0.4 * e}, 3, 5);
  return scene;
}

inline ContactDeck damped(Real epsilon_n, Real kn = 0) {
  ContactDeck c = contact(0.5, kn);
  c.damping_on = true;
  c.epsilon = epsilon_n;
  return c;
}

// betan of a restitution exp(-pi) is sqrt 2; with K = 1, Rc = 0.5: beta = sqrt(meq).
inline const Real restitution = std::exp(-pi);

inline void checkForces(const std::vector<Vec3>& f, const std::vector<Vec3>& expected) {
  // Some ten operations on numbers of size one.
  CHECK(relativeError(f, expected) < 50 * epsilon);
}

}  // namespace peridem::test
