#include "contact_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "bond_block.h"
#include "cell_grid.h"

namespace peridem {

namespace {
constexpr std::size_t nodes_worth_threads = 20000;
constexpr std::size_t nodes_of_run = 128;

// A wide skin makes long lists, a narrow one many rebuilds. Between these times the reach, it is
// widened when it has lasted for few steps and narrowed when it has for many.
constexpr Real narrowest_skin = 0.5;
constexpr Real widest_skin = 1.25;
constexpr Real widening = 1.5;
constexpr Offset few_steps = 40;
constexpr Offset many_steps = 400;

// Part of the way that the skin allows, after which a rebuild is due that looks at all nodes again
// and again would only put off.
constexpr Real near_the_end = 0.8;
}  // namespace

ContactSearch::ContactSearch(const std::vector<Particle>& bodies, Real reach,
                             std::vector<char> self_contact)
    : self_contact_(std::move(self_contact)),
      reach_(reach),
      skin_(narrowest_skin * reach),
      needed_(reach > 0 &&
              (bodies.size() > 1 ||
               std::find(self_contact_.begin(), self_contact_.end(), 1) != self_contact_.end())),
      boxes_(bodies.size()) {}

bool ContactSearch::needsRebuild(const State& state, int threads) {
  if (!needed_) return false;
  ++looks_;
  moved_ += std::exchange(travel_, unknown);
  if (moved_ < skin_ / 2) return false;
  const std::size_t n = state.size();
  if (x_built_.size() != n) return true;
  Real farthest = 0;
  int lost = 0;  // a position that is not a number: the rebuild is harmless, the step reports it
#pragma omp parallel for num_threads(threads) reduction(max : farthest) reduction(| : lost) \
    schedule(static) if (n > nodes_worth_threads)
  for (std::size_t i = 0; i < n; ++i) {
    const Real squared = (state.x[i] - x_built_[i]).squaredNorm();
    farthest = std::max(farthest, squared);
    lost |= !(squared >= 0);
  }
  if (lost) return true;
  moved_ = std::sqrt(farthest);
  return !(moved_ < near_the_end * skin_ / 2);
}

void ContactSearch::clusterNodes(const State& state, const std::vector<Particle>& bodies) {
  constexpr std::size_t cluster_nodes = 32;
  clustered_.reserve(state.size());
  for (const Particle& body : bodies) {
    first_cluster_.push_back(cluster_start_.size());
    const std::span<const Vec3> points(state.x.data() + body.start,
                                       static_cast<std::size_t>(body.nodes()));
    const std::vector<Index> order = bisectionOrder(points);
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (k % cluster_nodes == 0) cluster_start_.push_back(clustered_.size());
      clustered_.push_back(body.start + order[k]);
    }
  }
  first_cluster_.push_back(cluster_start_.size());
  cluster_boxes_.resize(cluster_start_.size());
  cluster_start_.push_back(clustered_.size());
}

ContactSearch::Box ContactSearch::boxAround(const State& state, std::size_t begin,
                                            std::size_t end) const {
  const Vec3& first = state.x[static_cast<std::size_t>(clustered_[begin])];
  Box box{first, first};
  for (std::size_t k = begin; k < end; ++k) {
    const Vec3& x = state.x[static_cast<std::size_t>(clustered_[k])];
    box.lower = box.lower.cwiseMin(x);
    box.upper = box.upper.cwiseMax(x);
  }
  return box;
}

// Bodies whose boxes, grown by half the margin each, overlap: sweep along x.
ContactSearch::BodyPairs ContactSearch::bodyPairs(const State& state,
                                                  const std::vector<Particle>& bodies, Real margin,
                                                  int threads) {
  const std::size_t n = bodies.size();
  if (clustered_.empty()) clusterNodes(state, bodies);
#pragma omp parallel for num_threads(threads) \
    schedule(dynamic, 8) if (state.size() > nodes_worth_threads)
  for (std::size_t p = 0; p < n; ++p) {
    for (std::size_t c = first_cluster_[p]; c < first_cluster_[p + 1]; ++c) {
      const Box box = boxAround(state, cluster_start_[c], cluster_start_[c + 1]);
      cluster_boxes_[c] = box;
      if (c == first_cluster_[p]) boxes_[p] = box;
      boxes_[p].lower = boxes_[p].lower.cwiseMin(box.lower);
      boxes_[p].upper = boxes_[p].upper.cwiseMax(box.upper);
    }
  }
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t p, std::size_t q) {
    return boxes_[p].lower[0] != boxes_[q].lower[0] ? boxes_[p].lower[0] < boxes_[q].lower[0]
                                                    : p < q;
  });
  BodyPairs pairs;
  for (std::size_t a = 0; a < n; ++a) {
    const std::size_t p = order[a];
    if (self_contact_[p]) pairs.emplace_back(p, p);
    for (std::size_t b = a + 1; b < n; ++b) {
      const std::size_t q = order[b];
      if (boxes_[q].lower[0] > boxes_[p].upper[0] + margin) break;
      if (!mayTouch(bodies[p], bodies[q])) continue;
      if (boxes_[p].overlaps(boxes_[q], margin)) pairs.emplace_back(std::min(p, q), std::max(p, q));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// Marks the nodes of body p that are within the margin of the box of a cluster of q.
void ContactSearch::markNearNodes(const State& state, std::size_t p, std::size_t q, Real margin,
                                  std::vector<std::uint8_t>& is_near) const {
  for (std::size_t d = first_cluster_[q]; d < first_cluster_[q + 1]; ++d) {
    const Box& other = cluster_boxes_[d];
    if (!boxes_[p].overlaps(other, margin)) continue;
    for (std::size_t c = first_cluster_[p]; c < first_cluster_[p + 1]; ++c) {
      if (!cluster_boxes_[c].overlaps(other, margin)) continue;
      for (std::size_t k = cluster_start_[c]; k < cluster_start_[c + 1]; ++k) {
        const auto i = static_cast<std::size_t>(clustered_[k]);
        if (!is_near[i] && other.overlaps({state.x[i], state.x[i]}, margin)) is_near[i] = 1;
      }
    }
  }
}

std::vector<Index> ContactSearch::nodesNearOthers(const State& state,
                                                  const std::vector<Particle>& bodies,
                                                  const BodyPairs& pairs, Real margin,
                                                  int threads) const {
  std::vector<std::vector<Index>> partners(bodies.size());
  for (const auto& [p, q] : pairs) {
    partners[static_cast<std::size_t>(p)].push_back(q);
    if (p != q) partners[static_cast<std::size_t>(q)].push_back(p);
  }
  std::vector<std::uint8_t> is_near(state.size(), 0);
#pragma omp parallel for num_threads(threads) \
    schedule(dynamic, 8) if (state.size() > nodes_worth_threads)
  for (std::size_t p = 0; p < bodies.size(); ++p)
    for (const Index q : partners[p])
      markNearNodes(state, p, static_cast<std::size_t>(q), margin, is_near);
  std::vector<Index> nodes;
  for (std::size_t i = 0; i < is_near.size(); ++i)
    if (is_near[i]) nodes.push_back(static_cast<Index>(i));
  return nodes;
}

void ContactSearch::adaptSkin() {
  if (rebuilds_ > 0 && looks_ < few_steps)
    skin_ = std::min(skin_ * widening, widest_skin * reach_);
  else if (looks_ > many_steps)
    skin_ = std::max(skin_ / widening, narrowest_skin * reach_);
  looks_ = 0;
}

void ContactSearch::rebuild(const State& state, const BondTable& bonds,
                            const std::vector<Particle>& bodies, int threads) {
  adaptSkin();
  const Real radius = reach_ + skin_;
  near_pairs_ = bodyPairs(state, bodies, radius, threads);
  const std::vector<Index> near = nodesNearOthers(state, bodies, near_pairs_, radius, threads);

  const CellGrid grid(state.x, near, radius);
  const auto body_of = [&](Index node) -> const Particle& {
    return bodies[static_cast<std::size_t>(state.particle_id[static_cast<std::size_t>(node)])];
  };

  // Runs of nodes have lists of their own, which are then put one after the other.
  const std::size_t n_runs = (near.size() + nodes_of_run - 1) / nodes_of_run;
  if (runs_.size() < n_runs) runs_.resize(n_runs);
#pragma omp parallel for num_threads(threads) \
    schedule(dynamic, 1) if (near.size() > nodes_worth_threads / 10)
  for (std::size_t r = 0; r < n_runs; ++r) {
    Run& run = runs_[r];
    run.nodes.clear();
    run.ends.clear();
    run.candidates.clear();
    for (std::size_t k = r * nodes_of_run; k < std::min((r + 1) * nodes_of_run, near.size()); ++k) {
      const Index i = near[k];
      const std::size_t begin = run.candidates.size();
      const Particle& p = body_of(i);
      const bool touches_itself = self_contact_[static_cast<std::size_t>(p.id)];
      grid.forEachNear(i, [&](Index j) {
        const bool own = state.particle_id[static_cast<std::size_t>(j)] == p.id;
        if (own && !touches_itself) return;
        const Vec3 dx = state.x[static_cast<std::size_t>(j)] - state.x[static_cast<std::size_t>(i)];
        if (!(dx.squaredNorm() < radius * radius)) return;
        if (own ? i != j && !bonds.everBonded(i, j) : mayTouch(p, body_of(j)))
          run.candidates.push_back(j);
      });
      if (run.candidates.size() == begin) continue;
      std::sort(run.candidates.begin() + static_cast<std::ptrdiff_t>(begin), run.candidates.end());
      run.nodes.push_back(i);
      run.ends.push_back(static_cast<Offset>(run.candidates.size()));
    }
  }
  nodes_.clear();
  candidates_.offsets.assign(1, 0);
  candidates_.indices.clear();
  for (std::size_t r = 0; r < n_runs; ++r) {
    const auto begin = static_cast<Offset>(candidates_.indices.size());
    nodes_.insert(nodes_.end(), runs_[r].nodes.begin(), runs_[r].nodes.end());
    candidates_.indices.insert(candidates_.indices.end(), runs_[r].candidates.begin(),
                               runs_[r].candidates.end());
    for (const Offset end : runs_[r].ends) candidates_.offsets.push_back(begin + end);
  }
  rebuildCenterPairs(state, bodies);
  x_built_ = state.x;
  moved_ = 0;
  ++rebuilds_;
}

// Bounding spheres around the centre nodes. They may be wider than the boxes, hence a search of
// their own among all particles, cheap because bodies are few.
void ContactSearch::rebuildCenterPairs(const State& state, const std::vector<Particle>& bodies) {
  center_pairs_.clear();
  std::vector<Index> order;
  for (const Particle& body : bodies)
    if (!body.is_wall) order.push_back(body.id);
  const auto center = [&](Index p) -> const Vec3& {
    return state.x[static_cast<std::size_t>(bodies[static_cast<std::size_t>(p)].center_node)];
  };
  Real largest = 0;
  for (const Index p : order)
    largest = std::max(largest, bodies[static_cast<std::size_t>(p)].bounding_radius);
  std::sort(order.begin(), order.end(), [&](Index p, Index q) {
    return center(p)[0] != center(q)[0] ? center(p)[0] < center(q)[0] : p < q;
  });
  for (std::size_t a = 0; a < order.size(); ++a) {
    const Index p = order[a];
    const Real margin = bodies[static_cast<std::size_t>(p)].bounding_radius + 1.01 * reach_ + skin_;
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      const Index q = order[b];
      if (center(q)[0] - center(p)[0] > margin + largest) break;
      const Real limit = margin + bodies[static_cast<std::size_t>(q)].bounding_radius;
      if ((center(q) - center(p)).squaredNorm() < limit * limit)
        center_pairs_.emplace_back(std::min(p, q), std::max(p, q));
    }
  }
  std::sort(center_pairs_.begin(), center_pairs_.end());
}

std::pair<std::size_t, std::size_t> ContactSearch::bodyRows(const Particle& body) const {
  const auto begin = std::lower_bound(nodes_.begin(), nodes_.end(), body.start);
  const auto end = std::lower_bound(begin, nodes_.end(), body.stop);
  return {static_cast<std::size_t>(begin - nodes_.begin()),
          static_cast<std::size_t>(end - nodes_.begin())};
}

}  // namespace peridem
