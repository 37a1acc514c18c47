// Eight lanes of double precision, on top of the vector extensions of GCC and Clang: the compiler
// maps them to one, two or four registers. Few operations need more than +, -, *, /.
//
// For the force kernels alone, which are compiled once per instruction set: include it before the
// laws, whose templates then find these functions. Everything is forced inline, so that no code of
// one set can be linked into another.
#pragma once

#include "lanes.h"

#if defined(__AVX512F__) || defined(__AVX2__)
#include <immintrin.h>
#endif

namespace peridem {

using Lanes = double __attribute__((vector_size(64)));
using LaneMask = std::int64_t __attribute__((vector_size(64)));

// Loads and stores at addresses that are multiples of 64 bytes.
PERIDEM_INLINE Lanes load(const double* p) {
  return *reinterpret_cast<const Lanes*>(p);
}
PERIDEM_INLINE void store(double* p, Lanes a) {
  *reinterpret_cast<Lanes*>(p) = a;
}
PERIDEM_INLINE Lanes broadcast(double a) {
  return Lanes{} + a;
}

PERIDEM_INLINE Lanes magnitude(Lanes a) {
  const auto bits = reinterpret_cast<LaneMask>(a) & 0x7fffffffffffffffLL;
  return reinterpret_cast<Lanes>(bits);
}

PERIDEM_INLINE Lanes larger(Lanes a, Lanes b) {
  return a < b ? b : a;
}

PERIDEM_INLINE Lanes exponential(Lanes a) {
  Lanes result = a;
  for (int k = 0; k < lanes; ++k) result[k] = std::exp(a[k]);
  return result;
}

// Bits of the lanes where a > b; false where one is NaN.
PERIDEM_INLINE LaneBits greaterBits(Lanes a, Lanes b) {
#if defined(__AVX512F__)
  return _mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), _CMP_GT_OQ);
#else
  const LaneMask mask = a > b;
#if defined(__AVX2__)
  const auto low = __builtin_shufflevector(mask, mask, 0, 1, 2, 3);
  const auto high = __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  return static_cast<LaneBits>(_mm256_movemask_pd(reinterpret_cast<__m256d>(low)) |
                               (_mm256_movemask_pd(reinterpret_cast<__m256d>(high)) << 4));
#else
  unsigned bits = 0;
  for (int k = 0; k < lanes; ++k) bits |= (mask[k] != 0 ? 1u : 0u) << k;
  return static_cast<LaneBits>(bits);
#endif
#endif
}

// a where the bit is set, 0 elsewhere (also where a is NaN).
PERIDEM_INLINE Lanes keep(LaneBits bits, Lanes a) {
#if defined(__AVX512F__)
  return reinterpret_cast<Lanes>(_mm512_maskz_mov_pd(bits, reinterpret_cast<__m512d>(a)));
#else
  const LaneMask bit = {1, 2, 4, 8, 16, 32, 64, 128};
  const LaneMask mask = ((LaneMask{} + bits) & bit) != 0;
  return reinterpret_cast<Lanes>(mask & reinterpret_cast<LaneMask>(a));
#endif
}

PERIDEM_INLINE Lanes squareRoot(Lanes a) {
#if defined(__AVX512F__)
  return reinterpret_cast<Lanes>(_mm512_sqrt_pd(reinterpret_cast<__m512d>(a)));
#elif defined(__AVX2__)
  const auto low = _mm256_sqrt_pd(__builtin_shufflevector(a, a, 0, 1, 2, 3));
  const auto high = _mm256_sqrt_pd(__builtin_shufflevector(a, a, 4, 5, 6, 7));
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
#else
  Lanes result = a;
  for (int k = 0; k < lanes; ++k) result[k] = std::sqrt(a[k]);
  return result;
#endif
}

// 1 / sqrt(a). With AVX-512 from the 14-bit estimate y: with e = 1 - a y^2,
// 1/sqrt(a) = y (1 + e/2 + 3/8 e^2 + 5/16 e^3 + ...), the rest below 1e-16.
PERIDEM_INLINE Lanes inverseSquareRoot(Lanes a) {
#if defined(__AVX512F__)
  const auto y = reinterpret_cast<Lanes>(_mm512_rsqrt14_pd(reinterpret_cast<__m512d>(a)));
  const Lanes e = 1.0 - (a * y) * y;
  const Lanes series = ((0.3125 * e + 0.375) * e + 0.5) * e;
  return y + y * series;
#else
  return 1.0 / squareRoot(a);
#endif
}

// Sum over the lanes in a fixed order.
PERIDEM_INLINE double sumOfLanes(Lanes a) {
  const double s0 = (a[0] + a[4]) + (a[2] + a[6]);
  const double s1 = (a[1] + a[5]) + (a[3] + a[7]);
  return s0 + s1;
}

PERIDEM_INLINE double largestLane(Lanes a) {
  double result = a[0];
  for (int k = 1; k < lanes; ++k) result = larger(result, a[k]);
  return result;
}

}  // namespace peridem
