#include "bonds.h"

#include <cmath>

#include "fuzzy.h"

namespace peridem {

Real partialVolume(Real r, Real horizon, Real mesh_size) {
  if (!fuzzyGreater(r, horizon - mesh_size / 2)) return 1;
  return (horizon + mesh_size / 2 - r) / mesh_size;
}

BondConstants bondConstants(const State& state, const Particle& body, const Influence& influence,
                            Index i, Index j) {
  const auto to = static_cast<std::size_t>(j);
  const Real r = (state.x_ref[to] - state.x_ref[static_cast<std::size_t>(i)]).norm();
  return {r, influence(r / body.horizon) * state.volume[to] *
                 partialVolume(r, body.horizon, body.mesh_size)};
}

void appendBonds(BondTable& bonds, State& state, const Particle& body, const Influence& influence,
                 int threads) {
  const auto n = static_cast<std::size_t>(body.nodes());
  const std::span<const Vec3> points(state.x_ref.data() + body.start, n);
  const AdjacencyList local = neighborsWithin(points, body.horizon, threads);

  const auto first = static_cast<Offset>(bonds.size());
  bonds.neighbors.reserve(bonds.size() + local.indices.size());
  for (Index i = 0; i < body.nodes(); ++i) {
    Real m = 0;  // m = sum of r^2 J V_j   (Jha et al. 2021, eq. 10)
    for (const Index j : local.links(i)) {
      bonds.neighbors.push_back(body.start + j);
      const auto [r, w] = bondConstants(state, body, influence, body.start + i, body.start + j);
      m += r * r * w;
    }
    state.weighted_volume[static_cast<std::size_t>(body.start + i)] = m;
    bonds.offsets.push_back(first + local.offsets[static_cast<std::size_t>(i) + 1]);
  }
  bonds.intact.resize(bonds.size(), 1);
}

}  // namespace peridem
