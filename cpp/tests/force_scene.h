// Bodies of one zone, turned and scaled, and their internal forces outside of a model.
#pragma once

#include <Eigen/Geometry>

#include "peridem/peridynamic.h"
#include "support.h"

namespace peridem::test {

inline constexpr MaterialType all_types[] = {MaterialType::pd_state, MaterialType::pmb_bond,
                                             MaterialType::rnp_bond, MaterialType::pd_elastic_bond};
inline constexpr Real spacing = 1e-3;  // h

// Bodies of 56 nodes in 2D and 64 in 3D, horizon 3.1 h, whose bonds break at a stretch of about
// 0.05.
inline ModelDeck irregularBodies(MaterialType type, int dimension) {
  MaterialDeck m = material(type, 3.1 * spacing);
  m.horizon_mesh_ratio = 3.1;
  m.fracture_energy *= 0.05 * 0.05;
  m.influence = {InfluenceType::linear, {}};
  Mesh mesh = dimension == 2 ? quadGrid(8, 7, spacing) : tetraGrid(4, spacing);
  Random random(17);
  for (Vec3& x : mesh.points) x += 0.1 * spacing * random.vector(dimension);
  ModelDeck deck = oneZone(std::move(mesh), m, dimension);
  deck.contacts.push_back(contact(spacing, 1));
  return deck;
}

// At different places, angles and scales, in 3D about different axes.
inline std::vector<BodyDeck> turnedBodies(int dimension) {
  std::vector<BodyDeck> bodies;
  const Real angles[] = {0, 0.5, pi / 2, -2.4};
  const Real scales[] = {1, 1, 0.7, 1.9};
  for (std::size_t k = 0; k < 4; ++k) {
    BodyDeck body = bodyAt(spacing * Vec3(16.3 * static_cast<Real>(k), -7.1, 0));
    body.angle = angles[k];
    body.scale = scales[k];
    if (dimension == 3) body.axis = Vec3(1, static_cast<Real>(k), -0.5);
    bodies.push_back(body);
  }
  return bodies;
}

// Each node by its own random vector, in units of the mesh size of its body.
inline void displaceBodies(State& state, const std::vector<Particle>& bodies, Real size,
                           int dimension, std::uint32_t seed) {
  Random random(seed);
  for (const Particle& body : bodies)
    for (Index i = body.start; i < body.stop; ++i)
      setDisplacement(state, static_cast<std::size_t>(i),
                      size * body.mesh_size * random.vector(dimension));
}

// The internal forces of the bodies of a model, with a state and flags of their own.
struct Forces {
  Forces(const DEMModel& model, const BlockSizes& sizes = {})
      : state(model.state()),
        bonds(model.bonds()),
        bodies(model.particles()),
        dimension(model.deck().dimension),
        force(state, bonds, bodies, influencesOf(model), dimension, Compatibility::corrected,
              sizes) {}

  void evaluate(int threads = 1, const Vec3& gravity = Vec3::Zero()) {
    force.compute(state, bonds, bodies, gravity, threads);
    force.computeDamage(state, threads);
  }

  static std::vector<Influence> influencesOf(const DEMModel& model) {
    std::vector<Influence> influences;
    for (const Particle& body : model.particles())
      influences.emplace_back(
          model.deck().zones[static_cast<std::size_t>(body.zone)].material.influence,
          model.deck().dimension);
    return influences;
  }

  State state;
  BondTable bonds;
  std::vector<Particle> bodies;
  int dimension;
  PeridynamicForce force;
};

// Bodies of more than 20 nodes are cut into pieces of 13.
inline BlockSizes smallPieces(Lengths lengths = Lengths::automatic) {
  BlockSizes sizes;
  sizes.smallest_piece = sizes.largest_piece = 13;
  sizes.whole = 20;
  sizes.lengths = lengths;
  return sizes;
}

inline void checkSameBits(const Forces& a, const Forces& b) {
  CHECK(a.state.f == b.state.f);
  CHECK(a.state.theta == b.state.theta);
  CHECK(a.state.damage_z == b.state.damage_z);
  CHECK(a.bonds.intact == b.bonds.intact);
}

inline std::size_t brokenBonds(const BondTable& bonds) {
  return static_cast<std::size_t>(std::count(bonds.intact.begin(), bonds.intact.end(), 0));
}

}  // namespace peridem::test
