#include "lanes_probe.h"

#include "peridem/simd.h"

namespace peridem::PERIDEM_ISA {

void probeLanes(LanesFunction function, const double* in, double* out, std::size_t n) {
  for (std::size_t k = 0; k < n; k += lanes) {
    switch (function) {
      case LanesFunction::exponential:
        store(out + k, exponential(load(in + k)));
        break;
      case LanesFunction::inverse_square_root:
        store(out + k, inverseSquareRoot(load(in + k)));
        break;
      case LanesFunction::magnitude:
        store(out + k, magnitude(load(in + k)));
        break;
      case LanesFunction::larger:
        store(out + k, larger(load(in + k), load(in + n + k)));
        break;
      case LanesFunction::sum_of_lanes:
        for (std::size_t row = k; row < k + lanes; ++row)
          out[row] = sumOfLanes(load(in + lanes * row));
        break;
      case LanesFunction::sums_of_rows:
        store(out + k, sumsOfRows(in + lanes * k));
        break;
      case LanesFunction::greater_bits:
        out[k] = greaterBits(load(in + k), load(in + n + k));
        break;
      case LanesFunction::product_kept:
        store(out + k, keepProduct(0b10010101, load(in + k), load(in + n + k)));
        break;
    }
  }
}

}  // namespace peridem::PERIDEM_ISA
