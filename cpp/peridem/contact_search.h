// Which nodes of different bodies may touch: candidate lists with a skin, kept over many steps.
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "bonds.h"
#include "neighbors.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Candidates stay complete while no node has moved by more than half the skin since they were
// built, so that no contact is ever missed.
class ContactSearch {
 public:
  ContactSearch() = default;
  // `reach`: largest distance at which two nodes interact. `self_contact[p]`: whether nodes of
  // body p that were never bonded to each other are candidates too.
  ContactSearch(const std::vector<Particle>& bodies, Real reach, std::vector<char> self_contact);

  // Whether some node has moved too far since the lists were built. Looks at all nodes, unless the
  // travel noted since the last look shows that none can have.
  bool needsRebuild(const State& state, int threads);

  // Before the next needsRebuild(): no node has moved by more than `distance` since the last one.
  void noteTravel(Real distance) { travel_ = distance; }
  // Nodes may have gone anywhere: the next needsRebuild() looks at all of them.
  void noteAnyTravel() { moved_ = unknown; }
  void rebuild(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
               int threads);

  // Nodes with candidates, ascending, and the candidates of each: nodes of other bodies,
  // and with self-contact of its own body.
  const std::vector<Index>& nodes() const { return nodes_; }
  const AdjacencyList& candidates() const { return candidates_; }

  // Bodies p < q, neither a wall, whose centres may be closer than R_p + R_q + 1.01 reach.
  const std::vector<std::pair<Index, Index>>& centerPairs() const { return center_pairs_; }

  // Bodies p <= q whose nodes may be within reach of each other (p = q: self-contact).
  const std::vector<std::pair<Index, Index>>& nearPairs() const { return near_pairs_; }

  // Rows of nodes() that belong to body p: [bodyRows(p).first, bodyRows(p).second).
  std::pair<std::size_t, std::size_t> bodyRows(const Particle& body) const;

  Offset rebuilds() const { return rebuilds_; }
  Real skin() const { return skin_; }

 private:
  using BodyPairs = std::vector<std::pair<Index, Index>>;
  void adaptSkin();
  void rebuildCenterPairs(const State& state, const std::vector<Particle>& bodies);
  BodyPairs bodyPairs(const State& state, const std::vector<Particle>& bodies, Real margin,
                      int threads);
  std::vector<Index> nodesNearOthers(const State& state, const std::vector<Particle>& bodies,
                                     const BodyPairs& pairs, Real margin, int threads) const;

  static constexpr Real unknown = std::numeric_limits<Real>::infinity();

  struct Box {
    Vec3 lower, upper;
    bool overlaps(const Box& other, Real margin) const {
      return !((other.lower.array() > upper.array() + margin).any() ||
               (lower.array() > other.upper.array() + margin).any());
    }
  };
  // Some nodes with candidates; those of nodes[k] end at ends[k].
  struct Run {
    std::vector<Index> nodes;
    std::vector<Offset> ends;
    std::vector<Index> candidates;
  };
  Box boxAround(const State& state, std::size_t begin, std::size_t end) const;
  void clusterNodes(const State& state, const std::vector<Particle>& bodies);
  void markNearNodes(const State& state, std::size_t p, std::size_t q, Real margin,
                     std::vector<std::uint8_t>& is_near) const;

  std::vector<char> self_contact_;
  Real reach_ = 0;
  Real skin_ = 0;
  bool needed_ = false;
  std::vector<Vec3> x_built_;  // positions at the last build
  std::vector<Box> boxes_;
  // Nodes of each body in clusters that are compact in the positions of the first build, and their
  // boxes: the box of a hollow body, a frame of walls, says little about where its nodes are.
  std::vector<Index> clustered_;
  std::vector<std::size_t> first_cluster_;  // of each body
  std::vector<std::size_t> cluster_start_;  // in clustered_
  std::vector<Box> cluster_boxes_;
  std::vector<Index> nodes_;
  AdjacencyList candidates_;
  std::vector<Run> runs_;
  BodyPairs center_pairs_;
  BodyPairs near_pairs_;
  Real moved_ = unknown;   // upper bound of the motion since the last build
  Real travel_ = unknown;  // and of that since the last look
  Offset looks_ = 0;       // since the last build
  Offset rebuilds_ = 0;
};

// Two bodies between which contact forces act.
inline bool mayTouch(const Particle& p, const Particle& q) {
  return p.id != q.id && !(p.is_wall && q.is_wall) && !(p.constrained && q.constrained);
}

}  // namespace peridem
