// Peridynamic forces inside the bodies: break test, dilatation, bond forces, damage.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bond_block.h"
#include "bonds.h"
#include "particle.h"
#include "peridynamic_kernel.h"
#include "state.h"

namespace peridem {

// Nodes per block of a body that is cut into pieces, and the largest body that is not.
struct BlockSizes {
  Index piece = 512;
  Index whole = 1500;
};

class PeridynamicForce {
 public:
  PeridynamicForce();
  ~PeridynamicForce();
  PeridynamicForce(PeridynamicForce&&) noexcept;
  PeridynamicForce& operator=(PeridynamicForce&&) noexcept;
  // `influences[body]`: influence function of each body.
  PeridynamicForce(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
                   const std::vector<Influence>& influences, int dimension, Compatibility mode,
                   const BlockSizes& sizes = {});

  // Break test of state-based bonds, dilatation theta, then f = internal force density of the
  // moving bodies. Flags of bonds that break are cleared in the table.
  void compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies, int threads);

  // Damage Z at the current state. It does not act back on the forces, so that it is enough to
  // compute it when someone looks.
  void computeDamage(State& state, const std::vector<Particle>& bodies, int threads);

  // Takes over the flags of the table, after they have been set from outside.
  void importFlags(const BondTable& bonds);

  std::size_t bytes() const;
  const std::string& instructionSet() const { return instruction_set_; }

 private:
  class Scratch;
  void prepareScratch(int threads);
  void runStage(Stage stage, const BondBlock& block, State& state, BondTable* bonds,
                const std::vector<Particle>& bodies, Scratch& scratch);

  int dimension_ = 2;
  std::string instruction_set_;
  RunBlock run_ = nullptr;
  std::vector<BondBlock> whole_;   // blocks that are whole bodies, largest first
  std::vector<BondBlock> pieces_;  // blocks of partitioned bodies
  BondGroups groups_;
  std::size_t most_places_ = 0;
  std::size_t most_groups_ = 0;                    // among whole bodies
  std::vector<std::unique_ptr<Scratch>> scratch_;  // one per thread
  bool state_based_stage_ = true;                  // see the constructor
};

}  // namespace peridem
