#include "bond_energy.h"

namespace peridem {

namespace {

struct Present {
  const std::vector<Vec3>& u;
  const Vec3& operator()(Index i) const { return u[static_cast<std::size_t>(i)]; }
};

}  // namespace

Real BondEnergy::dilatation(Index i) const {
  const auto* lps = std::get_if<Lps>(&body_.law);
  if (lps == nullptr || !dilates_) return 0;
  LpsSums sums;
  forEachBond(i, Present{state_.u},
              [&](std::size_t k, Index, const Vec3& xi, const Vec3& y, Real w) {
                if (bonds_.intact[k]) sums.add(w, xi.norm(), y.norm() - xi.norm());
              });
  return lps->dilatationFactor(weightedVolume(i)) * sums.w_r_e;
}

Eigen::Matrix3d BondEnergy::virial(Index i, const std::vector<Real>& theta) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const auto* lps = std::get_if<Lps>(&body_.law);
  const auto thetaOf = [&](Index k) { return theta[static_cast<std::size_t>(k - body_.start)]; };
  forEachBond(
      i, Present{state_.u}, [&](std::size_t k, Index j, const Vec3& xi, const Vec3& y, Real w) {
        const Real r = xi.norm();
        const Real length = y.norm();
        Real t = 0;  // force density on i along the bond
        Vec3 direction = y / length;
        if (!bonds_.intact[k]) {
          const Real gap = length - body_.self_contact_radius;
          t = gap < 0 ? body_.self_contact_kn * volume(j) * gap : 0;
        } else if (lps != nullptr) {
          const Real m_i = weightedVolume(i), m_j = weightedVolume(j);
          t = w * Lps::force(r, length - r, thetaOf(i) * lps->a(m_i) + thetaOf(j) * lps->a(m_j),
                             lps->b(m_i) + lps->b(m_j));
        } else if (const auto* pmb = std::get_if<Pmb>(&body_.law)) {
          t = w / r * pmb->force(length - r, 0.0);
        } else if (const auto* rnp = std::get_if<Rnp>(&body_.law)) {
          const Real s = (y - xi).dot(xi) / (r * r);
          t = w * rnp->force(s * r, s);
          direction = xi / r;
        }
        sum += half * volume(i) * t * direction * y.transpose();
      });
  return sum;
}

}  // namespace peridem
