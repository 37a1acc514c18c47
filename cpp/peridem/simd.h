// Eight lanes of double precision, as one, two or four registers of the width that the instruction
// set has, on top of the vector extensions of GCC and Clang.
//
// For the force kernels alone, which are compiled once per instruction set, each into a namespace
// PERIDEM_ISA of its own: no code of one set can be linked into another. The laws find these
// functions by their arguments.
#pragma once

#include "lanes.h"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace peridem::PERIDEM_ISA {

// the same functions of numbers
using peridem::exponential;
using peridem::larger;
using peridem::magnitude;
using peridem::multiplyAdd;
using peridem::squareRoot;

#if defined(__AVX512F__)
inline constexpr int register_lanes = 8;
#elif defined(__AVX2__)
inline constexpr int register_lanes = 4;
#else
inline constexpr int register_lanes = 2;  // SSE2, NEON
#endif
inline constexpr int registers = lanes / register_lanes;

using Register = double __attribute__((vector_size(8 * register_lanes)));
using RegisterMask = std::int64_t __attribute__((vector_size(8 * register_lanes)));

struct Lanes {
  Register part[registers] = {};
};

// Loads and stores at addresses that are multiples of 64 bytes.
PERIDEM_INLINE Lanes load(const double* p) {
  Lanes a;
  for (int k = 0; k < registers; ++k) a.part[k] = reinterpret_cast<const Register*>(p)[k];
  return a;
}
PERIDEM_INLINE void store(double* p, const Lanes& a) {
  for (int k = 0; k < registers; ++k) reinterpret_cast<Register*>(p)[k] = a.part[k];
}
PERIDEM_INLINE Lanes loadUnaligned(const double* p) {
  Lanes a;
  for (int k = 0; k < registers; ++k)
    __builtin_memcpy(&a.part[k], p + register_lanes * k, sizeof(Register));
  return a;
}
PERIDEM_INLINE void storeUnaligned(double* p, const Lanes& a) {
  for (int k = 0; k < registers; ++k)
    __builtin_memcpy(p + register_lanes * k, &a.part[k], sizeof(Register));
}
PERIDEM_INLINE Lanes broadcast(double value) {
  Lanes a;
  for (int k = 0; k < registers; ++k) a.part[k] = Register{} + value;
  return a;
}

#define PERIDEM_LANES_OPERATOR(op)                                          \
  PERIDEM_INLINE Lanes operator op(const Lanes& a, const Lanes& b) {        \
    Lanes c;                                                                \
    for (int k = 0; k < registers; ++k) c.part[k] = a.part[k] op b.part[k]; \
    return c;                                                               \
  }                                                                         \
  PERIDEM_INLINE Lanes operator op(const Lanes& a, double b) {              \
    Lanes c;                                                                \
    for (int k = 0; k < registers; ++k) c.part[k] = a.part[k] op b;         \
    return c;                                                               \
  }                                                                         \
  PERIDEM_INLINE Lanes operator op(double a, const Lanes& b) {              \
    Lanes c;                                                                \
    for (int k = 0; k < registers; ++k) c.part[k] = a op b.part[k];         \
    return c;                                                               \
  }
PERIDEM_LANES_OPERATOR(+)
PERIDEM_LANES_OPERATOR(-)
PERIDEM_LANES_OPERATOR(*)
PERIDEM_LANES_OPERATOR(/)
#undef PERIDEM_LANES_OPERATOR

PERIDEM_INLINE Lanes& operator+=(Lanes& a, const Lanes& b) {
  return a = a + b;
}

// a b + c, rounded once where the processor can.
PERIDEM_INLINE Lanes multiplyAdd(const Lanes& a, const Lanes& b, const Lanes& c) {
#if defined(__AVX512F__)
  Lanes d;
  d.part[0] = _mm512_fmadd_pd(a.part[0], b.part[0], c.part[0]);
  return d;
#elif defined(__AVX2__)
  Lanes d;
  for (int k = 0; k < registers; ++k) d.part[k] = _mm256_fmadd_pd(a.part[k], b.part[k], c.part[k]);
  return d;
#elif defined(__aarch64__)
  Lanes d;
  for (int k = 0; k < registers; ++k) d.part[k] = vfmaq_f64(c.part[k], a.part[k], b.part[k]);
  return d;
#else
  return a * b + c;
#endif
}

PERIDEM_INLINE Lanes magnitude(const Lanes& a) {
  Lanes c;
  for (int k = 0; k < registers; ++k)
    c.part[k] = reinterpret_cast<Register>(reinterpret_cast<RegisterMask>(a.part[k]) &
                                           0x7fffffffffffffffLL);
  return c;
}

PERIDEM_INLINE Lanes larger(const Lanes& a, const Lanes& b) {
  Lanes c;
  for (int k = 0; k < registers; ++k) c.part[k] = a.part[k] < b.part[k] ? b.part[k] : a.part[k];
  return c;
}

// c - a b, rounded once where the processor can.
PERIDEM_INLINE Lanes multiplySubtract(const Lanes& a, const Lanes& b, const Lanes& c) {
#if defined(__AVX512F__)
  Lanes d;
  d.part[0] = _mm512_fnmadd_pd(a.part[0], b.part[0], c.part[0]);
  return d;
#elif defined(__AVX2__)
  Lanes d;
  for (int k = 0; k < registers; ++k) d.part[k] = _mm256_fnmadd_pd(a.part[k], b.part[k], c.part[k]);
  return d;
#elif defined(__aarch64__)
  Lanes d;
  for (int k = 0; k < registers; ++k) d.part[k] = vfmsq_f64(c.part[k], a.part[k], b.part[k]);
  return d;
#else
  return c - a * b;
#endif
}

// Bits of the lanes where a > b; not set where one is NaN.
PERIDEM_INLINE unsigned greaterBits(Register a, Register b) {
#if defined(__AVX512F__)
  return _mm512_cmp_pd_mask(a, b, _CMP_GT_OQ);
#elif defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(a > b)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(a > b)));
#else
  return (a[0] > b[0] ? 1u : 0u) | (a[1] > b[1] ? 2u : 0u);
#endif
}
PERIDEM_INLINE LaneBits greaterBits(const Lanes& a, const Lanes& b) {
  unsigned bits = 0;
  for (int k = 0; k < registers; ++k)
    bits |= greaterBits(a.part[k], b.part[k]) << (k * register_lanes);
  return static_cast<LaneBits>(bits);
}

// exp(t) for |t| <= ln 2 / 2: the polynomial of degree 11 through the Chebyshev points, which is
// off by 3e-18 (coefficients by mpmath.chebyfit).
PERIDEM_INLINE Lanes exponentialNearZero(const Lanes& t) {
  constexpr double series[] = {2.511004920481866e-8,
                               2.7632654722527792e-7,
                               2.7557240887229869e-6,
                               2.4801485441561313e-5,
                               1.9841269890076403e-4,
                               1.3888888952352863e-3,
                               8.3333333333195896e-3,
                               0.041666666666487953,
                               0.16666666666666681,
                               0.50000000000000184,
                               1.0,
                               1.0};
  Lanes sum = broadcast(series[0]);
  for (int k = 1; k < 12; ++k) sum = multiplyAdd(sum, t, broadcast(series[k]));
  return sum;
}

// exp(a) = 2^n exp(t), n the integer nearest to a / ln 2. Below exp(-700) the result stays there.
// Bonds far from softening have n = 0: then there is nothing to split off, to the same bits.
PERIDEM_INLINE Lanes exponential(const Lanes& a) {
  constexpr double shift = 6755399441055744.0;          // 1.5 * 2^52: rounds to integers
  constexpr double log2e = 1.4426950408889634;          // 1 / ln 2
  constexpr double ln2_high = 0.693147180369123816490;  // ln 2 in two parts, the first of 33 bits
  constexpr double ln2_low = 1.90821492927058770002e-10;
  if (greaterBits(magnitude(a), broadcast(0.34)) == 0) return exponentialNearZero(a);
  const Lanes bounded = larger(a, broadcast(-700.0));
  const Lanes shifted = multiplyAdd(bounded, broadcast(log2e), broadcast(shift));
  const Lanes n = shifted - shift;
  Lanes t = multiplySubtract(n, broadcast(ln2_high), bounded);
  t = multiplySubtract(n, broadcast(ln2_low), t);
  Lanes power = exponentialNearZero(t);
  for (int k = 0; k < registers; ++k)
    power.part[k] =
        reinterpret_cast<Register>(reinterpret_cast<RegisterMask>(power.part[k]) +
                                   (reinterpret_cast<RegisterMask>(shifted.part[k]) << 52));
  return power;
}

#if !defined(__AVX512F__)
// All bits of a lane set or cleared, for every combination of the lanes of a register.
struct MaskTable {
  alignas(64) std::int64_t mask[1 << register_lanes][register_lanes] = {};
  constexpr MaskTable() {
    for (int bits = 0; bits < (1 << register_lanes); ++bits)
      for (int lane = 0; lane < register_lanes; ++lane)
        mask[bits][lane] = (bits >> lane) & 1 ? -1 : 0;
  }
};
static constexpr MaskTable mask_table;
#endif

// a where the bit is set, 0 elsewhere (also where a is NaN).
PERIDEM_INLINE Lanes keep(LaneBits bits, const Lanes& a) {
  Lanes c;
#if defined(__AVX512F__)
  c.part[0] = _mm512_maskz_mov_pd(bits, a.part[0]);
#else
  for (int k = 0; k < registers; ++k) {
    const auto own = (bits >> (k * register_lanes)) & ((1 << register_lanes) - 1);
    const auto mask = *reinterpret_cast<const RegisterMask*>(mask_table.mask[own]);
    c.part[k] = reinterpret_cast<Register>(mask & reinterpret_cast<RegisterMask>(a.part[k]));
  }
#endif
  return c;
}

// a b where the bit is set, 0 elsewhere (also where a or b is NaN).
PERIDEM_INLINE Lanes keepProduct(LaneBits bits, const Lanes& a, const Lanes& b) {
#if defined(__AVX512F__)
  Lanes c;
  c.part[0] = _mm512_maskz_mul_pd(bits, a.part[0], b.part[0]);
  return c;
#else
  return keep(bits, a * b);
#endif
}

PERIDEM_INLINE Lanes squareRoot(const Lanes& a) {
  Lanes c;
  for (int k = 0; k < registers; ++k) {
#if defined(__AVX512F__)
    c.part[k] = _mm512_sqrt_pd(a.part[k]);
#elif defined(__AVX2__)
    c.part[k] = _mm256_sqrt_pd(a.part[k]);
#elif defined(__SSE2__)
    c.part[k] = _mm_sqrt_pd(a.part[k]);
#else
    for (int lane = 0; lane < register_lanes; ++lane) c.part[k][lane] = std::sqrt(a.part[k][lane]);
#endif
  }
  return c;
}

// 1 / sqrt(a), a normal number of single precision, from an estimate y: with e = 1 - a y^2,
// 1/sqrt(a) = y (1 + e/2 + 3/8 e^2 + 5/16 e^3 + 35/128 e^4 + ...). With AVX-512 the estimate has 14
// bits and the rest after e^3 is below 1e-16, with AVX2 12 bits and e^4 is needed.
PERIDEM_INLINE Lanes inverseSquareRoot(const Lanes& a) {
#if defined(__AVX2__)
  Lanes y;
#if defined(__AVX512F__)
  y.part[0] = _mm512_rsqrt14_pd(a.part[0]);
#else
  for (int k = 0; k < registers; ++k)
    y.part[k] = _mm256_cvtps_pd(_mm_rsqrt_ps(_mm256_cvtpd_ps(a.part[k])));
#endif
  const Lanes e = multiplySubtract(a * y, y, broadcast(1.0));
  Lanes series = broadcast(0.3125);
#if !defined(__AVX512F__)
  series = multiplyAdd(e, broadcast(0.2734375), series);
#endif
  series = multiplyAdd(multiplyAdd(series, e, broadcast(0.375)), e, broadcast(0.5)) * e;
  return multiplyAdd(y, series, y);
#else
  return 1.0 / squareRoot(a);
#endif
}

// Sum over the lanes in a fixed order, the same for every register width.
PERIDEM_INLINE double sumOfLanes(const Lanes& a) {
  double value[lanes];
  for (int lane = 0; lane < lanes; ++lane)
    value[lane] = a.part[lane / register_lanes][lane % register_lanes];
  const double even = (value[0] + value[4]) + (value[2] + value[6]);
  const double odd = (value[1] + value[5]) + (value[3] + value[7]);
  return even + odd;
}

// The sums over the lanes of eight rows that follow each other, in the order of sumOfLanes.
PERIDEM_INLINE Lanes sumsOfRows(const double* rows) {
#if defined(__AVX2__)
  const auto half = [](const double* row) PERIDEM_LAMBDA {
    return _mm256_load_pd(row) + _mm256_load_pd(row + 4);  // 0+4, 1+5, 2+6, 3+7
  };
  alignas(64) double sums[lanes];
  for (int k = 0; k < lanes; k += 4) {
    const __m256d a = half(rows + lanes * k), b = half(rows + lanes * (k + 1));
    const __m256d c = half(rows + lanes * (k + 2)), d = half(rows + lanes * (k + 3));
    const __m256d ab = _mm256_permute2f128_pd(a, b, 0x20) + _mm256_permute2f128_pd(a, b, 0x31);
    const __m256d cd = _mm256_permute2f128_pd(c, d, 0x20) + _mm256_permute2f128_pd(c, d, 0x31);
    _mm256_store_pd(sums + k, _mm256_permute4x64_pd(_mm256_hadd_pd(ab, cd), 0xd8));
  }
  return load(sums);
#else
  alignas(64) double sums[lanes];
  for (int k = 0; k < lanes; ++k) sums[k] = sumOfLanes(load(rows + lanes * k));
  return load(sums);
#endif
}

PERIDEM_INLINE double largestLane(const Lanes& a) {
  double result = a.part[0][0];
  for (int lane = 1; lane < lanes; ++lane)
    result = larger(result, a.part[lane / register_lanes][lane % register_lanes]);
  return result;
}

}  // namespace peridem::PERIDEM_ISA
