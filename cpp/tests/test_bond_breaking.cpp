// Pairs of nodes by hand: forces, breaking, damage, self-contact.
#include "by_the_book.h"
#include "peridem/errors.h"

using namespace peridem;
using namespace peridem::test;

namespace {

// Two nodes at a distance of 1 with volumes 1 and 2 and horizon 2: no partial volumes, J = 1.
DEMModel makePair(MaterialDeck m) {
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}};
  mesh.volumes = {1, 2};
  m.horizon = 2;
  m.influence = {InfluenceType::constant, {1.0}};
  DEMModel model(oneBody(mesh, m), 1);
  model.init();
  return model;
}

}  // namespace

TEST_CASE("peridynamic force: a state-based pair by hand") {
  // V = 1, 2: m_0 = 2, m_1 = 1; u_1 = 0.25: e = 0.25, theta = 3 e / r = 0.75 for both.
  // a_0 + a_1 = (3K - 5G) 3/2, b_0 + b_1 = 15 G 3/2, t = 0.75 (3K - 5G) 3/2 + 0.25 15 G 3/2
  //           = 27/8 K, whatever G.
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.bulk_modulus = 8;
  m.shear_modulus = 4;
  m.fracture_energy = 1e6;
  DEMModel model = makePair(m);
  setDisplacement(model.state(), 1, Vec3(0.25, 0, 0));
  model.computePeridynamicForces();
  CHECK(relativeError(model.state().f[0], Vec3(54, 0, 0)) < 10 * epsilon);   // t V_1
  CHECK(relativeError(model.state().f[1], Vec3(-27, 0, 0)) < 10 * epsilon);  // -t V_0
  CHECK(relativeError(model.state().theta[0], 0.75) < 10 * epsilon);
  CHECK(relativeError(model.state().theta[1], 0.75) < 10 * epsilon);
}

TEST_CASE("peridynamic force: a prototype pair turned by a quarter pulls along the turned bond") {
  MaterialDeck m = material(MaterialType::pmb_bond, 2);
  m.law_parameters = {8, 10};  // c, s0
  DEMModel model = makePair(m);
  setDisplacement(model.state(), 1, Vec3(-1, 1.5, 0));  // y = (0, 1.5)
  evaluate(model);
  CHECK(relativeError(model.state().f[0], Vec3(0, 8, 0)) < 10 * epsilon);  // c s V_1 = 8 / 2 * 2
  CHECK(relativeError(model.state().f[1], Vec3(0, -4, 0)) < 10 * epsilon);
  CHECK(relativeError(model.state().damage_z[0], 0.05) < 10 * epsilon);
}

TEST_CASE("peridynamic force: a regularised pair pulls along the reference bond") {
  // C = 2, beta = 3, F = 2^3 pi: 4 C beta / F = 3 / pi; s = du . xi / r^2 = 0.25
  MaterialDeck m = material(MaterialType::rnp_bond, 2);
  m.law_parameters = {2, 3};
  DEMModel model = makePair(m);
  setDisplacement(model.state(), 1, Vec3(0.25, 0.5, 0));
  model.computePeridynamicForces();
  const Real t = 3 / pi * 0.25 * std::exp(-3 * 0.0625);
  CHECK(relativeError(model.state().f[0], Vec3(2 * t, 0, 0)) < 10 * epsilon);
  CHECK(relativeError(model.state().f[1], Vec3(-t, 0, 0)) < 10 * epsilon);
}

TEST_CASE(
    "peridynamic force: Z is the largest stretch by the critical one, broken bonds included") {
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.law_parameters = {8, 4, 0.5};  // K, G, s0
  DEMModel model = makePair(m);
  for (const Real u : {0.25, 0.75, -0.25}) {
    setDisplacement(model.state(), 1, Vec3(u, 0, 0));
    evaluate(model);
    for (const Real damage : model.state().damage_z)
      CHECK(relativeError(damage, std::abs(u) / 0.5) < 4 * epsilon);
  }
  CHECK(brokenBonds(model) == 2);
}

TEST_CASE("peridynamic force: a bond breaks for good and in both directions at once") {
  for (const MaterialType type : {MaterialType::pd_state, MaterialType::pmb_bond}) {
    MaterialDeck m = material(type, 2);
    m.law_parameters = {8, 4, 0.5};
    if (type == MaterialType::pmb_bond) m.law_parameters = {8, 0.5};
    DEMModel model = makePair(m);
    setDisplacement(model.state(), 1, Vec3(0.5, 0, 0));
    model.computePeridynamicForces();
    CHECK(model.bonds().intact == std::vector<std::uint8_t>{1, 1});
    setDisplacement(model.state(), 1, Vec3(0.51, 0, 0));
    model.computePeridynamicForces();
    CHECK(model.bonds().intact == std::vector<std::uint8_t>{0, 0});
    CHECK(largestNorm(model.state().f) == 0);
    setDisplacement(model.state(), 1, Vec3(0.25, 0, 0));
    model.computePeridynamicForces();
    CHECK(model.bonds().intact == std::vector<std::uint8_t>{0, 0});
    CHECK(largestNorm(model.state().f) == 0);
    CHECK(model.state().theta[0] == 0);
  }
}

TEST_CASE("bond flags: may be set from outside, both directions alike") {
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.law_parameters = {8, 4, 0.5};
  DEMModel model = makePair(m);
  const std::vector<std::uint8_t> broken = {0, 0};
  model.setIntact(broken);
  setDisplacement(model.state(), 1, Vec3(0.25, 0, 0));
  model.computePeridynamicForces();
  CHECK(largestNorm(model.state().f) == 0);
  CHECK(model.state().theta[0] == 0);
  const std::vector<std::uint8_t> whole = {1, 1};
  model.setIntact(whole);
  model.computePeridynamicForces();
  CHECK(model.state().f[0][0] > 0);
  const std::vector<std::uint8_t> one_sided = {0, 1};
  CHECK_THROWS_AS(model.setIntact(one_sided), InputError);
  const std::vector<std::uint8_t> too_many = {1, 1, 1};
  CHECK_THROWS_AS(model.setIntact(too_many), InputError);
}

TEST_CASE("self-contact: a broken pair pressed together by hand") {
  // Rc = 0.95 h = 0.95, Kn = 18 K / (pi eps^5) with K = 8 and eps = 2; |y| = 0.45: gap -0.5
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.law_parameters = {8, 4, 0.25};
  DEMModel model = makePair(m);
  const Real kn = 18 * 8 / (pi * 32);
  setDisplacement(model.state(), 1, Vec3(-0.55, 0, 0));
  model.computePeridynamicForces();  // breaks and resists in one evaluation
  CHECK(relativeError(model.state().f[0], Vec3(-kn * 2 * 0.5, 0, 0)) < 10 * epsilon);
  CHECK(relativeError(model.state().f[1], Vec3(kn * 1 * 0.5, 0, 0)) < 10 * epsilon);
  setDisplacement(model.state(), 1, Vec3(-0.04, 0, 0));  // |y| = 0.96 > Rc
  model.computePeridynamicForces();
  CHECK(largestNorm(model.state().f) == 0);
}

TEST_CASE("self-contact: a bond-based pair resists from the evaluation after the break") {
  MaterialDeck m = material(MaterialType::pmb_bond, 2);
  m.law_parameters = {3, 0.25};
  DEMModel model = makePair(m);
  // K of the law = 5/3 c pi eps^3 / 24 = 5/3 pi, so Kn = 18 (5/3) / 32 = 15/16
  setDisplacement(model.state(), 1, Vec3(-0.55, 0, 0));
  model.computePeridynamicForces();
  CHECK(largestNorm(model.state().f) == 0);
  model.computePeridynamicForces();
  CHECK(relativeError(model.state().f[0], Vec3(-15.0 / 16, 0, 0)) < 20 * epsilon);
}

TEST_CASE("tension only: compression does not break a bond, the same tension does") {
  for (const MaterialType type :
       {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::rnp_bond}) {
    MaterialDeck m = material(type, 2);
    m.bond_breaking = BondBreaking::tension;
    m.law_parameters = {8, 0.25};  // rnp: C, beta; sc = sqrt(2) at r = 1
    if (type == MaterialType::pd_state) m.law_parameters = {8, 4, 0.25};
    const Real u = type == MaterialType::rnp_bond ? 1.5 : 0.5;
    DEMModel model = makePair(m);
    setDisplacement(model.state(), 1, Vec3(-u, 0, 0));
    model.computePeridynamicForces();
    CHECK(brokenBonds(model) == 0);
    CHECK(model.state().f[0][0] < 0);  // the bond still pushes
    setDisplacement(model.state(), 1, Vec3(u, 0, 0));
    model.computePeridynamicForces();
    CHECK(brokenBonds(model) == 2);
  }
}

TEST_CASE("original mode: the material of body 0 decides whether state-based bonds may break") {
  for (const auto mode : {Compatibility::corrected, Compatibility::original}) {
    constexpr Real h = 1e-3;
    constexpr Real horizon = 3.1e-3;
    ModelDeck deck = oneZone(quadGrid(4, 4, h), material(MaterialType::pmb_bond, horizon));
    deck.compatibility = mode;
    deck.zones.push_back(deck.zones[0]);
    deck.zones[1].material = material(MaterialType::pd_state, horizon);
    deck.zones[1].material.fracture_energy *= 1e-4;
    deck.bodies = {bodyAt(Vec3::Zero()), bodyAt(Vec3(1, 0, 0), 1)};
    deck.contacts.assign(4, contact(h, 1));
    DEMModel model(deck, 1);
    model.init();
    const auto corner = static_cast<std::size_t>(model.particles()[1].start);
    setDisplacement(model.state(), corner, Vec3(-0.2 * h, 0, 0));
    model.computePeridynamicForces();
    CHECK((brokenBonds(model) > 0) == (mode == Compatibility::corrected));
    CHECK((model.state().theta[corner] != 0) == (mode == Compatibility::corrected));
  }
}
