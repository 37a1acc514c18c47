// RNPBond: regularised nonlinear bond with a softening potential (Lipton 2014, 2016).
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

  // f = J 4 s C beta exp(-beta r s^2) / F with s = e / r, e = (u_j - u_i) . xi / r;
  // along the reference bond
  template <class T>
  PERIDEM_INLINE T force(T r, T e) const {
    const T s = e / r;
    return four_c_beta_by_f * s * exponential(-beta * r * s * s);
  }

  // |s| > factor sc, sc = sqrt(1 / (2 beta r)), in the fuzzy comparison solved for |s|
  template <class T>
  PERIDEM_INLINE T excess(T r, T e) const {
    const Real limit = break_factor * sc_times_sqrt_r / (1 - fuzzy_tolerance);
    return (tension_only ? e : magnitude(e)) - limit * squareRoot(r);
  }

  template <class T>
  PERIDEM_INLINE T damage(T r, T e) const {
    return magnitude(e) / (sc_times_sqrt_r * squareRoot(r));
  }
};

}  // namespace peridem
