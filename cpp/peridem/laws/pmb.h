// PMBBond and PDElasticBond: prototype microelastic bonds; the latter never break.
#pragma once

#include <cmath>

#include "lps.h"

namespace peridem {

struct Pmb {
  static constexpr bool state_based = false;
  Real c;            // micromodulus
  Real s0;           // critical stretch
  Real break_limit;  // infinity: the bond never breaks (PDElasticBond)
  bool tension_only;

  // s = (|y| - r) / r; the force acts along the deformed bond
  static Real stretch(Real r, Real deformed_length, Real /*du_dot_xi*/) {
    return (deformed_length - r) / r;
  }
  static constexpr bool along_deformed_bond = true;

  // f = J c s, times V
  Real force(Real /*r*/, Real s) const { return c * s; }

  bool breaks(Real /*r*/, Real s) const { return (tension_only ? s : std::abs(s)) > break_limit; }
  // |s| / s0 of the damage Z; a law without fracture has Z = 0
  Real damage(Real /*r*/, Real s) const { return s0 > 0 ? std::abs(s) / s0 : 0; }
};

}  // namespace peridem
