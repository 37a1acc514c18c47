#include "peridynamic.h"

#include <omp.h>

#include <algorithm>
#include <cmath>

#include "instruction_set.h"
#include "partition.h"

namespace peridem {

namespace {

// Work below which waking threads costs more than it saves.
constexpr std::size_t groups_worth_threads = 5000;

// The law of a body in its frame, where lengths are in units of the horizon: of its constants only
// beta has a dimension that shows there; the others show in the unit of force.
class LawInFrame {
 public:
  explicit LawInFrame(const Particle& body) {
    view_.lps = std::get_if<Lps>(&body.law);
    view_.pmb = std::get_if<Pmb>(&body.law);
    if (const auto* rnp = std::get_if<Rnp>(&body.law)) {
      rnp_ = *rnp;
      rnp_.beta *= body.horizon;
      rnp_.sc_times_sqrt_r /= std::sqrt(body.horizon);
      view_.rnp = &rnp_;
    }
  }
  LawInFrame(const LawInFrame&) = delete;
  LawInFrame& operator=(const LawInFrame&) = delete;
  LawView& view() { return view_; }

 private:
  Rnp rnp_{};
  LawView view_;
};

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
  makeTables(bodies);
}

void PeridynamicForce::addBody(const State& state, const BondTable& bonds,
                               const std::vector<Particle>& bodies, const Particle& body,
                               const BlockSizes& sizes) {
  const bool whole = body.nodes() <= sizes.whole;
  for (std::size_t k = 0; whole && k < patterns_.size(); ++k) {
    const Particle& other = bodies[static_cast<std::size_t>(pattern_bodies_[k])];
    if (patterns_[k].n_own == static_cast<std::size_t>(body.nodes()) &&
        sameInFrame(state, bonds, other, body, dimension_)) {
      whole_.push_back({body.id, k, 0});
      return;
    }
  }
  std::size_t n_places = 0;
  const Index parts = whole ? 1 : (body.nodes() + sizes.piece - 1) / sizes.piece;
  for (BondPattern& pattern : makeBondPatterns(state, bonds, body, dimension_,
                                               partitionBody(state, bonds, body, parts), parts)) {
    (whole ? whole_ : pieces_).push_back({body.id, patterns_.size(), 0});
    n_places = pattern.first_place + pattern.n_padded;
    patterns_.push_back(std::move(pattern));
    pattern_bodies_.push_back(body.id);
  }
  if (whole) return;
  Exchange& exchange = exchanges_[static_cast<std::size_t>(body.id)];
  for (auto& component : exchange.z) component = AlignedArray(n_places);
  exchange.theta = AlignedArray(n_places);
}

// Patterns that bodies share get a table, and those whose weights take long to compute.
void PeridynamicForce::makeTables(const std::vector<Particle>& bodies) {
  for (const auto* blocks : {&whole_, &pieces_})
    for (const Block& block : *blocks) {
      const Particle& body = bodies[static_cast<std::size_t>(block.body)];
      BondPattern& pattern = patterns_[block.pattern];
      const bool shared = block.body != pattern_bodies_[block.pattern];
      const bool gaussian = influences_[static_cast<std::size_t>(body.id)].numbers().beta > 0;
      if (pattern.numbers.size() > 0 || !(shared || gaussian || getenv("PTAB"))) continue;
      pattern.numbers = AlignedArray(pattern.groups.size() * group_numbers);
      run_(Stage::table, dimension_, LawInFrame(body).view(), viewOf(block, body), {}, {}, {});
    }
}

BlockView PeridynamicForce::viewOf(const Block& block, const Particle& body) {
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
                                const std::vector<Particle>& bodies, Scratch& scratch) {
  const Particle& body = bodies[static_cast<std::size_t>(block.body)];
  LawInFrame law(body);
  law.view().state_based_stage = state_based_stage_;
  const NodeArrays nodes{state.u.front().data(), state.f.front().data(), state.theta.data(),
                         state.damage_z.data()};
  run_(stage, dimension_, law.view(), viewOf(block, body), nodes, scratch.view(),
       {clearFlag, bonds});
}

void PeridynamicForce::compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
                               int threads) {
  prepareScratch(threads);
  const auto n_whole = static_cast<std::ptrdiff_t>(whole_.size());
  const auto n_pieces = static_cast<std::ptrdiff_t>(pieces_.size());
  const auto run = [&](Stage stage, std::vector<Block>& blocks, std::ptrdiff_t k,
                       Scratch& scratch) {
    runStage(stage, blocks[static_cast<std::size_t>(k)], state, &bonds, bodies, scratch);
  };
#pragma omp parallel num_threads(threads) if (intact_.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(static) nowait
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k) run(Stage::place, pieces_, k, scratch);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_whole; ++k) run(Stage::whole, whole_, k, scratch);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k) run(Stage::dilatation, pieces_, k, scratch);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k) run(Stage::force, pieces_, k, scratch);
  }
}

void PeridynamicForce::computeDamage(State& state, const std::vector<Particle>& bodies,
                                     int threads) {
  prepareScratch(threads);
  const auto n = static_cast<std::ptrdiff_t>(whole_.size() + pieces_.size());
#pragma omp parallel num_threads(threads) if (intact_.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      const auto index = static_cast<std::size_t>(k);
      const Block& block = index < whole_.size() ? whole_[index] : pieces_[index - whole_.size()];
      runStage(Stage::damage, block, state, nullptr, bodies, scratch);
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
