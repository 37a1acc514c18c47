#include "instruction_set.h"

#include <array>
#include <cstdlib>

#include "errors.h"

namespace peridem {

namespace {

struct Choice {
  const char* name;
  RunBlock run;
  MoveNodes move;
  bool available;
};

std::array<Choice, 3> choices() {
#ifdef PERIDEM_X86
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  return {Choice{"avx512", avx512::runBlock, avx512::moveNodes, has_avx512 && has_avx2},
          Choice{"avx2", avx2::runBlock, avx2::moveNodes, has_avx2},
          Choice{"baseline", baseline::runBlock, baseline::moveNodes, true}};
#else
  return {Choice{"avx512", nullptr, nullptr, false}, Choice{"avx2", nullptr, nullptr, false},
          Choice{"baseline", baseline::runBlock, baseline::moveNodes, true}};
#endif
}

}  // namespace

std::string instructionSet() {
  const char* wanted = std::getenv("PERIDEM_SIMD");
  for (const Choice& choice : choices()) {
    if (wanted == nullptr || *wanted == '\0') {
      if (choice.available) return choice.name;
    } else if (choice.name == std::string(wanted)) {
      if (choice.available) return choice.name;
      throw InputError("PERIDEM_SIMD = " + std::string(wanted) +
                       ": this processor or build lacks it; unset the variable");
    }
  }
  throw InputError("PERIDEM_SIMD = " + std::string(wanted == nullptr ? "" : wanted) +
                   ": must be avx512, avx2 or baseline; unset the variable for the best");
}

RunBlock kernelFor(const std::string& instruction_set) {
  for (const Choice& choice : choices())
    if (choice.name == instruction_set) return choice.run;
  return baseline::runBlock;
}

MoveNodes moveKernelFor(const std::string& instruction_set) {
  for (const Choice& choice : choices())
    if (choice.name == instruction_set) return choice.move;
  return baseline::moveNodes;
}

}  // namespace peridem
