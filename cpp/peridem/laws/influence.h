// Constants of the influence function as the force kernels want them.
#pragma once

#include "../real.h"

namespace peridem {

// J(a) = a0 + a1 a, or a0 exp(-a^2 / beta) where beta > 0.
struct InfluenceNumbers {
  Real a0 = 1;
  Real a1 = 0;
  Real beta = 0;
};

}  // namespace peridem
