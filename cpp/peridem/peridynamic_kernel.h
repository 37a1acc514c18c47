// Interface of the force kernels, which are compiled once per instruction set. Plain pointers only:
// no code of the standard library is compiled with instructions that the processor may lack.
#pragma once

#include <cstddef>

#include "lanes.h"
#include "laws/lps.h"
#include "laws/pmb.h"
#include "laws/rnp.h"

namespace peridem {

// The arrays of a BondBlock.
struct BlockView {
  std::size_t n_own, n_padded, n_all, n_inside, n_groups;
  const Index* nodes;
  const double* z_ref[3];
  const double* volume;
  const double* weighted_volume;
  const double* a;
  const double* b;
  BondGroup* groups;
  double* numbers;             // group_numbers for each group
  std::size_t center;          // global centre node of the body
  double self_contact_radius;  // Rc
  double self_contact_kn;
};

// Arrays over the nodes of the model; vectors have three components per node.
struct NodeArrays {
  const double* u;
  double* f;
  double* theta;
  double* damage_z;
};

// Space of one thread, each array aligned: over the places of a block, and over the lanes of its
// groups (unit vector and elongation of every bond, kept from the first pass to the second).
struct KernelScratch {
  double* z[3];
  double* theta_a;
  double* row[3];     // sums over the groups of a row, eight lanes for each place
  double* column[3];  // sums over the rows of a tile
  double* e[3];
  double* elongation;
};

// Told about every bond that breaks: row node i, global numbers. Bonds inside a block are told once
// and `both` ends are the block's; those with the halo are told by either block.
struct BreakListener {
  void (*broken)(void* context, Index i, Index j, bool both);
  void* context;
};

enum class Stage {
  dilatation,  // break test, theta
  force,       // bond forces into f, with theta of all nodes known
  whole,       // both, for a block that is a whole body
  damage,      // Z
  lengths      // r of the reference configuration, in the arithmetic of the kernels
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

namespace baseline {
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}
namespace avx2 {
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}
namespace avx512 {
void runBlock(Stage, int dimension, const LawView&, const BlockView&, const NodeArrays&,
              const KernelScratch&, const BreakListener&);
}

}  // namespace peridem
