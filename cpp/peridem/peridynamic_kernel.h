// Interface of the force kernels, which are compiled once per instruction set. Plain pointers only:
// no code of the standard library is compiled with instructions that the processor may lack.
#pragma once

#include <cstddef>

#include "block_view.h"
#include "laws/lps.h"
#include "laws/pmb.h"
#include "laws/rnp.h"

namespace peridem {

// Arrays over the nodes of the model; vectors have three components per node.
struct NodeArrays {
  const double* u;
  double* f;
  double* theta;
  double* damage_z;
};

struct MovingArrays {
  const double* f;
  double* v;
  double* u;
  double* x;
};

// How the nodes [begin, end) of the model move: v += k f / rho, u += dt v, x += dt v in the first
// `dimension` directions, none of which is prescribed.
struct NodeMotion {
  double k_by_rho;
  double dt;
  double speed_limit;
  std::size_t begin, end;
  int dimension;
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

enum class Stage {
  place,       // positions of a piece into the arrays of all pieces
  dilatation,  // of a piece: break test, theta
  force,       // of a piece: bond forces into f
  whole,       // all three, for a block that is a whole body
  damage,      // Z, and theta of a piece
  table        // lengths and weights of the reference configuration into the numbers
};

// One law, one of the pointers.
struct LawView {
  const Lps* lps = nullptr;
  const Pmb* pmb = nullptr;
  const Rnp* rnp = nullptr;
  bool state_based_stage = true;  // dilatation and break test run at all
};

using RunBlock = void (*)(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
                          const KernelScratch&, const BreakListener&);

// Whether every component of a velocity is below the limit (NaN is not), and the largest.
struct NodeSpeed {
  bool within_limit;
  double fastest;
};
using MoveNodes = NodeSpeed (*)(const NodeMotion&, const MovingArrays&);

namespace baseline {
NodeSpeed moveNodes(const NodeMotion&, const MovingArrays&);
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}  // namespace baseline
namespace avx2 {
NodeSpeed moveNodes(const NodeMotion&, const MovingArrays&);
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}  // namespace avx2
namespace avx512 {
NodeSpeed moveNodes(const NodeMotion&, const MovingArrays&);
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}  // namespace avx512

}  // namespace peridem
