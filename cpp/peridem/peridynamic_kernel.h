// Interface of the force kernels, which are compiled once per instruction set. Plain pointers only:
// no code of the standard library is compiled with instructions that the processor may lack.
#pragma once

#include <cstddef>

#include "block_view.h"
#include "kernel_arrays.h"
#include "laws/lps.h"
#include "laws/pmb.h"
#include "laws/rnp.h"

namespace peridem {

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
