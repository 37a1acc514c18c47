// How PeridynamicForce is built: blocks, patterns, tables, and what the kernels see of them.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "instruction_set.h"
#include "partition.h"
#include "peridynamic.h"

namespace peridem {

namespace {

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

std::size_t quarterOfMemory() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return std::size_t{1} << 30;
  return static_cast<std::size_t>(pages) * static_cast<std::size_t>(page) / 4;
}

}  // namespace

bool lengthsPay(const std::string& instruction_set, std::size_t bytes) {
  constexpr std::size_t in_cache = std::size_t{1} << 24;
  return bytes <= (instruction_set == "avx512" ? in_cache : quarterOfMemory());
}

PeridynamicForce::PeridynamicForce(const State& state, const BondTable& bonds,
                                   const std::vector<Particle>& bodies,
                                   const std::vector<Influence>& influences, int dimension,
                                   Compatibility mode, const BlockSizes& sizes, int threads)
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
  // Bodies that never move have no internal forces.
  addWholeBodies(state, bonds, bodies, sizes.whole, threads);
  for (const Particle& body : bodies)
    if (!body.constrained && body.nodes() > sizes.whole)
      addPieces(state, bonds, body, sizes.nodesOfPiece(body.nodes()), threads);
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
  makeTables(bodies, sizes.lengths);
  for (auto* blocks : {&whole_, &pieces_})
    for (Block& block : *blocks)
      block.view = makeView(block, bodies[static_cast<std::size_t>(block.body)]);
  for (const Particle& body : bodies)
    if (body.constrained || body.nodes() > sizes.whole)
      for (Index begin = body.start; begin < body.stop; begin += nodes_of_range)
        other_nodes_.push_back({begin, std::min(begin + nodes_of_range, body.stop), body.id});
}

void PeridynamicForce::addWholeBodies(const State& state, const BondTable& bonds,
                                      const std::vector<Particle>& bodies, Index largest,
                                      int threads) {
  for (const Particle& body : bodies)
    if (!body.constrained && body.nodes() <= largest) whole_.push_back({body.id, 0, 0, {}});
  const auto n_bodies = static_cast<std::ptrdiff_t>(whole_.size());
  std::vector<std::uint64_t> hashes(whole_.size());
#pragma omp parallel for num_threads(threads) schedule(static) if (n_bodies > 100)
  for (std::ptrdiff_t k = 0; k < n_bodies; ++k) {
    const auto block = static_cast<std::size_t>(k);
    hashes[block] = hashOfBonds(bonds, bodies[static_cast<std::size_t>(whole_[block].body)]);
  }
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> found;  // patterns by hash
  for (std::size_t k = 0; k < whole_.size(); ++k) {
    const Particle& body = bodies[static_cast<std::size_t>(whole_[k].body)];
    auto& candidates = found[hashes[k]];
    const auto same = std::find_if(candidates.begin(), candidates.end(), [&](std::size_t pattern) {
      const Particle& other = bodies[static_cast<std::size_t>(pattern_bodies_[pattern])];
      return sameInFrame(state, bonds, other, body, dimension_);
    });
    if (same == candidates.end()) {
      candidates.push_back(pattern_bodies_.size());
      whole_[k].pattern = pattern_bodies_.size();
      pattern_bodies_.push_back(body.id);
    } else {
      whole_[k].pattern = *same;
    }
  }
  patterns_.resize(pattern_bodies_.size());
  const auto n_patterns = static_cast<std::ptrdiff_t>(patterns_.size());
#pragma omp parallel for num_threads(threads) schedule(dynamic, 1) if (n_patterns > 1)
  for (std::ptrdiff_t k = 0; k < n_patterns; ++k) {
    const auto pattern = static_cast<std::size_t>(k);
    const Particle& body = bodies[static_cast<std::size_t>(pattern_bodies_[pattern])];
    patterns_[pattern] = makeBondPattern(state, bonds, body, dimension_);
  }
}

void PeridynamicForce::addPieces(const State& state, const BondTable& bonds, const Particle& body,
                                 Index nodes_of_piece, int threads) {
  const Index parts = (body.nodes() + nodes_of_piece - 1) / nodes_of_piece;
  std::size_t n_places = 0;
  for (BondPattern& pattern :
       makeBondPatterns(state, bonds, body, dimension_, partitionBody(state, bonds, body, parts),
                        parts, threads)) {
    pieces_.push_back({body.id, patterns_.size(), 0, {}});
    n_places = pattern.first_place + pattern.n_padded;
    patterns_.push_back(std::move(pattern));
    pattern_bodies_.push_back(body.id);
  }
  Exchange& exchange = exchanges_[static_cast<std::size_t>(body.id)];
  for (auto& component : exchange.z) component = AlignedArray(n_places);
  exchange.theta = AlignedArray(n_places);
}

void PeridynamicForce::makeTables(const std::vector<Particle>& bodies, Lengths lengths) {
  std::size_t n_all = 0;
  for (const BondPattern& pattern : patterns_)
    n_all += pattern.groups.size() * numbersOf(TableOf::lengths_and_weights);
  const bool all =
      lengths == Lengths::of_all ||
      (lengths == Lengths::automatic && lengthsPay(instruction_set_, n_all * sizeof(double)));
  tables_.assign(patterns_.size(), all ? TableOf::lengths_and_weights : TableOf::weights);
  for (const Block& block : whole_)
    if (block.body != pattern_bodies_[block.pattern])
      tables_[block.pattern] = TableOf::lengths_and_weights;
  std::size_t n = 0;
  for (std::size_t k = 0; k < patterns_.size(); ++k) {
    first_number_.push_back(n);
    n += patterns_[k].groups.size() * numbersOf(tables_[k]);
  }
  numbers_ = AlignedArray(n);
  for (const auto* blocks : {&whole_, &pieces_})
    for (const Block& block : *blocks)
      if (block.body == pattern_bodies_[block.pattern])
        run_(Stage::table, dimension_, lawOf(block.body),
             makeView(block, bodies[static_cast<std::size_t>(block.body)]), {}, {}, {});
}

BlockView PeridynamicForce::makeView(const Block& block, const Particle& body) {
  BondPattern& pattern = patterns_[block.pattern];
  Exchange& exchange = exchanges_[static_cast<std::size_t>(body.id)];
  const Real volume_unit = std::pow(body.horizon, dimension_);
  // Force density in the model over that in the frame.
  const Real force_unit = std::holds_alternative<Lps>(body.law) ? 1 / body.horizon : volume_unit;
  BlockView view{pattern.n_own,
                 pattern.n_padded,
                 pattern.n_halo,
                 pattern.tiles.size(),
                 pattern.nodes.data(),
                 pattern.halo_places.data(),
                 pattern.tiles.data(),
                 pattern.groups.data(),
                 numbers_.data() + first_number_[block.pattern],
                 tables_[block.pattern],
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
                 {},
                 false,
                 {},
                 0};
  const Real h = body.mesh_size / body.horizon;
  view.reference = {(1 - h / 2) / (1 - fuzzy_tolerance), (1 - h / 2) / h, 1 / h};
  for (int d = 0; d < 3; ++d)
    for (int e = 0; e < 3; ++e) {
      view.into_frame[d][e] = body.rotation(e, d) / body.horizon;
      view.out_of_frame[d][e] = body.rotation(d, e) * force_unit;
    }
  return view;
}

void PeridynamicForce::importFlags(const BondTable& bonds, const std::vector<Particle>& bodies) {
  const bool all_intact =
      std::find(bonds.intact.begin(), bonds.intact.end(), 0) == bonds.intact.end();
  for (const auto* blocks : {&whole_, &pieces_})
    for (const Block& block : *blocks) {
      const BondPattern& pattern = patterns_[block.pattern];
      const Index start = bodies[static_cast<std::size_t>(block.body)].start;
      for (const TileBonds& tile : pattern.tiles)
        for (std::size_t g = tile.begin; g < tile.end; ++g) {
          const BondGroup group = pattern.groups[g];
          unsigned bits = 0;
          if (all_intact) {
            intact_[block.first_group + g] = group.exists;
            continue;
          }
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

}  // namespace peridem
