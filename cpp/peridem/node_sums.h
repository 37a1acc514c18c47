// Sums over nodes that do not depend on the number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "types.h"

namespace peridem {

// Sums of what add(i, sums) adds for every i below n: chunk by chunk, the chunks in order.
template <std::size_t N, class Add>
std::array<Real, N> sumOverNodes(std::size_t n, int threads, const Add& add) {
  constexpr std::size_t chunk = 512;
  std::vector<std::array<Real, N>> partial((n + chunk - 1) / chunk, std::array<Real, N>{});
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) if (partial.size() > 4)
  for (std::size_t c = 0; c < partial.size(); ++c)
    for (std::size_t i = c * chunk; i < std::min(n, (c + 1) * chunk); ++i) add(i, partial[c]);
  std::array<Real, N> sums{};
  for (const auto& part : partial)
    for (std::size_t k = 0; k < N; ++k) sums[k] += part[k];
  return sums;
}

}  // namespace peridem
