#include "mesh.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <string>

#include "errors.h"
#include "fuzzy.h"
#include "neighbors.h"

namespace peridem {

int nodesPerCell(CellType type) {
  switch (type) {
    case CellType::line:
      return 2;
    case CellType::triangle:
      return 3;
    case CellType::quad:
    case CellType::tetra:
      return 4;
    case CellType::none:
      break;
  }
  return 0;
}

namespace {

// Integrals of the four bilinear shape functions over a quadrilateral: 2 x 2 Gauss points.
std::array<Real, 4> quadIntegrals(const std::array<Vec3, 4>& p) {
  constexpr Real g = 0.57735026918962576451;  // 1 / sqrt(3)
  std::array<Real, 4> integral{};
  for (const Real xi : {-g, g}) {
    for (const Real eta : {-g, g}) {
      const std::array<Real, 4> phi = {(1 - xi) * (1 - eta) / 4, (1 + xi) * (1 - eta) / 4,
                                       (1 + xi) * (1 + eta) / 4, (1 - xi) * (1 + eta) / 4};
      const Vec3 dx_dxi = ((1 - eta) * (p[1] - p[0]) + (1 + eta) * (p[2] - p[3])) / 4;
      const Vec3 dx_deta = ((1 - xi) * (p[3] - p[0]) + (1 + xi) * (p[2] - p[1])) / 4;
      const Real jacobian = dx_dxi.cross(dx_deta).norm();
      for (std::size_t a = 0; a < 4; ++a) integral[a] += phi[a] * jacobian;
    }
  }
  return integral;
}

// Integral of every shape function over a cell with the corners p.
std::array<Real, 4> shapeIntegrals(CellType type, const std::array<Vec3, 4>& p) {
  std::array<Real, 4> integral{};
  switch (type) {
    case CellType::line:
      integral.fill((p[1] - p[0]).norm() / 2);
      break;
    case CellType::triangle:
      integral.fill((p[1] - p[0]).cross(p[2] - p[0]).norm() / 2 / 3);
      break;
    case CellType::tetra:
      integral.fill(std::abs((p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0])) / 6 / 4);
      break;
    case CellType::quad:
      return quadIntegrals(p);
    case CellType::none:
      break;
  }
  return integral;
}

}  // namespace

std::vector<Real> nodalVolumes(const Mesh& mesh) {
  std::vector<Real> volumes(mesh.points.size(), 0.0);
  const auto per_cell = static_cast<std::size_t>(nodesPerCell(mesh.cell_type));
  if (per_cell == 0) return volumes;
  for (std::size_t start = 0; start + per_cell <= mesh.cells.size(); start += per_cell) {
    std::array<Vec3, 4> corners;
    for (std::size_t a = 0; a < per_cell; ++a) {
      const Index node = mesh.cells[start + a];
      if (node < 0 || static_cast<std::size_t>(node) >= mesh.points.size())
        throw InputError("mesh: cell " + std::to_string(start / per_cell) + " names node " +
                         std::to_string(node) + ", but the mesh has " +
                         std::to_string(mesh.points.size()) + " nodes");
      corners[a] = mesh.points[static_cast<std::size_t>(node)];
    }
    const auto integral = shapeIntegrals(mesh.cell_type, corners);
    for (std::size_t a = 0; a < per_cell; ++a)
      volumes[static_cast<std::size_t>(mesh.cells[start + a])] += integral[a];
  }
  return volumes;
}

namespace {

constexpr std::size_t points_worth_threads = 20000;

Real trueMinimumDistance(std::span<const Vec3> points, int threads) {
  const PointTree tree(points);
  Real smallest = std::numeric_limits<Real>::infinity();
#pragma omp parallel num_threads(threads) if (points.size() > points_worth_threads)
  {
    // Only what is closer than the closest so far is looked for.
    Real best = std::numeric_limits<Real>::infinity();
#pragma omp for schedule(static)
    for (std::size_t i = 0; i < points.size(); ++i)
      best = std::min(best, tree.nearestOther(static_cast<Index>(i), best));
#pragma omp critical
    smallest = std::min(smallest, best);
  }
  return smallest;
}

}  // namespace

Real meshSize(std::span<const Vec3> points, bool fuzzy, int threads) {
  if (points.size() < 2) throw InputError("mesh: fewer than two nodes, so no mesh size");
  const Real smallest = trueMinimumDistance(points, threads);
  if (!(smallest > 0)) throw InputError("mesh: two nodes coincide; remove duplicate nodes");
  if (!fuzzy) return smallest;

  // Only distances within a few 1e-5 of the minimum can be the outcome of the running minimum;
  // the window is wide enough for any chain of them.
  const AdjacencyList near = neighborsWithin(points, smallest * (1 + 1e-3), threads);
  Real h = std::numeric_limits<Real>::max();
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const Index j : near.links(static_cast<Index>(i))) {
      if (j <= static_cast<Index>(i)) continue;
      const Real distance = (points[static_cast<std::size_t>(j)] - points[i]).norm();
      if (fuzzyLess(distance, h)) h = distance;
    }
  return h;
}

Real smallestMeshSize(std::span<const Real> sizes, bool fuzzy) {
  Real h = std::numeric_limits<Real>::max();
  for (const Real size : sizes)
    if (fuzzy ? fuzzyLess(size, h) : size < h) h = size;
  return h;
}

Index centerNode(std::span<const Vec3> points, const Vec3& center, Real bounding_radius,
                 bool fuzzy) {
  Real nearest = bounding_radius;
  Index node = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Real distance = (points[i] - center).norm();
    if (fuzzy ? fuzzyLess(distance, nearest) : distance < nearest) {
      nearest = distance;
      node = static_cast<Index>(i);
    }
  }
  return node;
}

}  // namespace peridem
