#include "contact.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "contact_pair.h"
#include "errors.h"
#include "fuzzy.h"
#include "mesh.h"

namespace peridem {

namespace {

// Rc and Kn when the deck leaves them out: 0.95 h (35) and 18 kappa_eff / (pi eps^5) (36).
ContactLaw makeContactLaw(const ContactDeck& deck, Real h_min, Real kappa, Real horizon,
                          Compatibility mode) {
  if (!(deck.epsilon > 0 && deck.epsilon <= 1))
    throw InputError("Contact: Epsilon must be above 0 and at most 1");
  if (!(deck.friction_coeff >= 0)) throw InputError("Contact: Friction_Coeff must not be negative");
  ContactLaw law;
  law.radius = isGiven(deck.contact_radius)          ? deck.contact_radius
               : isGiven(deck.contact_radius_factor) ? deck.contact_radius_factor * h_min
                                                     : 0.95 * h_min;
  if (!(law.radius > 0)) throw InputError("Contact: the contact radius must be positive");
  law.kappa = kappa;
  law.kn = isGiven(deck.kn) ? deck.kn * deck.kn_factor
                            : deck.kn_factor * 18 * kappa / (pi * std::pow(horizon, 5));
  // With F <= 0, -mu F e_t opposes the slip. The original adds +mu F e_t: it pushes along it.
  const Real sign = mode == Compatibility::original ? 1.0 : -1.0;
  law.friction = deck.friction_on ? sign * deck.friction_coeff : 0;
  law.damping_factor = dampingFactor(deck.beta_n_factor, deck.damping_on ? deck.epsilon : 1.0);
  law.damping_by_nodes = deck.center_damping_criterion == DampingCriterion::nodes;
  law.node_damping = deck.node_damping && deck.damping_on;
  law.friction_history = deck.friction_model == FrictionModel::history && law.friction != 0;
  law.kt = deck.tangential_stiffness_ratio * law.kn;
  law.self_contact = deck.self_contact;
  return law;
}

}  // namespace

ContactForce::ContactForce(const ModelDeck& deck, const std::vector<Particle>& bodies)
    : dimension_(deck.dimension),
      compatibility_(deck.compatibility),
      n_zones_(deck.zones.size()),
      laws_(n_zones_ * n_zones_) {
  if (deck.contacts.empty() && bodies.size() < 2) return;
  if (deck.contacts.size() != laws_.size())
    throw InputError("Contact: constants are needed for every pair of zones");

  std::vector<Real> sizes;
  for (const Particle& body : bodies) sizes.push_back(body.mesh_size);
  const Real h_min = smallestMeshSize(sizes, compatibility_ == Compatibility::original);
  // One body of a zone stands for all: K is the material's, and the horizon of the default Kn the
  // largest in the zone (bodies may differ in it where it is a multiple of their mesh size).
  std::vector<const Particle*> sample(n_zones_, nullptr);
  std::vector<Real> horizons(n_zones_, 0);
  for (const Particle& body : bodies) {
    const auto zone = static_cast<std::size_t>(body.zone);
    sample[zone] = &body;
    horizons[zone] = std::max(horizons[zone], body.horizon);
  }
  for (std::size_t i = 0; i < n_zones_; ++i) {
    for (std::size_t j = 0; j < n_zones_; ++j) {
      if (sample[i] == nullptr || sample[j] == nullptr) continue;
      if (sample[i]->is_wall && sample[j]->is_wall) continue;
      const Real kappa = harmonicMean(sample[i]->bulk_modulus, sample[j]->bulk_modulus);
      const Real horizon = std::max(horizons[i], horizons[j]);
      ContactLaw& law = laws_[i * n_zones_ + j];
      law = makeContactLaw(deck.contact(static_cast<Index>(i), static_cast<Index>(j)), h_min, kappa,
                           horizon, compatibility_);
      largest_radius_ = std::max(largest_radius_, law.radius);
      any_damping_ = any_damping_ || law.damping_factor > 0;
      any_history_ = any_history_ || law.friction_history;
    }
  }
  std::vector<char> self_contact(bodies.size(), 0);
  for (const Particle& body : bodies)
    self_contact[static_cast<std::size_t>(body.id)] =
        !body.is_wall && !body.constrained && law(body, body).self_contact;
  search_ = ContactSearch(bodies, largest_radius_, std::move(self_contact));
  wall_damping_.resize(bodies.size());
}

// The original gives no contact force to walls and to bodies that never move. Walls that are held
// get theirs in every mode, so that the reaction of a wall is right: it does not move them. In the
// original mode a wall that is free to move goes without, since it would move otherwise.
bool ContactForce::takesContactForce(const State& state, const std::vector<Particle>& bodies,
                                     std::size_t node) const {
  if (compatibility_ == Compatibility::corrected) return true;
  const Particle& body = bodies[static_cast<std::size_t>(state.particle_id[node])];
  if (!body.is_wall) return !body.constrained;
  const int all_directions = (1 << dimension_) - 1;
  return body.constrained || (state.fixity[node] & all_directions) == all_directions;
}

void ContactForce::updateSearch(const State& state, const BondTable& bonds,
                                const std::vector<Particle>& bodies, int threads) {
  if (!search_.needsRebuild(state, threads)) return;
  const std::vector<SlipRecord> stretched = slips();
  search_.rebuild(state, bonds, bodies, threads);
  if (any_history_) setSlips(stretched);
  if (any_damping_) listDamped(bodies);
}

std::vector<std::pair<Index, Index>> ContactForce::touching(
    const State& state, const std::vector<Particle>& bodies) const {
  const auto& candidates = search_.candidates();
  const auto body_of = [&](std::size_t i) -> const Particle& {
    return bodies[static_cast<std::size_t>(state.particle_id[i])];
  };
  std::vector<std::pair<Index, Index>> pairs;
  for (std::size_t row = 0; row < search_.nodes().size(); ++row)
    for (auto k = static_cast<std::size_t>(candidates.offsets[row]);
         k < static_cast<std::size_t>(candidates.offsets[row + 1]); ++k) {
      const auto [low, high] = std::minmax(search_.nodes()[row], candidates.indices[k]);
      const auto i = static_cast<std::size_t>(low), j = static_cast<std::size_t>(high);
      const ContactLaw& law = this->law(body_of(i), body_of(j));
      if (fuzzyLess((state.x[j] - state.x[i]).norm(), law.radius)) pairs.emplace_back(low, high);
    }
  std::sort(pairs.begin(), pairs.end());  // both nodes may list the pair
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

std::vector<SlipRecord> ContactForce::slips() const {
  std::vector<SlipRecord> records;
  if (slips_.empty()) return records;
  const auto& candidates = search_.candidates();
  for (std::size_t row = 0; row < search_.nodes().size(); ++row)
    for (auto k = static_cast<std::size_t>(candidates.offsets[row]);
         k < static_cast<std::size_t>(candidates.offsets[row + 1]); ++k)
      if (slips_[k] != Vec3::Zero())
        records.push_back({search_.nodes()[row], candidates.indices[k], slips_[k]});
  return records;
}

void ContactForce::setSlips(const std::vector<SlipRecord>& records) {
  if (!any_history_) return;
  const auto& nodes = search_.nodes();
  const auto& candidates = search_.candidates();
  slips_.assign(candidates.indices.size(), Vec3::Zero());
  for (const SlipRecord& record : records) {
    const auto node = std::lower_bound(nodes.begin(), nodes.end(), record.i);
    if (node == nodes.end() || *node != record.i) continue;
    const auto row = static_cast<Index>(node - nodes.begin());
    const auto links = candidates.links(row);
    const auto found = std::lower_bound(links.begin(), links.end(), record.j);
    if (found == links.end() || *found != record.j) continue;
    slips_[static_cast<std::size_t>(candidates.offsets[static_cast<std::size_t>(row)] +
                                    (found - links.begin()))] = record.elongation;
  }
}

void ContactForce::compute(const State& state, const std::vector<Particle>& bodies, Real slip_time,
                           std::vector<Vec3>& f, int threads, ContactParts* parts) {
  if (parts == nullptr)
    addNodeForces<false>(state, bodies, slip_time, f, threads, nullptr);
  else
    addNodeForces<true>(state, bodies, slip_time, f, threads, parts);
  if (any_damping_) addDamping(state, bodies, f, threads, parts);
}

namespace {

// Nodes in contact lie anywhere in the arrays; asked for early enough, they are there in time.
void prefetchNode(const State& state, Index node) {
  const auto i = static_cast<std::size_t>(node);
  __builtin_prefetch(&state.x[i]);
  __builtin_prefetch(&state.v[i]);
  __builtin_prefetch(&state.volume[i]);
  __builtin_prefetch(&state.zone_id[i]);
}

}  // namespace

// The forces of contact_pair.h, summed over the nodes in contact with node i; with `split` those of
// friction and damping also into their own arrays.
template <bool split>
void ContactForce::addNodeForces(const State& state, const std::vector<Particle>& bodies,
                                 Real slip_time, std::vector<Vec3>& f, int threads,
                                 ContactParts* parts) {
  constexpr std::size_t ahead = 16;  // nodes to ask for before they are needed
  const auto& nodes = search_.nodes();
  const auto& candidates = search_.candidates();
#pragma omp parallel for num_threads(threads) \
    schedule(static) if (nodes.size() > contact_rows_worth_threads)
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    if (row + ahead < nodes.size()) {
      prefetchNode(state, nodes[row + ahead]);
      __builtin_prefetch(&f[static_cast<std::size_t>(nodes[row + ahead])], 1);
    }
    const auto i = static_cast<std::size_t>(nodes[row]);
    if (!takesContactForce(state, bodies, i)) continue;
    Vec3 sum = Vec3::Zero();
    for (auto k = static_cast<std::size_t>(candidates.offsets[row]);
         k < static_cast<std::size_t>(candidates.offsets[row + 1]); ++k) {
      if (k + ahead < candidates.indices.size()) prefetchNode(state, candidates.indices[k + ahead]);
      const auto j = static_cast<std::size_t>(candidates.indices[k]);
      const Vec3 dx = state.x[j] - state.x[i];
      const Real squared = dx.squaredNorm();
      const bool far = squared > largest_radius_ * largest_radius_;  // as most candidates are
      const ContactLaw* law = far ? nullptr : &lawOfZones(state.zone_id[i], state.zone_id[j]);
      const Real distance = std::sqrt(squared);
      if (law == nullptr || !fuzzyLess(distance, law->radius)) {
        if (any_history_ && slip_time > 0) slips_[k].setZero();
        continue;
      }
      Vec3 elongation = any_history_ ? slips_[k] : Vec3::Zero();
      const PairForces pair = pairForces(*law, state, i, j, dx, distance, slip_time, elongation);
      sum += pair.normal;
      if (law->friction == 0 && !law->node_damping) continue;
      sum += pair.friction;
      sum += pair.damping;
      if (law->friction_history && slip_time > 0) slips_[k] = elongation;  // else only a look
      if constexpr (split) {
        parts->friction[i] += pair.friction;
        parts->damping[i] += pair.damping;
      }
    }
    f[i] += sum;
  }
}

}  // namespace peridem
