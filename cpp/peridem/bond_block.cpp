#include "bond_block.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstring>
#include <new>
#include <numeric>

namespace peridem {

namespace {

constexpr std::size_t tile_nodes = lanes;

std::size_t wholeTiles(std::size_t n) {
  return (n + tile_nodes - 1) / tile_nodes * tile_nodes;
}

}  // namespace

AlignedArray::AlignedArray(std::size_t n) : size_(n) {
  if (n == 0) return;
  constexpr std::size_t huge_page = std::size_t{1} << 21;
  const std::size_t wanted = wholeTiles(n) * sizeof(double);
  const std::size_t boundary = wanted < huge_page ? 64 : huge_page;
  const std::size_t bytes = (wanted + boundary - 1) / boundary * boundary;
  data_.reset(static_cast<double*>(std::aligned_alloc(boundary, bytes)));
  if (!data_) throw std::bad_alloc();
#ifdef __linux__
  if (boundary == huge_page) madvise(data_.get(), bytes, MADV_HUGEPAGE);  // a wish; may fail
#endif
  std::memset(data_.get(), 0, bytes);
}

std::size_t BondBlock::bytes() const {
  const std::size_t doubles = z_ref[0].size() + z_ref[1].size() + z_ref[2].size() + volume.size() +
                              weighted_volume.size() + a.size() + b.size();
  return doubles * sizeof(double) + nodes.size() * sizeof(Index) +
         n_groups * (sizeof(BondGroup) + group_numbers * sizeof(double));
}

void BondGroups::pack(std::span<BondBlock* const> blocks) {
  std::size_t total = 0;
  for (const BondBlock* block : blocks) total += block->n_groups;
  groups.reserve(total);
  numbers = AlignedArray(total * group_numbers);
  for (BondBlock* block : blocks) {
    block->first_group = groups.size();
    std::copy(block->numbers.begin(), block->numbers.end(),
              numbers.data() + groups.size() * group_numbers);
    groups.insert(groups.end(), block->groups.begin(), block->groups.end());
    std::vector<Real>().swap(block->numbers);
    std::vector<BondGroup>().swap(block->groups);
  }
}

namespace {

void bisect(std::span<const Vec3> points, std::span<Index> order) {
  if (order.size() <= tile_nodes) return;
  Vec3 lower = points[static_cast<std::size_t>(order[0])];
  Vec3 upper = lower;
  for (const Index i : order) {
    lower = lower.cwiseMin(points[static_cast<std::size_t>(i)]);
    upper = upper.cwiseMax(points[static_cast<std::size_t>(i)]);
  }
  Eigen::Index axis = 0;
  (upper - lower).maxCoeff(&axis);
  const std::size_t half = std::max(tile_nodes, wholeTiles(order.size() / 2));
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>(half);
  std::nth_element(order.begin(), middle, order.end(), [&](Index i, Index j) {
    const Real xi = points[static_cast<std::size_t>(i)][axis];
    const Real xj = points[static_cast<std::size_t>(j)][axis];
    return xi != xj ? xi < xj : i < j;
  });
  bisect(points, order.first(half));
  bisect(points, order.subspan(half));
}

}  // namespace

std::vector<Index> bisectionOrder(std::span<const Vec3> points) {
  std::vector<Index> order(points.size());
  std::iota(order.begin(), order.end(), Index{0});
  bisect(points, order);
  return order;
}

namespace {

// Builds one block; `place` maps the nodes of the body to places in the block (-1: not in it).
class BlockBuilder {
 public:
  BlockBuilder(const State& state, const BondTable& bonds, const Particle& body,
               const Influence& influence, std::vector<Index>& place)
      : state_(state), bonds_(bonds), body_(body), influence_(influence), place_(place) {}

  BondBlock build(const std::vector<Index>& own, bool whole_body) {
    block_ = BondBlock();
    block_.body = body_.id;
    block_.whole_body = whole_body;
    block_.n_own = own.size();
    append(own);
    block_.n_padded = block_.nodes.size();
    if (!whole_body) append(haloOf(own));
    block_.n_all = block_.nodes.size();
    fillNodes();
    fillGroups();
    for (const Index node : block_.nodes)
      if (node >= 0) place_[static_cast<std::size_t>(node - body_.start)] = -1;
    return std::move(block_);
  }

 private:
  std::span<const Index> neighborsOf(Index node) const {
    const auto row = static_cast<std::size_t>(node);
    const auto begin = static_cast<std::size_t>(bonds_.offsets[row]);
    const auto end = static_cast<std::size_t>(bonds_.offsets[row + 1]);
    return std::span(bonds_.neighbors).subspan(begin, end - begin);
  }

  // Appends nodes in bisection order, padded to whole tiles.
  void append(const std::vector<Index>& nodes) {
    std::vector<Vec3> points;
    for (const Index node : nodes) points.push_back(state_.x_ref[static_cast<std::size_t>(node)]);
    for (const Index k : bisectionOrder(points)) {
      const Index node = nodes[static_cast<std::size_t>(k)];
      place_[static_cast<std::size_t>(node - body_.start)] =
          static_cast<Index>(block_.nodes.size());
      block_.nodes.push_back(node);
    }
    block_.nodes.resize(wholeTiles(block_.nodes.size()), -1);
  }

  std::vector<Index> haloOf(const std::vector<Index>& own) const {
    std::vector<Index> halo;
    for (const Index i : own)
      for (const Index j : neighborsOf(i))
        if (place_[static_cast<std::size_t>(j - body_.start)] < 0) halo.push_back(j);
    std::sort(halo.begin(), halo.end());
    halo.erase(std::unique(halo.begin(), halo.end()), halo.end());
    return halo;
  }

  void fillNodes() {
    const std::size_t n = block_.n_all;
    for (auto& component : block_.z_ref) component = AlignedArray(n);
    block_.volume = AlignedArray(n);
    block_.a = AlignedArray(n);
    block_.b = AlignedArray(n);
    block_.weighted_volume = AlignedArray(n);
    const Vec3& center = state_.x_ref[static_cast<std::size_t>(body_.center_node)];
    const auto* lps = std::get_if<Lps>(&body_.law);
    for (std::size_t k = 0; k < n; ++k) {
      if (block_.nodes[k] < 0) continue;
      const auto node = static_cast<std::size_t>(block_.nodes[k]);
      for (std::size_t d = 0; d < 3; ++d)
        block_.z_ref[d][k] =
            state_.x_ref[node][static_cast<Eigen::Index>(d)] - center[static_cast<Eigen::Index>(d)];
      block_.volume[k] = state_.volume[node];
      const Real m = state_.weighted_volume[node];
      block_.weighted_volume[k] = m;
      if (lps != nullptr && m > 0) {
        block_.a[k] = lps->a(m);
        block_.b[k] = lps->b(m);
      }
    }
  }

  enum class Part { inside, halo };

  // Places of the nodes whose bonds with own node i are stored at i: later own ones, or the halo.
  std::vector<Index> storedPartners(std::size_t i, Part part) const {
    std::vector<Index> places;
    for (const Index j : neighborsOf(block_.nodes[i])) {
      const Index place = place_[static_cast<std::size_t>(j - body_.start)];
      const bool in_halo = place >= static_cast<Index>(block_.n_padded);
      if (place > static_cast<Index>(i) && in_halo == (part == Part::halo)) places.push_back(place);
    }
    std::sort(places.begin(), places.end());
    return places;
  }

  void fillGroups() {
    for (const Part part : {Part::inside, Part::halo}) {
      for (std::size_t i = 0; i < block_.n_own; ++i) appendRow(i, storedPartners(i, part));
      if (part == Part::inside) block_.n_inside = block_.groups.size();
    }
    block_.n_groups = block_.groups.size();
  }

  // Groups of own node i with the given places, ascending.
  void appendRow(std::size_t i, const std::vector<Index>& places) {
    Index last_tile = -1;
    for (const Index place : places) {
      const auto tile = place - place % static_cast<Index>(tile_nodes);
      if (tile != last_tile) {
        block_.groups.push_back({static_cast<Index>(i), tile, 0, 0});
        block_.numbers.insert(block_.numbers.end(), lanes, 1.0);
        block_.numbers.insert(block_.numbers.end(), lanes, 0.0);
        last_tile = tile;
      }
      const auto lane = static_cast<std::size_t>(place - tile);
      BondGroup& group = block_.groups.back();
      group.exists = static_cast<LaneBits>(group.exists | (1u << lane));
      group.intact = group.exists;
      const Real r = distance(block_.nodes[i], block_.nodes[static_cast<std::size_t>(place)]);
      Real* numbers = &block_.numbers[block_.numbers.size() - group_numbers];
      numbers[lane] = r;
      numbers[lanes + lane] =
          influence_(r / body_.horizon) * partialVolume(r, body_.horizon, body_.mesh_size);
    }
  }

  Real distance(Index i, Index j) const {
    return (state_.x_ref[static_cast<std::size_t>(j)] - state_.x_ref[static_cast<std::size_t>(i)])
        .norm();
  }

  const State& state_;
  const BondTable& bonds_;
  const Particle& body_;
  const Influence& influence_;
  std::vector<Index>& place_;
  BondBlock block_;
};

}  // namespace

std::vector<BondBlock> makeBondBlocks(const State& state, const BondTable& bonds,
                                      const Particle& body, const Influence& influence,
                                      const std::vector<Index>& piece, Index parts) {
  std::vector<std::vector<Index>> own(static_cast<std::size_t>(parts));
  for (Index i = 0; i < body.nodes(); ++i)
    own[static_cast<std::size_t>(piece[static_cast<std::size_t>(i)])].push_back(body.start + i);
  std::vector<Index> place(static_cast<std::size_t>(body.nodes()), -1);
  BlockBuilder builder(state, bonds, body, influence, place);
  std::vector<BondBlock> blocks;
  for (const auto& nodes : own)
    if (!nodes.empty()) blocks.push_back(builder.build(nodes, parts == 1));
  return blocks;
}

}  // namespace peridem
