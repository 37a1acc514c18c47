// Functions of eight lanes, compiled once per instruction set like the force kernels, for tests.
#pragma once

#include <cstddef>

namespace peridem {

enum class LanesFunction {
  exponential,
  inverse_square_root,
  magnitude,
  larger,        // of in[k] and in[k + n]
  sum_of_lanes,  // of the eight numbers from in[8 k] on
  sums_of_rows,  // the same, eight of them at once
  greater_bits,  // in[k] > in[k + n] as a number, for every eight of them
  product_kept   // in[k] in[k + n] in lanes 0, 2, 4, 7, else 0
};

// `n` results, a multiple of eight. The arrays start on 64 bytes.
using ProbeLanes = void (*)(LanesFunction, const double* in, double* out, std::size_t n);

namespace baseline {
void probeLanes(LanesFunction, const double* in, double* out, std::size_t n);
}
namespace avx2 {
void probeLanes(LanesFunction, const double* in, double* out, std::size_t n);
}
namespace avx512 {
void probeLanes(LanesFunction, const double* in, double* out, std::size_t n);
}

}  // namespace peridem
