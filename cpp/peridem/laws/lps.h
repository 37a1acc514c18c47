// PDState: ordinary state-based linear peridynamic solid (Jha et al. 2021, eqs. 9 to 11, 14).
// T is a number or eight lanes of them; e = |y| - r is the elongation of a bond of length r.
#pragma once

#include "../fuzzy.h"
#include "../lanes.h"

namespace peridem {

struct Lps {
  static constexpr bool state_based = true;
  static constexpr bool along_deformed_bond = true;
  Real bulk_modulus;   // K [Pa]
  Real shear_modulus;  // G [Pa]
  Real s0;             // critical stretch
  Real break_limit;    // |s| above which a bond breaks; see breakLimit()
  bool tension_only;

  // What the force is proportional to, from J and 1/r.
  template <class T>
  PERIDEM_INLINE static T weight(T J, T) {
    return J;
  }

  // (10) theta = 3/m sum of r e J V
  Real dilatationFactor(Real m) const { return m > 0 ? 3 / m : 0; }

  // Factors of (9) at a node: a = 3K/m - 15G/(3m) multiplies theta r, b = 15G/m multiplies e.
  Real b(Real m) const { return m > 0 ? 15 * shear_modulus / m : 0; }
  Real a(Real m) const { return m > 0 ? 3 * bulk_modulus / m - b(m) / 3 : 0; }

  // (9) T + T' = J(r/eps) [ r (theta a + theta' a') + e (b + b') ], along the deformed bond;
  // J_r and J_e are J r and J e.
  template <class T>
  PERIDEM_INLINE static T force(T J_r, T J_e, T theta_a_sum, T b_sum) {
    return multiplyAdd(J_r, theta_a_sum, J_e * b_sum);
  }

  // Positive where the bond breaks: |s| r - s_limit r
  template <class T>
  PERIDEM_INLINE T excess(T r, T e) const {
    return (tension_only ? e : magnitude(e)) - break_limit * r;
  }

  // (14) |s| / s0
  template <class T>
  PERIDEM_INLINE T damage(T r, T e) const {
    return magnitude(e) / (s0 * r);
  }
};

// The test of the original, |s| > s0 + 1e-10 in its fuzzy comparison, solved for |s|:
// |s| - b > 1e-5 |s| with b = s0 + 1e-10.
inline Real breakLimit(Real s0) {
  return (s0 + 1e-10) / (1 - fuzzy_tolerance);
}

}  // namespace peridem
