// What the laws and the interface of the force kernels need of eight lanes; the lanes themselves
// are in simd.h.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#define PERIDEM_INLINE [[gnu::always_inline]] inline
#define PERIDEM_LAMBDA __attribute__((always_inline))

namespace peridem {

inline constexpr int lanes = 8;
using LaneBits = std::uint8_t;  // bit k stands for lane k
inline constexpr unsigned all_lanes = 0xff;

// The bonds of one node, `row`, with up to eight nodes that follow each other in a block, a tile.
struct BondGroup {
  std::uint32_t row : 24;    // place of the node
  std::uint32_t exists : 8;  // lanes that carry a bond
};

// The groups of one tile of own nodes.
struct TileBonds {
  std::uint32_t tile;   // first place of the eight
  std::uint32_t begin;  // groups [begin, halo): rows are own nodes, the bond acts on both ends
  std::uint32_t halo;   // groups [halo, end): rows are nodes of other blocks of the body
  std::uint32_t end;
};

// A table has numbers of the bonds of each group, as the law wants them: eight lengths and eight
// weights, or the weights alone. 1 and 0 in lanes without a bond.
enum class TableOf { lengths_and_weights, weights };
inline constexpr std::size_t numbersOf(TableOf table) {
  return table == TableOf::weights ? lanes : 2 * lanes;
}

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

PERIDEM_INLINE double multiplyAdd(double a, double b, double c) {
  return a * b + c;
}

}  // namespace peridem
