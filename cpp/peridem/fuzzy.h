// Comparison with a relative tolerance of 1e-5, as in the original program. It is used where a
// threshold decides physics (bond breaking, contact, partial volumes), so that the events of a run
// are those of the original.
#pragma once

#include <algorithm>
#include <cmath>

#include "real.h"

namespace peridem {

inline constexpr Real fuzzy_tolerance = 1e-5;

inline bool fuzzyGreater(Real a, Real b) {
  return (a - b) > fuzzy_tolerance * std::max(std::abs(a), std::abs(b));
}

inline bool fuzzyLess(Real a, Real b) {
  return fuzzyGreater(b, a);
}

}  // namespace peridem
