// Peridynamic forces inside the bodies: break test, dilatation, bond forces, damage.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "bond_block.h"
#include "bonds.h"
#include "integrator.h"
#include "kernel_space.h"
#include "particle.h"
#include "peridynamic_kernel.h"
#include "state.h"

namespace peridem {

// Which patterns have the lengths of their bonds in their tables, besides the weights: those that
// bodies share, or all. The forces are the same to the last bit. Automatic: see lengthsPay().
enum class Lengths { automatic, of_shared_patterns, of_all };

// Whether lengths of bonds are rather fetched than computed, when all tables have `bytes` with
// them. They are while the tables stay in the cache. Beyond, the inverse square root of AVX-512
// takes no longer than memory does; with other instructions it takes much longer, and what counts
// is that the tables take no more than a quarter of the machine's memory.
bool lengthsPay(const std::string& instruction_set, std::size_t bytes);

// The largest body that is one block, and how others are cut: into so many pieces, to share among
// threads, but for the bounds of their nodes. Small pieces have much of their bonds in common with
// others, of which both keep a copy; large ones leave the cache. Threads have no say in it.
struct BlockSizes {
  Lengths lengths = Lengths::automatic;
  Index whole = 1500;
  Index pieces = 32;
  Index smallest_piece = 2048;
  Index largest_piece = 8192;

  Index nodesOfPiece(Index nodes) const {
    return std::clamp(nodes / pieces, smallest_piece, largest_piece);
  }
};

class PeridynamicForce {
 public:
  PeridynamicForce() = default;
  // `influences[body]`: influence function of each body.
  PeridynamicForce(const State& state, const BondTable& bonds, const std::vector<Particle>& bodies,
                   const std::vector<Influence>& influences, int dimension, Compatibility mode,
                   const BlockSizes& sizes = {}, int threads = 1);

  // Break test of state-based bonds, dilatation theta, then f = internal force density (none in
  // bodies that never move) + rho g. Flags of bonds that break are cleared in the table.
  void compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
               const Vec3& gravity, int threads);

  // The same after the nodes have been moved, body by body while a body is in the cache.
  Kick moveAndCompute(const KickAndDrift& motion, State& state, BondTable& bonds,
                      const std::vector<Particle>& bodies, const Vec3& gravity, int threads);

  // Damage Z at the current state, and theta of the last compute() if there was one. They do not
  // act back on the forces from there, so that it is enough to write them when someone looks.
  void computeDamage(State& state, int threads);

  // Takes over the flags of the table, after they have been set from outside.
  void importFlags(const BondTable& bonds, const std::vector<Particle>& bodies);

  std::size_t bytes() const;
  const std::string& instructionSet() const { return instruction_set_; }

 private:
  // Over the places of all pieces of a body; see BondPattern::halo_places.
  struct Exchange {
    std::array<AlignedArray, 3> z;
    AlignedArray theta;
  };
  // A body or a piece of one: a pattern and its flags.
  struct Block {
    Index body;
    std::size_t pattern;
    std::size_t first_group;  // in intact_
    BlockView view;
  };
  // Nodes of bodies that are not whole blocks: of partitioned ones, or of those that never move.
  struct NodeRange {
    Index begin, end;
    Index body;
  };
  void addWholeBodies(const State& state, const BondTable& bonds,
                      const std::vector<Particle>& bodies, Index largest, int threads);
  void addPieces(const State& state, const BondTable& bonds, const Particle& body,
                 Index nodes_of_piece, int threads);
  BlockView makeView(const Block& block, const Particle& body);
  Kick run(const KickAndDrift* motion, State& state, BondTable& bonds,
           const std::vector<Particle>& bodies, const Vec3& gravity, int threads);
  LawView lawOf(Index body) const;
  Kick move(const KickAndDrift& motion, State& state, const Particle& body, Index begin,
            Index end) const;
  void prepareScratch(int threads);
  void runStage(Stage stage, const Block& block, State& state, BondTable* bonds,
                const Vec3& body_force, KernelSpace& scratch, const Particle* next = nullptr);

  int dimension_ = 2;
  std::string instruction_set_;
  RunBlock run_ = nullptr;
  MoveNodes move_ = nullptr;
  void makeTables(const std::vector<Particle>& bodies, Lengths lengths);

  std::vector<Influence> influences_;  // of each body
  std::vector<Law> laws_;              // of each body, in its frame
  std::vector<NodeRange> other_nodes_;
  std::vector<BondPattern> patterns_;
  // Tables, weights with V_i V_j. One array, as large ones stream.
  AlignedArray numbers_;
  std::vector<TableOf> tables_;            // of each pattern
  std::vector<std::size_t> first_number_;  // of each pattern
  std::vector<Index> pattern_bodies_;      // the first body that has the pattern
  std::vector<Block> whole_;               // blocks that are whole bodies, largest first
  std::vector<Block> pieces_;              // blocks of partitioned bodies
  std::vector<Exchange> exchanges_;        // of each body; empty for whole ones
  std::vector<LaneBits> intact_;           // of the groups of all blocks
  std::vector<KernelSpace> scratch_;       // one per thread
  bool state_based_stage_ = true;          // see the constructor
  bool dilatation_known_ = false;          // of partitioned bodies, by a compute()
};

}  // namespace peridem
