// RNPBond: regularised nonlinear bond with a softening potential (Lipton 2014, 2016).
#pragma once

#include <cmath>

#include "../fuzzy.h"

namespace peridem {

struct Rnp {
  static constexpr bool state_based = false;
  Real four_c_beta_by_f;  // 4 C beta / F, F = eps^(d+1) omega_d, omega_d = 2, pi, 4 pi/3
  Real beta;
  Real sc_times_sqrt_r;  // sqrt(1 / (2 beta))
  Real break_factor;     // Check_Sc_Factor; infinity when fracture is reversible
  bool tension_only;

  // s = (u_j - u_i) . xi / r^2; the force acts along the reference bond
  static Real stretch(Real r, Real /*deformed_length*/, Real du_dot_xi) {
    return du_dot_xi / (r * r);
  }
  static constexpr bool along_deformed_bond = false;

  // f = J 4 s C beta exp(-beta r s^2) / F, times V
  Real force(Real r, Real s) const { return four_c_beta_by_f * s * std::exp(-beta * r * s * s); }

  Real criticalStretch(Real r) const { return sc_times_sqrt_r / std::sqrt(r); }
  bool breaks(Real r, Real s) const {
    return fuzzyGreater(tension_only ? s : std::abs(s), break_factor * criticalStretch(r));
  }
  Real damage(Real r, Real s) const { return std::abs(s) / criticalStretch(r); }
};

}  // namespace peridem
