// What the laws and the interface of the force kernels need of eight lanes; the lanes themselves
// are in simd.h.
#pragma once

#include <cmath>
#include <cstdint>

#define PERIDEM_INLINE [[gnu::always_inline]] inline
#define PERIDEM_LAMBDA __attribute__((always_inline))

namespace peridem {

inline constexpr int lanes = 8;
using LaneBits = std::uint8_t;  // bit k stands for lane k

PERIDEM_INLINE double magnitude(double a) {
  return std::fabs(a);
}
PERIDEM_INLINE double squareRoot(double a) {
  return std::sqrt(a);
}
PERIDEM_INLINE double exponential(double a) {
  return std::exp(a);
}
PERIDEM_INLINE double larger(double a, double b) {
  return a < b ? b : a;
}

}  // namespace peridem
