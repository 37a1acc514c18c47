#include "peridem/errors.h"
#include "peridem/fuzzy.h"
#include "peridem/mesh.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

Real sum(const std::vector<Real>& values) {
  Real total = 0;
  for (const Real value : values) total += value;
  return total;
}

Mesh single(CellType type, std::vector<Vec3> points) {
  Mesh mesh;
  mesh.cell_type = type;
  for (std::size_t i = 0; i < points.size(); ++i) mesh.cells.push_back(static_cast<Index>(i));
  mesh.points = std::move(points);
  return mesh;
}

}  // namespace

TEST_CASE("nodal volumes: a line gives half its length to each end") {
  Mesh mesh;
  mesh.cell_type = CellType::line;
  mesh.points = {{0, 0, 0}, {3, 0, 0}, {3, 4, 0}};
  mesh.cells = {0, 1, 1, 2};
  CHECK(nodalVolumes(mesh) == std::vector<Real>{1.5, 3.5, 2});
}

TEST_CASE("nodal volumes: a triangle gives a third of its area to each corner") {
  // Area 6, so exactly 2 each; clockwise numbering counts as well.
  CHECK(nodalVolumes(single(CellType::triangle, {{0, 0, 0}, {4, 0, 0}, {0, 3, 0}})) ==
        std::vector<Real>{2, 2, 2});
  CHECK(nodalVolumes(single(CellType::triangle, {{0, 0, 0}, {0, 3, 0}, {4, 0, 0}})) ==
        std::vector<Real>{2, 2, 2});
}

TEST_CASE("nodal volumes: a tetrahedron gives a quarter of its volume to each corner") {
  // Volume 2 * 3 * 4 / 6 = 4.
  const std::vector<Vec3> corners = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
  CHECK(nodalVolumes(single(CellType::tetra, corners)) == std::vector<Real>{1, 1, 1, 1});
  CHECK(nodalVolumes(single(CellType::tetra, {corners[1], corners[0], corners[2], corners[3]})) ==
        std::vector<Real>{1, 1, 1, 1});
}

TEST_CASE("nodal volumes: a trapezoid weighs its corners by the bilinear shape functions") {
  // (0,0) (4,0) (2,2) (0,2): x = 2 (1+xi) (1 - (1+eta)/4), y = 1+eta, Jacobian (3-eta)/2 with
  // integrals int (1 -+ xi)/2 = 1, int (1-eta)/2 (3-eta)/2 = 5/3, int (1+eta)/2 (3-eta)/2 = 4/3.
  const auto v = nodalVolumes(single(CellType::quad, {{0, 0, 0}, {4, 0, 0}, {2, 2, 0}, {0, 2, 0}}));
  const Real expected[] = {5.0 / 3, 5.0 / 3, 4.0 / 3, 4.0 / 3};
  for (std::size_t a = 0; a < 4; ++a) CHECK(relativeError(v[a], expected[a]) < 20 * epsilon);
}

TEST_CASE("nodal volumes: a grid of quads gives whole and half and quarter cells") {
  const auto v = nodalVolumes(quadGrid(3, 3, 2.0));
  const Real expected[] = {1, 2, 1, 2, 4, 2, 1, 2, 1};
  for (std::size_t i = 0; i < 9; ++i) CHECK(relativeError(v[i], expected[i]) < 20 * epsilon);
}

TEST_CASE("nodal volumes: a grid of triangles counts the triangles around a node") {
  // 2 x 2 nodes: the diagonal's ends belong to both triangles of area 2, the others to one.
  const auto v = nodalVolumes(triangleGrid(2, 2, 2.0));
  const Real expected[] = {4.0 / 3, 2.0 / 3, 2.0 / 3, 4.0 / 3};
  for (std::size_t i = 0; i < 4; ++i) CHECK(relativeError(v[i], expected[i]) < 4 * epsilon);
}

TEST_CASE("nodal volumes: their sum is the measure of the mesh") {
  // Interior points moved at random keep the measure; signs of the cells stay positive.
  Random random(3);
  for (Mesh mesh : {quadGrid(7, 5, 0.1), triangleGrid(7, 5, 0.1)}) {
    for (Index j = 1; j < 4; ++j)
      for (Index i = 1; i < 6; ++i)
        mesh.points[static_cast<std::size_t>(j * 7 + i)] += 0.02 * random.vector(2);
    CHECK(relativeError(sum(nodalVolumes(mesh)), 0.6 * 0.4) < 100 * epsilon);
  }
  Mesh cube = tetraGrid(4, 0.1);
  for (Vec3& x : cube.points)
    if (x.cwiseAbs().maxCoeff() < 0.1) x += 0.01 * random.vector(3);
  CHECK(relativeError(sum(nodalVolumes(cube)), 0.3 * 0.3 * 0.3) < 100 * epsilon);
}

TEST_CASE("nodal volumes: a plane mesh may lie anywhere in space") {
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  Mesh mesh = quadGrid(4, 3, 0.5);
  const auto flat = nodalVolumes(mesh);
  for (Vec3& x : mesh.points) x = rotation * x + Vec3(5, -1, 2);
  const auto turned = nodalVolumes(mesh);
  // Coordinates of size 5 for edges of 0.5: ten times the round-off.
  for (std::size_t i = 0; i < flat.size(); ++i)
    CHECK(relativeError(turned[i], flat[i]) < 200 * epsilon);
}

TEST_CASE("nodal volumes: a cell that names a missing node is refused") {
  Mesh mesh = quadGrid(3, 3, 1.0);
  mesh.cells[5] = 9;
  const std::string message = messageOf([&] { nodalVolumes(mesh); });
  CHECK(contains(message, "cell 1"));
  CHECK(contains(message, "node 9"));
  CHECK(contains(message, "9 nodes"));
  mesh.cells[5] = -1;
  CHECK_THROWS_AS(nodalVolumes(mesh), InputError);
}

TEST_CASE("nodal volumes: a mesh without cells has none") {
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}};
  CHECK(nodalVolumes(mesh) == std::vector<Real>{0, 0});
}

TEST_CASE("mesh size: the smallest distance between two nodes") {
  std::vector<Vec3> points(60);
  Random random(11);
  for (Vec3& x : points) x = random.vector(3);
  Real smallest = 10;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      smallest = std::min(smallest, (points[i] - points[j]).norm());
  // The square is summed in another order than by norm().
  CHECK(relativeError(meshSize(points, false), smallest) < 4 * epsilon);
}

TEST_CASE("mesh size: the fuzzy one is the running minimum in node order") {
  // 1 + 8e-6 comes first; 1 is not fuzzily smaller and does not replace it.
  const std::vector<Vec3> points = {{0, 0, 0}, {1 + 8e-6, 0, 0}, {10, 0, 0}, {11, 0, 0}};
  CHECK(meshSize(points, true) == 1 + 8e-6);
  CHECK(meshSize(points, false) == 1);
  // 1 - 2e-5 is.
  const std::vector<Vec3> shorter = {{0, 0, 0}, {1 + 8e-6, 0, 0}, {10, 0, 0}, {11 - 2e-5, 0, 0}};
  CHECK(meshSize(shorter, true) == shorter[3][0] - shorter[2][0]);
}

TEST_CASE("mesh size: the fuzzy one agrees with the plain double loop") {
  // A lattice disturbed by about the tolerance, where the order of the nodes matters.
  for (const std::uint32_t seed : {1u, 2u, 3u, 4u, 5u}) {
    Random random(seed);
    Mesh mesh = quadGrid(12, 12, 1e-3);
    for (Vec3& x : mesh.points) x += 2e-8 * random.vector(2);
    Real h = std::numeric_limits<Real>::max();
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (std::size_t j = i + 1; j < mesh.points.size(); ++j) {
        const Real distance = (mesh.points[j] - mesh.points[i]).norm();
        if (fuzzyLess(distance, h)) h = distance;
      }
    CHECK(meshSize(mesh.points, true) == h);
  }
}

TEST_CASE("mesh size: the number of threads changes nothing, nor does the order of the nodes") {
  // More than 20000 points, so that threads are used at all.
  Mesh mesh = quadGrid(150, 150, 1e-3);
  Random random(17);
  for (Vec3& x : mesh.points) x += 1e-4 * random.vector(2);
  const Real h = meshSize(mesh.points, false, 1);
  CHECK(meshSize(mesh.points, false, 3) == h);
  CHECK(meshSize(mesh.points, true, 3) == meshSize(mesh.points, true, 1));
  std::reverse(mesh.points.begin(), mesh.points.end());
  CHECK(meshSize(mesh.points, false, 2) == h);
}

TEST_CASE("mesh size: coinciding nodes and single nodes are refused") {
  const std::vector<Vec3> twice = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}};
  CHECK(contains(messageOf([&] { meshSize(twice, false); }), "coincide"));
  const std::vector<Vec3> one = {{0, 0, 0}};
  CHECK_THROWS_AS(meshSize(one, true), InputError);
}

TEST_CASE("mesh size: the smallest of several bodies") {
  const std::vector<Real> sizes = {2.0, 1 + 8e-6, 1.0, 3.0};
  CHECK(smallestMeshSize(sizes, false) == 1);
  CHECK(smallestMeshSize(sizes, true) == 1 + 8e-6);
}

TEST_CASE("centre node: the node nearest to the centre of the shape") {
  const std::vector<Vec3> points = {{1, 0, 0}, {0.2, 0.1, 0}, {-0.1, 0.1, 0}, {0.5, 0.5, 0}};
  CHECK(centerNode(points, Vec3::Zero(), 1, false) == 2);
  CHECK(centerNode(points, Vec3(0.6, 0.6, 0), 1, false) == 3);
}

TEST_CASE("centre node: the first of equally near nodes") {
  const std::vector<Vec3> points = {{1, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {-0.1, 0, 0}};
  CHECK(centerNode(points, Vec3::Zero(), 1, false) == 1);
  CHECK(centerNode(points, Vec3::Zero(), 1, true) == 1);
}

TEST_CASE("centre node: the fuzzy search keeps a node that is farther by less than 1e-5") {
  const std::vector<Vec3> points = {{1, 0, 0}, {0.1 + 5e-7, 0, 0}, {0, 0.1, 0}};
  CHECK(centerNode(points, Vec3::Zero(), 1, true) == 1);
  CHECK(centerNode(points, Vec3::Zero(), 1, false) == 2);
}

TEST_CASE("centre node: node 0 when no node is closer than the bounding radius") {
  const std::vector<Vec3> points = {{3, 0, 0}, {2, 0, 0}};
  CHECK(centerNode(points, Vec3::Zero(), 1, false) == 0);
}

TEST_CASE("cells: nodes per cell") {
  CHECK(nodesPerCell(CellType::none) == 0);
  CHECK(nodesPerCell(CellType::line) == 2);
  CHECK(nodesPerCell(CellType::triangle) == 3);
  CHECK(nodesPerCell(CellType::quad) == 4);
  CHECK(nodesPerCell(CellType::tetra) == 4);
}
