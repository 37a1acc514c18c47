#include "bond_block.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <numeric>

#include "huge_pages.h"

namespace peridem {

namespace {

constexpr std::size_t tile_nodes = lanes;

std::size_t wholeTiles(std::size_t n) {
  return (n + tile_nodes - 1) / tile_nodes * tile_nodes;
}

}  // namespace

AlignedArray::AlignedArray(std::size_t n) : size_(n) {
  if (n == 0) return;
  const std::size_t wanted = wholeTiles(n) * sizeof(double);
  const std::size_t boundary = wanted < huge_page ? 64 : huge_page;
  const std::size_t bytes = (wanted + boundary - 1) / boundary * boundary;
  data_.reset(static_cast<double*>(std::aligned_alloc(boundary, bytes)));
  if (!data_) throw std::bad_alloc();
  wishForHugePages(data_.get(), bytes);
  std::memset(data_.get(), 0, bytes);
}

std::size_t BondPattern::bytes() const {
  const std::size_t doubles = z_ref[0].size() + z_ref[1].size() + z_ref[2].size() + volume.size() +
                              inverse_volume.size() + dilatation_factor.size() + a.size() +
                              b.size();
  return doubles * sizeof(double) + (nodes.size() + n_halo) * sizeof(Index) +
         tiles.size() * sizeof(TileBonds) + groups.size() * sizeof(BondGroup);
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

// A node and the lanes of a tile that it is bonded with.
struct Row {
  Index row;
  LaneBits exists;
};

// Builds one pattern; `place` maps the nodes of the body to places in it (-1: not in it).
class PatternBuilder {
 public:
  PatternBuilder(const State& state, const BondTable& bonds, const Particle& body, int dimension,
                 std::vector<Index>& place)
      : state_(state), bonds_(bonds), body_(body), dimension_(dimension), place_(place) {}

  BondPattern build(const std::vector<Index>& own) {
    pattern_ = BondPattern();
    pattern_.n_own = own.size();
    append(own);
    pattern_.n_padded = pattern_.nodes.size();
    const std::vector<Index> halo = haloOf(own);
    pattern_.n_halo = halo.size();
    append(halo);
    pattern_.n_all = pattern_.nodes.size();
    fillNodes();
    fillGroups();
    for (const Index node : pattern_.nodes)
      if (node >= 0) place_[static_cast<std::size_t>(node)] = -1;
    return std::move(pattern_);
  }

 private:
  static constexpr Index tile_size = static_cast<Index>(tile_nodes);

  std::size_t globalNode(Index node) const { return static_cast<std::size_t>(body_.start + node); }

  // Global numbers.
  std::span<const Index> neighborsOf(Index node) const {
    const Index i = body_.start + node;
    return std::span(bonds_.neighbors).subspan(bonds_.begin(i), bonds_.end(i) - bonds_.begin(i));
  }
  Index placeOf(Index global) const {
    return place_[static_cast<std::size_t>(global - body_.start)];
  }

  // Appends nodes in bisection order, padded to whole tiles.
  void append(const std::vector<Index>& nodes) {
    std::vector<Vec3> points;
    for (const Index node : nodes) points.push_back(state_.x_ref[globalNode(node)]);
    for (const Index k : bisectionOrder(points)) {
      const Index node = nodes[static_cast<std::size_t>(k)];
      place_[static_cast<std::size_t>(node)] = static_cast<Index>(pattern_.nodes.size());
      pattern_.nodes.push_back(node);
    }
    pattern_.nodes.resize(wholeTiles(pattern_.nodes.size()), -1);
  }

  std::vector<Index> haloOf(const std::vector<Index>& own) const {
    std::vector<Index> halo;
    for (const Index i : own)
      for (const Index j : neighborsOf(i))
        if (placeOf(j) < 0) halo.push_back(j - body_.start);
    std::sort(halo.begin(), halo.end());
    halo.erase(std::unique(halo.begin(), halo.end()), halo.end());
    return halo;
  }

  void fillNodes() {
    const std::size_t n = pattern_.n_all;
    for (auto& component : pattern_.z_ref) component = AlignedArray(n);
    for (auto* array : {&pattern_.volume, &pattern_.inverse_volume, &pattern_.dilatation_factor,
                        &pattern_.a, &pattern_.b})
      *array = AlignedArray(n);
    const Vec3& center = state_.x_ref[static_cast<std::size_t>(body_.center_node)];
    const Real volume_unit = std::pow(body_.horizon, dimension_);
    const auto* lps = std::get_if<Lps>(&body_.law);
    for (std::size_t k = 0; k < n; ++k) {
      if (pattern_.nodes[k] < 0) continue;
      const std::size_t node = globalNode(pattern_.nodes[k]);
      const Vec3 z = body_.rotation.transpose() * (state_.x_ref[node] - center) / body_.horizon;
      for (std::size_t d = 0; d < 3; ++d) pattern_.z_ref[d][k] = z[static_cast<Eigen::Index>(d)];
      const Real volume = state_.volume[node] / volume_unit;
      pattern_.volume[k] = volume;
      pattern_.inverse_volume[k] = volume > 0 ? 1 / volume : 0;
      if (lps == nullptr) continue;
      const Real m = state_.weighted_volume[node] / (volume_unit * body_.horizon * body_.horizon);
      pattern_.dilatation_factor[k] = lps->dilatationFactor(m) * pattern_.inverse_volume[k];
      pattern_.a[k] = lps->a(m);
      pattern_.b[k] = lps->b(m);
    }
  }

  using RowsOfTiles = std::vector<std::vector<Row>>;

  void fillGroups() {
    const std::size_t n_tiles = pattern_.n_padded / tile_nodes;
    RowsOfTiles rows(n_tiles);
    RowsOfTiles halo_rows(n_tiles);
    for (std::size_t t = 0; t < n_tiles; ++t) addPairs(t, rows, halo_rows);
    for (std::size_t t = 0; t < n_tiles; ++t) {
      TileBonds tile{};
      tile.tile = static_cast<std::uint32_t>(t * tile_nodes);
      tile.begin = static_cast<std::uint32_t>(pattern_.groups.size());
      appendGroups(rows[t]);
      tile.halo = static_cast<std::uint32_t>(pattern_.groups.size());
      appendGroups(halo_rows[t]);
      tile.end = static_cast<std::uint32_t>(pattern_.groups.size());
      pattern_.tiles.push_back(tile);
    }
    pattern_.groups.shrink_to_fit();
  }

  void appendGroups(const std::vector<Row>& rows) {
    for (const Row& row : rows) {
      BondGroup group{};
      group.row = static_cast<std::uint32_t>(row.row) & 0xffffffu;
      group.exists = row.exists;
      pattern_.groups.push_back(group);
    }
  }

  // The pairs of tile t with itself, with later tiles and with the halo.
  void addPairs(std::size_t t, RowsOfTiles& rows, RowsOfTiles& halo_rows) {
    const auto first = static_cast<Index>(t) * tile_size;
    pairs_.clear();
    for (Index lane = 0; lane < tile_size; ++lane) {
      const Index node = pattern_.nodes[static_cast<std::size_t>(first + lane)];
      if (node < 0) continue;
      for (const Index j : neighborsOf(node))
        if (const Index place = placeOf(j); place > first + lane)
          pairs_.push_back(tile_size * place + lane);
    }
    std::sort(pairs_.begin(), pairs_.end());
    const auto inside = static_cast<Index>(pattern_.n_padded);
    for (std::size_t begin = 0; begin < pairs_.size();) {
      const Index other = pairs_[begin] / (tile_size * tile_size);
      std::size_t end = begin;
      while (end < pairs_.size() && pairs_[end] / (tile_size * tile_size) == other) ++end;
      const TilePair pair(std::span<const Index>(pairs_).subspan(begin, end - begin));
      begin = end;
      if (other * tile_size >= inside)
        append(halo_rows[t], other * tile_size, pair.lanes_of_partner);
      else if (countRows(pair.partners_of_lane) < countRows(pair.lanes_of_partner))
        append(rows[static_cast<std::size_t>(other)], first, pair.partners_of_lane);
      else
        append(rows[t], other * tile_size, pair.lanes_of_partner);
    }
  }

  // The bonds of a tile with another one. They are stored with the nodes of the other as rows, or
  // the other way round, whichever takes fewer rows.
  struct TilePair {
    std::array<LaneBits, tile_nodes> lanes_of_partner{};
    std::array<LaneBits, tile_nodes> partners_of_lane{};

    explicit TilePair(std::span<const Index> pairs) {
      for (const Index pair : pairs) {
        const auto lane = static_cast<std::size_t>(pair % tile_size);
        const auto partner = static_cast<std::size_t>(pair / tile_size % tile_size);
        lanes_of_partner[partner] = static_cast<LaneBits>(lanes_of_partner[partner] | 1u << lane);
        partners_of_lane[lane] = static_cast<LaneBits>(partners_of_lane[lane] | 1u << partner);
      }
    }
  };
  static std::ptrdiff_t countRows(const std::array<LaneBits, tile_nodes>& bits) {
    return std::count_if(bits.begin(), bits.end(), [](LaneBits b) { return b != 0; });
  }
  static void append(std::vector<Row>& rows, Index first,
                     const std::array<LaneBits, tile_nodes>& bits) {
    for (std::size_t k = 0; k < tile_nodes; ++k)
      if (bits[k] != 0) rows.push_back({first + static_cast<Index>(k), bits[k]});
  }

  const State& state_;
  const BondTable& bonds_;
  const Particle& body_;
  int dimension_;
  std::vector<Index>& place_;
  std::vector<Index> pairs_;  // tile_size * partner + lane
  BondPattern pattern_;
};

}  // namespace

BondPattern makeBondPattern(const State& state, const BondTable& bonds, const Particle& body,
                            int dimension) {
  std::vector<Index> nodes(static_cast<std::size_t>(body.nodes()));
  std::iota(nodes.begin(), nodes.end(), Index{0});
  std::vector<Index> place(nodes.size(), -1);
  return PatternBuilder(state, bonds, body, dimension, place).build(nodes);
}

std::vector<BondPattern> makeBondPatterns(const State& state, const BondTable& bonds,
                                          const Particle& body, int dimension,
                                          const std::vector<Index>& piece, Index parts,
                                          int threads) {
  std::vector<std::vector<Index>> own(static_cast<std::size_t>(parts));
  for (Index i = 0; i < body.nodes(); ++i)
    own[static_cast<std::size_t>(piece[static_cast<std::size_t>(i)])].push_back(i);
  std::erase_if(own, [](const std::vector<Index>& nodes) { return nodes.empty(); });
  std::vector<BondPattern> patterns(own.size());
  const auto n = static_cast<std::ptrdiff_t>(own.size());
#pragma omp parallel num_threads(threads) if (n > 1)
  {
    std::vector<Index> place(static_cast<std::size_t>(body.nodes()), -1);
    PatternBuilder builder(state, bonds, body, dimension, place);
#pragma omp for schedule(dynamic, 1)
    for (std::ptrdiff_t k = 0; k < n; ++k)
      patterns[static_cast<std::size_t>(k)] = builder.build(own[static_cast<std::size_t>(k)]);
  }
  std::vector<Index> place(static_cast<std::size_t>(body.nodes()), -1);
  std::size_t n_places = 0;
  for (BondPattern& pattern : patterns) {
    pattern.first_place = n_places;
    for (std::size_t k = 0; k < pattern.n_own; ++k)
      place[static_cast<std::size_t>(pattern.nodes[k])] = static_cast<Index>(n_places + k);
    n_places += pattern.n_padded;
  }
  for (BondPattern& pattern : patterns)
    for (std::size_t k = 0; k < pattern.n_halo; ++k)
      pattern.halo_places.push_back(
          place[static_cast<std::size_t>(pattern.nodes[pattern.n_padded + k])]);
  return patterns;
}

std::uint64_t hashOfBonds(const BondTable& bonds, const Particle& body) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  const auto add = [&](Index value) {
    hash = (hash ^ static_cast<std::uint64_t>(value)) * 1099511628211u;
  };
  add(body.zone);
  for (Index i = body.start; i < body.stop; ++i) {
    add(i - body.start);
    for (std::size_t k = bonds.begin(i); k < bonds.end(i); ++k)
      add(bonds.neighbors[k] - body.start);
  }
  return hash;
}

namespace {

bool nearlyEqual(Real a, Real b) {
  return std::abs(a - b) <= 1e-12 * std::abs(b);
}

// Whether the nodes of two bodies lie and weigh the same in their frames, up to round-off.
bool sameNodes(const State& state, const Particle& p, const Particle& q, int dimension) {
  const auto inFrame = [&](const Particle& body, Index k) -> Vec3 {
    return body.rotation.transpose() *
           (state.x_ref[static_cast<std::size_t>(body.start + k)] -
            state.x_ref[static_cast<std::size_t>(body.center_node)]) /
           body.horizon;
  };
  const Real unit_p = std::pow(p.horizon, dimension);
  const Real unit_q = std::pow(q.horizon, dimension);
  for (Index k = 0; k < p.nodes(); ++k) {
    const Real volume_p = state.volume[static_cast<std::size_t>(p.start + k)] / unit_p;
    const Real volume_q = state.volume[static_cast<std::size_t>(q.start + k)] / unit_q;
    if (!((inFrame(p, k) - inFrame(q, k)).norm() < 1e-9) ||
        !(std::abs(volume_p - volume_q) <= 1e-9 * volume_p))
      return false;
  }
  return true;
}

}  // namespace

bool sameInFrame(const State& state, const BondTable& bonds, const Particle& p, const Particle& q,
                 int dimension) {
  if (p.zone != q.zone || p.nodes() != q.nodes() ||
      p.center_node - p.start != q.center_node - q.start ||
      !nearlyEqual(p.mesh_size / p.horizon, q.mesh_size / q.horizon))
    return false;
  for (Index k = 0; k <= p.nodes(); ++k)
    if (bonds.offsets[static_cast<std::size_t>(p.start + k)] -
            bonds.offsets[static_cast<std::size_t>(p.start)] !=
        bonds.offsets[static_cast<std::size_t>(q.start + k)] -
            bonds.offsets[static_cast<std::size_t>(q.start)])
      return false;
  const Index shift = q.start - p.start;
  return std::equal(bonds.neighbors.begin() + bonds.offsets[static_cast<std::size_t>(p.start)],
                    bonds.neighbors.begin() + bonds.offsets[static_cast<std::size_t>(p.stop)],
                    bonds.neighbors.begin() + bonds.offsets[static_cast<std::size_t>(q.start)],
                    [&](Index i, Index j) { return i + shift == j; }) &&
         sameNodes(state, p, q, dimension);
}

}  // namespace peridem
