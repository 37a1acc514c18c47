#include "model.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "errors.h"
#include "integrator.h"
#include "memory.h"
#include "stopwatch.h"

namespace peridem {

void DEMModel::start() {
  if (started_) return;
  init();
  lockDirections();
  applyInitialVelocity(state_, particles_, initial_velocities_);
  computeExternalDisplacementBC();
  computeForces();
  computeDamage();
  started_ = true;
  if (tracks_energy_) beginEnergy();
}

void DEMModel::run(const StepObserver& observer) {
  init();
  integrate(deck_.time_steps - n_, observer);
}

Offset DEMModel::integrate(Offset n, const StepObserver& observer) {
  start();
  contact_.noteAnyTravel();  // the arrays may have been written since the last step
  Offset taken = 0;
  while (taken < n) {
    advance();
    ++taken;
    if (observer && observer()) break;
  }
  computeDamage();
  return taken;
}

void DEMModel::step() {
  start();
  contact_.noteAnyTravel();
  advance();
}

void DEMModel::advance() {
  evaluateLoads(time_ + timeStep());  // may throw: nothing of the step has happened yet
  if (tracks_energy_) energy_.beforeStep(energyScene());
  if (deck_.time_scheme == TimeScheme::velocity_verlet)
    integrateVerlet();
  else
    integrateCD();
  if (tracks_energy_) energy_.afterStep(energyScene());
}

// v += k f / rho, u += dt v, x += dt v, t += dt, the prescribed motion, then the forces. The bodies
// move one by one, in the loop over the forces inside of them.
void DEMModel::moveAndComputeForces(Real k, Real dt) {
  ++n_;
  time_ += dt;
  const Real prescribed = computeExternalDisplacementBC(dt);
  Kick kicked;
  {
    const Stopwatch watch(timings_.peridynamic);
    kicked = peridynamic_.moveAndCompute({k, dt, speed_limit_, &locked_, &locked_bodies_}, state_,
                                         bonds_, particles_, deck_.gravity, threads_);
  }
  if (!kicked.within_limit || !(prescribed < speed_limit_ * dt)) reportRunaway(n_, time_);
  contact_.noteTravel(std::sqrt(deck_.dimension) * dt * kicked.fastest +
                      std::sqrt(3.0) * prescribed);
  computeContactForces(dt);
  addForceSets();
}

void DEMModel::integrateCD() {
  moveAndComputeForces(timeStep(), timeStep());
}

void DEMModel::integrateVerlet() {
  const Real dt = timeStep();
  moveAndComputeForces(dt / 2, dt);
  const Stopwatch watch(timings_.integration);
  if (!kick(state_, locked_, dt / 2, speed_limit_, deck_.dimension, threads_).within_limit)
    reportRunaway(n_, time_);
}

void DEMModel::computeForces() {
  init();
  evaluateLoads(time_);
  {
    const Stopwatch watch(timings_.peridynamic);
    peridynamic_.compute(state_, bonds_, particles_, deck_.gravity, threads_);
  }
  computeContactForces();
  addForceSets();
}

void DEMModel::computePeridynamicForces() {
  init();
  const Stopwatch watch(timings_.peridynamic);
  peridynamic_.compute(state_, bonds_, particles_, Vec3::Zero(), threads_);
  peridynamic_.computeDamage(state_, threads_);
}

void DEMModel::computeContactForces(Real slip_time) {
  {
    const Stopwatch watch(timings_.contact_search);
    contact_.updateSearch(state_, bonds_, particles_, threads_);
  }
  const Stopwatch watch(timings_.contact);
  ContactParts* parts = tracks_energy_ && slip_time > 0 ? &energy_.contactParts() : nullptr;
  contact_.compute(state_, particles_, slip_time, state_.f, threads_, parts);
}

std::vector<Vec3> DEMModel::contactForces() {
  init();
  contact_.updateSearch(state_, bonds_, particles_, threads_);
  std::vector<Vec3> f(state_.size(), Vec3::Zero());
  contact_.compute(state_, particles_, 0, f, threads_);
  return f;
}

void DEMModel::computeDamage() {
  const Stopwatch watch(timings_.peridynamic);
  peridynamic_.computeDamage(state_, threads_);
}

void DEMModel::setIntact(std::span<const std::uint8_t> intact) {
  init();
  if (intact.size() != bonds_.size())
    throw InputError("intact: " + std::to_string(intact.size()) + " flags for " +
                     std::to_string(bonds_.size()) + " bonds");
  for (Index i = 0; i < static_cast<Index>(state_.size()); ++i)
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k)
      if (intact[k] != intact[bonds_.find(bonds_.neighbors[k], i)])
        throw InputError("intact: the two directions of bond (" + std::to_string(i) + ", " +
                         std::to_string(bonds_.neighbors[k]) + ") differ");
  std::copy(intact.begin(), intact.end(), bonds_.intact.begin());
  peridynamic_.importFlags(bonds_, particles_);
}

std::vector<BondConstants> DEMModel::bondConstants() const {
  std::vector<BondConstants> constants;
  if (!initialized_) return constants;
  constants.reserve(bonds_.size());
  for (const Particle& body : particles_) {
    const Influence& influence = influences_[static_cast<std::size_t>(body.id)];
    for (Index i = body.start; i < body.stop; ++i)
      for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k)
        constants.push_back(
            peridem::bondConstants(state_, body, influence, i, bonds_.neighbors[k]));
  }
  return constants;
}

void DEMModel::restore(Offset n, Real time, const std::vector<SlipRecord>& slips) {
  init();
  lockDirections();
  contact_.updateSearch(state_, bonds_, particles_, threads_);
  contact_.setSlips(slips);
  n_ = n;
  time_ = time;
  started_ = true;
  if (tracks_energy_) beginEnergy();
}

void DEMModel::computeExternalForces() {
  evaluateLoads(time_);
  const Stopwatch watch(timings_.external);
  addExternalForces(state_, deck_.gravity, force_sets_, time_, threads_);
}

// Of the functions evaluated before anything changed.
void DEMModel::addForceSets() {
  const Stopwatch watch(timings_.external);
  addExternalForces(state_, Vec3::Zero(), force_sets_, time_, threads_);
}

Real DEMModel::computeExternalDisplacementBC(Real dt) {
  evaluateLoads(time_);
  const Stopwatch watch(timings_.external);
  return prescribeDisplacements(state_, displacement_sets_, time_, deck_.compatibility, dt);
}

// Once for each time, so once per step. A function that throws leaves the state as it is.
void DEMModel::evaluateLoads(Real t) {
  if (t == loads_time_) return;
  const Stopwatch watch(timings_.external);
  loads_time_ = -std::numeric_limits<Real>::infinity();
  evaluateFunctions(std::span<DisplacementSet>(displacement_sets_), t);
  evaluateFunctions(std::span<ForceSet>(force_sets_), t);
  loads_time_ = t;
}

void DEMModel::reportRunaway(Offset step, Real time) const {
  enum class Look { free_directions, all_directions };
  const auto first_beyond = [&](Look look) {
    std::size_t i = 0;
    for (; i < state_.size(); ++i)
      for (int d = 0; d < deck_.dimension; ++d) {
        const bool looked_at = look == Look::all_directions || !((locked_[i] >> d) & 1);
        if (looked_at && !(std::abs(state_.v[i][d]) < speed_limit_)) return i;
      }
    return i;
  };
  // A fast prescribed node is named only when no free one is beyond the limit.
  std::size_t i = first_beyond(Look::free_directions);
  if (i == state_.size()) i = first_beyond(Look::all_directions);
  i = std::min(i, state_.size() - 1);
  const Particle& body = particles_[static_cast<std::size_t>(state_.particle_id[i])];
  std::ostringstream text;
  text << "step " << step << " (t = " << time << " s): body " << body.id << ", node "
       << static_cast<Index>(i) - body.start << ": speed = " << state_.v[i].norm()
       << " m/s: must be finite and below " << speed_limit_
       << " m/s (one horizon in a step); use a smaller time step (dt = " << timeStep()
       << " s), or check loads, stiffnesses and overlapping bodies";
  throw NumericalError(text.str());
}

StableTimeStep DEMModel::stableTimeStep() const {
  if (!initialized_) throw InputError("stable time step: call init() first");
  return peridem::stableTimeStep(state_, bonds_, influences_, particles_, contact_, threads_);
}

std::size_t DEMModel::memoryBytes() const {
  const MemoryCosts costs;
  return state_.size() * costs.node + bonds_.size() * costs.bond + peridynamic_.bytes();
}

}  // namespace peridem
