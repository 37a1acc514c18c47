// Peridynamic forces inside the bodies: break test, dilatation, bond forces, damage.
#pragma once

#include <vector>

#include "bonds.h"
#include "particle.h"
#include "partition.h"
#include "state.h"

namespace peridem {

// Per-node factors of the state-based force, from the weighted volume.
struct StateBasedFactors {
  std::vector<Real> a;        // 3K/m - 15G/(3m)
  std::vector<Real> b;        // 15G/m
  std::vector<Real> theta_a;  // theta a, renewed with theta

  explicit StateBasedFactors(std::size_t n = 0) : a(n, 0), b(n, 0), theta_a(n, 0) {}
};

class PeridynamicForce {
 public:
  PeridynamicForce() = default;
  // Blocks of about `block_nodes` nodes; see makeBlocks().
  PeridynamicForce(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
                   int dimension, Compatibility mode, Index block_nodes = 4096);

  // First stage: break test of state-based bonds, dilatation theta, damage Z. Second stage: sets
  // f to the internal force density. Bodies of one block go through both at once.
  void compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies, int threads);

 private:
  template <int Dim>
  void computeInDimension(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
                          int threads);

  int dimension_ = 2;
  std::vector<NodeBlock> whole_;   // blocks that are whole bodies
  std::vector<NodeBlock> pieces_;  // blocks of partitioned bodies
  StateBasedFactors factors_;
  bool parallel_ = false;
  bool state_based_stage_ = true;  // see the constructor
};

}  // namespace peridem
