// The peridynamic forces as the sums of their definition, for reading and as the oracle of the
// kernels: over all pairs of nodes, without lists, tables, blocks and lanes.
#pragma once

#include "peridem/fuzzy.h"
#include "support.h"

namespace peridem::test {

// Of the only body of a model.
struct ByTheBook {
  explicit ByTheBook(const DEMModel& m)
      : model(m),
        n(m.state().size()),
        broken(n * n, 0),
        influence(m.deck().zones[0].material.influence, m.deck().dimension) {}

  Vec3 xi(std::size_t i, std::size_t j) const { return s().x_ref[j] - s().x_ref[i]; }
  Vec3 y(std::size_t i, std::size_t j) const { return xi(i, j) + (s().u[j] - s().u[i]); }
  const State& s() const { return model.state(); }
  const Particle& body() const { return model.particles()[0]; }
  bool bonded(std::size_t i, std::size_t j) const {
    return i != j && xi(i, j).norm() < body().horizon;
  }

  Real weight(std::size_t i, std::size_t j) const {  // J V_j, corrected
    const Real r = xi(i, j).norm();
    const Real size = body().mesh_size;
    const bool cut = fuzzyGreater(r, body().horizon - size / 2);
    return influence(r / body().horizon) * s().volume[j] *
           (cut ? (body().horizon + size / 2 - r) / size : 1);
  }

  Real weightedVolume(std::size_t i) const {
    Real m = 0;
    for (std::size_t j = 0; j < n; ++j)
      if (bonded(i, j)) m += xi(i, j).squaredNorm() * weight(i, j);
    return m;
  }

  Vec3 selfContact(std::size_t i, std::size_t j) const {
    const Real length = y(i, j).norm();
    return std::min(0.0, body().self_contact_kn * s().volume[j] *
                             (length - 0.95 * body().mesh_size) / length) *
           y(i, j);
  }

  // One evaluation: breaks bonds, fills f, theta and z.
  void evaluate() {
    f.assign(n, Vec3::Zero());
    theta.assign(n, 0);
    z.assign(n, 0);
    std::visit([this](const auto& law) { evaluate(law); }, body().law);
  }

  void evaluate(const Lps& law) {
    std::vector<Real> m(n);
    for (std::size_t i = 0; i < n; ++i) {
      m[i] = weightedVolume(i);
      for (std::size_t j = 0; j < n; ++j) {
        if (!bonded(i, j)) continue;
        const Real r = xi(i, j).norm();
        const Real stretch = (y(i, j).norm() - r) / r;
        z[i] = std::max(z[i], std::abs(stretch) / law.s0);
        if (fuzzyGreater(law.tension_only ? stretch : std::abs(stretch), law.s0 + 1e-10))
          broken[i * n + j] = 1;
        if (!broken[i * n + j]) theta[i] += 3 / m[i] * r * (r * stretch) * weight(i, j);
      }
    }
    const auto b = [&](std::size_t k) { return 15 * law.shear_modulus / m[k]; };
    const auto a = [&](std::size_t k) { return 3 * law.bulk_modulus / m[k] - b(k) / 3; };
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        if (!bonded(i, j)) continue;
        const Real r = xi(i, j).norm();
        const Real e = y(i, j).norm() - r;
        const Real t = r * (theta[i] * a(i) + theta[j] * a(j)) + e * (b(i) + b(j));
        f[i] += broken[i * n + j] ? selfContact(i, j) : t * weight(i, j) * y(i, j).normalized();
      }
  }

  void evaluate(const Pmb& law) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        if (!bonded(i, j)) continue;
        const Real r = xi(i, j).norm();
        const Real stretch = (y(i, j).norm() - r) / r;
        if (law.s0 > 0) z[i] = std::max(z[i], std::abs(stretch) / law.s0);
        if (broken[i * n + j])
          f[i] += selfContact(i, j);
        else if (law.s0 > 0 && fuzzyGreater(std::abs(stretch), law.s0 + 1e-10))
          broken[i * n + j] = 1;  // no force in this evaluation
        else
          f[i] += law.c * stretch * weight(i, j) * y(i, j).normalized();
      }
  }

  void evaluate(const Rnp& law) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        if (!bonded(i, j)) continue;
        const Real r = xi(i, j).norm();
        const Real stretch = (s().u[j] - s().u[i]).dot(xi(i, j)) / (r * r);
        const Real sc = std::sqrt(1 / (2 * law.beta * r));
        z[i] = std::max(z[i], std::abs(stretch) / sc);
        if (broken[i * n + j])
          f[i] += selfContact(i, j);
        else if (fuzzyGreater(std::abs(stretch), sc))
          broken[i * n + j] = 1;
        else
          f[i] += law.four_c_beta_by_f * stretch * std::exp(-law.beta * r * stretch * stretch) *
                  weight(i, j) * xi(i, j).normalized();
      }
  }

  std::size_t brokenBonds() const {
    return static_cast<std::size_t>(std::count(broken.begin(), broken.end(), 1));
  }

  const DEMModel& model;
  std::size_t n;
  std::vector<char> broken;
  Influence influence;
  std::vector<Vec3> f;
  std::vector<Real> theta, z;
};

inline std::size_t brokenBonds(const DEMModel& model) {
  const auto& intact = model.bonds().intact;
  return static_cast<std::size_t>(std::count(intact.begin(), intact.end(), 0));
}

// Forces, dilatation and damage of the model as it is.
inline void evaluate(DEMModel& model) {
  model.computePeridynamicForces();
  model.computeDamage();
}

}  // namespace peridem::test
