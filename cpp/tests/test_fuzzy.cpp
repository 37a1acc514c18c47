#include <limits>

#include "peridem/fuzzy.h"
#include "support.h"

using namespace peridem;

TEST_CASE("fuzzy comparison: the tolerance is 1e-5 of the larger size") {
  CHECK(fuzzyGreater(1.0, 1 - 1.01e-5));
  CHECK_FALSE(fuzzyGreater(1.0, 1 - 0.99e-5));
  CHECK(fuzzyLess(1 - 1.01e-5, 1.0));
  CHECK_FALSE(fuzzyLess(1 - 0.99e-5, 1.0));
}

TEST_CASE("fuzzy comparison: equal values are neither less nor greater") {
  for (const Real a : {-3.0, 0.0, 1e-300, 7.5}) {
    CHECK_FALSE(fuzzyGreater(a, a));
    CHECK_FALSE(fuzzyLess(a, a));
  }
}

TEST_CASE("fuzzy comparison: scaling both sides changes nothing") {
  for (const Real scale : {1e-12, 1.0, 1e12}) {
    CHECK(fuzzyGreater(2.0001 * scale, 2 * scale));
    CHECK_FALSE(fuzzyGreater(2.00001 * scale, 2 * scale));
  }
}

TEST_CASE("fuzzy comparison: negative values and values around zero") {
  CHECK(fuzzyLess(-1.0, -0.9));
  CHECK(fuzzyLess(-1e-9, 1e-9));  // relative, so tiny values of different sign do differ
  CHECK(fuzzyGreater(1e-300, 0.0));
  CHECK_FALSE(fuzzyLess(-1.000001, -1.0));
}

TEST_CASE("fuzzy comparison: NaN is neither less nor greater") {
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  CHECK_FALSE(fuzzyLess(nan, 1.0));
  CHECK_FALSE(fuzzyGreater(nan, 1.0));
  CHECK_FALSE(fuzzyLess(1.0, nan));
}
