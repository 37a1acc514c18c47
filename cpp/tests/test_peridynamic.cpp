#include <Eigen/Geometry>

#include "by_the_book.h"
#include "force_scene.h"
#include "instruction_sets.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real h = 1e-3;
constexpr Real horizon = 3.1e-3;

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

// Sums of some hundred terms that cancel in part; strains of 1e-2 from lengths lose two digits
// more: 1e-12 is 5000 units of round-off.
void checkAgrees(const State& state, const ByTheBook& book) {
  CHECK(relativeError(state.f, book.f) < 1e-12);
  Real wrong_theta = 0;
  Real wrong_z = 0;
  for (std::size_t i = 0; i < book.n; ++i) {
    wrong_theta = std::max(wrong_theta, std::abs(state.theta[i] - book.theta[i]));
    wrong_z = std::max(wrong_z, relativeError(state.damage_z[i], book.z[i]));
  }
  CHECK(wrong_theta < 1e-12);
  CHECK(wrong_z < 1e-12);
}

// Breaks a share of the bonds, chosen at random.
void breakBonds(DEMModel& model, ByTheBook& book, Real share) {
  std::vector<std::uint8_t> intact = model.bonds().intact;
  Random random(53);
  for (std::size_t i = 0; i < book.n; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const std::size_t bond = model.bonds().find(static_cast<Index>(i), static_cast<Index>(j));
      if (bond == model.bonds().size() || (random() + 1) / 2 >= share) continue;
      intact[bond] = 0;
      intact[model.bonds().find(static_cast<Index>(j), static_cast<Index>(i))] = 0;
      book.broken[i * book.n + j] = book.broken[j * book.n + i] = 1;
    }
  model.setIntact(intact);
}

// Forces of random displacements of a thousandth of the mesh size, by which round-off is judged.
Real forceOfThousandthStrain(DEMModel& model) {
  displaceAtRandom(model.state(), 1e-3 * h, model.deck().dimension, 23);
  model.computePeridynamicForces();
  return largestNorm(model.state().f);
}

}  // namespace

TEST_CASE("peridynamic force: agrees with the sums of the definition, bonds breaking on the way") {
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    for (const int dimension : {2, 3})
      for (const MaterialType type : all_types) {
        CAPTURE(instruction_set);
        CAPTURE(dimension);
        CAPTURE(static_cast<int>(type));
        DEMModel model = makeModel(type, dimension, 0.05);
        REQUIRE(model.instructionSet() == instruction_set);
        ByTheBook book(model);
        for (const Real size : {0.02, 0.07, 0.3}) {  // the last one presses broken bonds together
          displaceAtRandom(model.state(), size * h, dimension, 29);
          evaluate(model);
          book.evaluate();
          checkAgrees(model.state(), book);
          CHECK(brokenBonds(model) == book.brokenBonds());
        }
        if (type != MaterialType::pd_elastic_bond) CHECK(brokenBonds(model) > 0);
      }
  }
}

TEST_CASE("peridynamic force: a body in pieces agrees with the definition as well") {
  for (const int dimension : {2, 3})
    for (const MaterialType type : all_types) {
      CAPTURE(dimension);
      CAPTURE(static_cast<int>(type));
      DEMModel model = makeModel(type, dimension, 0.05);
      const Influence influence(model.deck().zones[0].material.influence, dimension);
      PeridynamicForce force(model.state(), model.bonds(), model.particles(), {influence},
                             dimension, Compatibility::corrected, smallPieces());
      ByTheBook book(model);
      for (const Real size : {0.02, 0.07, 0.3}) {
        displaceAtRandom(model.state(), size * h, dimension, 29);
        force.compute(model.state(), model.bonds(), model.particles(), Vec3::Zero(), 2);
        force.computeDamage(model.state(), 2);
        book.evaluate();
        checkAgrees(model.state(), book);
        CHECK(brokenBonds(model) == book.brokenBonds());
      }
    }
}

TEST_CASE("peridynamic force: a rigid translation gives exactly zero") {
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    for (const int dimension : {2, 3})
      for (const MaterialType type : all_types) {
        CAPTURE(instruction_set);
        CAPTURE(dimension);
        CAPTURE(static_cast<int>(type));
        DEMModel model = makeModel(type, dimension);
        State& state = model.state();
        const Vec3 u = dimension == 2 ? Vec3(0.1, -7.3, 0) : Vec3(0.1, -7.3, 1e3);
        for (std::size_t i = 0; i < state.size(); ++i) setDisplacement(state, i, u);
        evaluate(model);
        CHECK(largestNorm(state.f) == 0);
        CHECK(*std::max_element(state.damage_z.begin(), state.damage_z.end()) == 0);
      }
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

TEST_CASE("self-contact: a crushed body agrees with the definition, few or all bonds broken") {
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    for (const int dimension : {2, 3})
      for (const MaterialType type : all_types)
        for (const Real share : {0.1, 0.5, 1.0}) {
          CAPTURE(instruction_set);
          CAPTURE(dimension);
          CAPTURE(static_cast<int>(type));
          CAPTURE(share);
          DEMModel model = makeModel(type, dimension);
          ByTheBook book(model);
          breakBonds(model, book, share);
          // Pressed together by 0.3, neighbours are 0.7 h apart, closer than 0.95 h; the next
          // ones, 1.41 h at first, just about.
          State& state = model.state();
          Random random(47);
          for (std::size_t i = 0; i < state.size(); ++i)
            setDisplacement(state, i, -0.3 * state.x_ref[i] + 0.05 * h * random.vector(dimension));
          Forces pieces(model, smallPieces());
          Forces computed(model, smallPieces(Lengths::of_shared_patterns));
          pieces.evaluate();
          computed.evaluate();
          evaluate(model);
          book.evaluate();
          checkAgrees(state, book);
          checkAgrees(pieces.state, book);
          checkSameBits(pieces, computed);
          CHECK(brokenBonds(model) == book.brokenBonds());
          // The forces of self-contact are there: without them a body in bits has none.
          if (share == 1) CHECK(largestNorm(state.f) > 0);
        }
  }
}
