// What the force kernels read and write besides a block (block_view.h). Plain pointers only.
#pragma once

#include "lanes.h"
#include "types.h"

namespace peridem {

// Arrays over the nodes of the model; vectors have three components per node.
struct NodeArrays {
  const double* u;
  double* f;
  double* theta;
  double* damage_z;
};

// A group with broken bonds whose ends are close; `row_is_own` as in TileBonds.
struct CloseGroup {
  std::uint32_t row;
  std::uint32_t tile;
  LaneBits close;
  bool row_is_own;
};

// Space of one thread, each array aligned: over the places of a block and over its groups.
struct KernelScratch {
  double* z[3];
  double* theta_a;
  double* sum;            // of a place
  double* row[3];         // sums over the groups of a row, eight lanes for each place; zero between
                          // two passes
  double* column[3];      // sums over the rows of a tile
  double* J_r_by_length;  // J V_i V_j r / |y| of every bond, kept from the first pass to the second
  double* J_e_by_length;  // J V_i V_j e / |y|
  CloseGroup* close;
};

// Told about every bond that breaks: nodes i and j of the model. Bonds inside a block are told once
// and `both` ends are the block's; those with the halo are told by either block.
struct BreakListener {
  void (*broken)(void* context, Index i, Index j, bool both);
  void* context;
};

}  // namespace peridem
