#include "contact.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"
#include "fuzzy.h"
#include "mesh.h"

namespace peridem {

namespace {

constexpr std::size_t rows_worth_threads = 2000;
constexpr Real skin_by_reach = 0.5;

// Rc and Kn when the deck leaves them out: 0.95 h (35) and 18 kappa_eff / (pi eps^5) (36).
ContactLaw makeContactLaw(const ContactDeck& deck, Real h_min, Real kappa, Real horizon,
                          Compatibility mode) {
  ContactLaw law;
  law.radius = isGiven(deck.contact_radius)          ? deck.contact_radius
               : isGiven(deck.contact_radius_factor) ? deck.contact_radius_factor * h_min
                                                     : 0.95 * h_min;
  law.kappa = kappa;
  law.kn = isGiven(deck.kn) ? deck.kn * deck.kn_factor
                            : deck.kn_factor * 18 * kappa / (pi * std::pow(horizon, 5));
  // With F <= 0, -mu F e_t opposes the slip. The original adds +mu F e_t: it pushes along it.
  const Real sign = mode == Compatibility::original ? 1.0 : -1.0;
  law.friction = deck.friction_on ? sign * deck.friction_coeff : 0;
  law.damping_factor = dampingFactor(deck.beta_n_factor, deck.damping_on ? deck.epsilon : 1.0);
  law.damping_by_nodes = deck.center_damping_criterion == DampingCriterion::nodes;
  law.node_damping = deck.node_damping && deck.damping_on;
  return law;
}

}  // namespace

ContactForce::ContactForce(const ModelDeck& deck, const std::vector<Particle>& bodies)
    : dimension_(deck.dimension),
      compatibility_(deck.compatibility),
      n_zones_(deck.zones.size()),
      laws_(n_zones_ * n_zones_) {
  if (bodies.size() < 2) return;
  if (deck.contacts.size() != laws_.size())
    throw InputError("Contact: constants are needed for every pair of zones");

  std::vector<Real> sizes;
  for (const Particle& body : bodies) {
    sizes.push_back(body.mesh_size);
    any_wall_ = any_wall_ || body.is_wall;
  }
  const Real h_min = smallestMeshSize(sizes, compatibility_ == Compatibility::original);
  // One body of a zone stands for all: K and the horizon are the material's.
  std::vector<const Particle*> sample(n_zones_, nullptr);
  for (const Particle& body : bodies) sample[static_cast<std::size_t>(body.zone)] = &body;
  for (std::size_t i = 0; i < n_zones_; ++i) {
    for (std::size_t j = 0; j < n_zones_; ++j) {
      if (sample[i] == nullptr || sample[j] == nullptr) continue;
      if (sample[i]->is_wall && sample[j]->is_wall) continue;
      const Real kappa = harmonicMean(sample[i]->bulk_modulus, sample[j]->bulk_modulus);
      const Real horizon = std::max(sample[i]->horizon, sample[j]->horizon);
      ContactLaw& law = laws_[i * n_zones_ + j];
      law = makeContactLaw(deck.contact(static_cast<Index>(i), static_cast<Index>(j)), h_min, kappa,
                           horizon, compatibility_);
      largest_radius_ = std::max(largest_radius_, law.radius);
      any_damping_ = any_damping_ || law.damping_factor > 0;
    }
  }
  search_ = ContactSearch(bodies, largest_radius_, skin_by_reach * largest_radius_);
  wall_damping_.resize(bodies.size());
}

// The original gives no contact force to walls and to bodies that never move. Walls that are held
// get theirs in every mode, so that the reaction of a wall is right: it does not move them. In the
// original mode a wall that is free to move goes without, since it would move otherwise.
bool ContactForce::takesContactForce(const State& state, const Particle& body,
                                     std::size_t node) const {
  if (compatibility_ == Compatibility::corrected) return true;
  if (!body.is_wall) return !body.constrained;
  const int all_directions = (1 << dimension_) - 1;
  return body.constrained || (state.fixity[node] & all_directions) == all_directions;
}

void ContactForce::compute(State& state, const std::vector<Particle>& bodies, int threads) {
  addNodeForces(state, bodies, threads);
  if (!any_damping_) return;
  if (any_wall_) addWallDamping(state, bodies, threads);
  addCenterDamping(state, bodies);
}

// (17) F = Kn (|x_j - x_i| - Rc) V_j <= 0,   f_i += F e_n
// (20) f_i -= mu F e_t, e_t the direction of the slip w - (w . e_n) e_n of w = v_j - v_i
// (22) f_i += beta w . e_n / V_i e_n while the nodes approach (option)      Jha et al. 2021
void ContactForce::addNodeForces(State& state, const std::vector<Particle>& bodies,
                                 int threads) const {
  const auto& nodes = search_.nodes();
  const auto body_of = [&](std::size_t i) -> const Particle& {
    return bodies[static_cast<std::size_t>(state.particle_id[i])];
  };
#pragma omp parallel for num_threads(threads) \
    schedule(static) if (nodes.size() > rows_worth_threads)
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    const auto i = static_cast<std::size_t>(nodes[row]);
    const Particle& p = body_of(i);
    if (!takesContactForce(state, p, i)) continue;
    Vec3 sum = Vec3::Zero();
    for (const Index candidate : search_.candidates().links(static_cast<Index>(row))) {
      const auto j = static_cast<std::size_t>(candidate);
      const ContactLaw& law = this->law(p, body_of(j));
      const Vec3 dx = state.x[j] - state.x[i];
      const Real distance = dx.norm();
      if (!fuzzyLess(distance, law.radius)) continue;
      const Vec3 e_n = dx / distance;
      const Real normal = law.normalForce(distance, state.volume[j]);
      sum += normal * e_n;
      if (law.friction == 0 && !law.node_damping) continue;
      const Vec3 w = state.v[j] - state.v[i];
      const Real approach = w.dot(e_n);
      const Vec3 slip = w - approach * e_n;
      const Real slip_speed = slip.norm();
      if (slip_speed > 0) sum += (law.friction * normal / slip_speed) * slip;
      if (law.node_damping && approach < 0) {
        const Real mass_i = state.density[i] * state.volume[i];
        const Real mass_j = state.density[j] * state.volume[j];
        sum += law.damping(harmonicMean(mass_i, mass_j)) * approach / state.volume[i] * e_n;
      }
    }
    state.f[i] += sum;
  }
}

// Volume of a body in the centre damping: the disc of the bounding radius. The original takes the
// disc in 3D too; ours the body's own volume there.
Real ContactForce::dampedVolume(const Particle& body) const {
  if (dimension_ == 3 && compatibility_ == Compatibility::corrected) return body.volume;
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

void addToBody(State& state, const Particle& body, const Vec3& force_density) {
  for (auto i = static_cast<std::size_t>(body.start); i < static_cast<std::size_t>(body.stop); ++i)
    state.f[i] += force_density;
}

}  // namespace

// (27) on every node of p: beta c n / |Omega_p|, c = min(0, (v_q - v_p) . n) between the centres,
// n from p to q, (28) beta = betan sqrt(kappa Rc M_eq)      Jha et al. 2021
void ContactForce::addCenterDamping(State& state, const std::vector<Particle>& bodies) const {
  for (const auto& [id_p, id_q] : search_.centerPairs()) {
    const Particle& p = bodies[static_cast<std::size_t>(id_p)];
    const Particle& q = bodies[static_cast<std::size_t>(id_q)];
    const ContactLaw& law = this->law(p, q);
    if (!(law.damping_factor > 0)) continue;
    const auto center_p = static_cast<std::size_t>(p.center_node);
    const auto center_q = static_cast<std::size_t>(q.center_node);
    const Vec3 dx = state.x[center_q] - state.x[center_p];
    const Real distance = dx.norm();
    const bool close =
        law.damping_by_nodes
            ? nodesTouch(state, bodies, p, q)
            : fuzzyLess(distance, p.bounding_radius + q.bounding_radius + 1.01 * law.radius);
    if (!close) continue;
    const Vec3 n = dx / distance;
    const Real c = (state.v[center_q] - state.v[center_p]).dot(n);
    if (c >= 0) continue;
    const Real volume_p = dampedVolume(p);
    const Real volume_q = dampedVolume(q);
    const Real beta = law.damping(harmonicMean(p.density * volume_p, q.density * volume_q));
    addToBody(state, p, beta * c / volume_p * n);
    addToBody(state, q, -beta * c / volume_q * n);
  }
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

void ContactForce::addWallDamping(State& state, const std::vector<Particle>& bodies, int threads) {
  const std::size_t n = bodies.size();
#pragma omp parallel for num_threads(threads) \
    schedule(dynamic, 8) if (search_.nodes().size() > rows_worth_threads)
  for (std::size_t p = 0; p < n; ++p) {
    auto& found = wall_damping_[p];
    found.clear();
    if (bodies[p].is_wall || bodies[p].constrained) continue;
    dampAgainstWalls(state, bodies, bodies[p], found);
    Vec3 sum = Vec3::Zero();
    for (const WallDamping& damping : found) sum += damping.force;
    if (!found.empty()) addToBody(state, bodies[p], sum);
  }
  // The wall nodes carry the reaction, body by body in a fixed order.
  for (std::size_t p = 0; p < n; ++p) {
    for (const WallDamping& damping : wall_damping_[p]) {
      const auto k = static_cast<std::size_t>(damping.node);
      const auto& wall = bodies[static_cast<std::size_t>(state.particle_id[k])];
      if (!takesContactForce(state, wall, k)) continue;
      state.f[k] -= damping.force * (bodies[p].volume / state.volume[k]);
    }
  }
}

}  // namespace peridem
