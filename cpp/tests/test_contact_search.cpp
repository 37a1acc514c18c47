#include "peridem/contact_search.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real reach = 0.08;
constexpr Real skin = 0.04;  // at first half the reach

// Clouds of nodes around a centre node: particles, some of which never move, and walls.
struct Crowd {
  std::vector<Particle> bodies;
  State state;
  BondTable bonds;

  explicit Crowd(int dimension) {
    Random random(43);
    std::vector<Vec3> x;
    for (Index id = 0; id < 14; ++id) {
      Particle body;
      body.id = id;
      body.is_wall = id % 5 == 4;
      body.constrained = id % 6 == 5;
      body.bounding_radius = 0.1 + 0.05 * std::abs(random());
      body.start = static_cast<Index>(x.size());
      body.center_node = body.start;
      const Vec3 center = 0.4 * random.vector(dimension);
      x.push_back(center);
      for (int k = 0; k < 8; ++k) x.push_back(center + 0.1 * random.vector(dimension));
      body.stop = static_cast<Index>(x.size());
      bodies.push_back(body);
    }
    state = State(x.size());
    state.x = x;
    for (const Particle& body : bodies)
      std::fill(state.particle_id.begin() + body.start, state.particle_id.begin() + body.stop,
                body.id);
    bonds.offsets.assign(x.size() + 1, 0);
  }

  const Particle& bodyOf(std::size_t i) const {
    return bodies[static_cast<std::size_t>(state.particle_id[i])];
  }

  bool isCandidate(const ContactSearch& search, std::size_t i, std::size_t j) const {
    const auto& nodes = search.nodes();
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), static_cast<Index>(i));
    if (at == nodes.end() || *at != static_cast<Index>(i)) return false;
    const auto links = search.candidates().links(static_cast<Index>(at - nodes.begin()));
    return std::binary_search(links.begin(), links.end(), static_cast<Index>(j));
  }

  // Pairs of nodes that interact but are not listed, and listed pairs that must not interact.
  std::pair<std::size_t, std::size_t> mistakes(const ContactSearch& search, bool own) const {
    std::size_t missed = 0;
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < state.size(); ++i)
      for (std::size_t j = 0; j < state.size(); ++j) {
        if (i == j) continue;
        const Particle& p = bodyOf(i);
        const Particle& q = bodyOf(j);
        const bool interact = p.id == q.id ? own && !p.is_wall && !p.constrained : mayTouch(p, q);
        const bool listed = isCandidate(search, i, j);
        missed += interact && !listed && (state.x[j] - state.x[i]).norm() <= reach;
        wrong += listed && !interact;
      }
    return {missed, wrong};
  }

  std::size_t missedCenters(const ContactSearch& search) const {
    const auto& pairs = search.centerPairs();
    std::size_t missed = 0;
    for (const Particle& p : bodies)
      for (const Particle& q : bodies) {
        if (p.id >= q.id || p.is_wall || q.is_wall) continue;
        const Real distance = (state.x[static_cast<std::size_t>(q.center_node)] -
                               state.x[static_cast<std::size_t>(p.center_node)])
                                  .norm();
        if (distance < p.bounding_radius + q.bounding_radius + 1.01 * reach)
          missed += !std::binary_search(pairs.begin(), pairs.end(), std::pair(p.id, q.id));
      }
    return missed;
  }
};

ContactSearch makeSearch(const Crowd& crowd, bool own) {
  std::vector<char> self_contact(crowd.bodies.size(), 0);
  for (std::size_t p = 0; p < self_contact.size(); ++p)
    self_contact[p] = own && !crowd.bodies[p].is_wall && !crowd.bodies[p].constrained;
  return ContactSearch(crowd.bodies, reach, self_contact);
}

}  // namespace

TEST_CASE("contact search: misses no pair of a crowd in random motion") {
  for (const int dimension : {2, 3})
    for (const bool own : {false, true}) {
      CAPTURE(dimension);
      CAPTURE(own);
      Crowd crowd(dimension);
      ContactSearch search = makeSearch(crowd, own);
      Random random(47);
      std::size_t missed = 0;
      std::size_t wrong = 0;
      std::size_t missed_centers = 0;
      constexpr int steps = 120;
      for (int n = 0; n < steps; ++n) {
        // Bodies drift and their nodes shake: pairs come and go.
        for (const Particle& body : crowd.bodies) {
          const Vec3 drift = 0.01 * random.vector(dimension);
          for (Index i = body.start; i < body.stop; ++i)
            crowd.state.x[static_cast<std::size_t>(i)] += drift + 0.003 * random.vector(dimension);
        }
        if (search.needsRebuild(crowd.state, 1))
          search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
        const auto [m, w] = crowd.mistakes(search, own);
        missed += m;
        wrong += w;
        missed_centers += crowd.missedCenters(search);
      }
      CHECK(missed == 0);
      CHECK(wrong == 0);
      CHECK(missed_centers == 0);
      CHECK(search.rebuilds() > 1);
      CHECK(search.rebuilds() < steps);  // lists are kept over some steps
    }
}

TEST_CASE("contact search: rebuilds when a node has moved by most of half the skin, not before") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  CHECK(search.needsRebuild(crowd.state, 1));  // nothing built yet
  search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  CHECK_FALSE(search.needsRebuild(crowd.state, 1));
  crowd.state.x[20][1] += 0.399 * skin;  // 0.8 of half the skin is 0.4
  CHECK_FALSE(search.needsRebuild(crowd.state, 1));
  crowd.state.x[20][1] += 0.002 * skin;
  CHECK(search.needsRebuild(crowd.state, 1));
}

TEST_CASE("contact search: the skin is wide in fast motion and narrow in slow motion") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  const auto move = [&](Real distance, int steps) {  // every node, and a list that never misses
    std::size_t missed = 0;
    for (int n = 0; n < steps; ++n) {
      for (const Particle& body : crowd.bodies)
        for (Index i = body.start; i < body.stop; ++i)
          crowd.state.x[static_cast<std::size_t>(i)][0] += body.id % 2 == 0 ? distance : -distance;
      search.noteTravel(std::abs(distance));
      if (search.needsRebuild(crowd.state, 1))
        search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
      missed += crowd.mistakes(search, false).first;
    }
    return missed;
  };
  CHECK(move(0, 1) == 0);
  CHECK(search.skin() == skin);
  CHECK(move(0.2 * reach, 60) == 0);  // 12 reach: a rebuild at least every sixth step
  CHECK(search.skin() == 1.25 * reach);
  CHECK(move(-0.0005 * reach, 4000) == 0);  // half a reach at least, in 1000 steps
  CHECK(search.skin() < 1.25 * reach);
  CHECK(search.skin() >= skin);
}

TEST_CASE("contact search: looks at the nodes only when the noted travel could be half the skin") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  crowd.state.x[20][1] += skin;  // not what is noted: shows whether it looks
  for (int step = 0; step < 4; ++step) {
    search.noteTravel(0.12 * skin);
    CHECK_FALSE(search.needsRebuild(crowd.state, 1));
  }
  search.noteTravel(0.12 * skin);  // 0.6 skin in all
  CHECK(search.needsRebuild(crowd.state, 1));
}

TEST_CASE("contact search: a look finds how far the nodes really are from where they were") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  for (int step = 0; step < 50; ++step) {  // to and fro
    crowd.state.x[20][1] += (step % 2 == 0 ? 0.3 : -0.3) * skin;
    search.noteTravel(0.3 * skin);
    CHECK_FALSE(search.needsRebuild(crowd.state, 1));
  }
  crowd.state.x[20][1] += 0.6 * skin;
  search.noteTravel(0.6 * skin);
  CHECK(search.needsRebuild(crowd.state, 1));
}

TEST_CASE("contact search: looks at the nodes when they may have gone anywhere") {
  for (const bool noted : {false, true}) {
    Crowd crowd(2);
    ContactSearch search = makeSearch(crowd, false);
    search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
    search.noteTravel(0);
    CHECK_FALSE(search.needsRebuild(crowd.state, 1));
    crowd.state.x[20][1] += skin;
    if (noted) search.noteAnyTravel();  // else nothing has been noted since the last look
    CHECK(search.needsRebuild(crowd.state, 1));
  }
}

TEST_CASE("contact search: a position that is not a number asks for a rebuild") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  crowd.state.x[3][0] = not_given;
  CHECK(search.needsRebuild(crowd.state, 1));
}

TEST_CASE("contact search: nodes that were once bonded are no candidates of each other") {
  // One body of three nodes in reach of each other; 0 and 1 are bonded.
  std::vector<Particle> bodies(1);
  bodies[0].stop = 3;
  State state(3);
  state.x = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}};
  BondTable bonds;
  bonds.offsets = {0, 1, 2, 2};
  bonds.neighbors = {1, 0};
  ContactSearch search(bodies, 1, {1});
  search.rebuild(state, bonds, bodies, 1);
  CHECK(search.nodes() == std::vector<Index>{0, 1, 2});
  CHECK(search.candidates().offsets == std::vector<Offset>{0, 1, 2, 4});
  CHECK(search.candidates().indices == std::vector<Index>{2, 2, 0, 1});
}

TEST_CASE("contact search: the rows of a body are its nodes") {
  Crowd crowd(2);
  ContactSearch search = makeSearch(crowd, false);
  search.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  std::size_t next = 0;
  for (const Particle& body : crowd.bodies) {
    const auto [begin, end] = search.bodyRows(body);
    CHECK(begin == next);
    for (std::size_t row = begin; row < end; ++row)
      CHECK(crowd.state.particle_id[static_cast<std::size_t>(search.nodes()[row])] == body.id);
    next = end;
  }
  CHECK(next == search.nodes().size());
}

TEST_CASE("contact search: the number of threads changes nothing") {
  Crowd crowd(3);
  ContactSearch one = makeSearch(crowd, true);
  ContactSearch four = makeSearch(crowd, true);
  one.rebuild(crowd.state, crowd.bonds, crowd.bodies, 1);
  four.rebuild(crowd.state, crowd.bonds, crowd.bodies, 4);
  CHECK(four.nodes() == one.nodes());
  CHECK(four.candidates().offsets == one.candidates().offsets);
  CHECK(four.candidates().indices == one.candidates().indices);
  CHECK(four.centerPairs() == one.centerPairs());
}

TEST_CASE("contact search: a single body needs none") {
  std::vector<Particle> bodies(1);
  bodies[0].stop = 1;
  ContactSearch search(bodies, 1, {0});
  CHECK_FALSE(search.needsRebuild(State(1), 1));
}

TEST_CASE("contact search: walls do not meet walls, nor bodies that never move each other") {
  Particle a, b;
  b.id = 1;
  CHECK(mayTouch(a, b));
  CHECK_FALSE(mayTouch(a, a));
  a.is_wall = true;
  CHECK(mayTouch(a, b));
  b.is_wall = true;
  CHECK_FALSE(mayTouch(a, b));
  a.is_wall = b.is_wall = false;
  a.constrained = true;
  CHECK(mayTouch(a, b));
  b.constrained = true;
  CHECK_FALSE(mayTouch(a, b));
}
