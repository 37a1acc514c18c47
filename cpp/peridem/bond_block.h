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

// Array of doubles on a 64-byte boundary, zero at first.
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
  AlignedArray a, b;                  // state-based factors, see Lps

  std::vector<Index> row_begin;  // groups of own node i: [row_begin[i], row_begin[i+1]),
  std::vector<Index> row_halo;   // those from row_halo[i] on are with the halo
  std::vector<Index> tile;       // first place of the tile of a group
  std::vector<LaneBits> exists;  // lanes that carry a bond
  std::vector<LaneBits> intact;  // lanes whose bond is unbroken
  AlignedArray length;           // r, lanes per group; 1 where there is no bond
  AlignedArray influence;        // J(r / eps) times the partial-volume factor; 0 likewise

  std::size_t groups() const { return tile.size(); }
  std::size_t bytes() const;
};

// Order of the points such that runs of eight are close in space, and so are runs of runs.
std::vector<Index> bisectionOrder(std::span<const Vec3> points);

// Blocks of a body from the piece of each of its nodes (see partitionBody). The lengths r are those
// of `BondTable` to round-off; the kernels renew them in their own arithmetic (fillLengths).
std::vector<BondBlock> makeBondBlocks(const State& state, const BondTable& bonds,
                                      const Particle& body, const Influence& influence,
                                      const std::vector<Index>& piece, Index parts);

}  // namespace peridem
