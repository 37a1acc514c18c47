// A block of bonds as the force kernels see it: plain pointers into the arrays of a BondPattern.
#pragma once

#include <cstddef>

#include "lanes.h"
#include "laws/influence.h"
#include "real.h"

namespace peridem {

// What the pieces of a body exchange: y and theta.
struct PieceArrays {
  double* z[3];
  double* theta;
  std::size_t first;  // place of this piece
};

// The partial-volume factor is 1 + partial_offset - r / h for r > partial_from, in the frame.
struct BondReference {
  double partial_from;    // eps - h/2, in the fuzzy comparison
  double partial_offset;  // (eps - h/2) / h
  double inverse_mesh_size;
};

// The arrays of a block and of its pattern; see bond_block.h.
struct BlockView {
  std::size_t n_own, n_padded, n_halo, n_tiles;
  const Index* nodes;  // of the body
  const Index* halo_places;
  const TileBonds* tiles;
  const BondGroup* groups;
  double* numbers;  // the table
  TableOf table;
  LaneBits* intact;  // of each group: lanes whose bond is unbroken
  const double* z_ref[3];
  const double* volume;
  const double* inverse_volume;
  const double* dilatation_factor;
  const double* a;
  const double* b;
  std::size_t start;  // first node of the body
  std::size_t center;
  double into_frame[3][3];
  double out_of_frame[3][3];
  double body_force[3];        // density of a force on every node, gravity
  double self_contact_radius;  // Rc, in the frame
  double self_contact_kn;
  // Arrays over the places of all pieces of the body; null for whole bodies.
  PieceArrays pieces;
  InfluenceNumbers influence;
  BondReference reference;
  bool write_theta;  // of a piece, when Z is
  // Arrays that the thread will need for its next body: asked for while it is busy with this one.
  const double* next[4];
  std::size_t next_lines;  // of 64 bytes, in each
};

}  // namespace peridem
