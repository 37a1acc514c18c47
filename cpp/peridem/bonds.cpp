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

void appendBonds(BondTable& bonds, State& state, std::span<const Particle> bodies,
                 std::span<const Influence> influences, int threads) {
  std::vector<PointSet> sets;
  std::vector<std::size_t> sizes;
  for (const Particle& body : bodies) {
    sizes.push_back(static_cast<std::size_t>(body.nodes()));
    sets.push_back({{state.x_ref.data() + body.start, sizes.back()}, body.horizon, body.start});
  }
  appendNeighbors(sets, bonds.offsets, bonds.neighbors, threads);
  bonds.intact.resize(bonds.size(), 1);

  const std::vector<Chunk> chunks = chunksOf(sizes);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads) if (chunks.size() > 1)
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const Particle& body = bodies[chunks[c].set];
    for (std::size_t k = chunks[c].begin; k < chunks[c].end; ++k) {
      const Index i = body.start + static_cast<Index>(k);
      Real m = 0;  // m = sum of r^2 J V_j   (Jha et al. 2021, eq. 10)
      for (std::size_t bond = bonds.begin(i); bond < bonds.end(i); ++bond) {
        const auto [r, w] =
            bondConstants(state, body, influences[chunks[c].set], i, bonds.neighbors[bond]);
        m += r * r * w;
      }
      state.weighted_volume[static_cast<std::size_t>(i)] = m;
    }
  }
}

void appendBonds(BondTable& bonds, State& state, const Particle& body, const Influence& influence,
                 int threads) {
  appendBonds(bonds, state, {&body, 1}, {&influence, 1}, threads);
}

}  // namespace peridem
