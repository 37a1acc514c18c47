// The model: bodies, their state, and the order in which a time step goes.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bonds.h"
#include "contact.h"
#include "deck.h"
#include "energy.h"
#include "external.h"
#include "particle.h"
#include "peridynamic.h"
#include "stability.h"
#include "state.h"

namespace peridem {

// Wall-clock seconds spent in each stage since the model was built.
struct Timings {
  double setup = 0;
  double peridynamic = 0;  // with the motion of the nodes in the same loop and gravity
  double contact_search = 0;
  double contact = 0;
  double external = 0;
  double integration = 0;  // the second half of velocity Verlet
};

// Called after a step; returns true to stop.
using StepObserver = std::function<bool()>;

class DEMModel {
 public:
  // Places the bodies: reference positions, volumes, mesh sizes. Throws InputError.
  DEMModel(ModelDeck deck, int threads);

  // Loads, to be added before init(). Nodes are global.
  void addDisplacementSet(DisplacementSet set);
  void addForceSet(ForceSet set);
  void addInitialVelocity(InitialVelocity velocity);

  // Bonds, laws, contact.
  void init();

  // Replaces the duration of the deck, and so the time step; before the first step.
  void setDuration(Real final_time, Offset time_steps);

  // init() and integrate() to the last step of the deck.
  void run(const StepObserver& observer = {});

  // Takes n steps, or fewer when the observer says stop. The first call applies the initial
  // condition and computes the forces at t = 0. Returns the number of steps taken.
  Offset integrate(Offset n, const StepObserver& observer = {});

  // Initial velocity, prescribed motion and forces at t = 0; done once.
  void start();
  void step();  // one step, whatever has been written to the arrays

  // All forces at the current state.
  void computeForces();
  // Their parts: each sets or adds to f. `slip_time`: time during which the springs of the friction
  // with history have stretched since the last evaluation; the step passes dt.
  void computePeridynamicForces();
  void computeContactForces(Real slip_time = 0);
  void computeExternalForces();
  // `dt`: time since the last call. Returns how far a node went in one direction at most.
  Real computeExternalDisplacementBC(Real dt = 0);

  const ModelDeck& deck() const { return deck_; }
  State& state() { return state_; }
  const State& state() const { return state_; }
  const std::vector<Particle>& particles() const { return particles_; }
  BondTable& bonds() { return bonds_; }
  const BondTable& bonds() const { return bonds_; }
  const ContactForce& contact() const { return contact_; }

  // Contact and damping forces alone, a force density per node, at the current state.
  std::vector<Vec3> contactForces();

  // Pairs of nodes i < j of different bodies in contact at the current state.
  std::vector<std::pair<Index, Index>> touchingNodes();

  // What touches at the current state, and with which forces.
  std::vector<NodeContact> nodeContacts();
  std::vector<BodyDamping> bodyDampings();

  // Energies of the current state, and what has flowed in and out of them since trackEnergy(true):
  // every step takes notes of it from then on, from the first forces on if none are there yet.
  void trackEnergy(bool on);
  bool tracksEnergy() const { return tracks_energy_; }
  Energies energies();
  const EnergyTracker& energyTracker() const { return energy_; }
  void restoreEnergy(const EnergyFlows& flows, EnergyTracker::Forces forces,
                     std::vector<Real> prescribed_works);
  std::vector<Eigen::Matrix3d> bondVirials();  // see bond_energy.h

  // Damage Z of the current state into the state; it is renewed whenever integrate() returns.
  void computeDamage();

  // Sets the flag of every bond of the table; both directions of a bond must agree.
  void setIntact(std::span<const std::uint8_t> intact);

  // r and w of every bond of the table; see bondConstants().
  std::vector<BondConstants> bondConstants() const;

  const std::string& instructionSet() const { return peridynamic_.instructionSet(); }

  // Goes on from a saved state: the arrays are set by the caller, these are the rest.
  void restore(Offset n, Real time, const std::vector<SlipRecord>& slips);
  const Timings& timings() const { return timings_; }
  Real time() const { return time_; }
  Real timeStep() const { return deck_.timeStep(); }
  Offset n() const { return n_; }
  bool started() const { return started_; }
  int threads() const { return threads_; }

  // See stability.h.
  StableTimeStep stableTimeStep() const;

  // Bytes held by the arrays of nodes and bonds.
  std::size_t memoryBytes() const;

 private:
  void advance();  // one step after another: no node has moved in between
  void integrateCD();
  void integrateVerlet();
  void moveAndComputeForces(Real k, Real dt);
  void addForceSets();
  EnergyScene energyScene() const;
  void beginEnergy();
  void lookAtContacts();
  void placeBody(const BodyDeck& body, Index id, const std::vector<Real>& mesh_volumes);
  void lockDirections();
  void evaluateLoads(Real t);
  Real speedLimit() const;
  [[noreturn]] void reportRunaway(Offset step, Real time) const;

  ModelDeck deck_;
  int threads_ = 1;
  State state_;
  std::vector<Particle> particles_;
  BondTable bonds_;
  PeridynamicForce peridynamic_;
  ContactForce contact_;
  std::vector<Influence> influences_;  // of each body
  std::vector<DisplacementSet> displacement_sets_;
  std::vector<ForceSet> force_sets_;
  std::vector<InitialVelocity> initial_velocities_;
  std::vector<std::uint8_t> locked_;         // bit d set: direction d of the node is not integrated
  std::vector<std::uint8_t> locked_bodies_;  // 1: some node of the body is
  EnergyTracker energy_;
  bool tracks_energy_ = false;
  Timings timings_;
  Real speed_limit_ = 0;  // |v| beyond which the run has diverged
  Real time_ = 0;
  Real loads_time_ = -std::numeric_limits<Real>::infinity();  // when functions were evaluated last
  Offset n_ = 0;
  bool initialized_ = false;
  bool started_ = false;
};

}  // namespace peridem
