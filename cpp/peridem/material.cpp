#include "material.h"

#include <cmath>
#include <limits>
#include <string>

#include "errors.h"

namespace peridem {

bool isStateBased(MaterialType type) {
  return type == MaterialType::pd_state;
}

namespace {

constexpr Real never = std::numeric_limits<Real>::infinity();

// K, E and G follow from the pair; the rest from E and nu.
void resolvePair(const MaterialDeck& m, Real& E, Real& nu) {
  const Real K = m.bulk_modulus;
  const Real G = m.shear_modulus;
  E = m.youngs_modulus;
  nu = m.poisson_ratio;
  if (isGiven(E) && isGiven(K)) {
    nu = (3 * K - E) / (6 * K);
  } else if (isGiven(E) && isGiven(G)) {
    nu = E / (2 * G) - 1;
  } else if (isGiven(K) && isGiven(G)) {
    E = 9 * K * G / (3 * K + G);
    nu = (3 * K - 2 * G) / (2 * (3 * K + G));
  } else if (!(isGiven(E) && isGiven(nu))) {
    throw InputError(
        "material: give exactly two of E, K, G, nu: (E, K), (E, G), (E, nu) or (K, G)");
  }
}

}  // namespace

ElasticConstants resolveElastic(const MaterialDeck& m) {
  ElasticConstants c{};
  Real E = not_given;
  Real nu = not_given;
  if (isStateBased(m.type)) {
    resolvePair(m, E, nu);
  } else {
    nu = 0.25;
    E = isGiven(m.youngs_modulus) ? m.youngs_modulus : 3 * m.bulk_modulus * (1 - 2 * nu);
    if (!isGiven(E)) throw InputError("material: a bond-based law needs E or K");
  }
  if (!(nu > -1 && nu < 0.5)) throw InputError("material: Poisson ratio outside (-1, 1/2)");
  c.youngs_modulus = E;
  c.poisson_ratio = nu;
  // Constants that were given stay as given, to the last digit.
  c.bulk_modulus = isGiven(m.bulk_modulus) ? m.bulk_modulus : E / (3 * (1 - 2 * nu));
  c.shear_modulus =
      isStateBased(m.type) && isGiven(m.shear_modulus) ? m.shear_modulus : E / (2 * (1 + nu));
  c.lame_lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  c.fracture_energy = isGiven(m.fracture_energy)
                          ? m.fracture_energy
                          : m.critical_stress_factor * m.critical_stress_factor / E;
  return c;
}

namespace {

Lps makeLps(const MaterialDeck& m, Real horizon) {
  Lps law{};
  if (m.law_parameters.empty()) {
    const ElasticConstants c = resolveElastic(m);
    law.bulk_modulus = c.bulk_modulus;
    law.shear_modulus = c.shear_modulus;
    // (11) s0 = sqrt( Gc / ((3G + (3/4)^4 (K - 5G/3)) eps) )   Jha et al. 2021
    law.s0 = std::sqrt(c.fracture_energy /
                       ((3 * c.shear_modulus +
                         std::pow(3.0 / 4.0, 4) * (c.bulk_modulus - 5 * c.shear_modulus / 3)) *
                        horizon));
  } else {
    law.bulk_modulus = m.law_parameters[0];
    law.shear_modulus = m.law_parameters[1];
    law.s0 = m.law_parameters[2];
  }
  if (!(law.s0 > 0)) throw InputError("material: the critical stretch s0 is not a positive number");
  law.break_limit = breakLimit(law.s0);
  return law;
}

Pmb makePmb(const MaterialDeck& m, Real horizon, int dimension) {
  Pmb law{};
  if (!m.law_parameters.empty()) {
    law.c = m.law_parameters[0];
    law.s0 = m.law_parameters[1];
  } else {
    const ElasticConstants c = resolveElastic(m);
    const Real eps3 = horizon * horizon * horizon;
    law.c = dimension == 3 ? 24 * c.lame_lambda / (pi * eps3)
                           : 24 * c.youngs_modulus / (pi * eps3 * (1 - c.poisson_ratio));
    law.s0 = std::sqrt(5 * pi * c.fracture_energy / (9 * c.youngs_modulus * horizon));
  }
  if (!(law.s0 > 0)) throw InputError("material: the critical stretch s0 is not a positive number");
  law.break_limit = breakLimit(law.s0);
  return law;
}

Pmb makeElasticBond(const MaterialDeck& m, Real horizon) {
  Pmb law{};
  law.c = m.law_parameters.empty()
              ? 24 * resolveElastic(m).lame_lambda / (pi * horizon * horizon * horizon)
              : m.law_parameters[0];
  law.s0 = 0;
  law.break_limit = never;
  return law;
}

Real rnpVolumeFactor(Real horizon, int dimension) {
  const Real omega = dimension == 1 ? 2 : dimension == 2 ? pi : 4 * pi / 3;
  return std::pow(horizon, dimension + 1) * omega;
}

Rnp makeRnp(const MaterialDeck& m, const Influence& influence, Real horizon, int dimension) {
  Real C = 0;
  Real beta = 0;
  if (!m.law_parameters.empty()) {
    C = m.law_parameters[0];
    beta = m.law_parameters[1];
  } else {
    const ElasticConstants e = resolveElastic(m);
    const Real moment = influence.moment(dimension);
    C = dimension == 3 ? 2 * e.fracture_energy / (3 * moment)
                       : pi * e.fracture_energy / (4 * moment);
    beta = (dimension == 3 ? 5 : 4) * e.lame_lambda / (C * moment);
  }
  if (!(C > 0 && beta > 0)) throw InputError("material: C and beta of RNPBond must be positive");
  Rnp law{};
  law.four_c_beta_by_f = 4 * C * beta / rnpVolumeFactor(horizon, dimension);
  law.beta = beta;
  law.sc_times_sqrt_r = std::sqrt(1 / (2 * beta));
  law.break_factor = m.irreversible_fracture ? m.check_sc_factor : never;
  return law;
}

}  // namespace

namespace {

std::size_t constantsNeeded(MaterialType type) {
  switch (type) {
    case MaterialType::pd_state:
      return 3;
    case MaterialType::pmb_bond:
    case MaterialType::rnp_bond:
      return 2;
    case MaterialType::pd_elastic_bond:
      break;
  }
  return 1;
}

}  // namespace

Law makeLaw(const MaterialDeck& m, const Influence& influence, Real horizon, int dimension) {
  if (!m.law_parameters.empty() && m.law_parameters.size() < constantsNeeded(m.type))
    throw InputError("material: the law needs " + std::to_string(constantsNeeded(m.type)) +
                     " constants, " + std::to_string(m.law_parameters.size()) + " are given");
  Law law;
  switch (m.type) {
    case MaterialType::pd_state:
      law = makeLps(m, horizon);
      break;
    case MaterialType::pmb_bond:
      law = makePmb(m, horizon, dimension);
      break;
    case MaterialType::pd_elastic_bond:
      law = makeElasticBond(m, horizon);
      break;
    case MaterialType::rnp_bond:
      law = makeRnp(m, influence, horizon, dimension);
      break;
  }
  std::visit([&](auto& l) { l.tension_only = m.bond_breaking == BondBreaking::tension; }, law);
  return law;
}

Real bulkModulusOfLaw(const Law& law, const Influence& influence, Real horizon, int dimension) {
  if (const auto* lps = std::get_if<Lps>(&law)) return lps->bulk_modulus;
  if (const auto* pmb = std::get_if<Pmb>(&law))
    return 5.0 / 3.0 * pmb->c * pi * horizon * horizon * horizon / 24;
  // RNP: lambda = C M_d beta / 4 (2D) or / 5 (3D), and K = 5/3 lambda for nu = 1/4
  const auto& rnp = std::get<Rnp>(law);
  const Real c_beta = rnp.four_c_beta_by_f * rnpVolumeFactor(horizon, dimension) / 4;
  return 5.0 / 3.0 * c_beta * influence.moment(dimension) / (dimension == 3 ? 5 : 4);
}

Real bulkModulusOfDeck(const MaterialDeck& m, Real modulus_of_law) {
  if (isGiven(m.bulk_modulus)) return m.bulk_modulus;
  const bool follows = m.law_parameters.empty() || isGiven(m.youngs_modulus);
  return follows ? resolveElastic(m).bulk_modulus : modulus_of_law;
}

}  // namespace peridem
