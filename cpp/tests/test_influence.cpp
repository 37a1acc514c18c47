#include "peridem/errors.h"
#include "peridem/influence.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// int_0^1 J(a) a^i da by Simpson's rule on 2000 intervals: error below 1e-12 for these smooth J
// (h^4 / 180 times a fourth derivative below 1e4).
Real momentByQuadrature(const Influence& influence, int i) {
  constexpr int n = 2000;
  Real sum = 0;
  for (int k = 0; k <= n; ++k) {
    const Real a = static_cast<Real>(k) / n;
    const int weight = k == 0 || k == n ? 1 : k % 2 == 1 ? 4 : 2;
    sum += weight * influence(a) * std::pow(a, i);
  }
  return sum / (3.0 * n);
}

Influence make(InfluenceType type, std::vector<Real> parameters, int dimension) {
  return Influence({type, std::move(parameters)}, dimension);
}

}  // namespace

TEST_CASE("influence: moments agree with numerical quadrature") {
  for (const int d : {1, 2, 3}) {
    const std::vector<Influence> all = {
        make(InfluenceType::constant, {}, d), make(InfluenceType::constant, {2.5}, d),
        make(InfluenceType::linear, {}, d),   make(InfluenceType::linear, {3, -1}, d),
        make(InfluenceType::gaussian, {}, d), make(InfluenceType::gaussian, {2, 0.5}, d),
    };
    for (const Influence& influence : all)
      for (const int i : {0, 1, 2, 3, 4})
        CHECK(relativeError(influence.moment(i), momentByQuadrature(influence, i)) < 1e-10);
  }
}

TEST_CASE("influence: defaults have a moment of order d equal to one") {
  for (const int d : {1, 2, 3})
    for (const auto type :
         {InfluenceType::constant, InfluenceType::linear, InfluenceType::gaussian})
      CHECK(relativeError(make(type, {}, d).moment(d), 1) < 10 * epsilon);
}

TEST_CASE("influence: constant J is a0 and d + 1 by default") {
  CHECK(make(InfluenceType::constant, {}, 2)(0.7) == 3);
  CHECK(make(InfluenceType::constant, {}, 3)(0.7) == 4);
  CHECK(make(InfluenceType::constant, {1.5}, 3)(0.7) == 1.5);
}

TEST_CASE("influence: linear J is a0 + a1 a with the defaults 6 and 12 and 20") {
  const Real a0[] = {6, 12, 20};
  for (const int d : {1, 2, 3}) {
    const Influence influence = make(InfluenceType::linear, {}, d);
    CHECK(influence(0) == a0[d - 1]);
    CHECK(influence(1) == 0);  // a1 = -a0
  }
  CHECK(make(InfluenceType::linear, {4}, 2)(1) == 0);
  CHECK(make(InfluenceType::linear, {4, 2}, 2)(0.5) == 5);
}

TEST_CASE("influence: Gaussian J is alpha exp of -a^2 by beta") {
  const Influence given = make(InfluenceType::gaussian, {2, 0.5}, 2);
  CHECK(given(0) == 2);
  CHECK(relativeError(given(1), 2 * std::exp(-2.0)) < 4 * epsilon);
  // Default beta 0.2.
  const Influence standard = make(InfluenceType::gaussian, {}, 2);
  CHECK(relativeError(standard(1) / standard(0), std::exp(-5.0)) < 10 * epsilon);
}

TEST_CASE("influence: a Gaussian needs a positive beta") {
  CHECK_THROWS_AS(make(InfluenceType::gaussian, {1, 0}, 2), InputError);
  CHECK_THROWS_AS(make(InfluenceType::gaussian, {1, -0.2}, 2), InputError);
}
