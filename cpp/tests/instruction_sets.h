// The instruction sets that the kernels can use here, one at a time.
#pragma once

#include <cstdlib>

#include "peridem/errors.h"
#include "peridem/instruction_set.h"
#include "support.h"

namespace peridem::test {

// Models built during its life use the given instruction set.
class UseInstructionSet {
 public:
  explicit UseInstructionSet(const std::string& name) {
    if (const char* value = std::getenv("PERIDEM_SIMD")) before_ = value;
    setenv("PERIDEM_SIMD", name.c_str(), 1);
  }
  ~UseInstructionSet() { setenv("PERIDEM_SIMD", before_.c_str(), 1); }  // empty: the best
  UseInstructionSet(const UseInstructionSet&) = delete;
  UseInstructionSet& operator=(const UseInstructionSet&) = delete;

 private:
  std::string before_;
};

inline std::vector<std::string> availableInstructionSets() {
  std::vector<std::string> available;
  for (const std::string name : {"baseline", "avx2", "avx512"}) {
    const UseInstructionSet use(name);
    try {
      if (instructionSet() == name) available.push_back(name);
    } catch (const InputError&) {  // not on this processor
    }
  }
  return available;
}

}  // namespace peridem::test
