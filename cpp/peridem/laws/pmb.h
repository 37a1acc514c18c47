// PMBBond and PDElasticBond: prototype microelastic bonds; the latter never break.
#pragma once

#include "../lanes.h"
#include "../real.h"

namespace peridem {

struct Pmb {
  static constexpr bool state_based = false;
  static constexpr bool along_deformed_bond = true;
  Real c;            // micromodulus
  Real s0;           // critical stretch; 0: the law has no fracture, Z = 0
  Real break_limit;  // infinity: the bond never breaks (PDElasticBond)
  bool tension_only;

  // What the force is proportional to, from J and 1/r.
  template <class T>
  PERIDEM_INLINE static T weight(T J, T inverse_r) {
    return J * inverse_r;
  }

  // f = w c e, w = J / r: f = J c s, s = e / r, e = |y| - r
  template <class T>
  PERIDEM_INLINE T force(T e, T) const {
    return c * e;
  }

  template <class T>
  PERIDEM_INLINE T excess(T r, T e) const {
    return (tension_only ? e : magnitude(e)) - break_limit * r;
  }

  template <class T>
  PERIDEM_INLINE T damage(T r, T e) const {
    return s0 > 0 ? magnitude(e) / (s0 * r) : T{};
  }
};

}  // namespace peridem
