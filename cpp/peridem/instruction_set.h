// Which of the compiled instruction sets the kernels use.
#pragma once

#include <string>

#include "peridynamic_kernel.h"

namespace peridem {

// "avx512", "avx2" or "baseline": the best one that is compiled in and that this processor has. The
// environment variable PERIDEM_SIMD may name a lesser one. Throws InputError when it names one that
// is unknown or not available.
std::string instructionSet();

RunBlock kernelFor(const std::string& instruction_set);
MoveNodes moveKernelFor(const std::string& instruction_set);

}  // namespace peridem
