// The bonds of a piece of a body, laid out for eight lanes at a time.
//
// The nodes of a block are ordered by recursive bisection and stored in tiles of eight neighbours
// in space. A bond group is one node i against one tile: the bonds of i with up to eight nodes j.
// Bonds inside a block are stored once, at the node that comes first; those with nodes of other
// blocks of the body (the halo) once on either side. So nothing is gathered in the force loops, and
// a block writes only its own nodes.
#pragma once

#include <array>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "bonds.h"
#include "lanes.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Array of doubles on a 64-byte boundary, zero at first; large ones ask for huge pages.
class AlignedArray {
 public:
  explicit AlignedArray(std::size_t n = 0);
  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }
  double& operator[](std::size_t i) { return data_.get()[i]; }
  double operator[](std::size_t i) const { return data_.get()[i]; }
  std::size_t size() const { return size_; }

 private:
  struct Free {
    void operator()(double* p) const { std::free(p); }
  };
  std::size_t size_ = 0;
  std::unique_ptr<double, Free> data_;
};

struct BondBlock {
  Index body = 0;
  std::size_t n_own = 0;     // nodes of the block
  std::size_t n_padded = 0;  // the same, in whole tiles
  std::size_t n_all = 0;     // with the halo, in whole tiles
  bool whole_body = true;    // no halo

  std::vector<Index> nodes;           // global node of each place; -1: padding
  std::array<AlignedArray, 3> z_ref;  // X - X_c, X_c the centre node of the body
  AlignedArray volume;                // V
  AlignedArray weighted_volume;       // m
  AlignedArray a, b;                  // state-based factors, see Lps

  std::size_t n_inside = 0;       // groups inside the block; the rest are with the halo
  std::vector<BondGroup> groups;  // by row in either part; moved to BondGroups by pack()
  std::vector<Real> numbers;      // group_numbers for each group; likewise
  std::size_t first_group = 0;    // in BondGroups
  std::size_t n_groups = 0;

  std::size_t bytes() const;
};

// The groups of all blocks, one after the other in the order in which the force loops pass them:
// they stream through memory.
struct BondGroups {
  std::vector<BondGroup> groups;
  AlignedArray numbers;

  // Takes the groups of the blocks over.
  void pack(std::span<BondBlock* const> blocks);
};

// Order of the points such that runs of eight are close in space, and so are runs of runs.
std::vector<Index> bisectionOrder(std::span<const Vec3> points);

// Blocks of a body from the piece of each of its nodes (see partitionBody). The lengths r are
// renewed by the kernels in their own arithmetic (Stage::lengths).
std::vector<BondBlock> makeBondBlocks(const State& state, const BondTable& bonds,
                                      const Particle& body, const Influence& influence,
                                      const std::vector<Index>& piece, Index parts);

}  // namespace peridem
