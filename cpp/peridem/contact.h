// Contact between bodies: normal force and friction node to node, damping between centres.
#pragma once

#include <utility>
#include <vector>

#include "contact_search.h"
#include "deck.h"
#include "laws/contact.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Nodes in contact below which waking threads costs more than it saves.
inline constexpr std::size_t contact_rows_worth_threads = 2000;

// Elongation [m] of the tangential spring that pulls node i towards where node j slips.
struct SlipRecord {
  Index i = 0;
  Index j = 0;
  Vec3 elongation = Vec3::Zero();
};

class ContactForce {
 public:
  ContactForce() = default;
  ContactForce(const ModelDeck& deck, const std::vector<Particle>& bodies);

  // Brings the candidate lists up to date.
  void updateSearch(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
                    int threads);

  // Adds the contact forces to f (a force density per node). Springs of the friction with history
  // stretch by the slip during `slip_time`; 0 leaves them as they are.
  void compute(const State& state, const std::vector<Particle>& bodies, Real slip_time,
               std::vector<Vec3>& f, int threads);

  // Pairs of nodes i < j closer than their contact radius.
  std::vector<std::pair<Index, Index>> touching(const State& state,
                                                const std::vector<Particle>& bodies) const;

  // Tangential springs that are stretched, in the order of nodes i and j.
  std::vector<SlipRecord> slips() const;
  void setSlips(const std::vector<SlipRecord>& records);

  // Upper bound of the motion of any node since the last updateSearch().
  void noteTravel(Real distance) { search_.noteTravel(distance); }
  void noteAnyTravel() { search_.noteAnyTravel(); }

  const ContactLaw& law(const Particle& p, const Particle& q) const {
    return laws_[static_cast<std::size_t>(p.zone) * n_zones_ + static_cast<std::size_t>(q.zone)];
  }
  Real largestRadius() const { return largest_radius_; }
  const ContactSearch& search() const { return search_; }

 private:
  // A damping force on body `body` because of wall node `node`.
  struct WallDamping {
    Index body;
    Index node;
    Vec3 force;
  };

  bool takesContactForce(const State& state, const Particle& body, std::size_t node) const;
  void addNodeForces(const State& state, const std::vector<Particle>& bodies, Real slip_time,
                     std::vector<Vec3>& f, int threads);
  void addCenterDamping(const State& state, const std::vector<Particle>& bodies,
                        std::vector<Vec3>& f) const;
  void dampPair(const State& state, const Particle& p, const Particle& q,
                std::vector<Vec3>& f) const;
  void addWallDamping(const State& state, const std::vector<Particle>& bodies, std::vector<Vec3>& f,
                      int threads);
  void dampAgainstWalls(const State& state, const std::vector<Particle>& bodies,
                        const Particle& body, std::vector<WallDamping>& found) const;
  bool nodesTouch(const State& state, const std::vector<Particle>& bodies, const Particle& p,
                  const Particle& q) const;
  Real dampedVolume(const Particle& body) const;

  int dimension_ = 2;
  Compatibility compatibility_ = Compatibility::corrected;
  bool any_damping_ = false;
  bool any_wall_ = false;
  bool any_history_ = false;
  Real largest_radius_ = 0;
  std::size_t n_zones_ = 0;
  std::vector<ContactLaw> laws_;
  ContactSearch search_;
  std::vector<Vec3> slips_;                             // per candidate; empty without history
  std::vector<std::vector<WallDamping>> wall_damping_;  // per body, reused
};

}  // namespace peridem
