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

// The pairs of particles whose damping is looked at until the candidates are rebuilt, and the
// particles that walls may damp.
void ContactForce::listDamped(const std::vector<Particle>& bodies) {
  damped_pairs_.clear();
  damped_by_walls_.clear();
  const auto body = [&](Index id) -> const Particle& {
    return bodies[static_cast<std::size_t>(id)];
  };
  const auto list = [&](Index p, Index q, bool by_nodes) {
    const ContactLaw& law = this->law(body(p), body(q));
    if (law.damping_factor > 0 && law.damping_by_nodes == by_nodes)
      damped_pairs_.emplace_back(p, q);
  };
  for (const auto& [p, q] : search_.centerPairs()) list(p, q, false);
  for (const auto& [p, q] : search_.nearPairs()) {
    if (!body(p).is_wall && !body(q).is_wall && p != q) list(p, q, true);
    if (body(p).is_wall == body(q).is_wall) continue;
    const Particle& particle = body(body(p).is_wall ? q : p);
    if (!particle.constrained) damped_by_walls_.push_back(particle.id);
  }
  std::sort(damped_by_walls_.begin(), damped_by_walls_.end());
  damped_by_walls_.erase(std::unique(damped_by_walls_.begin(), damped_by_walls_.end()),
                         damped_by_walls_.end());
  pair_damping_.resize(damped_pairs_.size());
}

// Two particles are damped while their centres (the program) or their nodes (the paper) are close.
bool ContactForce::areClose(const State& state, const std::vector<Particle>& bodies,
                            const Particle& p, const Particle& q) const {
  const ContactLaw& law = this->law(p, q);
  if (law.damping_by_nodes) return nodesTouch(state, bodies, p, q);
  const Real distance = (state.x[static_cast<std::size_t>(q.center_node)] -
                         state.x[static_cast<std::size_t>(p.center_node)])
                            .norm();
  return fuzzyLess(distance, p.bounding_radius + q.bounding_radius + 1.01 * law.radius);
}

// The dampers act on all nodes of a body alike: their forces are summed body by body, in the order
// of the pairs and then of the wall nodes, before they are added to the nodes.
void ContactForce::addDamping(const State& state, const std::vector<Particle>& bodies,
                              std::vector<Vec3>& f, int threads, ContactParts* parts) {
  const auto body = [&](Index id) -> const Particle& {
    return bodies[static_cast<std::size_t>(id)];
  };
  const std::size_t n_pairs = damped_pairs_.size();
  const std::size_t n_walled = damped_by_walls_.size();
  const bool worth_threads = search_.nodes().size() > contact_rows_worth_threads;
#pragma omp parallel num_threads(threads) if (worth_threads)
  {
#pragma omp for schedule(static) nowait
    for (std::size_t k = 0; k < n_pairs; ++k) {
      const Particle& p = body(damped_pairs_[k].first);
      const Particle& q = body(damped_pairs_[k].second);
      pair_damping_[k] = {Vec3::Zero(), Vec3::Zero()};
      if (areClose(state, bodies, p, q)) pair_damping_[k] = centerDamping(state, p, q);
    }
#pragma omp for schedule(static)
    for (std::size_t k = 0; k < n_walled; ++k) {
      const Index p = damped_by_walls_[k];
      dampAgainstWalls(state, bodies, body(p), wall_damping_[static_cast<std::size_t>(p)]);
    }
  }
  body_damping_.assign(bodies.size(), Vec3::Zero());
  for (std::size_t k = 0; k < n_pairs; ++k) {
    body_damping_[static_cast<std::size_t>(damped_pairs_[k].first)] += pair_damping_[k].first;
    body_damping_[static_cast<std::size_t>(damped_pairs_[k].second)] += pair_damping_[k].second;
  }
  for (const Index p : damped_by_walls_)
    for (const WallDamping& damping : wall_damping_[static_cast<std::size_t>(p)])
      body_damping_[static_cast<std::size_t>(p)] += damping.force;
#pragma omp parallel for num_threads(threads) schedule(static) if (worth_threads)
  for (std::size_t p = 0; p < bodies.size(); ++p) {
    if (body_damping_[p] == Vec3::Zero()) continue;
    addToBody(f, bodies[p], body_damping_[p]);
    if (parts != nullptr) addToBody(parts->damping, bodies[p], body_damping_[p]);
  }
  addWallReactions(state, bodies, f, parts);
}

// The wall nodes carry the reaction, body by body in a fixed order.
void ContactForce::addWallReactions(const State& state, const std::vector<Particle>& bodies,
                                    std::vector<Vec3>& f, ContactParts* parts) const {
  for (const Index id : damped_by_walls_) {
    const auto p = static_cast<std::size_t>(id);
    for (const WallDamping& damping : wall_damping_[p]) {
      const auto k = static_cast<std::size_t>(damping.node);
      if (!takesContactForce(state, bodies, k)) continue;
      const Vec3 reaction = damping.force * (bodies[p].volume / state.volume[k]);
      f[k] -= reaction;
      if (parts != nullptr) parts->damping[k] -= reaction;
    }
  }
}

// (27) on every node of p: beta c n / |Omega_p|, c = min(0, (v_q - v_p) . n) between the centres,
// n from p to q, (28) beta = betan sqrt(kappa Rc M_eq)      Jha et al. 2021
std::pair<Vec3, Vec3> ContactForce::centerDamping(const State& state, const Particle& p,
                                                  const Particle& q) const {
  const ContactLaw& law = this->law(p, q);
  const auto center_p = static_cast<std::size_t>(p.center_node);
  const auto center_q = static_cast<std::size_t>(q.center_node);
  const Vec3 dx = state.x[center_q] - state.x[center_p];
  const Vec3 n = dx / dx.norm();
  const Real c = (state.v[center_q] - state.v[center_p]).dot(n);
  if (c >= 0) return {Vec3::Zero(), Vec3::Zero()};
  const Real volume_p = dampedVolume(p);
  const Real volume_q = dampedVolume(q);
  const Real beta = law.damping(harmonicMean(p.density * volume_p, q.density * volume_q));
  return {beta * c / volume_p * n, -beta * c / volume_q * n};
}

// Damping forces on a particle from every wall node within Rc of one of its nodes, each once, while
// it approaches.
void ContactForce::dampAgainstWalls(const State& state, const std::vector<Particle>& bodies,
                                    const Particle& body, std::vector<WallDamping>& found) const {
  const auto wall_law = [&](std::size_t k) -> const ContactLaw& {
    return law(body, bodies[static_cast<std::size_t>(state.particle_id[k])]);
  };
  found.clear();
  const auto [begin, end] = search_.bodyRows(body);
  for (std::size_t row = begin; row < end; ++row) {
    const auto i = static_cast<std::size_t>(search_.nodes()[row]);
    for (const Index candidate : search_.candidates().links(static_cast<Index>(row))) {
      const auto k = static_cast<std::size_t>(candidate);
      if (!bodies[static_cast<std::size_t>(state.particle_id[k])].is_wall) continue;
      const ContactLaw& law = wall_law(k);
      if (law.damping_factor > 0 && fuzzyLess((state.x[k] - state.x[i]).norm(), law.radius))
        found.push_back({candidate, Vec3::Zero()});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const WallDamping& a, const WallDamping& b) { return a.node < b.node; });
  const auto same = [](const WallDamping& a, const WallDamping& b) { return a.node == b.node; };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());

  const auto center = static_cast<std::size_t>(body.center_node);
  const Real volume = dampedVolume(body);
  for (WallDamping& damping : found) {
    const auto k = static_cast<std::size_t>(damping.node);
    const Vec3 dx = state.x[k] - state.x[center];
    const Vec3 n = dx / dx.norm();
    const Real c = std::min((state.v[k] - state.v[center]).dot(n), 0.0);
    damping.force = wall_law(k).damping(body.density * volume) * c / volume * n;
  }
  std::erase_if(found, [](const WallDamping& damping) { return damping.force == Vec3::Zero(); });
}

std::vector<BodyDamping> ContactForce::bodyDampings(const State& state,
                                                    const std::vector<Particle>& bodies) const {
  std::vector<BodyDamping> dampings;
  for (const auto& [id_p, id_q] : damped_pairs_) {
    const Particle& p = bodies[static_cast<std::size_t>(id_p)];
    const Particle& q = bodies[static_cast<std::size_t>(id_q)];
    if (!areClose(state, bodies, p, q)) continue;
    const auto [on_p, on_q] = centerDamping(state, p, q);
    if (on_p != Vec3::Zero()) dampings.push_back({p.id, q.id, p.volume * on_p, q.volume * on_q});
  }
  std::vector<WallDamping> found;
  for (const Index id : damped_by_walls_) {
    const Particle& body = bodies[static_cast<std::size_t>(id)];
    dampAgainstWalls(state, bodies, body, found);
    for (const WallDamping& damping : found) {
      const auto k = static_cast<std::size_t>(damping.node);
      const auto& wall = bodies[static_cast<std::size_t>(state.particle_id[k])];
      const Vec3 force = body.volume * damping.force;
      const Vec3 reaction = takesContactForce(state, bodies, k) ? Vec3(-force) : Vec3(Vec3::Zero());
      dampings.push_back({body.id, wall.id, force, reaction});
    }
  }
  return dampings;
}

}  // namespace peridem
