#include "integrator.h"

#include <algorithm>
#include <cmath>

namespace peridem {

namespace {

constexpr std::size_t nodes_worth_threads = 20000;

bool isFree(std::uint8_t locked, int d) {
  return !((locked >> d) & 1);
}

}  // namespace

Kick kick(State& state, const std::vector<std::uint8_t>& locked, Real k, Real speed_limit,
          int dimension, int threads) {
  const std::size_t n = state.size();
  int bad = 0;
  Real fastest = 0;
#pragma omp parallel for num_threads(threads) schedule(static) reduction(| : bad) \
    reduction(max : fastest) if (n > nodes_worth_threads)
  for (std::size_t i = 0; i < n; ++i) {
    const Real k_by_rho = k / state.density[i];
    for (int d = 0; d < dimension; ++d) {
      if (!isFree(locked[i], d)) continue;
      state.v[i][d] += k_by_rho * state.f[i][d];
      bad |= !(std::abs(state.v[i][d]) < speed_limit);
      fastest = std::max(fastest, std::abs(state.v[i][d]));
    }
  }
  return {bad == 0, fastest};
}

Kick KickAndDrift::move(State& state, Index begin, Index end, int dimension) const {
  Kick kicked;
  for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
    const Real k_by_rho = k / state.density[i];
    for (int d = 0; d < dimension; ++d) {
      if (!isFree((*locked)[i], d)) continue;
      const Real v = state.v[i][d] + k_by_rho * state.f[i][d];
      kicked.within_limit &= std::abs(v) < speed_limit;
      kicked.fastest = std::max(kicked.fastest, std::abs(v));
      state.v[i][d] = v;
      state.u[i][d] += dt * v;
      state.x[i][d] += dt * v;
    }
  }
  return kicked;
}

}  // namespace peridem
