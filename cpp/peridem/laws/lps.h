// PDState: ordinary state-based linear peridynamic solid (Jha et al. 2021, eqs. 9 to 11).
#pragma once

#include <cmath>

#include "../fuzzy.h"

namespace peridem {

struct Lps {
  static constexpr bool state_based = true;
  Real bulk_modulus;   // K [Pa]
  Real shear_modulus;  // G [Pa]
  Real s0;             // critical stretch
  Real break_limit;    // |s| above which a bond breaks; see breakLimit()
  bool tension_only;

  // theta = 3/m sum of r e J V     (10), e = |y| - r
  Real dilatation(Real m, Real sum_r_e_w) const { return 3 / m * sum_r_e_w; }

  // Factors of (9) at a node: a = 3K/m - 15G/(3m) multiplies theta r, b = 15G/m multiplies e.
  Real a(Real m) const { return 3 * bulk_modulus / m - b(m) / 3; }
  Real b(Real m) const { return 15 * shear_modulus / m; }

  // (9) T + T' = J(r/eps) [ r (theta a + theta' a') + e (b + b') ], along the deformed bond
  static Real force(Real r, Real e, Real theta_a_sum, Real b_sum) {
    return r * theta_a_sum + e * b_sum;
  }

  bool breaks(Real s) const { return (tension_only ? s : std::abs(s)) > break_limit; }
  Real criticalStretch(Real /*r*/) const { return s0; }
};

// The test of the original, |s| > s0 + 1e-10 in its fuzzy comparison, solved for |s|:
// |s| - b > 1e-5 |s| with b = s0 + 1e-10.
inline Real breakLimit(Real s0) {
  return (s0 + 1e-10) / (1 - fuzzy_tolerance);
}

}  // namespace peridem
