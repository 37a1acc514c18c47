// Contact between two nodes and between two bodies (Jha et al. 2021, section 2.3).
#pragma once

#include <cmath>

#include "../real.h"

namespace peridem {

// Constants of a pair of zones.
struct ContactLaw {
  Real radius = 0;          // Rc [m]
  Real kn = 0;              // normal stiffness [N/m^7]
  Real friction = 0;        // mu, with the sign of the mode: see normalForce
  Real damping_factor = 0;  // betan, without sqrt(kappa Rc meq)
  Real kappa = 0;           // 2 K K' / (K + K') [Pa]
  bool damping_by_nodes = false;
  bool node_damping = false;
  bool friction_history = false;
  bool self_contact = false;
  Real kt = 0;  // tangential stiffness of the friction with history [N/m^7]

  // (17) F = Kn (|z' - z| - Rc) V'   per unit volume, at most 0; along e_n from z to z'
  Real normalForce(Real distance, Real volume) const { return kn * (distance - radius) * volume; }

  // Cundall, Strack 1979: the spring of elongation xi_t pulls with kt |xi_t| V', at most mu |F|.
  // Factor by which the elongation is cut back where it would pull harder.
  Real slipCap(Real elongation, Real normal, Real volume) const {
    const Real pull = kt * elongation * volume;
    const Real limit = std::abs(friction * normal);
    return pull > limit ? limit / pull : 1;
  }

  // (23, 28) beta = betan sqrt(kappa Rc meq), betan = -2 C ln(eps_n) / sqrt(pi^2 + ln(eps_n)^2)
  Real damping(Real equivalent_mass) const {
    return damping_factor * std::sqrt(kappa * radius * equivalent_mass);
  }
};

inline Real dampingFactor(Real beta_n_factor, Real epsilon) {
  const Real log_eps = std::log(epsilon);
  return beta_n_factor * (-2 * log_eps / std::sqrt(pi * pi + log_eps * log_eps));
}

// 2ab / (a + b): kappa_eff (25), m_eq (24, 29)
inline Real harmonicMean(Real a, Real b) {
  return 2 * a * b / (a + b);
}

}  // namespace peridem
