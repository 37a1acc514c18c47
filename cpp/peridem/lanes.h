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

// The bonds of one node with up to eight nodes that follow each other in a block.
struct BondGroup {
  std::int32_t row;   // place of the node
  std::int32_t tile;  // first place of the eight
  LaneBits exists;    // lanes that carry a bond
  LaneBits intact;    // lanes whose bond is unbroken
};

// Numbers kept for each group: the lengths r of its eight bonds, then J(r / eps) times the
// partial-volume factor. 1 and 0 in lanes without a bond.
inline constexpr int group_numbers = 2 * lanes;

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
