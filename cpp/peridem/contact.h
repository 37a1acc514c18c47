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

// Force densities of friction and of all dampers on every node.
struct ContactParts {
  std::vector<Vec3> friction, damping;
};

// What two nodes i < j in contact do to each other: forces [N] on i, those on j are opposite.
struct NodeContact {
  Index i = 0;
  Index j = 0;
  Vec3 normal = Vec3::Zero();
  Vec3 friction = Vec3::Zero();
  Vec3 damping = Vec3::Zero();
};

// Damping between two bodies that acts on their nodes all alike: forces [N] on either of them.
struct BodyDamping {
  Index p = 0;
  Index q = 0;
  Vec3 on_p = Vec3::Zero();
  Vec3 on_q = Vec3::Zero();
};

// Energies [J] of the springs between nodes in contact.
struct ContactEnergy {
  Real normal = 0;
  Real tangential = 0;  // of the friction with history
};

class ContactForce {
 public:
  ContactForce() = default;
  ContactForce(const ModelDeck& deck, const std::vector<Particle>& bodies);

  // Brings the candidate lists up to date.
  void updateSearch(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
                    int threads);

  // Adds the contact forces to f (a force density per node). Springs of the friction with history
  // stretch by the slip during `slip_time`; 0 leaves them as they are. `parts`, if given, are added
  // to as well.
  void compute(const State& state, const std::vector<Particle>& bodies, Real slip_time,
               std::vector<Vec3>& f, int threads, ContactParts* parts = nullptr);

  // The contacts of the current state, in the order of nodes and bodies (contact_network.cpp).
  std::vector<NodeContact> nodeContacts(const State& state,
                                        const std::vector<Particle>& bodies) const;
  std::vector<BodyDamping> bodyDampings(const State& state,
                                        const std::vector<Particle>& bodies) const;
  ContactEnergy energy(const State& state, const std::vector<Particle>& bodies) const;

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
    return lawOfZones(p.zone, q.zone);
  }
  const ContactSearch& search() const { return search_; }

 private:
  // A damping force on a body because of wall node `node`.
  struct WallDamping {
    Index node;
    Vec3 force;
  };

  const ContactLaw& lawOfZones(Index p, Index q) const {
    return laws_[static_cast<std::size_t>(p) * n_zones_ + static_cast<std::size_t>(q)];
  }
  bool takesContactForce(const State& state, const std::vector<Particle>& bodies,
                         std::size_t node) const;
  template <bool split>
  void addNodeForces(const State& state, const std::vector<Particle>& bodies, Real slip_time,
                     std::vector<Vec3>& f, int threads, ContactParts* parts);
  // visit(i, j, k, law, dx, distance) for every candidate k, node j, in contact with node i.
  template <class Visit>
  void forEachContact(const State& state, const std::vector<Particle>& bodies, Visit visit) const;
  void listDamped(const std::vector<Particle>& bodies);
  bool areClose(const State& state, const std::vector<Particle>& bodies, const Particle& p,
                const Particle& q) const;
  void addDamping(const State& state, const std::vector<Particle>& bodies, std::vector<Vec3>& f,
                  int threads, ContactParts* parts);
  // Force densities on either body; zero when they part.
  std::pair<Vec3, Vec3> centerDamping(const State& state, const Particle& p,
                                      const Particle& q) const;
  void dampAgainstWalls(const State& state, const std::vector<Particle>& bodies,
                        const Particle& body, std::vector<WallDamping>& found) const;
  void addWallReactions(const State& state, const std::vector<Particle>& bodies,
                        std::vector<Vec3>& f, ContactParts* parts) const;
  bool nodesTouch(const State& state, const std::vector<Particle>& bodies, const Particle& p,
                  const Particle& q) const;
  Real dampedVolume(const Particle& body) const;

  int dimension_ = 2;
  Compatibility compatibility_ = Compatibility::corrected;
  bool any_damping_ = false;
  bool any_history_ = false;
  Real largest_radius_ = 0;
  std::size_t n_zones_ = 0;
  std::vector<ContactLaw> laws_;
  ContactSearch search_;
  std::vector<Vec3> slips_;  // per candidate; empty without history
  // Since the last rebuild of the candidates: particles that may damp each other, and those near
  // walls. The forces of a step are kept in arrays that are reused.
  std::vector<std::pair<Index, Index>> damped_pairs_;
  std::vector<Index> damped_by_walls_;
  std::vector<std::pair<Vec3, Vec3>> pair_damping_;     // of each pair
  std::vector<std::vector<WallDamping>> wall_damping_;  // of each body
  std::vector<Vec3> body_damping_;                      // of each body, all together
};

}  // namespace peridem
