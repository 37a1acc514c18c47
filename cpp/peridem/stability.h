// How large a time step the explicit integration bears.
#pragma once

#include <vector>

#include "bonds.h"
#include "contact.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Estimates of the largest stable time step [s], 2 / omega: omega^2 bounded by the row sums of the
// linearised bond forces (Gershgorin), that of two nodes in contact, and that of two nodes of a
// body that the spring between the ends of a broken bond keeps apart.
struct StableTimeStep {
  Real bonds;
  Real contact;
  Real self_contact;
};

// `influences[body]`: influence function of each body.
StableTimeStep stableTimeStep(const State& state, const BondTable& bonds,
                              const std::vector<Influence>& influences,
                              const std::vector<Particle>& bodies, const ContactForce& contact,
                              int threads);

}  // namespace peridem
