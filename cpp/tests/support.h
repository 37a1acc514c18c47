// Small meshes, decks and comparisons shared by the tests.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "peridem/model.h"

namespace peridem::test {

// Round-off of one operation. Tolerances are multiples of it: the number of operations that lead
// to the value, with a margin of about ten for unlucky signs.
inline constexpr Real epsilon = std::numeric_limits<Real>::epsilon();

inline Real relativeError(Real a, Real b) {
  const Real scale = std::max(std::abs(a), std::abs(b));
  return scale == 0 ? 0 : std::abs(a - b) / scale;
}

inline Real relativeError(const Vec3& a, const Vec3& b) {
  const Real scale = std::max(a.norm(), b.norm());
  return scale == 0 ? 0 : (a - b).norm() / scale;
}

inline Real largestNorm(const std::vector<Vec3>& values) {
  Real largest = 0;
  for (const Vec3& value : values) largest = std::max(largest, value.norm());
  return largest;
}

// Largest difference of two arrays by the largest value of the second.
inline Real relativeError(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  REQUIRE(a.size() == b.size());
  Real largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  const Real scale = largestNorm(b);
  return scale == 0 ? largest : largest / scale;
}

template <class Function>
std::string messageOf(Function&& function) {
  try {
    function();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// nx x ny nodes with spacing h, centred at the origin, cut into quads.
inline Mesh quadGrid(Index nx, Index ny, Real h) {
  Mesh mesh;
  mesh.cell_type = CellType::quad;
  for (Index j = 0; j < ny; ++j)
    for (Index i = 0; i < nx; ++i)
      mesh.points.emplace_back((i - (nx - 1) / 2.0) * h, (j - (ny - 1) / 2.0) * h, 0.0);
  for (Index j = 0; j + 1 < ny; ++j)
    for (Index i = 0; i + 1 < nx; ++i) {
      const Index a = j * nx + i;
      mesh.cells.insert(mesh.cells.end(), {a, a + 1, a + nx + 1, a + nx});
    }
  return mesh;
}

// The same with every quad cut into two triangles.
inline Mesh triangleGrid(Index nx, Index ny, Real h) {
  const Mesh quads = quadGrid(nx, ny, h);
  Mesh mesh;
  mesh.cell_type = CellType::triangle;
  mesh.points = quads.points;
  for (std::size_t e = 0; e < quads.cells.size(); e += 4) {
    const Index* q = &quads.cells[e];
    mesh.cells.insert(mesh.cells.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
  }
  return mesh;
}

// n x n x n nodes with spacing h, centred at the origin, every cube cut into six tetrahedra.
inline Mesh tetraGrid(Index n, Real h) {
  Mesh mesh;
  mesh.cell_type = CellType::tetra;
  const auto number = [n](Index i, Index j, Index k) { return (k * n + j) * n + i; };
  for (Index k = 0; k < n; ++k)
    for (Index j = 0; j < n; ++j)
      for (Index i = 0; i < n; ++i)
        mesh.points.push_back(h * (Vec3(i, j, k).array() - (n - 1) / 2.0));
  // Each tetrahedron is a way from the lowest corner to the highest, one direction at a time.
  const std::array<std::array<int, 3>, 6> ways = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (Index k = 0; k + 1 < n; ++k)
    for (Index j = 0; j + 1 < n; ++j)
      for (Index i = 0; i + 1 < n; ++i)
        for (const auto& way : ways) {
          std::array<Index, 3> at = {i, j, k};
          mesh.cells.push_back(number(at[0], at[1], at[2]));
          for (const int d : way) {
            ++at[static_cast<std::size_t>(d)];
            mesh.cells.push_back(number(at[0], at[1], at[2]));
          }
        }
  return mesh;
}

// A soft elastic solid, K = 2.16e7 Pa, G = 0.9e7 Pa, that does not break below a stretch of a half.
inline MaterialDeck material(MaterialType type, Real horizon) {
  MaterialDeck m;
  m.type = type;
  m.density = 1200;
  m.horizon = horizon;
  if (type == MaterialType::pd_state) {
    m.bulk_modulus = 2.16e7;
    m.shear_modulus = 0.9e7;
  } else {
    m.youngs_modulus = 3.24e7;
  }
  m.fracture_energy = 4e7 * horizon;
  return m;
}

inline ContactDeck contact(Real radius, Real kn) {
  ContactDeck c;
  c.contact_radius = radius;
  c.kn = kn;
  c.damping_on = false;
  c.friction_on = false;
  return c;
}

// One zone with one mesh; bodies and contacts are left to the test.
inline ModelDeck oneZone(Mesh mesh, const MaterialDeck& m, int dimension = 2) {
  ModelDeck deck;
  deck.dimension = dimension;
  deck.final_time = 1e-3;
  deck.time_steps = 1000;
  ZoneDeck zone;
  zone.name = "Zone_1";
  for (const Vec3& x : mesh.points) zone.bounding_radius = std::max(zone.bounding_radius, x.norm());
  zone.material = m;
  deck.meshes.push_back(std::move(mesh));
  deck.zones.push_back(zone);
  return deck;
}

inline BodyDeck bodyAt(const Vec3& site, Index zone = 0) {
  BodyDeck body;
  body.zone = zone;
  body.site = site;
  return body;
}

inline ModelDeck oneBody(Mesh mesh, const MaterialDeck& m, int dimension = 2) {
  ModelDeck deck = oneZone(std::move(mesh), m, dimension);
  deck.bodies.push_back(bodyAt(Vec3::Zero()));
  return deck;
}

inline void setDisplacement(State& state, std::size_t i, const Vec3& u) {
  state.u[i] = u;
  state.x[i] = state.x_ref[i] + u;
}

// Uniform random numbers in [-1, 1). Made by hand, since those of <random> differ between
// standard libraries.
class Random {
 public:
  explicit Random(std::uint32_t seed) : generator_(seed) {}
  Real operator()() { return static_cast<Real>(generator_()) / 2147483648.0 - 1; }
  Vec3 vector(int dimension) {
    Vec3 v = Vec3::Zero();
    for (int d = 0; d < dimension; ++d) v[d] = (*this)();
    return v;
  }

 private:
  std::mt19937 generator_;
};

inline void displaceAtRandom(State& state, Real size, int dimension, std::uint32_t seed) {
  Random random(seed);
  for (std::size_t i = 0; i < state.size(); ++i)
    setDisplacement(state, i, size * random.vector(dimension));
}

inline Vec3 totalForce(const State& state) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < state.size(); ++i) sum += state.volume[i] * state.f[i];
  return sum;
}

inline Real sumOfForceSizes(const State& state) {
  Real sum = 0;
  for (std::size_t i = 0; i < state.size(); ++i) sum += state.volume[i] * state.f[i].norm();
  return sum;
}

}  // namespace peridem::test
