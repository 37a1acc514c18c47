// Numbers, without anything else: also for the force kernels, which include no library.
#pragma once

#include <cstdint>
#include <limits>

namespace peridem {

using Real = double;
using Index = std::int32_t;   // nodes, bodies, zones
using Offset = std::int64_t;  // positions in bond and contact lists

inline constexpr Real pi = 3.14159265358979323846;
inline constexpr Real not_given = std::numeric_limits<Real>::quiet_NaN();

inline bool isGiven(Real value) {
  return value == value;
}

}  // namespace peridem
