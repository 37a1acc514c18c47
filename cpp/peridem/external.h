// Loads: gravity, force sets, prescribed displacements, initial velocity.
#pragma once

#include <span>
#include <vector>

#include "deck.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Evaluates the functions from outside of some sets at time t.
void evaluateFunctions(std::span<DisplacementSet> sets, Real t);
void evaluateFunctions(std::span<ForceSet> sets, Real t);

// Factor in time of a force set, without the amplitude.
Real forceTimeFactor(const TimeFunction& function, Real t);

// Adds the force sets to a force density per node.
void addForceSets(std::vector<Vec3>& f, std::span<const ForceSet> sets, Real t);

// Adds rho g on every node and the force sets.
void addExternalForces(State& state, const Vec3& gravity, std::span<const ForceSet> sets, Real t,
                       int threads);

// Sets u, v and x of the prescribed directions at time t, `dt` after they were set last (0 at the
// start). Returns the longest way a node went in one direction.
Real prescribeDisplacements(State& state, std::span<const DisplacementSet> sets, Real t,
                            Compatibility mode, Real dt = 0);

void applyInitialVelocity(State& state, const std::vector<Particle>& bodies,
                          std::span<const InitialVelocity> velocities);

// Throws InputError when the set names nodes that do not exist or lacks parameters.
void validate(const DisplacementSet& set, std::size_t n_nodes);
void validate(const ForceSet& set, std::size_t n_nodes);

}  // namespace peridem
