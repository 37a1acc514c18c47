#include "peridynamic.h"

#include <omp.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "instruction_set.h"
#include "partition.h"

namespace peridem {

namespace {

// Work below which waking threads costs more than it saves.
constexpr std::size_t groups_worth_threads = 5000;
constexpr Index nodes_of_range = 4096;

// The law of a body in its frame, where lengths are in units of the horizon: of its constants only
// beta has a dimension that shows there; the others show in the unit of force.
Law inFrame(Law law, Real horizon) {
  if (auto* rnp = std::get_if<Rnp>(&law)) {
    rnp->beta *= horizon;
    rnp->sc_times_sqrt_r /= std::sqrt(horizon);
  }
  return law;
}

// Tables of bonds that no two bodies share are kept while all of them fit into this part of the
// last-level cache: from memory they are not faster than computing the numbers again.
std::size_t tableBudget() {
  long cache = 0;
#ifdef _SC_LEVEL3_CACHE_SIZE
  cache = sysconf(_SC_LEVEL3_CACHE_SIZE);
#endif
  return cache > 0 ? static_cast<std::size_t>(cache) / 2 : std::size_t{8} << 20;
}

void clearFlag(void* table, Index i, Index j, bool both) {
  auto& bonds = *static_cast<BondTable*>(table);
  bonds.intact[bonds.find(i, j)] = 0;
  if (both) bonds.intact[bonds.find(j, i)] = 0;
}

}  // namespace

// Space of one thread for the largest block, allocated once.
class PeridynamicForce::Scratch {
 public:
  Scratch(std::size_t places, std::size_t groups, std::size_t groups_of_whole)
      : space_((8 + 3 * lanes) * places + 2 * lanes * groups_of_whole), close_(groups) {
    double* next = space_.data();
    const auto take = [&](std::size_t n) {
      double* begin = next;
      next += n;
      return begin;
    };
    for (int d = 0; d < 3; ++d) {
      view_.z[d] = take(places);
      view_.row[d] = take(lanes * places);
      view_.column[d] = take(places);
    }
    view_.theta_a = take(places);
    view_.sum = take(places);
    view_.J_r_by_length = take(lanes * groups_of_whole);
    view_.J_e_by_length = take(lanes * groups_of_whole);
    view_.close = close_.data();
  }
  const KernelScratch& view() const { return view_; }

 private:
  AlignedArray space_;
  std::vector<CloseGroup> close_;
  KernelScratch view_{};
};

PeridynamicForce::PeridynamicForce() = default;
PeridynamicForce::~PeridynamicForce() = default;
PeridynamicForce::PeridynamicForce(PeridynamicForce&&) noexcept = default;
PeridynamicForce& PeridynamicForce::operator=(PeridynamicForce&&) noexcept = default;

PeridynamicForce::PeridynamicForce(const State& state, const BondTable& bonds,
                                   const std::vector<Particle>& bodies,
                                   const std::vector<Influence>& influences, int dimension,
                                   Compatibility mode, const BlockSizes& sizes)
    : dimension_(dimension),
      instruction_set_(peridem::instructionSet()),
      run_(kernelFor(instruction_set_)),
      move_(moveKernelFor(instruction_set_)),
      influences_(influences) {
  // In the original the material of body 0 decides whether dilatation and the break test of
  // state-based bonds run at all, for all bodies.
  if (mode == Compatibility::original)
    state_based_stage_ = std::holds_alternative<Lps>(bodies.front().law);
  exchanges_.resize(bodies.size());
  for (const Particle& body : bodies)
    if (!body.constrained)  // those have no internal forces
      addBody(state, bonds, bodies, body, sizes);
  // Largest first, so that no thread ends with a long one.
  std::stable_sort(whole_.begin(), whole_.end(), [&](const Block& p, const Block& q) {
    return patterns_[p.pattern].groups.size() > patterns_[q.pattern].groups.size();
  });
  std::size_t n_groups = 0;
  for (auto* blocks : {&whole_, &pieces_})
    for (Block& block : *blocks) {
      block.first_group = n_groups;
      n_groups += patterns_[block.pattern].groups.size();
    }
  intact_.resize(n_groups);
  importFlags(bonds, bodies);
  for (const Particle& body : bodies) laws_.push_back(inFrame(body.law, body.horizon));
  makeTables(bodies, sizes.tables);
  for (auto* blocks : {&whole_, &pieces_})
    for (Block& block : *blocks)
      block.view = makeView(block, bodies[static_cast<std::size_t>(block.body)]);
  for (const Particle& body : bodies)
    if (body.constrained || body.nodes() > sizes.whole)
      for (Index begin = body.start; begin < body.stop; begin += nodes_of_range)
        other_nodes_.push_back(
            {begin, std::min(begin + nodes_of_range, body.stop), body.id});
}

void PeridynamicForce::addBody(const State& state, const BondTable& bonds,
                               const std::vector<Particle>& bodies, const Particle& body,
                               const BlockSizes& sizes) {
  const bool whole = body.nodes() <= sizes.whole;
  for (std::size_t k = 0; whole && k < patterns_.size(); ++k) {
    const Particle& other = bodies[static_cast<std::size_t>(pattern_bodies_[k])];
    if (patterns_[k].n_own == static_cast<std::size_t>(body.nodes()) &&
        sameInFrame(state, bonds, other, body, dimension_)) {
      whole_.push_back({body.id, k, 0, {}});
      return;
    }
  }
  std::size_t n_places = 0;
  const Index parts = whole ? 1 : (body.nodes() + sizes.piece - 1) / sizes.piece;
  for (BondPattern& pattern : makeBondPatterns(state, bonds, body, dimension_,
                                               partitionBody(state, bonds, body, parts), parts)) {
    (whole ? whole_ : pieces_).push_back({body.id, patterns_.size(), 0, {}});
    n_places = pattern.first_place + pattern.n_padded;
    patterns_.push_back(std::move(pattern));
    pattern_bodies_.push_back(body.id);
  }
  if (whole) return;
  Exchange& exchange = exchanges_[static_cast<std::size_t>(body.id)];
  for (auto& component : exchange.z) component = AlignedArray(n_places);
  exchange.theta = AlignedArray(n_places);
}

// Patterns that bodies share get a table, those whose weights take long to compute, and all of
// them when they are few.
void PeridynamicForce::makeTables(const std::vector<Particle>& bodies, Tables tables) {
  std::vector<char> shared(patterns_.size(), 0);
  std::size_t unshared_bytes = 0;
  for (const Block& block : whole_)
    if (block.body != pattern_bodies_[block.pattern]) shared[block.pattern] = 1;
  for (std::size_t k = 0; k < patterns_.size(); ++k)
    if (!shared[k]) unshared_bytes += patterns_[k].groups.size() * group_numbers * sizeof(double);
  const bool fits = unshared_bytes <= tableBudget();
  const auto wanted = [&](std::size_t pattern) {
    if (tables != Tables::where_faster) return tables == Tables::all;
    return shared[pattern] || fits;
  };
  for (auto* blocks : {&whole_, &pieces_})
    for (Block& block : *blocks) {
      const auto body = static_cast<std::size_t>(block.body);
      BondPattern& pattern = patterns_[block.pattern];
      const bool gaussian = influences_[body].numbers().beta > 0;
      if (block.body == pattern_bodies_[block.pattern] &&
          (gaussian || wanted(block.pattern))) {
        pattern.numbers = AlignedArray(pattern.groups.size() * group_numbers);
        run_(Stage::table, dimension_, lawOf(block.body), makeView(block, bodies[body]), {}, {}, {});
      }
    }
}

LawView PeridynamicForce::lawOf(Index body) const {
  const Law& law = laws_[static_cast<std::size_t>(body)];
  LawView view;
  view.lps = std::get_if<Lps>(&law);
  view.pmb = std::get_if<Pmb>(&law);
  view.rnp = std::get_if<Rnp>(&law);
  view.state_based_stage = state_based_stage_;
  return view;
}

BlockView PeridynamicForce::makeView(const Block& block, const Particle& body) {
  BondPattern& pattern = patterns_[block.pattern];
  Exchange& exchange = exchanges_[static_cast<std::size_t>(body.id)];
  const Real volume_unit = std::pow(body.horizon, dimension_);
  // Force density in the model over that in the frame.
  const Real force_unit =
      std::holds_alternative<Lps>(body.law) ? 1 / body.horizon : volume_unit;
  BlockView view{
      pattern.n_own,
      pattern.n_padded,
      pattern.n_halo,
      pattern.tiles.size(),
      pattern.nodes.data(),
      pattern.halo_places.data(),
      pattern.tiles.data(),
      pattern.groups.data(),
      pattern.numbers.size() > 0 ? pattern.numbers.data() : nullptr,
      intact_.data() + block.first_group,
      {pattern.z_ref[0].data(), pattern.z_ref[1].data(), pattern.z_ref[2].data()},
      pattern.volume.data(),
      pattern.inverse_volume.data(),
      pattern.dilatation_factor.data(),
      pattern.a.data(),
      pattern.b.data(),
      static_cast<std::size_t>(body.start),
      static_cast<std::size_t>(body.center_node),
      {},
      {},
      {},
      body.self_contact_radius / body.horizon,
      body.self_contact_kn * volume_unit * body.horizon / force_unit,
      {{exchange.z[0].data(), exchange.z[1].data(), exchange.z[2].data()},
       exchange.theta.data(),
       pattern.first_place},
      influences_[static_cast<std::size_t>(body.id)].numbers(),
      {}};
  const Real h = body.mesh_size / body.horizon;
  view.reference = {(1 - h / 2) / (1 - fuzzy_tolerance), (1 - h / 2) / h, 1 / h};
  for (int d = 0; d < 3; ++d)
    for (int e = 0; e < 3; ++e) {
      view.into_frame[d][e] = body.rotation(e, d) / body.horizon;
      view.out_of_frame[d][e] = body.rotation(d, e) * force_unit;
    }
  return view;
}

void PeridynamicForce::prepareScratch(int threads) {
  std::size_t places = 0;
  std::size_t groups = 0;
  std::size_t groups_of_whole = 0;
  if (scratch_.size() >= static_cast<std::size_t>(threads)) return;
  for (const BondPattern& pattern : patterns_) {
    places = std::max(places, pattern.n_all);
    groups = std::max(groups, pattern.groups.size());
  }
  for (const Block& block : whole_)
    groups_of_whole = std::max(groups_of_whole, patterns_[block.pattern].groups.size());
  while (scratch_.size() < static_cast<std::size_t>(threads))
    scratch_.push_back(std::make_unique<Scratch>(places, groups, groups_of_whole));
}

void PeridynamicForce::runStage(Stage stage, const Block& block, State& state, BondTable* bonds,
                                const Vec3& body_force, Scratch& scratch) {
  const NodeArrays nodes{state.u.front().data(), state.f.front().data(), state.theta.data(),
                         state.damage_z.data()};
  BlockView view = block.view;
  for (int d = 0; d < 3; ++d) view.body_force[d] = body_force[d];
  run_(stage, dimension_, lawOf(block.body), view, nodes, scratch.view(), {clearFlag, bonds});
}

void PeridynamicForce::compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
                               const Vec3& gravity, int threads) {
  run(nullptr, state, bonds, bodies, gravity, threads);
}

Kick PeridynamicForce::moveAndCompute(const KickAndDrift& motion, State& state, BondTable& bonds,
                                      const std::vector<Particle>& bodies, const Vec3& gravity,
                                      int threads) {
  return run(&motion, state, bonds, bodies, gravity, threads);
}

Kick PeridynamicForce::run(const KickAndDrift* motion, State& state, BondTable& bonds,
                           const std::vector<Particle>& bodies, const Vec3& gravity, int threads) {
  prepareScratch(threads);
  const auto n_ranges = static_cast<std::ptrdiff_t>(other_nodes_.size());
  const auto n_whole = static_cast<std::ptrdiff_t>(whole_.size());
  const auto n_pieces = static_cast<std::ptrdiff_t>(pieces_.size());
  Kick kicked;
#pragma omp parallel num_threads(threads) if (intact_.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
    Kick own;
    const auto runBlock = [&](Stage stage, const Block& block) {
      const Particle& body = bodies[static_cast<std::size_t>(block.body)];
      if (motion != nullptr && stage == Stage::whole)
        own.merge(move(*motion, state, body, body.start, body.stop));
      runStage(stage, block, state, &bonds, body.density * gravity, scratch);
    };
#pragma omp for schedule(static)
    for (std::ptrdiff_t k = 0; k < n_ranges; ++k) {
      const NodeRange& range = other_nodes_[static_cast<std::size_t>(k)];
      const Particle& body = bodies[static_cast<std::size_t>(range.body)];
      if (motion != nullptr) own.merge(move(*motion, state, body, range.begin, range.end));
      if (body.constrained)
        std::fill(state.f.begin() + range.begin, state.f.begin() + range.end,
                  body.density * gravity);
    }
#pragma omp for schedule(static) nowait
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runBlock(Stage::place, pieces_[static_cast<std::size_t>(k)]);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_whole; ++k)
      runBlock(Stage::whole, whole_[static_cast<std::size_t>(k)]);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runBlock(Stage::dilatation, pieces_[static_cast<std::size_t>(k)]);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runBlock(Stage::force, pieces_[static_cast<std::size_t>(k)]);
#pragma omp critical(peridem_kick)
    kicked.merge(own);
  }
  return kicked;
}

Kick PeridynamicForce::move(const KickAndDrift& motion, State& state, const Particle& body,
                            Index begin, Index end) const {
  if ((*motion.locked_bodies)[static_cast<std::size_t>(body.id)])
    return motion.move(state, begin, end, dimension_);
  const NodeSpeed speed =
      move_({motion.k / body.density, motion.dt, motion.speed_limit,
             static_cast<std::size_t>(begin), static_cast<std::size_t>(end), dimension_},
            {state.f.front().data(), state.v.front().data(), state.u.front().data(),
             state.x.front().data()});
  return {speed.within_limit, speed.fastest};
}

void PeridynamicForce::computeDamage(State& state, int threads) {
  prepareScratch(threads);
  const auto n = static_cast<std::ptrdiff_t>(whole_.size() + pieces_.size());
#pragma omp parallel num_threads(threads) if (intact_.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      const auto index = static_cast<std::size_t>(k);
      const Block& block = index < whole_.size() ? whole_[index] : pieces_[index - whole_.size()];
      runStage(Stage::damage, block, state, nullptr, Vec3::Zero(), scratch);
    }
  }
}

void PeridynamicForce::importFlags(const BondTable& bonds, const std::vector<Particle>& bodies) {
  for (const auto* blocks : {&whole_, &pieces_})
    for (const Block& block : *blocks) {
      const BondPattern& pattern = patterns_[block.pattern];
      const Index start = bodies[static_cast<std::size_t>(block.body)].start;
      for (const TileBonds& tile : pattern.tiles)
        for (std::size_t g = tile.begin; g < tile.end; ++g) {
          const BondGroup group = pattern.groups[g];
          unsigned bits = 0;
          for (unsigned lane = 0; lane < lanes; ++lane) {
            if (!((group.exists >> lane) & 1u)) continue;
            const Index i = start + pattern.nodes[tile.tile + lane];
            const Index j = start + pattern.nodes[group.row];
            if (bonds.intact[bonds.find(i, j)]) bits |= 1u << lane;
          }
          intact_[block.first_group + g] = static_cast<LaneBits>(bits);
        }
    }
}

std::size_t PeridynamicForce::bytes() const {
  std::size_t sum = intact_.size();
  for (const BondPattern& pattern : patterns_) sum += pattern.bytes();
  for (const Exchange& exchange : exchanges_) sum += 4 * exchange.theta.size() * sizeof(double);
  return sum;
}

}  // namespace peridem
