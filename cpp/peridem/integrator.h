// Explicit time integration of rho a = f on the free directions of moving bodies.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "state.h"

namespace peridem {

// What a kick found: whether every component of a velocity is below the limit (NaN is not), and
// the largest of them.
struct Kick {
  bool within_limit = true;
  Real fastest = 0;

  void merge(const Kick& other) {
    within_limit = within_limit && other.within_limit;
    fastest = std::max(fastest, other.fastest);
  }
};

// v += k f / rho
Kick kick(State& state, const std::vector<std::uint8_t>& locked, Real k, Real speed_limit,
          int dimension, int threads);

// v += k f / rho, then u += dt v and x += dt v, in one pass. With k = dt the step of the central
// difference scheme (Jha et al. 2021, eq. 32), with k = dt/2 the first half of velocity Verlet.
struct KickAndDrift {
  Real k = 0;
  Real dt = 0;
  Real speed_limit = 0;
  const std::vector<std::uint8_t>* locked = nullptr;  // bit d: direction d of a node is not moved
  const std::vector<std::uint8_t>* locked_bodies = nullptr;  // 1: some node of the body is locked

  // Moves the nodes [begin, end), leaving locked directions alone.
  Kick move(State& state, Index begin, Index end, int dimension) const;
};

}  // namespace peridem
