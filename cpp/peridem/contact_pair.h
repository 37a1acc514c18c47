// The forces between two nodes in contact.
#pragma once

#include "laws/contact.h"
#include "state.h"

namespace peridem {

// Force densities on the first node of a pair, zero where the law has no such part.
struct PairForces {
  Vec3 normal = Vec3::Zero();
  Vec3 friction = Vec3::Zero();
  Vec3 damping = Vec3::Zero();
};

// Spring of the friction with history: stretched by the slip, turned into the tangential plane,
// cut back to the Coulomb limit. Returns the force density on i.
inline Vec3 springFriction(const ContactLaw& law, const Vec3& e_n, const Vec3& slip_velocity,
                           Real normal, Real volume, Real slip_time, Vec3& elongation) {
  elongation += slip_time * slip_velocity;
  elongation -= elongation.dot(e_n) * e_n;
  elongation *= law.slipCap(elongation.norm(), normal, volume);
  return law.kt * volume * elongation;
}

// (17) F = Kn (|x_j - x_i| - Rc) V_j <= 0,   f_i += F e_n
// (20) f_i -= mu F e_t, e_t the direction of the slip w - (w . e_n) e_n of w = v_j - v_i
// (22) f_i += beta w . e_n / V_i e_n while the nodes approach (option)      Jha et al. 2021
// `elongation`: that of the spring of the friction with history, which stretches for `slip_time`.
inline PairForces pairForces(const ContactLaw& law, const State& state, std::size_t i,
                             std::size_t j, const Vec3& dx, Real distance, Real slip_time,
                             Vec3& elongation) {
  PairForces forces;
  const Vec3 e_n = dx / distance;
  const Real normal = law.normalForce(distance, state.volume[j]);
  forces.normal = normal * e_n;
  if (law.friction == 0 && !law.node_damping) return forces;
  const Vec3 w = state.v[j] - state.v[i];
  const Real approach = w.dot(e_n);
  const Vec3 slip = w - approach * e_n;
  if (law.friction_history) {
    forces.friction =
        springFriction(law, e_n, slip, normal, state.volume[j], slip_time, elongation);
  } else if (const Real speed = slip.norm(); speed > 0) {
    forces.friction = (law.friction * normal / speed) * slip;
  }
  if (law.node_damping && approach < 0) {
    const Real mass_i = state.density[i] * state.volume[i];
    const Real mass_j = state.density[j] * state.volume[j];
    forces.damping = law.damping(harmonicMean(mass_i, mass_j)) * approach / state.volume[i] * e_n;
  }
  return forces;
}

}  // namespace peridem
