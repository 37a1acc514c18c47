#include "instruction_sets.h"

using namespace peridem;
using namespace peridem::test;

TEST_CASE("instruction set: the baseline is always there, and the best is one of the available") {
  const auto available = availableInstructionSets();
  REQUIRE_FALSE(available.empty());
  CHECK(available.front() == "baseline");
  const UseInstructionSet use("");
  CHECK(instructionSet() == available.back());  // they are listed from the least to the best
}

TEST_CASE("instruction set: the environment may name a lesser one") {
  const UseInstructionSet use("baseline");
  CHECK(instructionSet() == "baseline");
  const bool is_baseline = kernelFor("baseline") == &baseline::runBlock;
  CHECK(is_baseline);
}

TEST_CASE("instruction set: an unknown name is refused with the known ones") {
  const UseInstructionSet use("sse9");
  CHECK_THROWS_AS(instructionSet(), InputError);
  const std::string message = messageOf([] { instructionSet(); });
  CHECK(contains(message, "sse9"));
  CHECK(contains(message, "avx2"));
}
