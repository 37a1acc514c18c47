// The bonds of a body or a piece of one, laid out for eight lanes at a time.
//
// The nodes of a block are ordered by recursive bisection and stored in tiles of eight neighbours
// in space. A bond group is one node against one tile: its bonds with up to eight nodes. The groups
// of a tile follow each other. Bonds inside a block are stored once, on the side that needs fewer
// groups; those with nodes of other blocks of the body (the halo) once on either side. So nothing
// is gathered in the force loops, and a block writes only its own nodes.
//
// What does not change in a run is the pattern of a block. Forces are computed in a frame of the
// body: turned back by the rotation Q of its mesh, lengths in units of its horizon,
// y = z + Q^T (u - u_c) / eps, so that an undeformed body has no elongation at all. Bodies of one
// zone that are equal in their frames share a pattern with a table of the lengths and weights of
// its bonds. Tables of other bodies may have the weights alone: where computing lengths from the
// reference positions again and again takes less time than streaming them through memory.
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

struct BondPattern {
  std::size_t n_own = 0;     // nodes of the block
  std::size_t n_padded = 0;  // the same, in whole tiles
  std::size_t n_halo = 0;    // nodes of other blocks, from place n_padded on
  std::size_t n_all = 0;     // all places, in whole tiles

  // Pieces of a body exchange positions and dilatations through arrays over the places of all of
  // them: the own ones of this piece from `first_place` on, and where those of the halo are.
  std::size_t first_place = 0;
  std::vector<Index> halo_places;

  std::vector<Index> nodes;           // node of the body at each place; -1: padding
  std::array<AlignedArray, 3> z_ref;  // Q^T (X - X_c) / eps, X_c the centre node of the body
  AlignedArray volume;                // V / eps^d
  AlignedArray inverse_volume;        // 1/V
  AlignedArray dilatation_factor;     // 3/(m V), see Lps
  AlignedArray a, b;                  // see Lps

  std::vector<TileBonds> tiles;  // of the own nodes
  std::vector<BondGroup> groups;

  std::size_t bytes() const;
};

// Order of the points such that runs of eight are close in space, and so are runs of runs.
std::vector<Index> bisectionOrder(std::span<const Vec3> points);

// The pattern of a body that is one block.
BondPattern makeBondPattern(const State& state, const BondTable& bonds, const Particle& body,
                            int dimension);

// Patterns of the blocks of a body from the piece of each of its nodes (see partitionBody).
std::vector<BondPattern> makeBondPatterns(const State& state, const BondTable& bonds,
                                          const Particle& body, int dimension,
                                          const std::vector<Index>& piece, Index parts,
                                          int threads = 1);

// Equal for bodies of one zone whose nodes are bonded to each other in the same way.
std::uint64_t hashOfBonds(const BondTable& bonds, const Particle& body);

// Whether two bodies of one zone are the same in their frames.
bool sameInFrame(const State& state, const BondTable& bonds, const Particle& p, const Particle& q,
                 int dimension);

}  // namespace peridem
