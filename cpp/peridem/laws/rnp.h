// RNPBond: regularised nonlinear bond with a softening potential (Lipton 2014, 2016).
// T is a number or eight lanes of them; q = 1 / r, s = (u_j - u_i) . xi / r^2 = e / r.
#pragma once

#include "../fuzzy.h"
#include "../lanes.h"

namespace peridem {

struct Rnp {
  static constexpr bool state_based = false;
  static constexpr bool along_deformed_bond = false;
  Real four_c_beta_by_f;  // 4 C beta / F, F = eps^(d+1) omega_d, omega_d = 2, pi, 4 pi/3
  Real beta;
  Real sc_times_sqrt_r;  // sqrt(1 / (2 beta))
  Real break_factor;     // Check_Sc_Factor; infinity when fracture is reversible
  bool tension_only;

  // What the force is proportional to, from J and 1/r.
  template <class T>
  PERIDEM_INLINE static T weight(T J, T) {
    return J;
  }
  // f = w 4 s C beta exp(-beta r s^2) / F, w = J, along the reference bond; e = s r
  template <class T>
  PERIDEM_INLINE T force(T e, T s) const {
    return four_c_beta_by_f * s * exponential(-beta * (s * e));
  }

  // |s| > factor sc, sc = sqrt(1 / (2 beta r)), in the fuzzy comparison solved for |s|; squared
  template <class T>
  PERIDEM_INLINE T excess(T q, T s) const {
    const Real limit = break_factor * sc_times_sqrt_r / (1 - fuzzy_tolerance);
    return (tension_only ? s : magnitude(s)) * magnitude(s) - limit * limit * q;
  }

  // |s| / sc
  template <class T>
  PERIDEM_INLINE T damage(T q, T s) const {
    return magnitude(s) / (sc_times_sqrt_r * squareRoot(q));
  }
};

}  // namespace peridem
