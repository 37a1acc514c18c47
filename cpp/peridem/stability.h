// How large a time step the explicit integration bears.
#pragma once

#include <vector>

#include "bonds.h"
#include "contact.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Estimates of the largest stable time step [s], 2 / omega: omega^2 bounded by the row sums of the
// linearised bond forces (Gershgorin), and that of two nodes in contact.
struct StableTimeStep {
  Real bonds;
  Real contact;
};

// `influences[body]`: influence function of each body.
StableTimeStep stableTimeStep(const State& state, const BondTable& bonds,
                              const std::vector<Influence>& influences,
                              const std::vector<Particle>& bodies, const ContactForce& contact,
                              int threads);

}  // namespace peridem
