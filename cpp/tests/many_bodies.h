// Bodies with bonds, put together without a model.
#pragma once

#include "peridem/bonds.h"
#include "support.h"

namespace peridem::test {

// Bodies with mesh size 0.1, horizon 0.3, volumes 0.01 and J = 2 (1 - r / eps).
struct ManyBodies {
  std::vector<Particle> list;
  State state;
  BondTable bonds;
  Influence influence{{InfluenceType::linear, {2}}, 2};

  explicit ManyBodies(const std::vector<std::vector<Vec3>>& points) {
    std::size_t n = 0;
    for (const auto& of_body : points) n += of_body.size();
    state = State(n);
    for (const auto& of_body : points) {
      Particle body;
      body.id = static_cast<Index>(list.size());
      body.start = body.center_node = list.empty() ? 0 : list.back().stop;
      body.stop = body.start + static_cast<Index>(of_body.size());
      body.mesh_size = 0.1;
      body.horizon = 0.3;
      std::copy(of_body.begin(), of_body.end(), state.x_ref.begin() + body.start);
      list.push_back(body);
    }
    state.volume.assign(n, 0.01);
    for (const Particle& body : list) appendBonds(bonds, state, body, influence, 1);
  }
};

}  // namespace peridem::test
