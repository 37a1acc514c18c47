// The damping part of ContactForce: between centres, and between particles and wall nodes.
#include <algorithm>
#include <cmath>

#include "contact.h"
#include "fuzzy.h"

namespace peridem {

// |Omega_p| of (27), the volume of the body (area in 2D); in the original the disc of the bounding
// radius, in 3D too.
Real ContactForce::dampedVolume(const Particle& body) const {
  if (compatibility_ == Compatibility::corrected) return body.volume;
  return pi * body.bounding_radius * body.bounding_radius;
}

bool ContactForce::nodesTouch(const State& state, const std::vector<Particle>& bodies,
                              const Particle& p, const Particle& q) const {
  const Real radius = law(p, q).radius;
  const auto [begin, end] = search_.bodyRows(p);
  for (std::size_t row = begin; row < end; ++row) {
    const auto i = static_cast<std::size_t>(search_.nodes()[row]);
    for (const Index candidate : search_.candidates().links(static_cast<Index>(row))) {
      const auto j = static_cast<std::size_t>(candidate);
      if (bodies[static_cast<std::size_t>(state.particle_id[j])].id == q.id &&
          fuzzyLess((state.x[j] - state.x[i]).norm(), radius))
        return true;
    }
  }
  return false;
}

namespace {

void addToBody(std::vector<Vec3>& f, const Particle& body, const Vec3& force_density) {
  for (auto i = static_cast<std::size_t>(body.start); i < static_cast<std::size_t>(body.stop); ++i)
    f[i] += force_density;
}

}  // namespace

// Two particles are damped while their centres (the program) or their nodes (the paper) are close.
template <class Visit>
void ContactForce::forEachDampedPair(const State& state, const std::vector<Particle>& bodies,
                                     Visit visit) const {
  for (const auto& [id_p, id_q] : search_.centerPairs()) {
    const Particle& p = bodies[static_cast<std::size_t>(id_p)];
    const Particle& q = bodies[static_cast<std::size_t>(id_q)];
    const ContactLaw& law = this->law(p, q);
    if (law.damping_by_nodes) continue;
    const Real distance = (state.x[static_cast<std::size_t>(q.center_node)] -
                           state.x[static_cast<std::size_t>(p.center_node)])
                              .norm();
    if (fuzzyLess(distance, p.bounding_radius + q.bounding_radius + 1.01 * law.radius)) visit(p, q);
  }
  for (const auto& [id_p, id_q] : search_.nearPairs()) {
    const Particle& p = bodies[static_cast<std::size_t>(id_p)];
    const Particle& q = bodies[static_cast<std::size_t>(id_q)];
    if (id_p == id_q || p.is_wall || q.is_wall || !law(p, q).damping_by_nodes) continue;
    if (nodesTouch(state, bodies, p, q)) visit(p, q);
  }
}

void ContactForce::addCenterDamping(const State& state, const std::vector<Particle>& bodies,
                                    std::vector<Vec3>& f, ContactParts* parts) const {
  forEachDampedPair(state, bodies, [&](const Particle& p, const Particle& q) {
    const auto [on_p, on_q] = centerDamping(state, p, q);
    if (on_p == Vec3::Zero()) return;
    addToBody(f, p, on_p);
    addToBody(f, q, on_q);
    if (parts == nullptr) return;
    addToBody(parts->damping, p, on_p);
    addToBody(parts->damping, q, on_q);
  });
}

// (27) on every node of p: beta c n / |Omega_p|, c = min(0, (v_q - v_p) . n) between the centres,
// n from p to q, (28) beta = betan sqrt(kappa Rc M_eq)      Jha et al. 2021
std::pair<Vec3, Vec3> ContactForce::centerDamping(const State& state, const Particle& p,
                                                  const Particle& q) const {
  const std::pair<Vec3, Vec3> none(Vec3::Zero(), Vec3::Zero());
  const ContactLaw& law = this->law(p, q);
  if (!(law.damping_factor > 0)) return none;
  const auto center_p = static_cast<std::size_t>(p.center_node);
  const auto center_q = static_cast<std::size_t>(q.center_node);
  const Vec3 dx = state.x[center_q] - state.x[center_p];
  const Vec3 n = dx / dx.norm();
  const Real c = (state.v[center_q] - state.v[center_p]).dot(n);
  if (c >= 0) return none;
  const Real volume_p = dampedVolume(p);
  const Real volume_q = dampedVolume(q);
  const Real beta = law.damping(harmonicMean(p.density * volume_p, q.density * volume_q));
  return {beta * c / volume_p * n, -beta * c / volume_q * n};
}

// Damping forces on a particle from every wall node within Rc of one of its nodes, each once.
void ContactForce::dampAgainstWalls(const State& state, const std::vector<Particle>& bodies,
                                    const Particle& body, std::vector<WallDamping>& found) const {
  std::vector<Index> touching;
  const auto wall_law = [&](std::size_t k) -> const ContactLaw& {
    return law(body, bodies[static_cast<std::size_t>(state.particle_id[k])]);
  };
  const auto [begin, end] = search_.bodyRows(body);
  for (std::size_t row = begin; row < end; ++row) {
    const auto i = static_cast<std::size_t>(search_.nodes()[row]);
    for (const Index candidate : search_.candidates().links(static_cast<Index>(row))) {
      const auto k = static_cast<std::size_t>(candidate);
      if (!bodies[static_cast<std::size_t>(state.particle_id[k])].is_wall) continue;
      const ContactLaw& law = wall_law(k);
      if (law.damping_factor > 0 && fuzzyLess((state.x[k] - state.x[i]).norm(), law.radius))
        touching.push_back(candidate);
    }
  }
  std::sort(touching.begin(), touching.end());
  touching.erase(std::unique(touching.begin(), touching.end()), touching.end());

  const auto center = static_cast<std::size_t>(body.center_node);
  const Real volume = dampedVolume(body);
  for (const Index node : touching) {
    const auto k = static_cast<std::size_t>(node);
    const Vec3 dx = state.x[k] - state.x[center];
    const Vec3 n = dx / dx.norm();
    const Real c = (state.v[k] - state.v[center]).dot(n);
    if (c >= 0) continue;
    const Real beta = wall_law(k).damping(body.density * volume);
    found.push_back({body.id, node, beta * c / volume * n});
  }
}

void ContactForce::addWallDamping(const State& state, const std::vector<Particle>& bodies,
                                  std::vector<Vec3>& f, int threads, ContactParts* parts) {
  const std::size_t n = bodies.size();
#pragma omp parallel for num_threads(threads) \
    schedule(dynamic, 8) if (search_.nodes().size() > contact_rows_worth_threads)
  for (std::size_t p = 0; p < n; ++p) {
    auto& found = wall_damping_[p];
    found.clear();
    if (bodies[p].is_wall || bodies[p].constrained) continue;
    dampAgainstWalls(state, bodies, bodies[p], found);
    Vec3 sum = Vec3::Zero();
    for (const WallDamping& damping : found) sum += damping.force;
    if (!found.empty()) addToBody(f, bodies[p], sum);
    if (!found.empty() && parts != nullptr) addToBody(parts->damping, bodies[p], sum);
  }
  // The wall nodes carry the reaction, body by body in a fixed order.
  for (std::size_t p = 0; p < n; ++p) {
    for (const WallDamping& damping : wall_damping_[p]) {
      const auto k = static_cast<std::size_t>(damping.node);
      const auto& wall = bodies[static_cast<std::size_t>(state.particle_id[k])];
      if (!takesContactForce(state, wall, k)) continue;
      const Vec3 reaction = damping.force * (bodies[p].volume / state.volume[k]);
      f[k] -= reaction;
      if (parts != nullptr) parts->damping[k] -= reaction;
    }
  }
}

std::vector<BodyDamping> ContactForce::bodyDampings(const State& state,
                                                    const std::vector<Particle>& bodies) const {
  std::vector<BodyDamping> dampings;
  if (!any_damping_) return dampings;
  forEachDampedPair(state, bodies, [&](const Particle& p, const Particle& q) {
    const auto [on_p, on_q] = centerDamping(state, p, q);
    if (on_p != Vec3::Zero()) dampings.push_back({p.id, q.id, p.volume * on_p, q.volume * on_q});
  });
  std::vector<WallDamping> found;
  for (const Particle& body : bodies) {
    if (!any_wall_ || body.is_wall || body.constrained) continue;
    found.clear();
    dampAgainstWalls(state, bodies, body, found);
    for (const WallDamping& damping : found) {
      const auto k = static_cast<std::size_t>(damping.node);
      const auto& wall = bodies[static_cast<std::size_t>(state.particle_id[k])];
      const Vec3 force = body.volume * damping.force;
      const Vec3 reaction = takesContactForce(state, wall, k) ? Vec3(-force) : Vec3(Vec3::Zero());
      dampings.push_back({body.id, wall.id, force, reaction});
    }
  }
  return dampings;
}

}  // namespace peridem
