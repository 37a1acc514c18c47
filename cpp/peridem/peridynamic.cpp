#include "peridynamic.h"

#include <omp.h>

#include <algorithm>

#include "instruction_set.h"
#include "partition.h"

namespace peridem {

namespace {

// Work below which waking threads costs more than it saves.
constexpr std::size_t groups_worth_threads = 5000;

BlockView viewOf(const BondBlock& block, BondGroups& groups, const Particle& body) {
  return {block.n_own,
          block.n_padded,
          block.n_all,
          block.n_inside,
          block.n_groups,
          block.nodes.data(),
          {block.z_ref[0].data(), block.z_ref[1].data(), block.z_ref[2].data()},
          block.volume.data(),
          block.weighted_volume.data(),
          block.a.data(),
          block.b.data(),
          groups.groups.data() + block.first_group,
          groups.numbers.data() + block.first_group * group_numbers,
          static_cast<std::size_t>(body.center_node),
          body.self_contact_radius,
          body.self_contact_kn};
}

LawView viewOf(const Law& law) {
  LawView view;
  view.lps = std::get_if<Lps>(&law);
  view.pmb = std::get_if<Pmb>(&law);
  view.rnp = std::get_if<Rnp>(&law);
  return view;
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
  Scratch(std::size_t places, std::size_t groups)
      : space_((7 + 3 * lanes) * places + 4 * lanes * groups) {
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
      view_.e[d] = take(lanes * groups);
    }
    view_.theta_a = take(places);
    view_.elongation = take(lanes * groups);
  }
  const KernelScratch& view() const { return view_; }

 private:
  AlignedArray space_;
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
      run_(kernelFor(instruction_set_)) {
  // In the original the material of body 0 decides whether dilatation and the break test of
  // state-based bonds run at all, for all bodies.
  if (mode == Compatibility::original)
    state_based_stage_ = std::holds_alternative<Lps>(bodies.front().law);
  for (const Particle& body : bodies) {
    if (body.constrained) continue;  // no internal forces
    const Index parts =
        body.nodes() <= sizes.whole ? 1 : (body.nodes() + sizes.piece - 1) / sizes.piece;
    auto blocks = makeBondBlocks(state, bonds, body, influences[static_cast<std::size_t>(body.id)],
                                 partitionBody(state, bonds, body, parts), parts);
    for (BondBlock& block : blocks) {
      most_places_ = std::max(most_places_, block.n_all);
      if (block.whole_body) most_groups_ = std::max(most_groups_, block.n_groups);
      (block.whole_body ? whole_ : pieces_).push_back(std::move(block));
    }
  }
  // Largest first, so that no thread ends with a long one.
  std::stable_sort(whole_.begin(), whole_.end(),
                   [](const BondBlock& p, const BondBlock& q) { return p.n_groups > q.n_groups; });
  std::vector<BondBlock*> order;
  for (BondBlock& block : whole_) order.push_back(&block);
  for (BondBlock& block : pieces_) order.push_back(&block);
  groups_.pack(order);
  for (const BondBlock* block : order)
    run_(Stage::lengths, dimension_, {},
         viewOf(*block, groups_, bodies[static_cast<std::size_t>(block->body)]), {}, {}, {});
}

void PeridynamicForce::prepareScratch(int threads) {
  while (scratch_.size() < static_cast<std::size_t>(threads))
    scratch_.push_back(std::make_unique<Scratch>(most_places_, most_groups_));
}

void PeridynamicForce::runStage(Stage stage, const BondBlock& block, State& state, BondTable* bonds,
                                const std::vector<Particle>& bodies, Scratch& scratch) {
  const Particle& body = bodies[static_cast<std::size_t>(block.body)];
  LawView law = viewOf(body.law);
  law.state_based_stage = state_based_stage_;
  const NodeArrays nodes{state.u.front().data(), state.f.front().data(), state.theta.data(),
                         state.damage_z.data()};
  run_(stage, dimension_, law, viewOf(block, groups_, body), nodes, scratch.view(),
       {clearFlag, bonds});
}

void PeridynamicForce::compute(State& state, BondTable& bonds, const std::vector<Particle>& bodies,
                               int threads) {
  prepareScratch(threads);
  const auto n_whole = static_cast<std::ptrdiff_t>(whole_.size());
  const auto n_pieces = static_cast<std::ptrdiff_t>(pieces_.size());
  const auto run = [&](Stage stage, std::vector<BondBlock>& blocks, std::ptrdiff_t k,
                       Scratch& scratch) {
    runStage(stage, blocks[static_cast<std::size_t>(k)], state, &bonds, bodies, scratch);
  };
#pragma omp parallel num_threads(threads) if (groups_.groups.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic, 1) nowait
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
#pragma omp parallel num_threads(threads) if (groups_.groups.size() > groups_worth_threads)
  {
    Scratch& scratch = *scratch_[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      const auto index = static_cast<std::size_t>(k);
      BondBlock& block = index < whole_.size() ? whole_[index] : pieces_[index - whole_.size()];
      runStage(Stage::damage, block, state, nullptr, bodies, scratch);
    }
  }
}

void PeridynamicForce::importFlags(const BondTable& bonds) {
  for (auto* blocks : {&whole_, &pieces_})
    for (BondBlock& block : *blocks)
      for (std::size_t g = block.first_group; g < block.first_group + block.n_groups; ++g) {
        BondGroup& group = groups_.groups[g];
        unsigned bits = 0;
        for (unsigned lane = 0; lane < lanes; ++lane) {
          if (!((group.exists >> lane) & 1)) continue;
          const Index i = block.nodes[static_cast<std::size_t>(group.row)];
          const Index j = block.nodes[static_cast<std::size_t>(group.tile) + lane];
          if (bonds.intact[bonds.find(i, j)]) bits |= 1u << lane;
        }
        group.intact = static_cast<LaneBits>(bits);
      }
}

std::size_t PeridynamicForce::bytes() const {
  std::size_t sum = 0;
  for (const auto* blocks : {&whole_, &pieces_})
    for (const BondBlock& block : *blocks) sum += block.bytes();
  return sum;
}

}  // namespace peridem
