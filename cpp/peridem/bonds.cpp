#include "bonds.h"

#include <cmath>

#include "fuzzy.h"

namespace peridem {

Real partialVolume(Real r, Real horizon, Real mesh_size) {
  if (!fuzzyGreater(r, horizon - mesh_size / 2)) return 1;
  return (horizon + mesh_size / 2 - r) / mesh_size;
}

void appendBonds(BondTable& bonds, State& state, const Particle& body, const Influence& influence,
                 int threads) {
  const auto start = static_cast<std::size_t>(body.start);
  const auto n = static_cast<std::size_t>(body.nodes());
  const std::span<const Vec3> points(state.x_ref.data() + start, n);
  const AdjacencyList local = neighborsWithin(points, body.horizon, threads);

  const std::size_t first = bonds.size();
  const std::size_t total = first + local.indices.size();
  bonds.neighbors.resize(total);
  bonds.length.resize(total);
  bonds.weight.resize(total);
  bonds.intact.resize(total, 1);
  for (std::size_t i = 0; i < n; ++i) {
    Real m = 0;  // m = sum of r^2 J V_j   (Jha et al. 2021, eq. 10)
    for (auto k = static_cast<std::size_t>(local.offsets[i]);
         k < static_cast<std::size_t>(local.offsets[i + 1]); ++k) {
      const auto j = static_cast<std::size_t>(local.indices[k]);
      const Real r = (points[j] - points[i]).norm();
      const Real w = influence(r / body.horizon) * state.volume[start + j] *
                     partialVolume(r, body.horizon, body.mesh_size);
      bonds.neighbors[first + k] = body.start + local.indices[k];
      bonds.length[first + k] = r;
      bonds.weight[first + k] = w;
      m += r * r * w;
    }
    state.weighted_volume[start + i] = m;
    bonds.offsets.push_back(static_cast<Offset>(first) + local.offsets[i + 1]);
  }
}

}  // namespace peridem
