#include "peridem/laws/contact.h"
#include "peridem/laws/lps.h"
#include "peridem/laws/pmb.h"
#include "peridem/laws/rnp.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// Smallest stretch at which a law breaks, by bisection, to the last digit.
template <class Breaks>
Real threshold(Real below, Real above, const Breaks& breaks) {
  for (int k = 0; k < 200; ++k) {
    const Real middle = (below + above) / 2;
    (breaks(middle) ? above : below) = middle;
  }
  return above;
}

// Whether a bond of length r breaks at the stretch s.
template <class Law>
bool breaks(const Law& law, Real r, Real s) {
  if constexpr (Law::along_deformed_bond)
    return law.excess(r, s * r) > 0;
  else
    return law.excess(1 / r, s) > 0;
}

}  // namespace

TEST_CASE("state-based law: factors and force by hand") {
  Lps law{};
  law.bulk_modulus = 5;
  law.shear_modulus = 2;
  law.s0 = 0.5;
  CHECK(law.b(4) == 7.5);   // 15 * 2 / 4
  CHECK(law.a(4) == 1.25);  // 3 * 5 / 4 - 7.5 / 3
  CHECK(law.dilatationFactor(4) == 0.75);
  CHECK(Lps::weight(3.0, 0.5) == 3);
  // J = 3, r = 2, e = 0.5: J (r 3 + e 4)
  CHECK(Lps::force(6.0, 1.5, 3.0, 4.0) == 24);
  CHECK(law.damage(2.0, -0.5) == 0.5);
}

TEST_CASE("state-based law: a node without neighbours has neither dilatation nor factors") {
  const Lps law{5, 2, 0.5, 0.5, false};
  CHECK(law.dilatationFactor(0) == 0);
  CHECK(law.a(0) == 0);
  CHECK(law.b(0) == 0);
}

TEST_CASE("state-based law: breaks just above s0 + 1e-10 in the fuzzy comparison") {
  Lps law{};
  law.s0 = 0.01;
  law.break_limit = breakLimit(law.s0);
  const auto rule = [](Real s) { return fuzzyGreater(s, 0.01 + 1e-10); };
  // Both thresholds solve the same inequality; in `rule` it is a difference 1e-5 of its terms, so
  // that round-off moves its threshold by up to 1e5 units.
  CHECK(relativeError(threshold(0.005, 0.02, [&](Real s) { return breaks(law, 2, s); }),
                      threshold(0.005, 0.02, rule)) < 1e-11);
  CHECK_FALSE(breaks(law, 2, 0.01));
  CHECK(breaks(law, 2, 0.0100002));
}

TEST_CASE("laws: bonds break in compression too unless only tension counts") {
  Lps lps{};
  lps.break_limit = breakLimit(0.01);
  Pmb pmb{};
  pmb.break_limit = breakLimit(0.01);
  Rnp rnp{};
  rnp.sc_times_sqrt_r = 0.01;
  rnp.break_factor = 1;
  CHECK(breaks(lps, 1, -0.02));
  CHECK(breaks(pmb, 1, -0.02));
  CHECK(breaks(rnp, 1, -0.02));
  lps.tension_only = pmb.tension_only = rnp.tension_only = true;
  for (const Real s : {-0.02, 0.005}) {
    CHECK_FALSE(breaks(lps, 1, s));
    CHECK_FALSE(breaks(pmb, 1, s));
    CHECK_FALSE(breaks(rnp, 1, s));
  }
  CHECK(breaks(lps, 1, 0.02));
  CHECK(breaks(pmb, 1, 0.02));
  CHECK(breaks(rnp, 1, 0.02));
}

TEST_CASE("prototype bonds: force and damage by hand") {
  Pmb law{};
  law.c = 6;
  law.s0 = 0.5;
  CHECK(Pmb::weight(3.0, 0.5) * law.force(0.5, 0.25) == 4.5);  // J c e / r
  CHECK(law.damage(2.0, -0.5) == 0.5);
  law.s0 = 0;  // a law without fracture
  CHECK(law.damage(2.0, 0.5) == 0);
}

TEST_CASE("regularised bonds: force and damage and break by hand") {
  Rnp law{};
  law.four_c_beta_by_f = 3;
  law.beta = 2;
  law.sc_times_sqrt_r = 0.5;  // sqrt(1 / (2 beta)): sc = 0.25 at r = 4
  law.break_factor = 2;
  CHECK(Rnp::weight(3.0, 0.25) == 3);
  // r = 4, s = 0.5: 3 s exp(-2 r s^2)
  CHECK(relativeError(law.force(2.0, 0.5), 1.5 * std::exp(-2.0)) < 4 * epsilon);
  CHECK(law.damage(0.25, -0.5) == 2);
  CHECK_FALSE(breaks(law, 4, 0.5 * (1 + 0.9e-5)));  // fuzzy
  CHECK(breaks(law, 4, 0.5 * (1 + 1.1e-5)));
}

TEST_CASE("regularised bonds: break just above the critical stretch in the fuzzy comparison") {
  Rnp law{};
  law.sc_times_sqrt_r = 0.5;
  law.break_factor = 1;
  // sc = 0.5 / sqrt(2). The law compares squares; see the state-based law for the tolerance.
  const Real sc = 0.5 / std::sqrt(2.0);
  CHECK(relativeError(threshold(0.3, 0.4, [&](Real s) { return breaks(law, 2, s); }),
                      threshold(0.3, 0.4, [&](Real s) { return fuzzyGreater(s, sc); })) < 1e-11);
}

TEST_CASE("regularised bonds: the force is largest at the critical stretch") {
  Rnp law{};
  law.four_c_beta_by_f = 1;
  law.beta = 3;
  law.sc_times_sqrt_r = std::sqrt(1 / (2 * law.beta));
  const Real r = 0.7;
  const Real critical = law.sc_times_sqrt_r / std::sqrt(r);
  const auto force = [&](Real s) { return law.force(r * s, s); };
  CHECK(force(0.99 * critical) < force(critical));
  CHECK(force(1.01 * critical) < force(critical));
}

TEST_CASE("contact law: normal force and damping by hand") {
  ContactLaw law;
  law.radius = 0.5;
  law.kn = 8;
  law.kappa = 2;
  law.damping_factor = 3;
  CHECK(law.normalForce(0.25, 2) == -4);
  CHECK(law.normalForce(0.5, 2) == 0);
  CHECK(law.damping(4) == 6);  // 3 sqrt(2 * 0.5 * 4)
}

TEST_CASE("contact law: the damping factor of a restitution") {
  CHECK(dampingFactor(1, 1) == 0);
  // ln eps = -pi: 2 pi / sqrt(2 pi^2) = sqrt 2
  CHECK(relativeError(dampingFactor(1, std::exp(-pi)), std::sqrt(2.0)) < 10 * epsilon);
  CHECK(relativeError(dampingFactor(3, std::exp(-pi)), 3 * std::sqrt(2.0)) < 10 * epsilon);
}

TEST_CASE("contact law: harmonic means of equal and unequal values") {
  CHECK(harmonicMean(3, 3) == 3);
  CHECK(harmonicMean(1, 3) == 1.5);
}

TEST_CASE("contact law: the tangential spring is cut back at the Coulomb limit") {
  ContactLaw law;
  law.kt = 4;
  law.friction = -0.5;                    // its sign is that of the mode
  CHECK(law.slipCap(0.125, -4, 2) == 1);  // pulls 1, limit 2
  CHECK(law.slipCap(0.5, -4, 2) == 0.5);  // pulls 4
  CHECK(law.slipCap(0, -4, 2) == 1);
}
