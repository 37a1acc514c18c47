// Energies of a model, and what flows in and out of them from step to step.
//
// The integrators are leapfrogs: dx = x_{n+1} - x_n = dt v_{n+1/2}, and forces that depend on the
// velocity take v_{n+1/2} at x_{n+1}. For them the kinetic energy
//     K_n = sum of 1/2 rho V v_{n-1/2} . v_{n+1/2}
// grows in a step by exactly the work  sum of 1/2 V (f_n + f_{n+1}) . dx  of all forces. The work
// of a force with a potential differs from the change of the potential by O(dt^3) per step, not at
// all where it is quadratic. So the work of the other forces is taken by the same rule, and the
// balance closes to second order in dt over a run. A bond that is found broken at x_{n+1} has done
// half of its work of that step, so that it broke in the middle: the energy it held there is that
// of fracture.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bonds.h"
#include "contact.h"
#include "deck.h"
#include "influence.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Energies [J] of the present state, per unit thickness in 2D.
struct Energies {
  Real kinetic = 0;
  Real bonds = 0;
  Real self_contact = 0;  // springs between broken neighbours
  Real contact = 0;       // springs between nodes in contact
  Real tangential = 0;    // springs of the friction with history
  Real gravity = 0;       // 0 in the reference positions

  Real sum() const { return kinetic + bonds + self_contact + contact + tangential + gravity; }
};

// Energies [J] that have flowed since the tracking began.
struct EnergyFlows {
  Real work_prescribed = 0;   // in, of prescribed motion
  Real work_forces = 0;       // in, of force sets
  Real damping = 0;           // out
  Real friction = 0;          // out, and into the springs of friction with history
  Real fracture = 0;          // out, with the bonds that broke
  Real created = 0;           // in, with the springs of bonds that broke when squeezed
  Real start = 0;             // sum of the energies when the tracking began
  Real tangential_start = 0;  // of this in the springs of friction
};

// What the energies are those of.
struct EnergyScene {
  const ModelDeck& deck;
  const State& state;
  const BondTable& bonds;
  const std::vector<Particle>& bodies;
  const std::vector<Influence>& influences;  // of each body
  const ContactForce& contact;
  std::span<const ForceSet> force_sets;
  std::span<const std::uint8_t> locked;  // bit d: direction d of a node is not integrated
  Real time;
  int threads;
};

// Energies of the state: f are the forces of these positions, v the velocities that the integrator
// keeps with them. `contact` knows the candidates of these positions.
Energies energies(const EnergyScene& scene);

// Share of each node in its body's volume times stress [J], from bonds and springs of broken ones.
std::vector<Eigen::Matrix3d> bondVirials(const EnergyScene& scene);

class EnergyTracker {
 public:
  // Force densities of the last evaluation whose work is to be told from that of the others.
  struct Forces {
    ContactParts contact;
    std::vector<Vec3> sets;
  };

  // Begins anew at the present state, whose forces of contact are `contact`.
  void begin(const EnergyScene& scene, ContactParts contact);
  void beforeStep(const EnergyScene& scene);
  ContactParts& contactParts() { return forces_.contact; }  // zero until the step adds to them
  void afterStep(const EnergyScene& scene);

  EnergyFlows flows() const { return flows_; }
  const Forces& forces() const { return forces_; }
  // Of the work of prescribed motion, that on each body [J].
  const std::vector<Real>& prescribedWorks() const { return prescribed_works_; }
  // Goes on from what flows(), forces() and prescribedWorks() were.
  void restore(const EnergyScene& scene, const EnergyFlows& flows, Forces forces,
               std::vector<Real> prescribed_works);

 private:
  // The nodes [begin, end) of driven_ of a body.
  struct DrivenRange {
    std::size_t body, begin, end;
  };

  void addWork(const EnergyScene& scene);
  void addPrescribedWork(const EnergyScene& scene);
  void addFracture(const EnergyScene& scene);
  void setForceSets(const EnergyScene& scene);
  void noteFlags(const EnergyScene& scene);

  EnergyFlows flows_;
  Forces forces_, forces_before_;
  std::vector<Vec3> u_before_;
  std::vector<Vec3> v_before_, f_before_;  // of driven nodes
  std::vector<Real> prescribed_works_;     // of each body
  std::vector<Index> driven_;              // nodes with prescribed motion, body by body
  std::vector<DrivenRange> driven_ranges_;
  std::vector<std::uint8_t> intact_;  // flags before the step
};

}  // namespace peridem
