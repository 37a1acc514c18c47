// The table of a pattern as the kernels fill it: lengths and weights of the bonds of a body.
#include <Eigen/Geometry>

#include "instruction_sets.h"
#include "many_bodies.h"
#include "peridem/bond_block.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real horizon = 0.3;
constexpr Real mesh_size = 0.1;

// One body of 42 nodes with unequal volumes, and its pattern.
struct Scene {
  ManyBodies bodies;
  BondPattern pattern;

  Scene() : bodies({disturbed()}) {
    Random random(11);
    for (Real& volume : bodies.state.volume) volume *= 1 + 0.2 * random();
    const std::vector<Index> piece(bodies.state.size(), 0);
    pattern = std::move(
        makeBondPatterns(bodies.state, bodies.bonds, bodies.list[0], 2, piece, 1).front());
  }
  static std::vector<Vec3> disturbed() {
    std::vector<Vec3> points = quadGrid(7, 6, mesh_size).points;
    Random random(7);
    for (Vec3& x : points) x += 0.1 * mesh_size * random.vector(2);
    return points;
  }
};

template <class T>
LawView viewOf(const T& law) {
  LawView view;
  if constexpr (std::is_same_v<T, Lps>) view.lps = &law;
  if constexpr (std::is_same_v<T, Pmb>) view.pmb = &law;
  if constexpr (std::is_same_v<T, Rnp>) view.rnp = &law;
  return view;
}

// 8 lengths, 8 weights for each group.
constexpr std::size_t group_numbers = numbersOf(TableOf::lengths_and_weights);

template <class T>
AlignedArray tableOf(const BondPattern& pattern, const Influence& influence) {
  AlignedArray numbers(pattern.groups.size() * group_numbers);
  BlockView view{};
  view.n_own = pattern.n_own;
  view.n_padded = pattern.n_padded;
  view.n_tiles = pattern.tiles.size();
  view.tiles = pattern.tiles.data();
  view.groups = pattern.groups.data();
  view.numbers = numbers.data();
  for (std::size_t d = 0; d < 3; ++d) view.z_ref[d] = pattern.z_ref[d].data();
  view.volume = pattern.volume.data();
  view.influence = influence.numbers();
  const Real h = mesh_size / horizon;
  view.reference = {(1 - h / 2) / (1 - fuzzy_tolerance), (1 - h / 2) / h, 1 / h};
  const T law{};
  kernelFor(instructionSet())(Stage::table, 2, viewOf(law), view, {}, {}, {});
  return numbers;
}

// Compares with bondConstants(): r and J V_j with the partial volume.
template <class T>
void checkTable(const Scene& scene, const InfluenceDeck& deck) {
  const BondPattern& pattern = scene.pattern;
  const Influence influence(deck, 2);
  const AlignedArray numbers = tableOf<T>(pattern, influence);
  const State& state = scene.bodies.state;
  const Real unit = horizon * horizon;
  Real worst = 0;
  std::size_t cut = 0;
  std::size_t wrong = 0;
  for (const TileBonds& tile : pattern.tiles)
    for (std::size_t g = tile.begin; g < tile.end; ++g)
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const Real number = numbers[group_numbers * g + lane];
        const Real weight = numbers[group_numbers * g + lanes + lane];
        if (!((pattern.groups[g].exists >> lane) & 1)) {
          wrong += number != 1 || weight != 0;
          continue;
        }
        const Index i = pattern.nodes[tile.tile + lane];
        const Index j = pattern.nodes[pattern.groups[g].row];
        const auto [r, J] = bondConstants(state, scene.bodies.list[0], influence, i, j);
        const Real length = r / horizon;
        const auto weightOf = [&](Real J_V) {
          const Real V = state.volume[static_cast<std::size_t>(i)] / unit;
          return T::weight(J_V / unit, 1 / length) * V;
        };
        const Real full = weightOf(influence(0) * state.volume[static_cast<std::size_t>(j)]);
        worst =
            std::max({worst, relativeError(number, T::along_deformed_bond ? length : 1 / length),
                      std::abs(weight - weightOf(J)) / full});
        cut += r > horizon - mesh_size / 2;
      }
  CHECK(wrong == 0);
  CHECK(cut > 0);
  // Coordinates of up to 2 horizons, turned into the frame and subtracted, leave 4 epsilon of a
  // length of 0.3 horizons: 13 epsilon. It changes a partial volume by 3 times as much (eps / h),
  // J by less.
  CHECK(worst < 50 * epsilon);
}

}  // namespace

TEST_CASE("bond table: has lengths and weights of the bonds, one and zero where there is none") {
  const Scene scene;
  for (const std::string& instruction_set : availableInstructionSets()) {
    const UseInstructionSet use(instruction_set);
    CAPTURE(instruction_set);
    for (const InfluenceDeck& influence :
         {InfluenceDeck{InfluenceType::constant, {}}, InfluenceDeck{InfluenceType::linear, {}},
          InfluenceDeck{InfluenceType::gaussian, {}}}) {
      checkTable<Lps>(scene, influence);
      checkTable<Pmb>(scene, influence);
      checkTable<Rnp>(scene, influence);
    }
  }
}
