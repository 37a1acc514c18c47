// From the constants of a deck to the constants of a law.
#pragma once

#include <variant>

#include "deck.h"
#include "influence.h"
#include "laws/lps.h"
#include "laws/pmb.h"
#include "laws/rnp.h"

namespace peridem {

using Law = std::variant<Lps, Pmb, Rnp>;

struct ElasticConstants {
  Real youngs_modulus;   // E
  Real bulk_modulus;     // K
  Real shear_modulus;    // G
  Real poisson_ratio;    // nu
  Real lame_lambda;      // lambda
  Real fracture_energy;  // Gc
};

// Complete set from the pair of constants given (state-based: (E,K), (E,G), (E,nu), (K,G);
// bond-based: E, else K, with nu = 1/4) and Gc or KIc. Throws InputError otherwise.
ElasticConstants resolveElastic(const MaterialDeck& material);

// The law of a material for a body of the given horizon eps.
Law makeLaw(const MaterialDeck& material, const Influence& influence, Real horizon, int dimension);

// Bulk modulus recovered from the constants of the law: the stiffness of self-contact.
Real bulkModulusOfLaw(const Law& law, const Influence& influence, Real horizon, int dimension);

// Bulk modulus that a material is given or that follows from its elastic constants; with constants
// of the law alone, that of the law.
Real bulkModulusOfDeck(const MaterialDeck& material, Real modulus_of_law);

bool isStateBased(MaterialType type);

}  // namespace peridem
