// The scratch arrays of one thread in the force kernels.
#pragma once

#include <vector>

#include "bond_block.h"
#include "kernel_arrays.h"

namespace peridem {

// Space of one thread for the largest block, allocated once.
class KernelSpace {
 public:
  KernelSpace(std::size_t places, std::size_t groups, std::size_t groups_of_whole)
      : space_((8 + 3 * lanes) * places + 2 * lanes * groups_of_whole), close_(groups) {
    double* next = space_.data();
    const auto take = [&](std::size_t n) {
      double* begin = next;
      next += n;
      return begin;
    };
    for (int d = 0; d < 3; ++d) {
      view_.z[d] = take(places);
      view_.row[d] = take(lanes * places);
      view_.column[d] = take(places);
    }
    view_.theta_a = take(places);
    view_.sum = take(places);
    view_.J_r_by_length = take(lanes * groups_of_whole);
    view_.J_e_by_length = take(lanes * groups_of_whole);
    view_.close = close_.data();
  }
  const KernelScratch& view() const { return view_; }

 private:
  AlignedArray space_;
  std::vector<CloseGroup> close_;
  KernelScratch view_{};
};

}  // namespace peridem
