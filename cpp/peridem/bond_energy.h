// Strain energy of the bonds of a body, whose negative gradient is the force of peridynamic.h, and
// that of the springs between broken neighbours.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "bonds.h"
#include "influence.h"
#include "particle.h"
#include "state.h"

namespace peridem {

// Energies [J]; a bond's is shared by halves between its ends.
struct NodeEnergy {
  Real bonds = 0;
  Real self_contact = 0;
};

class BondEnergy {
 public:
  // `dilates`: whether state-based bonds know their dilatation; see PeridynamicForce.
  BondEnergy(const State& state, const BondTable& bonds, const Particle& body,
             const Influence& influence, bool dilates)
      : state_(state), bonds_(bonds), body_(body), influence_(influence), dilates_(dilates) {}

  // Of node i, for the displacements u(node) and the flags `intact` of all bonds.
  template <class Displacement>
  NodeEnergy at(Index i, const std::uint8_t* intact, const Displacement& u) const {
    NodeEnergy energy;
    LpsSums sums;
    forEachBond(i, u, [&](std::size_t k, Index j, const Vec3& xi, const Vec3& y, Real w) {
      const Real r = xi.norm();
      const Real e = y.norm() - r;
      if (!intact[k])
        energy.self_contact += selfContact(i, j, y.norm());
      else if (const auto* pmb = std::get_if<Pmb>(&body_.law))
        energy.bonds += half * w * bondOf(*pmb, e, r);
      else if (const auto* rnp = std::get_if<Rnp>(&body_.law))
        energy.bonds += half * w * bondOf(*rnp, (y - xi).dot(xi) / (r * r), r);
      else
        sums.add(w, r, e);
    });
    if (const auto* lps = std::get_if<Lps>(&body_.law)) energy.bonds = nodeOf(*lps, i, sums);
    energy.bonds *= volume(i);
    return energy;
  }

  // Sum over the bonds of node i of half the force from the other end, times the way to it: the
  // node's share of the body's volume times its Cauchy stress [J], tension positive. `theta`:
  // dilatations of the body's nodes, from dilatation().
  Eigen::Matrix3d virial(Index i, const std::vector<Real>& theta) const;
  Real dilatation(Index i) const;

 private:
  static constexpr Real half = 0.5;

  struct LpsSums {
    Real w_r_e = 0;
    Real w_e_e = 0;
    void add(Real w, Real r, Real e) {
      w_r_e += w * r * e;
      w_e_e += w * e * e;
    }
  };

  Real volume(Index i) const { return state_.volume[static_cast<std::size_t>(i)]; }
  Real weightedVolume(Index i) const { return state_.weighted_volume[static_cast<std::size_t>(i)]; }

  // visit(k, j, xi, y, w) for the bonds k of node i, broken ones too: xi and y = xi + u_j - u_i
  // from i to j, w = J V_j with the partial-volume factor.
  template <class Displacement, class Visit>
  void forEachBond(Index i, const Displacement& u, const Visit& visit) const {
    const Vec3& X = state_.x_ref[static_cast<std::size_t>(i)];
    const Vec3 u_i = u(i);
    for (std::size_t k = bonds_.begin(i); k < bonds_.end(i); ++k) {
      const Index j = bonds_.neighbors[k];
      const Vec3 xi = state_.x_ref[static_cast<std::size_t>(j)] - X;
      visit(k, j, xi, Vec3(xi + (u(j) - u_i)),
            bondConstants(state_, body_, influence_, i, j).weight);
    }
  }

  // c e^2 / (2 r): the force density of a bond is w c e / r                  Silling 2000
  static Real bondOf(const Pmb& law, Real e, Real r) { return law.c * e * e / (2 * r); }

  // (4 C beta / F) / (2 beta) (1 - exp(-beta r s^2)): the force density is w 4 C beta s
  // exp(-beta r s^2) / F along the reference bond, and e = r s               Lipton 2016
  static Real bondOf(const Rnp& law, Real s, Real r) {
    return law.four_c_beta_by_f / (2 * law.beta) * -std::expm1(-law.beta * r * s * s);
  }

  // W = 1/2 (a m / 3) theta^2 + 1/2 b sum of w e^2, theta = 3/m sum of w r e, with the a and b of
  // (9). With all bonds unbroken, b = 15G/m and a m / 3 = K - 5G/3, it is K theta^2 / 2 +
  // 15G/(2m) sum of w (e - theta r / 3)^2: dilatation and deviator  Silling et al. 2007, eq. 104
  Real nodeOf(const Lps& law, Index i, const LpsSums& sums) const {
    const Real m = weightedVolume(i);
    const Real theta = dilates_ ? law.dilatationFactor(m) * sums.w_r_e : 0;
    return half * (law.a(m) * m / 3 * theta * theta + law.b(m) * sums.w_e_e);
  }

  // 1/2 Kn V V' (Rc - |y|)^2, half of it: f = Kn V' (Rc - |y|) pushes apart.
  Real selfContact(Index i, Index j, Real length) const {
    const Real gap = body_.self_contact_radius - length;
    if (gap <= 0) return 0;
    return half * half * body_.self_contact_kn * volume(i) * volume(j) * gap * gap;
  }

  const State& state_;
  const BondTable& bonds_;
  const Particle& body_;
  const Influence& influence_;
  bool dilates_;
};

}  // namespace peridem
