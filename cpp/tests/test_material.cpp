#include "peridem/errors.h"
#include "peridem/material.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// E = 1, nu = 1/4: K = 1 / (3 / 2) = 2/3, G = 1 / 2.5 = 0.4, lambda = 0.25 / (1.25 * 0.5) = 0.4.
void checkConstants(const MaterialDeck& m) {
  const ElasticConstants c = resolveElastic(m);
  CHECK(relativeError(c.youngs_modulus, 1) < 10 * epsilon);
  CHECK(relativeError(c.poisson_ratio, 0.25) < 20 * epsilon);
  CHECK(relativeError(c.bulk_modulus, 2.0 / 3) < 20 * epsilon);
  CHECK(relativeError(c.shear_modulus, 0.4) < 20 * epsilon);
  CHECK(relativeError(c.lame_lambda, 0.4) < 40 * epsilon);
}

MaterialDeck bondBased(MaterialType type, Real youngs_modulus, Real fracture_energy) {
  MaterialDeck m;
  m.type = type;
  m.youngs_modulus = youngs_modulus;
  m.fracture_energy = fracture_energy;
  return m;
}

Influence standardInfluence(int dimension) {
  return Influence({InfluenceType::constant, {}}, dimension);  // M_d = 1
}

}  // namespace

TEST_CASE("material: every pair of constants gives the same set") {
  MaterialDeck m;
  m.youngs_modulus = 1;
  SUBCASE("E and nu") {
    m.poisson_ratio = 0.25;
  }
  SUBCASE("E and K") {
    m.bulk_modulus = 2.0 / 3;
  }
  SUBCASE("E and G") {
    m.shear_modulus = 0.4;
  }
  SUBCASE("K and G") {
    m.youngs_modulus = not_given;
    m.bulk_modulus = 2.0 / 3;
    m.shear_modulus = 0.4;
  }
  checkConstants(m);
}

TEST_CASE("material: a bond-based law takes E or K with a Poisson ratio of a quarter") {
  MaterialDeck m = bondBased(MaterialType::pmb_bond, 1, 1);
  m.poisson_ratio = 0.1;  // has no effect
  checkConstants(m);
  m.youngs_modulus = not_given;
  m.bulk_modulus = 2.0 / 3;
  checkConstants(m);
}

TEST_CASE("material: constants that were given stay to the last digit") {
  MaterialDeck m;
  m.bulk_modulus = 2.16e7;
  m.shear_modulus = 1.296e7;
  const ElasticConstants c = resolveElastic(m);
  CHECK(c.bulk_modulus == 2.16e7);
  CHECK(c.shear_modulus == 1.296e7);
}

TEST_CASE("material: Gc is given or KIc^2 by E") {
  MaterialDeck m = bondBased(MaterialType::pmb_bond, 4, 7);
  CHECK(resolveElastic(m).fracture_energy == 7);
  m.fracture_energy = not_given;
  m.critical_stress_factor = 6;
  CHECK(resolveElastic(m).fracture_energy == 9);
}

TEST_CASE("material: too few constants are refused with the pairs that would do") {
  MaterialDeck m;
  m.fracture_energy = 1;
  m.bulk_modulus = 1;
  CHECK_THROWS_AS(resolveElastic(m), InputError);
  CHECK(contains(messageOf([&] { resolveElastic(m); }), "(K, G)"));
  m.bulk_modulus = not_given;
  m.poisson_ratio = 0.3;
  CHECK_THROWS_AS(resolveElastic(m), InputError);
  m.type = MaterialType::pmb_bond;
  CHECK(contains(messageOf([&] { resolveElastic(m); }), "E or K"));
}

TEST_CASE("material: a Poisson ratio outside (-1, 1/2) is refused") {
  MaterialDeck m;
  m.youngs_modulus = 1;
  for (const Real nu : {0.5, 0.7, -1.0}) {
    m.poisson_ratio = nu;
    CHECK_THROWS_AS(resolveElastic(m), InputError);
  }
  m.poisson_ratio = not_given;
  m.shear_modulus = 0.2;  // nu = 1 / 0.4 - 1 = 1.5
  CHECK_THROWS_AS(resolveElastic(m), InputError);
}

TEST_CASE("state-based material: critical stretch by hand") {
  // 3 G + (3/4)^4 (K - 5G/3) with K = 5, G = 1 is 3 + 81/256 * 10/3 = 4.0546875.
  MaterialDeck m;
  m.bulk_modulus = 5;
  m.shear_modulus = 1;
  m.fracture_energy = 4.0546875 * 0.5 * 1e-4;
  const auto law = std::get<Lps>(makeLaw(m, standardInfluence(2), 0.5, 2));
  CHECK(relativeError(law.s0, 0.01) < 10 * epsilon);
  CHECK(law.bulk_modulus == 5);
  CHECK(law.shear_modulus == 1);
  CHECK_FALSE(law.tension_only);
  CHECK(bulkModulusOfLaw(law, standardInfluence(2), 0.5, 2) == 5);
}

TEST_CASE("prototype bonds: constants in 2D by hand") {
  // E = pi, horizon 2: c = 24 pi / (pi 8 3/4) = 4; Gc = 0.144: s0 = sqrt(5 pi Gc / (18 pi)) = 0.2
  const auto m = bondBased(MaterialType::pmb_bond, pi, 0.144);
  const Law law = makeLaw(m, standardInfluence(2), 2, 2);
  CHECK(relativeError(std::get<Pmb>(law).c, 4) < 10 * epsilon);
  CHECK(relativeError(std::get<Pmb>(law).s0, 0.2) < 10 * epsilon);
  // K of the law is 5/3 c pi eps^3 / 24: ten thirds of the deck's K = 2/3 E.
  CHECK(relativeError(bulkModulusOfLaw(law, standardInfluence(2), 2, 2), 20.0 / 9 * pi) <
        20 * epsilon);
}

TEST_CASE("prototype bonds: constants in 3D by hand") {
  // lambda = 0.4 E: c = 24 * 0.4 pi / (pi 8) = 1.2; K of the law = 5/3 lambda = K of the deck
  const auto m = bondBased(MaterialType::pmb_bond, pi, 0.144);
  const Law law = makeLaw(m, standardInfluence(3), 2, 3);
  CHECK(relativeError(std::get<Pmb>(law).c, 1.2) < 20 * epsilon);
  CHECK(relativeError(bulkModulusOfLaw(law, standardInfluence(3), 2, 3), 2.0 / 3 * pi) <
        20 * epsilon);
}

TEST_CASE("elastic bonds: c is 24 lambda by pi eps^3 and no stretch breaks them") {
  auto m = bondBased(MaterialType::pd_elastic_bond, pi, not_given);
  const auto law = std::get<Pmb>(makeLaw(m, standardInfluence(2), 2, 2));
  CHECK(relativeError(law.c, 1.2) < 20 * epsilon);
  CHECK_FALSE(law.excess(1.0, 1e6) > 0);
  CHECK(law.damage(1.0, 1e6) == 0);
  m.law_parameters = {17};
  CHECK(std::get<Pmb>(makeLaw(m, standardInfluence(2), 2, 2)).c == 17);
}

TEST_CASE("regularised bonds: constants in 2D by hand") {
  // Gc = 4, M_2 = 1: C = pi; E = 2.5 pi: lambda = pi, beta = 4; horizon 2: F = 8 pi, 4 C beta / F
  // = 2; sc sqrt(r) = sqrt(1/8)
  auto m = bondBased(MaterialType::rnp_bond, 2.5 * pi, 4);
  m.check_sc_factor = 1.5;
  const Law made = makeLaw(m, standardInfluence(2), 2, 2);
  const auto law = std::get<Rnp>(made);
  CHECK(relativeError(law.beta, 4) < 40 * epsilon);
  CHECK(relativeError(law.four_c_beta_by_f, 2) < 40 * epsilon);
  CHECK(relativeError(law.sc_times_sqrt_r, std::sqrt(0.125)) < 40 * epsilon);
  CHECK(law.break_factor == 1.5);
  // lambda = K 3/5
  CHECK(relativeError(bulkModulusOfLaw(made, standardInfluence(2), 2, 2), 5 * pi / 3) <
        80 * epsilon);
}

TEST_CASE("regularised bonds: constants in 3D by hand") {
  // Gc = 6, M_3 = 1: C = 4; E = 10: lambda = 4, beta = 5; horizon 1: F = 4 pi / 3
  const auto m = bondBased(MaterialType::rnp_bond, 10, 6);
  const Law made = makeLaw(m, standardInfluence(3), 1, 3);
  const auto law = std::get<Rnp>(made);
  CHECK(relativeError(law.beta, 5) < 40 * epsilon);
  CHECK(relativeError(law.four_c_beta_by_f, 60 / pi) < 40 * epsilon);
  CHECK(relativeError(bulkModulusOfLaw(made, standardInfluence(3), 1, 3), 20.0 / 3) < 80 * epsilon);
}

TEST_CASE("regularised bonds: the moment of the influence function enters") {
  // Linear J in 2D with a0 = 24: M_2 = 24/3 - 24/4 = 2; C = pi Gc / 8, beta = 4 lambda / (2 C)
  const Influence influence({InfluenceType::linear, {24}}, 2);
  const auto law =
      std::get<Rnp>(makeLaw(bondBased(MaterialType::rnp_bond, 2.5 * pi, 8), influence, 2, 2));
  CHECK(relativeError(law.beta, 2) < 40 * epsilon);
}

TEST_CASE("regularised bonds: reversible fracture never breaks a bond") {
  auto m = bondBased(MaterialType::rnp_bond, 10, 6);
  m.irreversible_fracture = false;
  CHECK_FALSE(std::get<Rnp>(makeLaw(m, standardInfluence(2), 1, 2)).excess(1.0, 1e6) > 0);
}

TEST_CASE("material: law constants may be given directly") {
  MaterialDeck m;
  m.law_parameters = {3, 2, 0.5};
  const auto lps = std::get<Lps>(makeLaw(m, standardInfluence(2), 1, 2));
  CHECK(lps.bulk_modulus == 3);
  CHECK(lps.shear_modulus == 2);
  CHECK(lps.s0 == 0.5);
  m.type = MaterialType::pmb_bond;
  CHECK(std::get<Pmb>(makeLaw(m, standardInfluence(2), 1, 2)).c == 3);
  CHECK(std::get<Pmb>(makeLaw(m, standardInfluence(2), 1, 2)).s0 == 2);
  m.type = MaterialType::rnp_bond;
  CHECK(std::get<Rnp>(makeLaw(m, standardInfluence(2), 1, 2)).beta == 2);
}

TEST_CASE("material: breaking in tension only reaches the law") {
  for (const auto type : {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::rnp_bond}) {
    MaterialDeck m = material(type, 0.1);
    m.bond_breaking = BondBreaking::tension;
    const Law law = makeLaw(m, standardInfluence(2), 0.1, 2);
    CHECK(std::visit([](const auto& l) { return l.tension_only; }, law));
  }
}

TEST_CASE("material: a law that breaks needs a fracture energy") {
  for (const auto type : {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::rnp_bond}) {
    MaterialDeck m = material(type, 0.1);
    m.fracture_energy = not_given;
    CHECK_THROWS_AS(makeLaw(m, standardInfluence(2), 0.1, 2), InputError);
    m.fracture_energy = 0;
    CHECK_THROWS_AS(makeLaw(m, standardInfluence(2), 0.1, 2), InputError);
  }
}
