// Contact between bodies: normal force and friction node to node, damping between centres.
#pragma once

#include <vector>

#include "contact_search.h"
#include "deck.h"
#include "laws/contact.h"
#include "particle.h"
#include "state.h"

namespace peridem {

class ContactForce {
 public:
  ContactForce() = default;
  ContactForce(const ModelDeck& deck, const std::vector<Particle>& bodies);

  // Brings the candidate lists up to date; true when they were rebuilt.
  bool updateSearch(const State& state, const std::vector<Particle>& bodies, int threads) {
    return search_.update(state, bodies, threads);
  }

  // Adds the contact forces to f.
  void compute(State& state, const std::vector<Particle>& bodies, int threads);

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
  void addNodeForces(State& state, const std::vector<Particle>& bodies, int threads) const;
  void addCenterDamping(State& state, const std::vector<Particle>& bodies) const;
  void addWallDamping(State& state, const std::vector<Particle>& bodies, int threads);
  void dampAgainstWalls(const State& state, const std::vector<Particle>& bodies,
                        const Particle& body, std::vector<WallDamping>& found) const;
  bool nodesTouch(const State& state, const std::vector<Particle>& bodies, const Particle& p,
                  const Particle& q) const;
  Real dampedVolume(const Particle& body) const;

  int dimension_ = 2;
  Compatibility compatibility_ = Compatibility::corrected;
  bool any_damping_ = false;
  bool any_wall_ = false;
  Real largest_radius_ = 0;
  std::size_t n_zones_ = 0;
  std::vector<ContactLaw> laws_;
  ContactSearch search_;
  std::vector<std::vector<WallDamping>> wall_damping_;  // per body, reused
};

}  // namespace peridem
