#include <Eigen/Geometry>

#include "peridem/fuzzy.h"
#include "peridem/peridynamic.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real h = 1e-3;
constexpr Real horizon = 3.1e-3;

constexpr MaterialType all_types[] = {MaterialType::pd_state, MaterialType::pmb_bond,
                                      MaterialType::rnp_bond, MaterialType::pd_elastic_bond};

// A body whose bonds break at a stretch of about `strain` (of about 1 without).
DEMModel makeModel(MaterialType type, int dimension, Real strain = 1,
                   BondBreaking breaking = BondBreaking::both) {
  MaterialDeck m = material(type, horizon);
  m.fracture_energy *= strain * strain;
  m.bond_breaking = breaking;
  m.influence = {InfluenceType::linear, {}};
  Mesh mesh = dimension == 2 ? quadGrid(8, 7, h) : tetraGrid(5, h);
  Random random(17);
  for (Vec3& x : mesh.points) x += 0.1 * h * random.vector(dimension);
  DEMModel model(oneBody(std::move(mesh), m, dimension), 1);
  model.init();
  return model;
}

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

// The sums of the definition, over all pairs of nodes of a body: no lists, no tables.
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

std::size_t brokenBonds(const DEMModel& model) {
  const auto& intact = model.bonds().intact;
  return static_cast<std::size_t>(std::count(intact.begin(), intact.end(), 0));
}

// Forces of random displacements of a thousandth of the mesh size, by which round-off is judged.
Real forceOfThousandthStrain(DEMModel& model) {
  displaceAtRandom(model.state(), 1e-3 * h, model.deck().dimension, 23);
  model.computePeridynamicForces();
  return largestNorm(model.state().f);
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
  model.computePeridynamicForces();
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

TEST_CASE("peridynamic force: agrees with the sums of the definition, bonds breaking on the way") {
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types) {
      CAPTURE(dimension);
      CAPTURE(static_cast<int>(type));
      DEMModel model = makeModel(type, dimension, 0.05);
      ByTheBook book(model);
      for (const Real size : {0.02, 0.07, 0.3}) {  // the last one presses broken bonds together
        displaceAtRandom(model.state(), size * h, dimension, 29);
        model.computePeridynamicForces();
        book.evaluate();
        CHECK(brokenBonds(model) == book.brokenBonds());
        // Sums of some hundred terms that cancel in part; strains of 1e-2 from lengths lose two
        // digits more: 1e-12 is 5000 units of round-off.
        CHECK(relativeError(model.state().f, book.f) < 1e-12);
        Real wrong_theta = 0;
        Real wrong_z = 0;
        for (std::size_t i = 0; i < book.n; ++i) {
          wrong_theta = std::max(wrong_theta, std::abs(model.state().theta[i] - book.theta[i]));
          wrong_z = std::max(wrong_z, relativeError(model.state().damage_z[i], book.z[i]));
        }
        CHECK(wrong_theta < 1e-12);
        CHECK(wrong_z < 1e-12);
      }
      if (type != MaterialType::pd_elastic_bond) CHECK(brokenBonds(model) > 0);
    }
}

TEST_CASE("peridynamic force: a rigid translation gives exactly zero") {
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types) {
      CAPTURE(dimension);
      CAPTURE(static_cast<int>(type));
      DEMModel model = makeModel(type, dimension);
      const Vec3 u = dimension == 2 ? Vec3(0.1, -7.3, 0) : Vec3(0.1, -7.3, 1e3);
      for (std::size_t i = 0; i < model.state().size(); ++i) setDisplacement(model.state(), i, u);
      model.computePeridynamicForces();
      CHECK(largestNorm(model.state().f) == 0);
      CHECK(*std::max_element(model.state().damage_z.begin(), model.state().damage_z.end()) == 0);
    }
}

TEST_CASE("peridynamic force: a rigid rotation gives round-off") {
  // Not for RNPBond, whose linearised stretch is no measure of large rotations.
  for (const int dimension : {2, 3})
    for (const MaterialType type :
         {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::pd_elastic_bond}) {
      CAPTURE(dimension);
      DEMModel model = makeModel(type, dimension);
      const Real unit = forceOfThousandthStrain(model) / 1e-3;  // force of a strain of 1
      const Vec3 axis = dimension == 2 ? Vec3(0, 0, 1) : Vec3(1, -2, 0.5).normalized();
      for (const Real angle : {0.5, 2.4}) {
        const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
        for (std::size_t i = 0; i < model.state().size(); ++i) {
          const Vec3& x = model.state().x_ref[i];
          setDisplacement(model.state(), i, rotation * x - x);
        }
        model.computePeridynamicForces();
        // Displacements are up to eight mesh sizes: their round-off is a strain of 8 epsilon.
        CHECK(largestNorm(model.state().f) < 50 * epsilon * unit);
      }
    }
}

TEST_CASE("peridynamic force: linear and angular momentum balance") {
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types) {
      CAPTURE(dimension);
      CAPTURE(static_cast<int>(type));
      DEMModel model = makeModel(type, dimension, 0.05);
      for (int evaluation = 0; evaluation < 2; ++evaluation) {  // the second with self-contact
        displaceAtRandom(model.state(), 0.2 * h, dimension, 31);
        model.computePeridynamicForces();
        const State& state = model.state();
        Vec3 torque = Vec3::Zero();
        Real torque_size = 0;
        for (std::size_t i = 0; i < state.size(); ++i) {
          // RNPBond acts along the reference bond, so its torques balance about X.
          const Vec3& arm = type == MaterialType::rnp_bond ? state.x_ref[i] : state.x[i];
          torque += state.volume[i] * arm.cross(state.f[i]);
          torque_size += state.volume[i] * arm.norm() * state.f[i].norm();
        }
        // Sums over up to 125 nodes of forces that are themselves sums of 50 terms.
        CHECK(totalForce(state).norm() < 100 * epsilon * sumOfForceSizes(state));
        if (type != MaterialType::rnp_bond || evaluation == 0)
          CHECK(torque.norm() < 100 * epsilon * torque_size);
      }
    }
}

TEST_CASE("peridynamic force: the dilatation of a uniform expansion is three times the strain") {
  for (const int dimension : {2, 3}) {
    DEMModel model = makeModel(MaterialType::pd_state, dimension);
    for (std::size_t i = 0; i < model.state().size(); ++i)
      setDisplacement(model.state(), i, 1e-3 * model.state().x_ref[i]);
    model.computePeridynamicForces();
    // e = |y| - r loses three digits at a strain of 1e-3.
    for (const Real theta : model.state().theta) CHECK(relativeError(theta, 3e-3) < 1e4 * epsilon);
  }
}

TEST_CASE(
    "peridynamic force: Z is the largest stretch by the critical one, broken bonds included") {
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.law_parameters = {8, 4, 0.5};  // K, G, s0
  DEMModel model = makePair(m);
  for (const Real u : {0.25, 0.75, -0.25}) {
    setDisplacement(model.state(), 1, Vec3(u, 0, 0));
    model.computePeridynamicForces();
    CHECK(model.state().damage_z == std::vector<Real>(2, std::abs(u) / 0.5));
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

TEST_CASE("peridynamic force: 1 and 2 and 4 threads give the same bits on a partitioned body") {
  // 72 x 72 nodes: more than one block (4096 nodes) and enough bonds for threads; a second, small
  // body is a block of its own.
  for (const MaterialType type : {MaterialType::pd_state, MaterialType::pmb_bond}) {
    const auto evaluate = [type](int threads) {
      MaterialDeck m = material(type, 3.1 * h);
      m.fracture_energy *= 0.05 * 0.05;
      ModelDeck deck = oneZone(quadGrid(72, 72, h), m);
      deck.meshes.push_back(quadGrid(9, 9, h));
      deck.zones.push_back(deck.zones[0]);
      deck.zones[1].mesh = 1;
      deck.bodies = {bodyAt(Vec3::Zero()), bodyAt(Vec3(1, 0, 0), 1)};
      deck.contacts.assign(4, contact(h, 1));
      DEMModel model(deck, threads);
      model.init();
      for (int evaluation = 0; evaluation < 2; ++evaluation) {
        displaceAtRandom(model.state(), 0.1 * h, 2, 37);
        model.computePeridynamicForces();
      }
      return model;
    };
    const DEMModel one = evaluate(1);
    CHECK(brokenBonds(one) > 1000);
    for (const int threads : {2, 4}) {
      const DEMModel many = evaluate(threads);
      CHECK(many.state().f == one.state().f);
      CHECK(many.state().theta == one.state().theta);
      CHECK(many.state().damage_z == one.state().damage_z);
      CHECK(many.bonds().intact == one.bonds().intact);
    }
  }
}

TEST_CASE("peridynamic force: cutting a body into blocks changes no bit") {
  for (const MaterialType type : all_types) {
    DEMModel whole = makeModel(type, 2, 0.05);
    DEMModel cut = makeModel(type, 2, 0.05);
    PeridynamicForce in_pieces(cut.state(), cut.bonds(), cut.particles(), 2,
                               Compatibility::corrected, 10);
    for (int evaluation = 0; evaluation < 2; ++evaluation) {
      displaceAtRandom(whole.state(), 0.1 * h, 2, 41);
      displaceAtRandom(cut.state(), 0.1 * h, 2, 41);
      whole.computePeridynamicForces();
      in_pieces.compute(cut.state(), cut.bonds(), cut.particles(), 1);
      CHECK(cut.state().f == whole.state().f);
      CHECK(cut.state().theta == whole.state().theta);
      CHECK(cut.bonds().intact == whole.bonds().intact);
    }
  }
}

TEST_CASE("original mode: the material of body 0 decides whether state-based bonds may break") {
  for (const auto mode : {Compatibility::corrected, Compatibility::original}) {
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
