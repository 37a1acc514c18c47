#include "peridynamic.h"

#include <omp.h>

#include <algorithm>

namespace peridem {

namespace {

// Work below which waking threads costs more than it saves.
constexpr std::size_t groups_worth_threads = 5000;

void clearFlag(void* table, Index i, Index j, bool both) {
  auto& bonds = *static_cast<BondTable*>(table);
  bonds.intact[bonds.find(i, j)] = 0;
  if (both) bonds.intact[bonds.find(j, i)] = 0;
}

}  // namespace

LawView PeridynamicForce::lawOf(Index body) const {
  const Law& law = laws_[static_cast<std::size_t>(body)];
  LawView view;
  view.lps = std::get_if<Lps>(&law);
  view.pmb = std::get_if<Pmb>(&law);
  view.rnp = std::get_if<Rnp>(&law);
  view.state_based_stage = state_based_stage_;
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
    scratch_.emplace_back(places, groups, groups_of_whole);
}

void PeridynamicForce::runStage(Stage stage, const Block& block, State& state, BondTable* bonds,
                                const Vec3& body_force, KernelSpace& scratch,
                                const Particle* next) {
  const NodeArrays nodes{state.u.front().data(), state.f.front().data(), state.theta.data(),
                         state.damage_z.data()};
  BlockView view = block.view;
  for (int d = 0; d < 3; ++d) view.body_force[d] = body_force[d];
  view.write_theta = dilatation_known_;
  if (next != nullptr) {
    const auto start = static_cast<std::size_t>(next->start);
    view.next[0] = state.f[start].data();
    view.next[1] = state.v[start].data();
    view.next[2] = state.u[start].data();
    view.next[3] = state.x[start].data();
    view.next_lines = static_cast<std::size_t>(next->nodes()) * sizeof(Vec3) / 64;
  }
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
  // Bodies that follow each other, so that a thread can fetch its next one early; few enough that
  // no thread ends with a long share.
  const std::ptrdiff_t bodies_at_a_time =
      std::clamp<std::ptrdiff_t>(n_whole / (32 * threads), 1, 8);
  Kick kicked;
#pragma omp parallel num_threads(threads) if (intact_.size() > groups_worth_threads)
  {
    KernelSpace& scratch = scratch_[static_cast<std::size_t>(omp_get_thread_num())];
    Kick own;
    const auto runBlock = [&](Stage stage, const Block& block, const Particle* next = nullptr) {
      const Particle& body = bodies[static_cast<std::size_t>(block.body)];
      if (motion != nullptr && stage == Stage::whole)
        own.merge(move(*motion, state, body, body.start, body.stop));
      runStage(stage, block, state, &bonds, body.density * gravity, scratch, next);
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
#pragma omp for schedule(dynamic, bodies_at_a_time)
    for (std::ptrdiff_t k = 0; k < n_whole; ++k) {
      const auto block = static_cast<std::size_t>(k);
      const Particle* next = block + 1 < whole_.size()
                                 ? &bodies[static_cast<std::size_t>(whole_[block + 1].body)]
                                 : nullptr;
      runBlock(Stage::whole, whole_[block], next);
    }
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runBlock(Stage::dilatation, pieces_[static_cast<std::size_t>(k)]);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runBlock(Stage::force, pieces_[static_cast<std::size_t>(k)]);
#pragma omp critical(peridem_kick)
    kicked.merge(own);
  }
  dilatation_known_ = true;
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
    KernelSpace& scratch = scratch_[static_cast<std::size_t>(omp_get_thread_num())];
    const auto n_pieces = static_cast<std::ptrdiff_t>(pieces_.size());
#pragma omp for schedule(static)
    for (std::ptrdiff_t k = 0; k < n_pieces; ++k)
      runStage(Stage::place, pieces_[static_cast<std::size_t>(k)], state, nullptr, Vec3::Zero(),
               scratch);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n; ++k) {
      const auto index = static_cast<std::size_t>(k);
      const Block& block = index < whole_.size() ? whole_[index] : pieces_[index - whole_.size()];
      runStage(Stage::damage, block, state, nullptr, Vec3::Zero(), scratch);
    }
  }
}

std::size_t PeridynamicForce::bytes() const {
  std::size_t sum = intact_.size() + numbers_.size() * sizeof(double);
  for (const BondPattern& pattern : patterns_) sum += pattern.bytes();
  for (const Exchange& exchange : exchanges_) sum += 4 * exchange.theta.size() * sizeof(double);
  return sum;
}

}  // namespace peridem
